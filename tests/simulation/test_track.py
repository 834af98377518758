import numpy as np
import pytest

from polyins.errors import InputError
from polyins.simulation.plane import Plane
from polyins.simulation.track import LEVEL, Odometer, Survey, track_path

ORIGIN = (0.0, 0.0, 0.0)
ODOMETER = np.arange(0.0, 60.5, 0.5)
SPEED = 1.5 * np.minimum(1.0, np.minimum(ODOMETER, ODOMETER[::-1]) / 4.0)
LENGTH = 84.0


def loops(count=70, straight=10.0, radius=5.0):
    """Return points along a straight and then a circle, as far as the speeds last."""
    way = np.linspace(0.0, LENGTH, count)
    angle = np.maximum(way - straight, 0.0) / radius
    return np.minimum(way, straight) + radius * np.sin(angle), radius * (1.0 - np.cos(angle))


def along(points, smoothing=0.7, slopes=LEVEL, **stands):
    odometer = Odometer(ODOMETER, SPEED, **stands)
    return track_path(Survey(*points, smoothing), odometer, slopes, start=ORIGIN, world=Plane())


def test_a_path_through_the_points_of_a_curve_is_that_curve():
    path = along(loops(), smoothing=0.0)
    time = np.linspace(0.0, path.duration, 5000)
    position = path.position(time)
    np.testing.assert_array_equal(position[:, 2], 0.0)
    np.testing.assert_allclose(position[time < 37.0, 1], 0.0, atol=2e-3)
    cruising = (time > 45.0) & (time < 75.0)
    radius = np.hypot(position[cruising, 0] - 10.0, position[cruising, 1] - 5.0)
    np.testing.assert_allclose(radius, 5.0, atol=0.02)
    np.testing.assert_allclose(path.heading(time[cruising], 1), path.speed(time[cruising]) / 5.0, rtol=0.01)
    moved = np.diff(position, axis=0) / np.diff(time)[:, None]
    middle = (time[1:] + time[:-1]) / 2.0
    course = np.column_stack([np.cos(path.heading(middle)), np.sin(path.heading(middle))])
    np.testing.assert_allclose(moved[:, :2], path.speed(middle)[:, None] * course, atol=1e-3)


def test_the_path_stands_at_both_ends_and_lasts_to_the_last_point():
    points = loops()
    path = along(points, static=20.0, rest=10.0)
    start, end = np.linspace(0.0, 20.0, 300), np.linspace(path.duration - 10.0, path.duration, 100)
    for still in (start, end):
        np.testing.assert_array_equal(path.speed(still), 0.0)
        np.testing.assert_allclose(path.heading(still, 1), 0.0, atol=1e-12)
        assert np.ptp(path.position(still), axis=0).max() < 1e-9
    np.testing.assert_allclose(path.position(end)[0, :2], [points[0][-1], points[1][-1]], atol=0.1)
    assert path.static == 20.0
    # standing, three intervals of the odometer that smoothing adds at each end, driving
    assert path.duration == 20.0 + 60.0 + 2 * 1.5 + 10.0


def test_heading_while_standing_is_the_course_at_departure():
    north, east = loops()
    path = along((-east, north))
    departure = path.position(np.array([36.0]))[0] - path.position(np.array([0.0]))[0]
    assert path.heading(np.array([0.0]))[0] == pytest.approx(np.pi / 2, abs=0.02)
    assert np.arctan2(departure[1], departure[0]) == pytest.approx(np.pi / 2, abs=0.02)


def test_points_of_a_standing_receiver_do_not_matter():
    north, east = loops()
    rng = np.random.default_rng(0)
    shaken = rng.normal(0.0, 0.01, (2, 40))
    shaken[:, 0] = 0.0
    path = along((np.append(shaken[0], north[1:]), np.append(shaken[1], east[1:])))
    assert np.abs(path.heading(np.linspace(0.0, path.duration, 3000), 1)).max() < 0.4


def test_noise_on_the_points_is_smoothed():
    rng, points = np.random.default_rng(1), np.array(loops())
    noisy = points + rng.normal(0.0, 0.03, points.shape)
    time = np.linspace(45.0, 80.0, 3000)
    rough, smooth = (along(noisy, smoothing=smoothing).heading(time, 1) for smoothing in (0.0, 2.0))
    assert (smooth - 0.3).std() < 0.5 * (rough - 0.3).std()


@pytest.mark.parametrize(
    ("points", "time", "speed"),
    [
        (([0.0, 1.0], [0.0, 0.0]), ODOMETER, SPEED),
        (loops(), ODOMETER[:1], SPEED[:1]),
        (loops(), ODOMETER[::-1], SPEED),
        (loops(), ODOMETER, -SPEED),
        (loops(), ODOMETER, np.full_like(SPEED, np.nan)),
    ],
    ids=["two points", "one speed", "backward time", "reverse", "nan"],
)
def test_what_is_no_track_is_refused(points, time, speed):
    with pytest.raises(InputError, match=r"track: .*; expected at least 6 points"):
        track_path(Survey(*points), Odometer(time, speed))


def test_a_point_without_coordinates_is_refused():
    north, east = loops()
    east[7] = np.nan
    with pytest.raises(InputError, match="track: a point has no coordinates"):
        along((north, east))


def test_an_odometer_that_never_moves_is_refused():
    with pytest.raises(InputError, match="track: the speeds are all zero; expected"):
        track_path(Survey(*loops()), Odometer(ODOMETER, np.zeros_like(SPEED)))


def test_an_odometer_s_noise_at_rest_is_rest():
    noisy = np.where(SPEED == 0.0, -0.02, SPEED)
    assert np.count_nonzero(noisy < 0.0) == 2
    path = track_path(Survey(*loops()), Odometer(ODOMETER, noisy), start=ORIGIN, world=Plane())
    time = np.linspace(0.0, path.duration, 1000)
    np.testing.assert_array_equal(path.speed(time), along(loops()).speed(time))
    with pytest.raises(InputError, match="none of them backward"):
        track_path(Survey(*loops()), Odometer(ODOMETER, np.where(SPEED == 0.0, -0.2, SPEED)))
