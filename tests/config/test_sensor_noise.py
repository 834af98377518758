"""Common IMUs by name."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pydantic import ValidationError

from polyins.config import KNOWN_IMUS, NOISE_BY_NAME, NOISE_GRADES, Noise
from polyins.config.sensor_noise import PER_UNIT
from polyins.config.units import read
from polyins.model.rig import NoiseGrade

UNITS = {
    "angle_random_walk_deg_sqrt_h": {"deg/sqrt(h)", "deg/s/sqrt(Hz)", "mdeg/s/sqrt(Hz)"},
    "velocity_random_walk_m_s_sqrt_h": {"m/s/sqrt(h)", "mg/sqrt(Hz)", "ug/sqrt(Hz)"},
    "gyro_bias_deg_h": {"deg/h"},
    "accel_bias_mgal": {"mGal"},
    "correlation_time_h": {"h"},
}


@pytest.mark.parametrize("name", KNOWN_IMUS)
def test_every_figure_has_an_address_and_a_unit_of_its_key(name: str) -> None:
    imu = KNOWN_IMUS[name]
    assert {"angle_random_walk_deg_sqrt_h", "velocity_random_walk_m_s_sqrt_h"} <= set(imu.figures)
    for key, stated in imu.figures.items():
        assert stated.unit in UNITS[key]
        assert re.match(r"https://\S+\.\S+", stated.source)
        assert stated.number > 0.0


@pytest.mark.parametrize("name", KNOWN_IMUS)
def test_a_name_is_a_noise(name: str) -> None:
    noise = Noise.model_validate(name)
    assert noise.grade == name
    for key in NOISE_GRADES["consumer-mems"]:
        imu = KNOWN_IMUS[name]
        expected = imu.figures[key].value if key in imu.figures else NOISE_GRADES[imu.grade][key]
        assert np.all(np.array(getattr(noise, key)) == expected)


def test_densities_become_random_walks() -> None:
    grade = read(Noise.model_validate("icm-42688-p"), NoiseGrade)
    assert grade.angle_random_walk[0] == pytest.approx(np.radians(2.8e-3), rel=1e-5)
    assert grade.velocity_random_walk[0] == pytest.approx(70e-6 * 9.80665, rel=1e-5)
    assert PER_UNIT["deg/s/sqrt(Hz)"] == 60.0


def test_what_is_said_beside_a_name_holds() -> None:
    noise = Noise.model_validate({"grade": "adis16465", "gyro_bias_deg_h": 7.0})
    assert noise.gyro_bias_deg_h[0] == 7.0
    assert noise.accel_bias_mgal[0] == NOISE_BY_NAME["adis16465"]["accel_bias_mgal"] == 200.0


@pytest.mark.parametrize("given", ["icm-99999", {"grade": "icm-99999"}, {"grade": ["icm-20602"]}])
def test_another_name_is_refused_with_those_that_are_known(given: object) -> None:
    with pytest.raises(ValidationError, match=r"unknown grade.*expected one of consumer-mems, .*icm-20602"):
        Noise.model_validate(given)
