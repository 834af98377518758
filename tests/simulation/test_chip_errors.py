"""Each error beyond bias, scale and noise does what it says, and nothing else."""

from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polyins.errors import InputError
from polyins.model.rig import DEG, HOUR, NoiseGrade
from polyins.simulation.error_scenario import ChipCalibration, SensorErrors
from polyins.simulation.imu_errors import Imperfections, TrueIncrements, corrupt, draw_errors
from polyins.simulation.run import simulate
from polyins.simulation.sampling import jittered, rounded
from polyins.simulation.scenario import Board, Scenario
from polyins.simulation.shared_noise import SharedNoise
from polyins.simulation.triads import TriadCalibration, skewed

GRADE = NoiseGrade.from_datasheet(
    angle_random_walk_deg_sqrt_h=0.24,
    velocity_random_walk_m_s_sqrt_h=0.24,
    gyro_bias_deg_h=50.0,
    accel_bias_mgal=250.0,
    gyro_scale_ppm=1000.0,
    accel_scale_ppm=1000.0,
    correlation_time_h=1.0,
)
NOTHING = Imperfections(noise=False, biases=False, scales=False)
INTERVAL = 0.005
TIME = INTERVAL * np.arange(1, 2001)
RNG = np.random.default_rng(7)
DTHETA, DVEL = RNG.normal(0.0, 1e-3, (TIME.size, 3)), RNG.normal(0.0, 0.02, (TIME.size, 3)) - [0.0, 0.0, 0.049]
DVEL[0] = [0.0, 0.0, -0.049]


def measured(imperfections, *, seed=5, shared=None, vibration=None, truth=(DTHETA, DVEL), number=0):
    rng = np.random.default_rng(seed)
    errors = draw_errors(TIME[-1], GRADE, imperfections, rng, shared=shared, number=number)
    white = imperfections.limit(GRADE)
    return errors, *corrupt(
        TrueIncrements(TIME, *truth, vibration), errors, white, rng, imperfections=imperfections, shared=shared
    )


SWITCHES = {
    "chip_rotation_std": 0.01,
    "gyro_turn_on_std": 1e-3,
    "accel_turn_on_std": 0.1,
    "gyro_skew_std": 1e-3,
    "accel_skew_std": 1e-3,
    "gyro_random_walk": 1e-6,
    "accel_random_walk": 1e-4,
    "g_sensitivity_std": 1e-5,
    "rectification_mean": 1e-4,
    "rectification_std": 1e-4,
    "jitter_std": 1e-4,
    "gyro_lsb": 1e-4,
    "accel_lsb": 1e-3,
}


@pytest.mark.parametrize("name", SWITCHES)
def test_each_switch_changes_its_sensor_and_leaves_the_other_errors(name):
    plain = Imperfections(misalignment_std=0.001, turn_on_share=0.5)
    _, dtheta, dvel = measured(plain)
    errors, other_dtheta, other_dvel = measured(replace(plain, **{name: SWITCHES[name]}))
    expected = {"gyro": (True, False), "g_sen": (True, False), "accel": (False, True), "recti": (False, True)}
    gyro, accel = next((value for key, value in expected.items() if name.startswith(key)), (True, True))
    assert np.any(other_dtheta != dtheta) == gyro
    assert np.any(other_dvel != dvel) == accel
    # what is drawn first stays: the difference is small against the noise that both have
    assert (other_dtheta - dtheta).std() < 0.02 * dtheta.std() + 1e-5
    np.testing.assert_array_equal(errors.gyro_misalignment, measured(plain)[0].gyro_misalignment)


def test_every_size_is_a_switch():
    known = {"turn_on_share", "misalignment_std", "noise", "biases", "scales", "chips"}
    assert {field.name for field in fields(Imperfections)} == known | set(SWITCHES)


def test_random_walk_grows_with_the_root_of_time():
    walks = Imperfections(biases=False, scales=False, gyro_random_walk=2e-6, accel_random_walk=3e-4)
    drawn = np.array(
        [draw_errors(400.0, GRADE, walks, np.random.default_rng(seed)).series[:, :6] for seed in range(800)]
    )
    np.testing.assert_array_equal(drawn[:, 0], 0.0)
    for at in (100, 400):
        np.testing.assert_allclose(drawn[:, at, :3].std() / np.sqrt(at), 2e-6, rtol=0.06)
        np.testing.assert_allclose(drawn[:, at, 3:].std() / np.sqrt(at), 3e-4, rtol=0.06)
    assert SensorErrors(gyro_random_walk_deg_h_sqrt_h=3.0).imperfections().gyro_random_walk == pytest.approx(
        3.0 * DEG / HOUR / np.sqrt(HOUR)
    )


def test_a_chip_turns_as_a_whole():
    _, dtheta, dvel = measured(replace(NOTHING, chip_rotation_std=0.05))
    gyro, accel = (Rotation.align_vectors(seen, true)[0] for seen, true in ((dtheta, DTHETA), (dvel, DVEL)))
    np.testing.assert_allclose(gyro.as_rotvec(), accel.as_rotvec(), atol=1e-12)
    assert gyro.magnitude() > 0.01
    np.testing.assert_allclose(gyro.apply(DTHETA), dtheta, atol=1e-15)


def test_skew_leaves_x_and_leans_the_others():
    errors, dtheta, dvel = measured(replace(NOTHING, gyro_skew_std=0.01))
    np.testing.assert_array_equal(dtheta[:, 0], DTHETA[:, 0])
    np.testing.assert_array_equal(dvel, DVEL)
    lean = errors.gyro_response[1, 0]
    np.testing.assert_allclose(dtheta[:, 1], DTHETA[:, 1] + lean * DTHETA[:, 0], atol=1e-18)
    np.testing.assert_array_equal(np.triu(skewed(np.ones(3)), 1), 0.0)


def test_a_chip_s_calibration_takes_off_what_it_put_on():
    matrix = np.eye(3) + RNG.normal(0.0, 0.01, (3, 3))
    calibration = TriadCalibration(matrix, np.array([0.01, -0.02, 0.03]))
    plain, odd = ChipCalibration().chip(), replace(ChipCalibration().chip(), gyro=calibration, accel=calibration)
    _, dtheta, dvel = measured(replace(NOTHING, chips=(plain, odd)), number=3)
    for raw, true in ((dtheta, DTHETA), (dvel, DVEL)):
        np.testing.assert_allclose(raw @ matrix.T + calibration.offset * INTERVAL, true, atol=1e-15)
    _, untouched, _ = measured(replace(NOTHING, chips=(plain, odd)), number=2)
    np.testing.assert_allclose(untouched, DTHETA, atol=1e-18)


def test_gyros_feel_force():
    errors, dtheta, dvel = measured(replace(NOTHING, g_sensitivity_std=1e-4))
    np.testing.assert_array_equal(dvel, DVEL)
    matrix = errors.force_response.g_sensitivity
    np.testing.assert_allclose(dtheta - DTHETA, DVEL @ matrix.T, atol=1e-18)
    assert np.abs(matrix).min() > 0.0


def test_vibration_is_rectified():
    vibration = np.where(TIME < 5.0, 0.0, 4.0)
    still = np.tile([0.0, 0.0, -0.049], (TIME.size, 1))
    truth = (DTHETA, still)
    _, dtheta, dvel = measured(replace(NOTHING, rectification_mean=1e-3), vibration=vibration, truth=truth)
    np.testing.assert_array_equal(dtheta, DTHETA)
    # k times the mean square, on every axis; gravity's own share is in the bias
    np.testing.assert_allclose((dvel - still) / INTERVAL, 1e-3 * np.tile(vibration, (3, 1)).T, atol=1e-15)
    # what the increments show counts as well
    _, _, shaken = measured(replace(NOTHING, rectification_mean=1e-3))
    added = (shaken - DVEL) / INTERVAL
    np.testing.assert_allclose(added, 1e-3 * ((DVEL / INTERVAL) ** 2 - (DVEL[0] / INTERVAL) ** 2), atol=1e-14)
    assert SensorErrors(vibration_m_s2=0.5).vibration(np.array([20.0]))[0] == pytest.approx(1.0)
    assert SensorErrors(rectification_mg_g2=1.0).imperfections().rectification_mean == pytest.approx(1e-3 / 9.80665)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_chips_of_a_board_share_their_noise(share):
    still = (np.zeros((TIME.size, 3)), np.zeros((TIME.size, 3)))
    noisy = Imperfections(biases=False, scales=False)
    shared = SharedNoise(11, white_share=share)
    first, second = (measured(noisy, seed=seed, shared=shared, truth=still) for seed in (1, 2))
    for one, two in zip(first[1:], second[1:], strict=True):
        assert np.corrcoef(one.ravel(), two.ravel())[0, 1] == pytest.approx(share, abs=0.04)
        assert one.std() == pytest.approx(measured(noisy, truth=still, seed=9)[1:][one is first[2]].std(), rel=0.04)


def test_chips_of_a_board_share_their_drift():
    quick = replace(GRADE, correlation_time=2.0)
    drifts = [
        [
            draw_errors(
                2000.0, quick, Imperfections(), np.random.default_rng(seed), shared=SharedNoise(3, drift_share=0.6)
            ).series[:, 0]
            for seed in pair
        ]
        for pair in ((1, 2), (3, 4))
    ]
    for one, two in drifts:
        assert np.corrcoef(one, two)[0, 1] == pytest.approx(0.6, abs=0.06)
        assert one.std() == pytest.approx(quick.gyro_bias_std[0], rel=0.1)


def test_rates_are_multiples_of_the_least_significant_bit():
    lsb = 250.0 / 32768.0 * DEG
    seen = rounded(DTHETA, lsb, INTERVAL)
    steps = seen / (lsb * INTERVAL)
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-9)
    assert (seen - DTHETA).std() == pytest.approx(lsb * INTERVAL / np.sqrt(12.0), rel=0.02)
    assert rounded(DTHETA, 0.0, INTERVAL) is DTHETA


def test_jitter_shows_the_rate_of_another_instant():
    jitter = 1e-4 * RNG.standard_normal(TIME.size)
    constant = np.tile([1e-3, -2e-3, 0.0], (TIME.size, 1))
    np.testing.assert_allclose(jittered(constant, jitter, INTERVAL), constant, atol=1e-15)
    rate = np.column_stack([np.sin(6.0 * TIME), np.cos(TIME), TIME])
    off = jittered(rate * INTERVAL, jitter, INTERVAL) / INTERVAL - rate
    slope = np.gradient(rate, TIME, axis=0)
    inside = slice(1, -1)
    np.testing.assert_allclose(off[inside], (slope * jitter[:, None])[inside], atol=5e-5)
    # no sample makes up for another: the sum is off as well
    assert np.abs(off[:, 2].sum() - jitter.sum()) < 1e-4


def test_scenarios_switch_errors_on_one_by_one():
    short = Scenario(duration_s=20.0, static_s=5.0, rate_hz=50.0, imus=Board(count=2), outages=())
    plain = simulate(short)
    same = simulate(short.model_copy(update={"errors": SensorErrors(vibration_m_s2=1.0)}))
    np.testing.assert_array_equal(plain.imus[1].dvel, same.imus[1].dvel)
    walked = simulate(short.model_copy(update={"errors": SensorErrors(gyro_turn_on_deg_h=100.0)}))
    offset = walked.imus[1].dtheta - plain.imus[1].dtheta
    np.testing.assert_allclose(offset, np.tile(offset[0], (len(offset), 1)), atol=1e-15)
    assert walked.rig.imus[1].start_std()[0] == pytest.approx(np.hypot(100.0, 50.0) * DEG / HOUR)
    np.testing.assert_array_equal(plain.gnss.position, walked.gnss.position)


def test_jitter_beyond_a_tenth_of_the_interval_is_refused():
    with pytest.raises((InputError, ValueError), match=r"errors.jitter_s is 0.001; expected at most a tenth"):
        Scenario(errors=SensorErrors(jitter_s=1e-3))
