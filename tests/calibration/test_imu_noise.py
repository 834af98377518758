"""All figures of an IMU, what a configuration is told of them, and what is said beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from resting import ACCEL, GYRO, INTERVAL, of_rates, shaken, stream

from polyins.calibration.imu_noise import AXES, SENSORS, ImuNoise, imu_noise
from polyins.calibration.noise_findings import findings
from polyins.calibration.noise_listing import QUANTITIES, NoiseFigures, configuration, document, rows
from polyins.config import NOISE_GRADES, Noise
from polyins.config.units import read
from polyins.errors import InputError
from polyins.model.recording import ImuStream
from polyins.model.rig import NoiseGrade
from polyins.simulation.imu_errors import gauss_markov
from polyins.studies.noise_cases import NoiseCase


@pytest.fixture(scope="module")
def quiet() -> ImuNoise:
    return imu_noise(stream("left", 400.0, 1))


@pytest.fixture(scope="module")
def drifting() -> ImuNoise:
    """Biases that are seen to drift."""
    rng = np.random.default_rng(2)
    gyro = NoiseCase(GYRO, 5e-5, 2e-6, INTERVAL, 50_000)
    accel = NoiseCase(ACCEL, 1e-3, 3e-5, INTERVAL, 50_000)
    columns = [case.rates(rng) for case in (gyro, gyro, gyro, accel, accel, accel)]
    return imu_noise(of_rates("right", np.column_stack(columns)))


def test_random_walks_are_those_of_the_filter(quiet: ImuNoise) -> None:
    grade = read(Noise.model_validate(quiet.configuration()), NoiseGrade)
    np.testing.assert_allclose(grade.angle_random_walk, GYRO, rtol=0.03)
    np.testing.assert_allclose(grade.velocity_random_walk, ACCEL, rtol=0.03)


def test_a_drift_that_is_not_seen_is_at_most_what_it_can_be(quiet: ImuNoise) -> None:
    """Or nothing, where that is more than a cheap IMU has anyway."""
    said, usual = quiet.configuration(), NOISE_GRADES["consumer-mems"]
    for key in ("gyro_bias_deg_h", "accel_bias_mgal"):
        value = said[key]
        assert value is None or 0.0 < value < usual[key]
    text = configuration(NoiseFigures((quiet,), None, ()))
    assert ("not told by this recording" in text) == (None in said.values())


def test_a_drift_that_is_seen_is_told(drifting: ImuNoise) -> None:
    grade = read(Noise.model_validate(drifting.configuration()), NoiseGrade)
    assert drifting.axes["gyro"][0].noise.instability.value == pytest.approx(5e-5, rel=0.3)
    # as large as the flicker at least, at a hundred seconds
    ten_minutes = grade.gyro_bias_std[0] * np.sqrt(2.0 * 100.0 / (3.0 * grade.correlation_time))
    assert ten_minutes > 0.9 * 0.664 * 5e-5


def test_the_figures_of_a_simulated_imu_come_back() -> None:
    """Of two hours at rest with the biases that the filter's model has; those of the worst of three axes."""
    rng, interval, count = np.random.default_rng(1), 0.1, 72_000
    grade = read(Noise.model_validate("consumer-mems"), NoiseGrade)
    white = rng.standard_normal((count, 6)) / np.sqrt(interval)
    walks = np.concatenate([grade.angle_random_walk, grade.velocity_random_walk])
    biases = gauss_markov(count, interval / grade.correlation_time, rng)[:, :6] * grade.steady_std()[:6]
    rates = white * walks + biases + [0.0, 0.0, 0.0, 0.0, 0.0, -9.81]
    time = np.arange(1, count + 1) * interval
    said = imu_noise(ImuStream("a", time, rates[:, :3] * interval, rates[:, 3:] * interval)).configuration()
    for key, stated in NOISE_GRADES["consumer-mems"].items():
        if "scale" not in key:
            assert said[key] == pytest.approx(stated, rel=0.02 if "walk" in key else 0.4), key


def test_short_rests_tell_no_drift() -> None:
    one = shaken(shaken(stream("a", 90.0, 3), 25.0, 35.0), 60.0, 66.0)
    said = imu_noise(one).configuration()
    assert said["gyro_bias_deg_h"] is None
    assert said["accel_bias_mgal"] is None
    assert said["angle_random_walk_deg_sqrt_h"] == pytest.approx(np.degrees(GYRO) * 60.0, rel=0.1)


def test_si_and_datasheet_say_the_same(drifting: ImuNoise) -> None:
    found = document(NoiseFigures((drifting,), None, ()))
    axis = found["imus"]["right"]["gyro"]["x"]
    si, sheet = axis["angle_random_walk_rad_sqrt_s"], axis["datasheet"]["angle_random_walk_deg_sqrt_h"]
    assert sheet["value"] == pytest.approx(np.degrees(si["value"]) * 60.0)
    assert axis["datasheet"]["bias_instability_deg_h"]["high"] == pytest.approx(
        np.degrees(axis["bias_instability_rad_s"]["high"]) * 3600.0
    )
    accel = found["imus"]["right"]["accel"]["z"]
    walk = accel["acceleration_random_walk_m_s2_sqrt_s"]
    assert accel["datasheet"]["acceleration_random_walk_mgal_sqrt_h"]["high"] == pytest.approx(
        walk["high"] * 1e5 * 60.0
    )
    assert found["array"] is None
    curve = axis["allan"]
    assert np.all(np.less(curve["low_rad_s"], curve["deviation_rad_s"]))
    assert np.all(np.less(curve["deviation_rad_s"], curve["high_rad_s"]))


def test_what_is_not_told_is_null_with_its_limit(quiet: ImuNoise) -> None:
    figures = NoiseFigures((quiet,), None, ())
    walk = document(figures)["imus"]["left"]["gyro"]["x"]["rate_random_walk_rad_s_sqrt_s"]
    assert walk["value"] is None
    assert walk["low"] == 0.0
    assert walk["high"] > 0.0
    table = rows(figures)
    assert [row[0] for row in table] == [f"left  {sensor} {axis}" for sensor in SENSORS for axis in AXES]
    assert table[0][3].startswith("at most")
    assert table[0][3].endswith(QUANTITIES["gyro"][2].unit)


def test_what_is_left_out_is_said() -> None:
    one = imu_noise(shaken(stream("a", 120.0, 4), 40.0, 50.0))
    (motion,) = [found for found in findings(one) if found.kind == "left out"]
    assert motion.severity == "note"
    assert motion.size == pytest.approx(12.0, abs=3.0)
    assert "in 2 stretches at rest are used" in motion.text
    assert "do not tell the" in findings(one)[-1].text


def test_nothing_is_left_out_of_a_whole_rest(quiet: ImuNoise) -> None:
    assert {found.kind for found in findings(quiet)} == {"noise"}
    assert all(found.severity == "note" for found in findings(quiet))


def test_noise_that_is_nearly_motion_is_doubted(quiet: ImuNoise) -> None:
    noisy = replace(quiet, rest=replace(quiet.rest, closeness=0.7))
    doubts = [found.text for found in findings(noisy) if found.severity == "doubt"]
    assert len(doubts) == 1
    assert "70 % of what is taken for motion" in doubts[0]


def test_samples_that_repeat_are_doubted() -> None:
    one = stream("a", 60.0, 5)
    rates = np.hstack([one.dtheta, one.dvel]) / INTERVAL
    rates[:, 2] = np.repeat(rates[::4, 2], 4)
    doubts = [found for found in findings(imu_noise(of_rates("a", rates))) if found.severity == "doubt"]
    assert any(found.axis == "gyro z" and found.size == pytest.approx(0.75, abs=0.01) for found in doubts)


def test_steps_are_no_noise_of_the_model() -> None:
    one = stream("a", 200.0, 6)
    rates = np.hstack([one.dtheta, one.dvel]) / INTERVAL
    rates[:, 0] += np.where(np.arange(len(rates)) // 250 % 2, 30.0 * GYRO, 0.0)
    doubts = [found.text for found in findings(imu_noise(of_rates("a", rates))) if found.severity == "doubt"]
    assert any("do not describe gyro x:" in text for text in doubts)


def test_a_stuck_axis_is_refused() -> None:
    one = stream("a", 60.0, 7)
    rates = np.hstack([one.dtheta, one.dvel]) / INTERVAL
    rates[:, 4] = -0.2
    with pytest.raises(InputError, match="IMU a: accel y: one value at rest throughout"):
        imu_noise(of_rates("a", rates))
