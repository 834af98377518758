from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from polyins.model.rig import NoiseGrade
from polyins.simulation.imu_errors import Imperfections, TrueErrors, TrueIncrements, corrupt, draw_errors, gauss_markov

GRADE = NoiseGrade.from_datasheet(
    angle_random_walk_deg_sqrt_h=[0.2, 0.3, 0.4],
    velocity_random_walk_m_s_sqrt_h=[0.1, 0.2, 0.3],
    gyro_bias_deg_h=50.0,
    accel_bias_mgal=250.0,
    gyro_scale_ppm=1000.0,
    accel_scale_ppm=2000.0,
    correlation_time_h=1.0,
)
SILENT = Imperfections(noise=False).limit(GRADE)
TIME = np.arange(1, 4001) / 200.0
STD = np.concatenate([GRADE.gyro_bias_std, GRADE.accel_bias_std, GRADE.gyro_scale_std, GRADE.accel_scale_std])


def true_increments(seed):
    rng = np.random.default_rng(seed)
    return rng.normal(0.0, 1e-3, (TIME.size, 3)), rng.normal(0.0, 0.05, (TIME.size, 3))


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_the_filter_s_correction_takes_bias_and_scale_off(seed, share):
    rng = np.random.default_rng(seed)
    dtheta, dvel = true_increments(seed)
    errors = draw_errors(20.0, GRADE, Imperfections(turn_on_share=share), rng)
    measured_dtheta, measured_dvel = corrupt(TrueIncrements(TIME, dtheta, dvel), errors, SILENT, rng)
    gyro_bias, accel_bias, gyro_scale, accel_scale = np.split(errors.at(TIME - 0.0025), 4, axis=1)
    np.testing.assert_allclose((measured_dtheta - gyro_bias * 0.005) / (1 + gyro_scale), dtheta, atol=1e-15)
    np.testing.assert_allclose((measured_dvel - accel_bias * 0.005) / (1 + accel_scale), dvel, atol=1e-15)
    assert np.abs(measured_dtheta - dtheta).max() > 0.0


def test_white_noise_has_the_grade_s_random_walk():
    rng, time = np.random.default_rng(1), np.arange(1, 200_001) / 200.0
    still, none = np.zeros((time.size, 3)), Imperfections(biases=False, scales=False)
    errors = draw_errors(1000.0, GRADE, none, rng)
    dtheta, dvel = corrupt(TrueIncrements(time, still, still), errors, none.limit(GRADE), rng)
    # the relative std of a std estimate from 200,000 samples is 0.16 %
    np.testing.assert_allclose(dtheta.std(axis=0) / np.sqrt(0.005), GRADE.angle_random_walk, rtol=0.008)
    np.testing.assert_allclose(dvel.std(axis=0) / np.sqrt(0.005), GRADE.velocity_random_walk, rtol=0.008)
    assert np.abs(np.corrcoef(np.hstack([dtheta, dvel]).T) - np.eye(6)).max() < 0.012


@pytest.mark.parametrize("step", [0.001, 0.1, 2.0])
def test_gauss_markov_is_stationary_and_forgets_exponentially(step):
    rng, lag = np.random.default_rng(2), 5
    drawn = np.stack([gauss_markov(lag + 1, step, rng) for _ in range(4000)])
    first, last = drawn[:, 0].ravel(), drawn[:, -1].ravel()
    assert first.var() == pytest.approx(1.0, abs=0.03)
    assert last.var() == pytest.approx(1.0, abs=0.03)
    assert np.mean(first * last) == pytest.approx(np.exp(-lag * step), abs=0.03)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_turn_on_share_splits_the_variance(share):
    quick = replace(GRADE, correlation_time=2.0)
    drawn = [
        draw_errors(20.0, quick, Imperfections(turn_on_share=share), np.random.default_rng(seed)).series / STD
        for seed in range(1500)
    ]
    first, last = np.array([series[0] for series in drawn]), np.array([series[-1] for series in drawn])
    assert first.var() == pytest.approx(1.0, abs=0.05)
    assert last.var() == pytest.approx(1.0, abs=0.05)
    # ten correlation times later only the constant part is common
    assert np.mean(first * last) == pytest.approx(share, abs=0.05)


def test_short_correlation_times_have_fine_nodes():
    errors = draw_errors(10.0, replace(GRADE, correlation_time=5.0), Imperfections(), np.random.default_rng(0))
    assert errors.time[1] == pytest.approx(0.1)
    assert errors.time[-1] >= 10.0


def test_switches_silence_their_error_and_leave_the_others():
    def drawn(**switches):
        rng = np.random.default_rng(3)
        dtheta, dvel = true_increments(3)
        imperfections = Imperfections(misalignment_std=0.001, **switches)
        errors = draw_errors(20.0, GRADE, imperfections, rng)
        return errors, np.hstack(corrupt(TrueIncrements(TIME, dtheta, dvel), errors, imperfections.limit(GRADE), rng))

    everything, measured = drawn()
    no_biases, _ = drawn(biases=False)
    np.testing.assert_array_equal(no_biases.series[:, :6], 0.0)
    np.testing.assert_array_equal(no_biases.series[:, 6:], everything.series[:, 6:])
    np.testing.assert_array_equal(drawn(scales=False)[0].series[:, 6:], 0.0)
    quiet, silent = drawn(noise=False)
    np.testing.assert_array_equal(quiet.series, everything.series)
    # at 200 Hz the noise of an increment is 20 to 80 microradian: far above what rounding could make
    assert np.abs(measured - silent)[:, :3].std() > 1e-6
    assert np.abs(measured - silent)[:, 3:].std() > 1e-5


def test_misalignment_turns_before_scale_and_bias():
    gyro_turn, accel_turn = np.array([0.0, 0.0, 0.01]), np.array([0.02, 0.0, 0.0])
    series = np.tile(np.repeat([1e-3, 2e-2, 1e-2, -2e-2], 3), (2, 1))
    errors = TrueErrors(np.array([0.0, 100.0]), series, gyro_turn, accel_turn)
    dtheta, dvel = true_increments(4)
    measured_dtheta, measured_dvel = corrupt(
        TrueIncrements(TIME, dtheta, dvel), errors, SILENT, np.random.default_rng(0)
    )
    # sensor axes turned by r see a fixed vector turned by -r
    turned = Rotation.from_rotvec(-gyro_turn).apply(dtheta)
    np.testing.assert_allclose(measured_dtheta, 1.01 * turned + 1e-3 * 0.005, atol=1e-16)
    turned = Rotation.from_rotvec(-accel_turn).apply(dvel)
    np.testing.assert_allclose(measured_dvel, 0.98 * turned + 2e-2 * 0.005, atol=1e-15)


def test_errors_in_array_axes_explain_what_a_reader_returns():
    C_ab = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    rng = np.random.default_rng(5)
    dtheta, dvel = true_increments(5)
    errors = draw_errors(20.0, GRADE, Imperfections(), rng)
    measured = corrupt(TrueIncrements(TIME, dtheta @ C_ab, dvel @ C_ab), errors, SILENT, rng)
    gyro_bias, accel_bias, gyro_scale, accel_scale = np.split(errors.in_array_axes(TIME - 0.0025, C_ab), 4, axis=1)
    np.testing.assert_allclose(measured[0] @ C_ab.T, (1 + gyro_scale) * dtheta + gyro_bias * 0.005, atol=1e-16)
    np.testing.assert_allclose(measured[1] @ C_ab.T, (1 + accel_scale) * dvel + accel_bias * 0.005, atol=1e-15)
    np.testing.assert_allclose(errors.start(C_ab).as_array(), errors.in_array_axes(np.zeros(1), C_ab)[0])
