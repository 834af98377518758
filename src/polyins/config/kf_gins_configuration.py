"""The configuration file of KF-GINS, put into the words of a polyins configuration.

Units there: position deg, deg, m; attitude deg; biases deg/h and mGal; scales ppm; random walks deg/sqrt(h) and
m/s/sqrt(h); correlation time h. Keys it does not know are ignored, as that program does.
"""

from __future__ import annotations

from typing import Any

from polyins.config.lab_configuration import Reader, noise, warnings
from polyins.config.yaml_document import Document
from polyins.model.rig import HOUR, MGAL

INITIAL_ERRORS = ("initgyrbias", "initaccbias", "initgyrscale", "initaccscale")
INITIAL_STD = {"initbgstd": "gbstd", "initbastd": "abstd", "initsgstd": "gsstd", "initsastd": "asstd"}
"""and the noise that is taken where one is not given"""
GNSS_SNAP_S = 1e-3
"""Within this time of an IMU record that program applies a fix at the record."""


def recognizes(document: Document) -> bool:
    """Tell by its keys whether a YAML file is a KF-GINS configuration."""
    return "imupath" in document.values


def translated(document: Document) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the values of the polyins configuration that says the same, and warnings.

    The keys of noise and initial std may be one number or three. Raises InputError that names a key that is missing
    or of a wrong kind.
    """
    read = Reader(document, "KF-GINS")
    position = read.three("initpos")
    end = read.number("endtime")
    imu = {
        "name": "imu",
        "file": read.text("imupath"),
        "format": "kf-gins",
        "noise": noise(read),
        "initial_errors": _errors(*(read.three(key) for key in INITIAL_ERRORS)),
        "initial_std": _errors(
            *(
                read.spread(key) if document.values.get(key) is not None else read.spread("imunoise", otherwise)
                for key, otherwise in INITIAL_STD.items()
            )
        ),
    }
    values: dict[str, Any] = {
        "imus": [imu],
        "gnss": {
            "file": read.text("gnsspath"),
            "format": "kf-gins",
            "antenna_position_m": read.three("antlever"),
        },
        "start": {
            "time_s": read.number("starttime"),
            "end_time_s": None if end < 0 else end,
            "position": {"latitude_deg": position[0], "longitude_deg": position[1], "height_m": position[2]},
            "velocity_m_s": read.three("initvel"),
            "roll_pitch_deg": read.three("initatt")[:2],
            "heading_deg": read.three("initatt")[2],
            "heading_from": "value",
            "position_std_m": read.spread("initposstd"),
            "velocity_std_m_s": read.spread("initvelstd"),
            "attitude_std_deg": read.spread("initattstd"),
            "estimate_gyro_bias": False,
        },
        "filter": {"gate_limit": None, "gnss_snap_s": GNSS_SNAP_S},
    }
    return values, warnings(document)


def _errors(
    gyro_bias: list[float], accel_bias: list[float], gyro_scale: list[float], accel_scale: list[float]
) -> dict[str, Any]:
    return {
        "gyro_bias_deg_s": [value / HOUR for value in gyro_bias],
        "accel_bias_m_s2": [value * MGAL for value in accel_bias],
        "gyro_scale_ppm": gyro_scale,
        "accel_scale_ppm": accel_scale,
    }
