"""Noise figures of common IMUs by name, each with where it was found; none is from memory.

What a source does not give is left to a grade. A figure that a source prints in another unit is converted here, once.
Chips' datasheets give noise densities and no drift; figures of other laboratories are what their filters were told.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from polyins.model.rig import HOUR, STANDARD_GRAVITY

ROOT_HOUR = HOUR**0.5
PER_UNIT: dict[str, float] = {
    "deg/sqrt(h)": 1.0,
    "deg/s/sqrt(Hz)": ROOT_HOUR,
    "mdeg/s/sqrt(Hz)": 1e-3 * ROOT_HOUR,
    "m/s/sqrt(h)": 1.0,
    "mg/sqrt(Hz)": 1e-3 * STANDARD_GRAVITY * ROOT_HOUR,
    "ug/sqrt(Hz)": 1e-6 * STANDARD_GRAVITY * ROOT_HOUR,
    "deg/h": 1.0,
    "mGal": 1.0,
    "h": 1.0,
}
"""how much of the key's unit a unit is"""


@dataclass(frozen=True)
class Stated:
    """A figure as its source prints it."""

    number: float
    unit: str
    source: str
    """address"""

    @property
    def value(self) -> float:
        """The number in the unit of its key, to six digits."""
        return float(f"{self.number * PER_UNIT[self.unit]:.6g}")


@dataclass(frozen=True)
class KnownImu:
    """What is known of an IMU."""

    title: str
    grade: str
    """fills in what no source gives"""
    figures: Mapping[str, Stated]
    """by the keys of `noise`"""


IMU_ARRAY = "https://github.com/i2Nav-WHU/IMU-Array, NavigationTest/ErrorParameter.txt"
GINS = "https://github.com/i2Nav-WHU/awesome-gins-datasets, README.md"


def _densities(gyro: tuple[float, str], accel: tuple[float, str], source: str) -> dict[str, Stated]:
    return {
        "angle_random_walk_deg_sqrt_h": Stated(*gyro, source),
        "velocity_random_walk_m_s_sqrt_h": Stated(*accel, source),
    }


def _tuned(figures: tuple[float, float, float, float], source: str, hours: str = GINS) -> dict[str, Stated]:
    """Return random walks and stds of biases, in the units of the keys, and a correlation time of an hour."""
    units = ("deg/sqrt(h)", "m/s/sqrt(h)", "deg/h", "mGal")
    keys = ("angle_random_walk_deg_sqrt_h", "velocity_random_walk_m_s_sqrt_h", "gyro_bias_deg_h", "accel_bias_mgal")
    stated = {key: Stated(number, unit, source) for key, number, unit in zip(keys, figures, units, strict=True)}
    return {**stated, "correlation_time_h": Stated(1.0, "h", hours)}


KNOWN_IMUS: dict[str, KnownImu] = {
    "icm-20602": KnownImu(
        "TDK InvenSense ICM-20602, as the laboratory of paper A has it",
        "consumer-mems",
        _tuned((0.24, 0.24, 50.0, 250.0), IMU_ARRAY),
    ),
    "icm-20600": KnownImu(
        "TDK InvenSense ICM-20600",
        "consumer-mems",
        _densities(
            (4.0, "mdeg/s/sqrt(Hz)"),
            (100.0, "ug/sqrt(Hz)"),
            "https://novapart.co/products/ICM-20600/mems-module-motiontracking-series-3-axis-gyroscope",
        ),
    ),
    "icm-42605": KnownImu(
        "TDK InvenSense ICM-42605",
        "consumer-mems",
        _densities(
            (3.8, "mdeg/s/sqrt(Hz)"),
            (70.0, "ug/sqrt(Hz)"),
            "https://vdocument.in/icm-42605-datasheet-2020-9-16-icm-42605-datasheet-premium-performance-6-axis.html",
        ),
    ),
    "icm-42688-p": KnownImu(
        "TDK InvenSense ICM-42688-P",
        "consumer-mems",
        _densities((2.8, "mdeg/s/sqrt(Hz)"), (70.0, "ug/sqrt(Hz)"), "https://pdf.elecfans.com/TDK/EV_ICM-42688-P.html"),
    ),
    "mpu-6050": KnownImu(
        "TDK InvenSense MPU-6000 and MPU-6050",
        "consumer-mems",
        {
            "angle_random_walk_deg_sqrt_h": Stated(
                0.005,
                "deg/s/sqrt(Hz)",
                "https://text-id.123dok.com/document/myjooo0pz-additional-features-datasheet-revision-history.html",
            ),
            "velocity_random_walk_m_s_sqrt_h": Stated(
                400.0,
                "ug/sqrt(Hz)",
                "https://text-id.123dok.com/document/nzw000x7y-motionprocessing-clocking-datasheet-revision-history.html",
            ),
        },
    ),
    "bmi270": KnownImu(
        "Bosch Sensortec BMI270",
        "consumer-mems",
        _densities((0.007, "deg/s/sqrt(Hz)"), (0.16, "mg/sqrt(Hz)"), "https://wiki.adom.inc/kyle/bmi270"),
    ),
    "lsm6dsv": KnownImu(
        "STMicroelectronics LSM6DSV",
        "consumer-mems",
        _densities(
            (2.8, "mdeg/s/sqrt(Hz)"),
            (60.0, "ug/sqrt(Hz)"),
            "https://docs.luxonis.com/hardware/platform/sensors/imu/lsm6dsv.md",
        ),
    ),
    "mti-1": KnownImu(
        "Xsens MTi-1",
        "industrial-mems",
        _densities(
            (0.007, "deg/s/sqrt(Hz)"),
            (120.0, "ug/sqrt(Hz)"),
            "https://reference-global.com/article/10.2478/tar-2023-0022?tab=figures-and-tables",
        ),
    ),
    "adis16460": KnownImu("Analog Devices ADIS16460", "industrial-mems", _tuned((0.2, 0.1, 20.0, 100.0), GINS)),
    "adis16465": KnownImu("Analog Devices ADIS16465", "industrial-mems", _tuned((0.1, 0.1, 25.0, 200.0), GINS)),
    "hguide-i300": KnownImu("Honeywell HGuide i300", "industrial-mems", _tuned((0.2, 0.2, 15.0, 150.0), GINS)),
}
