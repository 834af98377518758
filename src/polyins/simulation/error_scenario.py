"""What a scenario may say of the errors of its IMUs. What is not said is not there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from polyins.config import NotNegative, Number, Section, Triple
from polyins.config.fields import IDENTITY, Matrix
from polyins.config.units import in_si, read
from polyins.model.rig import ImuErrors, NoiseGrade
from polyins.simulation.imu_errors import Imperfections
from polyins.simulation.shared_noise import SharedNoise
from polyins.simulation.triads import Chip, TriadCalibration

Array = NDArray[np.float64]

Share = Annotated[Number, Field(ge=0.0, le=1.0)]

NOTHING = (0.0, 0.0, 0.0)

VIBRATION_SPEED = 10.0  # m/s


class ChipCalibration(Section):
    """A calibration that nobody applies: corrected = matrix raw + offset, in sensor axes."""

    gyro_matrix: Matrix = IDENTITY
    """three rows of three"""
    gyro_offset_deg_s: Triple = NOTHING
    """deg/s"""
    accel_matrix: Matrix = IDENTITY
    """three rows of three"""
    accel_offset_m_s2: Triple = NOTHING
    """m/s^2"""

    def chip(self) -> Chip:
        """Return the same in SI."""
        return Chip(
            TriadCalibration(np.array(self.gyro_matrix), in_si(self, "gyro_offset_deg_s")),
            TriadCalibration(np.array(self.accel_matrix), in_si(self, "accel_offset_m_s2")),
        )


class SensorErrors(Section):
    """Which errors the IMUs have, beyond the statistics under `noise`."""

    FIELDS: ClassVar[Mapping[str, str]] = {
        "rectification": "rectification_mean",
        "rectification_spread": "rectification_std",
        **{
            name: f"{name}_std"
            for name in (
                "misalignment",
                "gyro_turn_on",
                "accel_turn_on",
                "chip_rotation",
                "gyro_skew",
                "accel_skew",
                "g_sensitivity",
                "jitter",
            )
        },
    }

    noise: bool = True
    """white noise"""
    biases: bool = True
    """biases"""
    scales: bool = True
    """scale factor errors"""
    turn_on_share: Share = 0.0
    """share of the variance of biases and scale factors that is constant; the rest drifts"""
    misalignment_deg: NotNegative = 0.0
    """std of the rotation of gyro and accelerometer triads about each axis, deg"""
    gyro_turn_on_deg_h: NotNegative = 0.0
    """std of a constant gyro bias besides those under noise, deg/h; the configuration says how large it may be"""
    accel_turn_on_mgal: NotNegative = 0.0
    """the same of the accelerometers, mGal"""
    chip_rotation_deg: NotNegative = 0.0
    """std of the rotation of a chip, both triads alike, about each axis, deg; real chips 0.2, hand-made mounts 2"""
    gyro_skew_deg: NotNegative = 0.0
    """std of the angle by which two gyro axes are not square, deg; real chips 0.03 to 0.14"""
    accel_skew_deg: NotNegative = 0.0
    """the same of accelerometer axes, deg; real chips 0.003 to 0.05"""
    chips: tuple[ChipCalibration, ...] = ()
    """calibrations of real chips that nobody applies, one for each IMU in turn; with them set scales to false"""
    gyro_random_walk_deg_h_sqrt_h: NotNegative = 0.0
    """rate random walk of the gyro biases, deg/h/sqrt(h); MEMS 1 to 50"""
    accel_random_walk_mgal_sqrt_h: NotNegative = 0.0
    """random walk of the accelerometer biases, mGal/sqrt(h); MEMS 10 to 300"""
    g_sensitivity_deg_s_g: NotNegative = 0.0
    """std of what each gyro shows of each component of force, deg/s/g; MEMS 0.01 to 0.1"""
    vibration_m_s2: NotNegative = 0.0
    """rms, along each axis, of the vibration at 10 m/s, m/s^2; it grows with the speed; cars 0.3 to 1"""
    rectification_mg_g2: Number = 0.0
    """what every accelerometer makes of the mean square of force, mg/g^2; MEMS 0.1 to 3"""
    rectification_spread_mg_g2: NotNegative = 0.0
    """its std over axes and chips, mg/g^2"""
    common_noise_share: Share = 0.0
    """share of the variance of white noise that all chips of the board have in common"""
    common_drift_share: Share = 0.0
    """share of the variance of drifts and random walks that they have in common"""
    gyro_lsb_deg_s: NotNegative = 0.0
    """rates are multiples of this, deg/s; 16 bit over 250 deg/s: 0.0076; 0: any"""
    accel_lsb_mg: NotNegative = 0.0
    """forces are multiples of this, mg; 16 bit over 2 g: 0.061; 0: any"""
    jitter_s: NotNegative = 0.0
    """std of the instants at which samples are taken about those at which they should be, s; 1e-5 to 5e-4"""

    def imperfections(self) -> Imperfections:
        """Return the same in SI."""
        return read(self, Imperfections, chips=tuple(entry.chip() for entry in self.chips))

    def start_std(self, grade: NoiseGrade) -> ImuErrors | None:
        """Return how large the slow errors may be at the start; None: as large as those of the grade."""
        gyro, accel = in_si(self, "gyro_turn_on_deg_h"), in_si(self, "accel_turn_on_mgal")
        if gyro == accel == 0.0:
            return None
        return ImuErrors(
            np.hypot(grade.gyro_bias_std, gyro),
            np.hypot(grade.accel_bias_std, accel),
            grade.gyro_scale_std,
            grade.accel_scale_std,
        )

    def vibration(self, speed: Array) -> Array:
        """Return the mean square of the vibration along each axis at speeds, m/s, in (m/s^2)^2."""
        return np.asarray((self.vibration_m_s2 * speed / VIBRATION_SPEED) ** 2)

    def shared(self, seed: int) -> SharedNoise:
        """Return what the chips of the board have in common."""
        return SharedNoise(seed, self.common_noise_share, self.common_drift_share)
