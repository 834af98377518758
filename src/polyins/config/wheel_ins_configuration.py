"""The configuration file of Wheel-INS, put into the words of a polyins configuration.

That program starts at the first record from `starttime` on with zero position, velocity and attitude of the wheel IMU,
so that the vehicle heads to -90 deg; it navigates on a plane with a fixed gravity and without the earth's rate. Its
wheel IMU has x along the axle to the right. Units are those of KF-GINS; ODO_std is in m/s.
"""

from __future__ import annotations

from typing import Any

from polyins.config.lab_configuration import Reader, noise, warnings
from polyins.config.yaml_document import Document

GRAVITY_M_S2 = 9.782940329221166
SPEED_WINDOW_S = 0.1
IMU_COLUMNS = 7


def recognizes(document: Document) -> bool:
    """Tell by its keys whether a YAML file is a Wheel-INS configuration."""
    return "imupath" in document.values and ("Wheel_Radius" in document.values or "ODO_dt" in document.values)


def translated(document: Document) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the values of the polyins configuration that says the same, and warnings.

    Raises InputError that names a key that is missing or of a wrong kind.
    """
    read = Reader(document, "Wheel-INS")
    _check_columns(read, document)
    end = read.number("endtime")
    imu = {
        "name": "wheel",
        "file": read.text("imupath"),
        "format": "wheel-ins",
        "noise": noise(read),
        "wheel": {
            "radius_m": read.number("Wheel_Radius"),
            "spin_axis": "x",
            "lever_arm_m": read.three("WheelLA"),
        },
    }
    values: dict[str, Any] = {
        "imus": [imu],
        "start": {
            "time_s": read.number("starttime"),
            "end_time_s": None if end < 0 else end,
            "position": {"north_m": 0.0, "east_m": 0.0},
            "velocity_m_s": [0.0, 0.0, 0.0],
            "roll_pitch_deg": [0.0, 0.0],
            "heading_deg": -90.0,
            "heading_from": "value",
            "position_std_m": read.spread("initposstd"),
            "velocity_std_m_s": read.spread("initvelstd"),
            "attitude_std_deg": read.spread("initattstd"),
            "estimate_gyro_bias": False,
        },
        "filter": {
            "gate_limit": None,
            "gravity_m_s2": GRAVITY_M_S2,
            "rolling": {
                "speed_interval_s": read.number("ODO_dt"),
                "speed_window_s": SPEED_WINDOW_S,
                "predict": "end",
                "wheel_speed_std_m_s": read.spread("ODO_std"),
                "standstill": False,
            },
        },
    }
    return values, (*warnings(document), *_not_used(read, document))


def _check_columns(read: Reader, document: Document) -> None:
    if "imudatalen" in document.values and read.number("imudatalen") != IMU_COLUMNS:
        raise document.error(
            ["imudatalen"], f"is {document.values['imudatalen']}; expected {IMU_COLUMNS} (s, 3 rates, 3 forces)"
        )


def _not_used(read: Reader, document: Document) -> list[str]:
    """Say what that program reads and does not use, where it would matter."""
    texts = []
    if "MisalignAngle" in document.values and any(read.three("MisalignAngle")):
        texts.append(f"{document.place(['MisalignAngle'])}: is not used, as in that program; wheel.tilt_deg would be")
    if document.values.get("ifCompVel"):
        texts.append(f"{document.place(['ifCompVel'])}: is not used, as in that program")
    return texts
