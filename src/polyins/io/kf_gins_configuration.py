"""The configuration file of KF-GINS, put into the words of a polyins configuration.

Units there: position deg, deg, m; attitude deg; biases deg/h and mGal; scales ppm; random walks deg/sqrt(h) and
m/s/sqrt(h); correlation time h. Keys it does not know are ignored, as that program does.
"""

from __future__ import annotations

from typing import Any

from polyins.errors import InputError
from polyins.io.yaml_document import Document, Key
from polyins.rig import HOUR, MGAL

NOISE = {
    "arw": "angle_random_walk_deg_sqrt_h",
    "vrw": "velocity_random_walk_m_s_sqrt_h",
    "gbstd": "gyro_bias_deg_h",
    "abstd": "accel_bias_mgal",
    "gsstd": "gyro_scale_ppm",
    "asstd": "accel_scale_ppm",
}
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
    read = _Reader(document)
    position = read.three("initpos")
    end = read.number("endtime")
    imu = {
        "name": "imu",
        "file": read.text("imupath"),
        "format": "kf-gins",
        "noise": {
            **{ours: read.spread("imunoise", theirs) for theirs, ours in NOISE.items()},
            "correlation_time_h": read.number("imunoise", "corrtime"),
        },
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
    return values, _warnings(document)


class _Reader:
    """Reads values by key and says which key is wrong."""

    def __init__(self, document: Document) -> None:
        self._document = document

    def text(self, *keys: Key) -> str:
        value = self._value(keys)
        if not isinstance(value, str):
            raise InputError(f"{self._document.place(keys)}: is {value!r}; expected a file name")
        return value

    def number(self, *keys: Key) -> float:
        return self._as_number(self._value(keys), keys)

    def three(self, *keys: Key) -> list[float]:
        value = self._value(keys)
        values = value if isinstance(value, list) else 3 * [value]
        if len(values) < 3:
            raise InputError(f"{self._document.place(keys)}: is {value!r}; expected three numbers, like [0, 0, 0]")
        return [self._as_number(item, keys) for item in values[:3]]

    def spread(self, *keys: Key) -> list[float]:
        values = self.three(*keys)
        if min(values) < 0.0:
            raise InputError(f"{self._document.place(keys)}: is {values}; expected no negative number")
        return values

    def _value(self, keys: tuple[Key, ...]) -> Any:
        value: Any = self._document.values
        for key in keys:
            value = value.get(key) if isinstance(value, dict) else None
            if value is None:
                raise InputError(f"{self._document.place(keys)}: is missing; expected it in a KF-GINS configuration")
        return value

    def _as_number(self, value: Any, keys: tuple[Key, ...]) -> float:
        # That program converts the text of a value, so a number in quotes is one.
        try:
            if isinstance(value, bool):
                raise ValueError
            return float(value)
        except (TypeError, ValueError) as error:
            raise InputError(f"{self._document.place(keys)}: is {value!r}; expected a number") from error


def _errors(
    gyro_bias: list[float], accel_bias: list[float], gyro_scale: list[float], accel_scale: list[float]
) -> dict[str, Any]:
    return {
        "gyro_bias_deg_s": [value / HOUR for value in gyro_bias],
        "accel_bias_m_s2": [value * MGAL for value in accel_bias],
        "gyro_scale_ppm": gyro_scale,
        "accel_scale_ppm": accel_scale,
    }


def _warnings(document: Document) -> tuple[str, ...]:
    texts = []
    if document.duplicate:
        texts.append(f"{document.duplicate}; the first one counts")
    if "outputpath" in document.values:
        texts.append(f"{document.place(['outputpath'])}: is ignored; --out says where results go")
    return tuple(texts)
