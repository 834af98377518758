"""A replayed drive goes where the positions were, at their speed, pointing along its course."""

from dataclasses import asdict
from pathlib import Path as FilePath

import numpy as np
import pytest
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.model.geodesy import displacement
from polyins.model.rig import DEG
from polyins.simulation.drive_scenario import Drive, ReplayedDrive
from polyins.simulation.path import Driving, Path, drive
from polyins.simulation.replay import HELD_BELOW, Ride, replay
from polyins.simulation.run import simulate, true_run
from polyins.simulation.scenario import read_scenario
from polyins.studies.rigid_array import base_scenario

Array = NDArray[np.float64]

STD = np.array([0.013, 0.010, 0.023])


@pytest.fixture(scope="module")
def original() -> Path:
    return drive(240.0, static=30.0, seed=3)


@pytest.fixture(scope="module")
def fixes(original: Path) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 241.0)
    position = original.position(time)
    metres = rng.normal(0.0, 0.3 * STD, (len(time), 3))
    return 1000.0 + time, position + original.world.displacement(position, metres), np.tile(STD, (len(time), 1))


@pytest.fixture(scope="module")
def again(fixes: tuple[Array, Array, Array]) -> Path:
    return replay(*fixes)


def test_it_stays_near_the_positions(original: Path, again: Path) -> None:
    time = np.arange(0.0, 240.0, 0.1)
    origin = original.position(np.zeros(1))[0]
    apart = displacement(again.position(time), origin, True) - displacement(original.position(time), origin, True)
    assert np.abs(apart[:, :2]).max() < 1.5
    assert np.abs(apart[:, 2]).max() < 1.0


def test_it_drives_at_the_speed_along_the_course_of_the_positions(original: Path, again: Path) -> None:
    time = np.arange(35.0, 239.0, 0.1)
    speed = original.speed(time)
    assert np.sqrt(np.mean((again.speed(time) - speed) ** 2)) < 0.15
    fast = speed > 3.0
    apart = again.heading(time[fast]) - original.heading(time[fast])
    apart = (apart + np.pi) % (2.0 * np.pi) - np.pi
    assert np.sqrt(np.mean(apart**2)) < 1.0 * DEG
    assert np.sqrt(np.mean((again.pitch(time[fast]) - original.pitch(time[fast])) ** 2)) < 1.0 * DEG


def test_it_stands_while_the_positions_do(again: Path) -> None:
    assert 26.0 <= again.static <= 31.0
    still = np.linspace(0.0, again.static, 500)
    assert not again.speed(still).any()
    for curve in (again.roll, again.pitch, again.heading):
        np.testing.assert_allclose(curve(still, 1), 0.0, atol=1e-12)


def test_its_heading_is_held_where_it_is_slow(again: Path) -> None:
    time = np.arange(0.0, 240.0, 0.01)
    slow = again.speed(time) < 0.5 * HELD_BELOW
    assert np.abs(again.heading(time[slow], 1)).max() < 10.0 * DEG


def test_its_velocity_is_the_derivative_of_its_position(again: Path) -> None:
    time, step = np.linspace(40.0, 230.0, 200), 1e-3
    before, truth, after = (again.truth(time + shift) for shift in (-step, 0.0, step))
    origin = truth.position[0]
    change = displacement(after.position, origin, True) - displacement(before.position, origin, True)
    north = np.abs(change[:, 0] / (2.0 * step) - truth.velocity[:, 0])
    # the plane at the first position turns away from n by 1.6e-7 rad per metre
    assert north.max() < 0.02


def test_its_curves_have_continuous_derivatives(again: Path) -> None:
    knots = np.arange(50.0, 200.0, 0.5)
    for curve in (again.speed, again.roll, again.pitch, again.heading):
        for order in (1, 2, 3):
            left, right = curve(knots - 1e-6, order), curve(knots + 1e-6, order)
            np.testing.assert_allclose(left, right, atol=1e-3 * max(np.abs(left).max(), 1e-6))


def test_equal_seeds_give_equal_roads(fixes: tuple[Array, Array, Array], again: Path) -> None:
    time = np.linspace(0.0, 240.0, 50)
    np.testing.assert_array_equal(replay(*fixes).roll(time), again.roll(time))
    other = replay(*fixes, seed=1)
    np.testing.assert_array_equal(other.heading(time), again.heading(time))
    assert np.abs(other.roll(time) - again.roll(time)).max() > 0.1 * DEG


@pytest.mark.parametrize(
    ("rows", "change", "expected"),
    [
        (5, "", "expected at least 6 at increasing times"),
        (30, "time", "expected at least 6 at increasing times"),
        (30, "std", "standard deviations above zero"),
        (20, "", "never move faster than"),
    ],
)
def test_positions_that_make_no_path(fixes: tuple[Array, Array, Array], rows: int, change: str, expected: str) -> None:
    time, position, std = (values[:rows].copy() for values in fixes)
    if change == "time":
        time[3] = time[2]
    if change == "std":
        std[1] = 0.0
    with pytest.raises(InputError, match=expected):
        replay(time, position, std)


def test_the_real_track(data_folder: FilePath) -> None:
    rows = np.loadtxt(data_folder / "whu-array" / "gnss_group1.txt")[:900]
    path = replay(rows[:, 0], np.column_stack([rows[:, 1:3] * DEG, rows[:, 3]]), rows[:, 4:7])
    assert np.abs(off(path, rows)[:, :2]).max() < 0.8
    assert path.static == pytest.approx(358.0, abs=4.0)
    time = np.arange(0.0, path.duration, 0.1)
    assert np.abs(path.speed(time, 1)).max() < 4.0
    assert np.abs(path.speed(time) * path.heading(time, 1)).max() < 4.0


def test_all_that_is_used_of_the_real_track(data_folder: FilePath) -> None:
    scenario = base_scenario(quick=False)
    assert scenario.replay is not None
    path = scenario.replay.path(0)
    rows = np.loadtxt(data_folder / "whu-array" / "gnss_group1.txt")
    used = (rows[:, 0] >= scenario.replay.from_s) & (rows[:, 0] <= scenario.replay.to_s)
    apart = off(path, rows[used])
    assert np.hypot(*apart[:, :2].T).max() < 1.1
    assert np.sqrt(np.mean(apart**2)) < 0.3
    assert path.static == scenario.static_s


def off(path: Path, rows: Array) -> Array:
    """Return how far a path is from the positions of a file, m."""
    points = np.column_stack([rows[:, 1:3] * DEG, rows[:, 3]])
    driven = path.position(rows[:, 0] - rows[0, 0])
    return displacement(driven, points[0], True) - displacement(points, points[0], True)


def replay_file(folder: FilePath, fixes: tuple[Array, Array, Array], text: str = "") -> FilePath:
    time, position, _ = fixes
    table = np.column_stack([time, position[:, :2] / DEG, position[:, 2]])
    header = "time_s,latitude_deg,longitude_deg,height_m"
    np.savetxt(folder / "rtk.csv", table, delimiter=",", header=header, comments="", fmt="%.12f")
    (folder / "scenario.yaml").write_text(f"rate_hz: 50\nimus: {{count: 1}}\nreplay: {{file: rtk.csv}}\n{text}")
    return folder / "scenario.yaml"


def test_a_scenario_drives_again_what_was_surveyed(
    tmp_path: FilePath, original: Path, fixes: tuple[Array, Array, Array]
) -> None:
    recording = simulate(replay_file(tmp_path, fixes))
    assert recording.reference is not None
    time, reference = recording.reference.time, recording.reference.position
    assert time[-1] == pytest.approx(240.0, abs=0.2)
    origin = original.position(np.zeros(1))[0]
    apart = displacement(reference, origin, True) - displacement(original.position(time), origin, True)
    assert np.abs(apart).max() < 1.5
    standing = recording.start.static_interval
    assert standing is not None
    assert 26.0 <= standing[1] <= 31.0
    # the way is the file's; what the road and the springs add is drawn
    other = simulate(replay_file(tmp_path, fixes, "seed: 1\n"))
    assert other.reference is not None
    assert other.reference.attitude is not None
    assert recording.reference.attitude is not None
    np.testing.assert_allclose(other.reference.position, reference, rtol=0.0, atol=1e-3)
    assert np.abs(other.reference.attitude[:, 0] - recording.reference.attitude[:, 0]).max() > 0.2 * DEG


def test_a_scenario_refuses_what_cannot_be_driven_again(tmp_path: FilePath, fixes: tuple[Array, Array, Array]) -> None:
    for text, message in {
        "shuttle: {}": "shuttle: is given with replay",
        "start: {latitude_deg: 30, longitude_deg: 114}": "start: is given with a replay",
        "outages: [[90, 60]]": r"outages: \[90, 60\]; expected",
        "errors: {jitter_s: 0.1}": "errors.jitter_s is 0.1; expected",
        "earth: plane": "replay: has latitudes and longitudes; expected earth: turning",
        "wheels: [{name: left, position_m: [0, -1, 0]}]": "replay: is of a body that leans; with wheels",
    }.items():
        with pytest.raises(InputError, match=message):
            read_scenario(replay_file(tmp_path, fixes, text))
    scenario = replay_file(tmp_path, fixes)
    lines = (tmp_path / "rtk.csv").read_text().splitlines()
    (tmp_path / "rtk.csv").write_text("\n".join([*lines[:5], "1004,,114.0,35.0", *lines[6:]]))
    with pytest.raises(InputError, match=r"rtk\.csv, line 6: position is missing"):
        simulate(scenario)
    (tmp_path / "rtk.csv").write_text("time_s,north_m,east_m,down_m\n0,1,1,0\n1,2,1,0\n")
    with pytest.raises(InputError, match=r"rtk\.csv: holds no latitudes"):
        simulate(scenario)
    (tmp_path / "rtk.csv").write_text("time_s,a,b,c\n0,1,2,3\n")
    with pytest.raises(InputError, match=r"rtk\.csv: .*latitude, longitude, height"):
        simulate(scenario)


def test_a_nose_points_into_the_turn_where_slip_is_asked_for(fixes: tuple[Array, Array, Array], again: Path) -> None:
    slipping = replay(*fixes, ride=Ride(side_slip=0.5 * DEG))
    time = np.arange(35.0, 239.0, 0.1)
    origin = fixes[1][0]
    apart = displacement(slipping.position(time), origin, True) - displacement(again.position(time), origin, True)
    assert np.abs(apart[:, :2]).max() < 0.5
    assert np.abs(apart[:, 2]).max() < 0.05
    inwards = slipping.heading(time) - again.heading(time)
    lateral = again.speed(time) * again.heading(time, 1)
    assert np.corrcoef(inwards, lateral)[0, 1] > 0.98
    assert np.abs(inwards).max() == pytest.approx(0.5 * DEG * np.abs(lateral).max(), rel=0.15)
    motion = slipping.motion(time)
    course = np.arctan2(motion.velocity[:, 1], motion.velocity[:, 0])
    fast = again.speed(time) > 3.0
    off = (course - again.heading(time) + np.pi)[fast] % (2.0 * np.pi) - np.pi
    assert np.abs(off).max() < 0.1 * DEG


def test_a_survey_is_driven_to_its_end_unless_it_is_cut(tmp_path: FilePath, fixes: tuple[Array, Array, Array]) -> None:
    time, position, std = fixes
    # the same way at a fifth of the speed: longer than a drive of a scenario's own
    slowly = read_scenario(replay_file(tmp_path, (5.0 * time, position, std)))
    assert true_run(slowly).path.duration == pytest.approx(1200.0)
    cut = read_scenario(replay_file(tmp_path, fixes, "duration_s: 55\n"))
    run = true_run(cut)
    assert run.scenario.duration_s == run.path.duration == 55.0
    assert run.scenario.static_s == run.path.static < 35.0
    for text, message in {
        "duration_s: 25": "expected more than the .* s it stands first",
        "outages: [[500, 530]]": r"outages: \[500, 530\]; expected .* within the 240 s",
    }.items():
        with pytest.raises(InputError, match=message):
            simulate(replay_file(tmp_path, fixes, text))


def test_the_file_of_a_receiver_is_driven_again_as_sure_as_it_says(
    tmp_path: FilePath, fixes: tuple[Array, Array, Array]
) -> None:
    time, position, std = fixes
    np.savetxt(tmp_path / "rtk.txt", np.column_stack([time, position[:, :2] / DEG, position[:, 2], std]), fmt="%.12f")
    seconds = np.linspace(0.0, 200.0, 50)
    path = ReplayedDrive(file=str(tmp_path / "rtk.txt")).path(3)
    np.testing.assert_allclose(path.roll(seconds), replay(*fixes, seed=3).roll(seconds), atol=1e-6)
    # told that they are worse it follows them less
    loose = ReplayedDrive(file=str(tmp_path / "rtk.txt"), position_std_m=(2.0, 2.0, 2.0)).path(3)
    assert np.abs(path.speed(seconds) - loose.speed(seconds)).max() > 0.1
    # a part of it begins where the survey is then
    later = ReplayedDrive(file=str(tmp_path / "rtk.txt"), from_s=1060.0, to_s=1230.0).path(3)
    assert later.duration == pytest.approx(170.0)
    np.testing.assert_allclose(later.position(np.zeros(1))[0], position[60], atol=1e-9)
    np.testing.assert_allclose(later.speed(seconds[:40]), path.speed(seconds[:40] + 60.0), atol=0.3)


def test_the_road_and_the_springs_are_as_the_scenario_says(
    tmp_path: FilePath, fixes: tuple[Array, Array, Array]
) -> None:
    file = str(replay_file(tmp_path, fixes).with_name("rtk.csv"))
    stiff = ReplayedDrive(file=file, camber_deg=0.0, roll_deg_per_m_s2=0.0, pitch_deg_per_m_s2=0.0).path(0)
    time = np.arange(35.0, 239.0, 0.1)
    assert not stiff.roll(time).any()
    across = stiff.speed(time) * stiff.heading(time, 1)
    leaning = ReplayedDrive(file=file, camber_deg=0.0, roll_deg_per_m_s2=1.0, pitch_deg_per_m_s2=0.0).path(0)
    assert np.polyfit(across, leaning.roll(time), 1)[0] == pytest.approx(-1.0 * DEG, rel=0.1)
    diving = ReplayedDrive(file=file, camber_deg=0.0, roll_deg_per_m_s2=0.0, pitch_deg_per_m_s2=1.0).path(0)
    along = stiff.speed(time, 1)
    assert np.polyfit(along, diving.pitch(time) - stiff.pitch(time), 1)[0] == pytest.approx(1.0 * DEG, rel=0.1)
    cambered = ReplayedDrive(file=file, camber_deg=2.0, camber_length_m=20.0, roll_deg_per_m_s2=0.0).path(0)
    assert np.std(cambered.roll(time)) == pytest.approx(2.0 * DEG * np.sqrt(2.0 / 3.0), rel=0.35)


def test_what_a_scenario_does_not_say_of_a_road_is_as_elsewhere() -> None:
    def of(parameters: object) -> list[float]:
        return [
            value / DEG if "std" in key or "per_" in key or key == "steepest" or "slip" in key else value
            for key, value in asdict(parameters).items()
        ]  # type: ignore[call-overload]

    assert of(Driving()) == pytest.approx(list(Drive().model_dump().values()))
    said = ReplayedDrive(file="").model_dump(exclude={"file", "from_s", "to_s", "position_std_m"})
    assert of(Ride()) == pytest.approx(list(said.values()))


def test_doubts_about_a_survey_reach_the_recording(tmp_path: FilePath, fixes: tuple[Array, Array, Array]) -> None:
    time, position, std = fixes
    head = "%  GPST  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)"
    rows = [
        f"2300 {t:.3f} {p[0] / DEG:.10f} {p[1] / DEG:.10f} {p[2]:.4f} {2 if t == 1100.0 else 1} 9 {s[0]} {s[1]} {s[2]}"
        for t, p, s in zip(time, position, std, strict=True)
    ]
    (tmp_path / "rtk.pos").write_text("\n".join([head, *rows, ""]))
    (tmp_path / "scenario.yaml").write_text("rate_hz: 20\nimus: {count: 1}\nreplay: {file: rtk.pos}\n")
    (warning,) = simulate(tmp_path / "scenario.yaml").warnings
    assert "rtk.pos" in warning
    assert "float" in warning


def test_a_part_that_is_not_there(tmp_path: FilePath, fixes: tuple[Array, Array, Array]) -> None:
    file = str(replay_file(tmp_path, fixes).with_name("rtk.csv"))
    with pytest.raises(InputError, match=r"from_s and to_s leave no positions; .*rtk\.csv covers 1000 to 1240 s"):
        ReplayedDrive(file=file, from_s=10.0, to_s=20.0).path(0)
    (warning,) = ReplayedDrive(file=file, from_s=10.0).path(0).warnings
    assert "outside of what there is" in warning
    assert ReplayedDrive(file=file, from_s=1000.0, to_s=1240.0).path(0).warnings == ()
    (tmp_path / "scenario.yaml").write_text("replay: {file: rtk.csv, from_s: 9, to_s: 5}")
    with pytest.raises(InputError, match=r"line 1: replay\.to_s: is 5; expected more than the 9 of from_s"):
        read_scenario(tmp_path / "scenario.yaml")
    # what is wrong elsewhere in the file does not matter
    lines = (tmp_path / "rtk.csv").read_text().splitlines()
    (tmp_path / "rtk.csv").write_text("\n".join([*lines[:5], "1004,,114.0,35.0", *lines[6:]]))
    assert ReplayedDrive(file=file, from_s=1010.0).path(0).duration == pytest.approx(230.0)


def test_heights_may_be_taken_as_they_are(tmp_path: FilePath, fixes: tuple[Array, Array, Array]) -> None:
    file = str(replay_file(tmp_path, fixes).with_name("rtk.csv"))
    rough, smooth = (
        ReplayedDrive(file=file, slope_smoothing_m=way).path(0).pitch(np.arange(35.0, 239.0)) for way in (0, 10)
    )
    assert np.std(np.diff(rough)) > np.std(np.diff(smooth))
