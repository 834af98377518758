"""Configurations of Wheel-INS."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rolling_files import RADIUS, REST_S, wheel_rows
from written_recordings import write_config

from polyins.errors import InputError
from polyins.model.rig import DEG, HOUR, MGAL, PPM
from polyins.reading.loading import load
from polyins.tools.inspect import inspect

VALUES: dict[str, Any] = {
    "imupath": "wheel.bin",
    "outputpath": "out",
    "imudatalen": 7,
    "imudatarate": 100,
    "starttime": 2.0,
    "endtime": -1,
    "initposstd": [0.05, 0.06, 0.07],
    "initvelstd": [0.05, 0.05, 0.05],
    "initattstd": [1.0, 2.0, 0.1],
    "imunoise": {"arw": 1.2, "vrw": 6, "gbstd": 50, "abstd": 2000, "gsstd": 50, "asstd": 500, "corrtime": 1.0},
    "MisalignAngle": [0, 0, 0],
    "WheelLA": [0.001, 0.014, -0.005],
    "ODO_std": [0.035, 0.02, 0.03],
    "ODO_dt": 0.5,
    "Wheel_Radius": RADIUS,
    "ifCompVel": False,
}


def module_rows() -> np.ndarray:
    """time, rates, specific forces with x to the right along the axle."""
    return wheel_rows("rear-right")[:, [0, 3, 1, 2, 6, 4, 5]]


def written(folder: Path, **changes: Any) -> Path:
    (folder / "wheel.bin").write_bytes(module_rows().astype("<f8").tobytes())
    return write_config(folder, {key: value for key, value in {**VALUES, **changes}.items() if value is not None})


def test_everything_comes_out_in_si(tmp_path: Path) -> None:
    recording = load(written(tmp_path))
    (imu,) = recording.rig.imus
    assert imu.wheel is not None
    assert imu.wheel.radius == RADIUS
    np.testing.assert_allclose(imu.wheel.lever_arm, [0.001, 0.014, -0.005])
    np.testing.assert_array_equal(imu.rotation, np.eye(3))
    np.testing.assert_array_equal(imu.position, 0.0)
    np.testing.assert_allclose(imu.noise.gyro_bias_std, 50 * DEG / HOUR)
    np.testing.assert_allclose(imu.start_std(), np.repeat([50 * DEG / HOUR, 2000 * MGAL, 50 * PPM, 500 * PPM], 3))
    start, options = recording.start, recording.options
    assert not recording.geodetic
    assert (start.time, start.end_time, start.heading_from) == (2.0, None, "value")
    np.testing.assert_array_equal(start.roll_pitch, 0.0)
    np.testing.assert_array_equal(start.position, 0.0)
    np.testing.assert_array_equal(start.velocity, 0.0)
    assert start.heading == pytest.approx(-90 * DEG)
    assert not start.estimate_gyro_bias
    np.testing.assert_allclose(start.attitude_std, np.array([1.0, 2.0, 0.1]) * DEG)
    np.testing.assert_allclose(start.position_std, [0.05, 0.06, 0.07])
    assert options.gravity == 9.782940329221166
    assert options.gate_limit is None
    rolling = options.rolling
    assert (rolling.speed_interval, rolling.speed_window, rolling.predict) == (0.5, 0.1, "end")
    assert not rolling.standstill
    np.testing.assert_allclose(rolling.wheel_speed_std, [0.035, 0.02, 0.03])


def test_increments_are_rates_times_intervals(tmp_path: Path) -> None:
    (stream,) = load(written(tmp_path)).imus
    rows = module_rows()
    np.testing.assert_allclose(stream.dtheta[1:], rows[1:, 1:4] * np.diff(rows[:, 0])[:, None], atol=1e-15)
    np.testing.assert_allclose(stream.dvel[1:], rows[1:, 4:7] * np.diff(rows[:, 0])[:, None], atol=1e-15)
    assert -RADIUS * stream.dtheta[stream.time > REST_S, 0].sum() > 100.0


def test_what_is_not_used_is_said(tmp_path: Path) -> None:
    path = written(tmp_path, MisalignAngle=[0, 1.3, 0], ifCompVel=True)
    (output, misaligned, compensated) = load(path).warnings
    assert "outputpath: is ignored; --out says where results go" in output
    assert "MisalignAngle: is not used, as in that program" in misaligned
    assert "ifCompVel: is not used" in compensated


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"Wheel_Radius": None}, r"Wheel_Radius: is missing; expected it in a Wheel-INS configuration"),
        ({"Wheel_Radius": 300}, r"radius_m: is 300; expected metres"),
        ({"ODO_dt": "often"}, r"line \d+: ODO_dt: is 'often'; expected a number"),
        ({"WheelLA": [0.1]}, r"line \d+: WheelLA: is \[0\.1\]; expected three numbers"),
        ({"imudatalen": 9}, r"line \d+: imudatalen: is 9; expected 7"),
        ({"imunoise": {"arw": 1}}, r"imunoise\.vrw: is missing"),
        ({"starttime": 99.0}, r"start\.time_s: is 99.*expected a time within the data"),
        ({"imupath": "other.bin"}, r"other\.bin: no such file"),
    ],
)
def test_wrong_keys_are_named(changes: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load(written(tmp_path, **changes))
    assert re.search(message, str(caught.value)), caught.value
    assert len(str(caught.value).splitlines()) <= 2


def test_text_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path)
    np.savetxt(tmp_path / "wheel.bin", module_rows())
    with pytest.raises(InputError, match="is text; expected rows of 7 doubles"):
        load(path)


def test_the_parity_configuration(data_folder: Path) -> None:
    path = data_folder / "wheelins-parity" / "wheel-ins.yaml"
    recording = load(path)
    (stream,) = recording.imus
    assert stream.time[0] == recording.start.time == 1000.005
    assert stream.rate_hz == pytest.approx(200.0)
    rates = stream.dtheta[2000:, 0] / np.diff(stream.time)[1999:]
    assert np.median(rates) == pytest.approx(-14.0, abs=0.5)
    assert inspect(path)["format"] == "wheel-ins"
