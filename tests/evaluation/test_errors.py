"""Errors put into a known drive come out again."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_solutions import RADIUS_M, drive, moved, reference, solution

from polyins.errors import InputError
from polyins.evaluation.errors import compare_to_reference
from polyins.evaluation.summary import summarize
from polyins.model.attitude import quaternions

metres = st.floats(-50.0, 50.0)


@settings(max_examples=20, deadline=None)
@given(metres, metres, metres)
def test_geodetic_position_error_in_metres(north, east, down):
    truth = drive()
    wrong = solution(truth, position=moved(truth.geodetic, np.array([north, east, down])))
    errors = compare_to_reference(wrong, reference(truth))
    np.testing.assert_allclose(errors.position, np.tile([north, east, down], (truth.time.size, 1)), atol=1e-6)
    statistics = summarize(wrong, reference(truth))["reference"]
    assert statistics["horizontal_rms_m"] == pytest.approx(np.hypot(north, east), abs=1e-6)
    assert statistics["horizontal_max_m"] == pytest.approx(np.hypot(north, east), abs=1e-6)
    assert statistics["vertical_rms_m"] == pytest.approx(abs(down), abs=1e-6)


def test_local_position_error_has_down_positive_downwards():
    truth = drive()
    wrong = solution(truth, geodetic=False, position=truth.local + np.array([1.0, 2.0, 3.0]))
    errors = compare_to_reference(wrong, reference(truth, geodetic=False))
    np.testing.assert_allclose(errors.position, np.tile([1.0, 2.0, -3.0], (truth.time.size, 1)), atol=1e-12)


def test_attitude_errors_are_wrapped_where_heading_passes_180_degrees():
    truth = drive(duration=120.0)  # nearly two turns
    turned = truth.euler + np.radians([0.5, -0.25, 2.0])
    statistics = summarize(solution(truth, attitude=quaternions(turned)), reference(truth))["reference"]
    assert statistics["roll_rmse_deg"] == pytest.approx(0.5)
    assert statistics["pitch_rmse_deg"] == pytest.approx(0.25)
    assert statistics["heading_rmse_deg"] == pytest.approx(2.0)


def test_wrapped_reference_angles_are_interpolated_the_shorter_way_round():
    truth = drive(duration=120.0)
    coarse = np.arange(0, truth.time.size, 7)
    wrapped = (truth.euler[coarse] + np.pi) % (2.0 * np.pi) - np.pi
    sparse = reference(truth, time=truth.time[coarse], position=truth.geodetic[coarse], velocity=None, attitude=wrapped)
    errors = compare_to_reference(solution(truth), sparse)
    assert errors.attitude is not None
    assert np.max(np.abs(errors.attitude)) < 1e-12


def test_longitudes_on_both_sides_of_180_degrees_are_neighbours():
    truth = drive()
    shift = np.array([0.0, np.pi - truth.geodetic[300, 1], 0.0])
    across = truth.geodetic + shift
    across[:, 1] = (across[:, 1] + np.pi) % (2.0 * np.pi) - np.pi
    assert np.ptp(across[:, 1]) > 6.0
    ours = solution(truth, position=moved(across, np.array([0.0, 1.0, 0.0])))
    errors = compare_to_reference(ours, reference(truth, time=truth.time[::3], position=across[::3], velocity=None,
                                                  attitude=None))  # fmt: skip
    np.testing.assert_allclose(errors.position[:, 1], 1.0, atol=2e-3)
    assert errors.distance[-1] == pytest.approx(RADIUS_M * 6.0, rel=1e-3)


@pytest.mark.parametrize("geodetic", [True, False])
def test_the_solution_is_moved_to_the_references_point(geodetic):
    truth = drive()
    point, lever_arm = np.array([0.3, -0.2, 0.1]), np.array([2.0, 1.0, -1.5])
    ours, ours_speed = truth.lever_arm_motion(point)
    theirs, theirs_speed = truth.lever_arm_motion(lever_arm)
    if geodetic:
        here, there = moved(truth.geodetic, ours), moved(truth.geodetic, theirs)
    else:
        here, there = truth.local + ours * [1, 1, -1], truth.local + theirs * [1, 1, -1]
    at_point = solution(truth, geodetic, position=here, velocity=truth.velocity + ours_speed, point=point)
    at_lever_arm = reference(
        truth, geodetic, position=there, velocity=truth.velocity + theirs_speed, lever_arm=lever_arm
    )
    errors = compare_to_reference(at_point, at_lever_arm)
    np.testing.assert_allclose(errors.position, 0.0, atol=2e-6)
    np.testing.assert_allclose(errors.velocity, 0.0, atol=1e-9)
    unmoved = summarize(replace(at_point, point=lever_arm), at_lever_arm)
    assert unmoved["reference"]["horizontal_rms_m"] > 1.0


def test_epochs_beyond_the_reference_are_left_out_and_counted():
    truth = drive()
    within = (truth.time >= 1010.0) & (truth.time <= 1030.0)
    part = reference(truth, time=truth.time[within], position=truth.geodetic[within], velocity=None, attitude=None)
    errors = compare_to_reference(solution(truth), part)
    np.testing.assert_array_equal(errors.time, truth.time[within])
    assert errors.epochs_without_reference == truth.time.size - np.count_nonzero(within)
    assert errors.velocity is None
    assert errors.attitude is None
    assert summarize(solution(truth), part)["reference"]["heading_rmse_deg"] is None


@pytest.mark.parametrize(("missing", "bridged"), [(4, True), (5, False)])
def test_only_short_gaps_of_the_reference_are_bridged(missing, bridged):
    truth = drive()
    kept = np.ones(truth.time.size, bool)
    kept[100 : 100 + missing] = False
    gappy = reference(truth, time=truth.time[kept], position=truth.geodetic[kept], velocity=None, attitude=None)
    errors = compare_to_reference(solution(truth), gappy)
    assert errors.epochs_without_reference == (0 if bridged else missing)


def test_a_reference_elsewhere_in_time_gives_no_figures():
    truth = drive()
    later = reference(truth, time=truth.time + 1e5)
    assert compare_to_reference(solution(truth), later).time.size == 0
    assert set(summarize(solution(truth), later)["reference"].values()) == {None}


def test_distance_is_measured_along_the_reference():
    truth = drive()
    errors = compare_to_reference(solution(truth), reference(truth))
    np.testing.assert_allclose(errors.distance, RADIUS_M * 0.1 * (truth.time - 1000.0), rtol=1e-4, atol=1e-6)


def test_distance_counts_from_the_solutions_first_epoch_not_the_references():
    truth = drive()
    kept = slice(400, None)
    late = solution(truth, time=truth.time[kept], position=truth.geodetic[kept], velocity=truth.velocity[kept],
                    attitude=truth.attitude[kept])  # fmt: skip
    errors = compare_to_reference(late, reference(truth))
    assert errors.distance[0] == 0.0
    assert errors.distance[-1] == pytest.approx(RADIUS_M * 4.0, rel=1e-4)


@pytest.mark.parametrize("time", [[1000.0], [1000.0, 1000.0], [1001.0, 1000.0]])
def test_a_reference_without_increasing_times_is_refused(time):
    truth = drive()
    count = len(time)
    bad = reference(truth, time=np.array(time), position=truth.geodetic[:count], velocity=None, attitude=None)
    with pytest.raises(InputError, match="expected at least two, with increasing times"):
        compare_to_reference(solution(truth), bad)
