"""What the configurations of KF-GINS and Wheel-INS, programs of one laboratory, have in common.

Units there: deg/sqrt(h), m/s/sqrt(h), deg/h, mGal, ppm, h.
"""

from __future__ import annotations

from typing import Any

from polyins.config.yaml_document import Document, Key

NOISE = {
    "arw": "angle_random_walk_deg_sqrt_h",
    "vrw": "velocity_random_walk_m_s_sqrt_h",
    "gbstd": "gyro_bias_deg_h",
    "abstd": "accel_bias_mgal",
    "gsstd": "gyro_scale_ppm",
    "asstd": "accel_scale_ppm",
}


class Reader:
    """Reads values by key and says which key is wrong."""

    def __init__(self, document: Document, program: str) -> None:
        self._document = document
        self._program = program

    def text(self, *keys: Key) -> str:
        """Return a file name."""
        value = self._value(keys)
        if not isinstance(value, str):
            raise self._document.error(keys, f"is {value!r}; expected a file name")
        return value

    def number(self, *keys: Key) -> float:
        """Return a number."""
        return self._as_number(self._value(keys), keys)

    def three(self, *keys: Key) -> list[float]:
        """Return three numbers; one stands for all."""
        value = self._value(keys)
        values = value if isinstance(value, list) else 3 * [value]
        if len(values) < 3:
            raise self._document.error(keys, f"is {value!r}; expected three numbers, like [0, 0, 0]")
        return [self._as_number(item, keys) for item in values[:3]]

    def spread(self, *keys: Key) -> list[float]:
        """Return three numbers that are not negative."""
        values = self.three(*keys)
        if min(values) < 0.0:
            raise self._document.error(keys, f"is {values}; expected no negative number")
        return values

    def _value(self, keys: tuple[Key, ...]) -> Any:
        value: Any = self._document.values
        for key in keys:
            value = value.get(key) if isinstance(value, dict) else None
            if value is None:
                raise self._document.error(keys, f"is missing; expected it in a {self._program} configuration")
        return value

    def _as_number(self, value: Any, keys: tuple[Key, ...]) -> float:
        # That program converts the text of a value, so a number in quotes is one.
        try:
            if isinstance(value, bool):
                raise ValueError
            return float(value)
        except (TypeError, ValueError) as error:
            raise self._document.error(keys, f"is {value!r}; expected a number") from error


def noise(read: Reader) -> dict[str, Any]:
    """Return the noise section of polyins; each value may be one number or three."""
    return {
        **{ours: read.spread("imunoise", theirs) for theirs, ours in NOISE.items()},
        "correlation_time_h": read.number("imunoise", "corrtime"),
    }


def warnings(document: Document) -> tuple[str, ...]:
    """Say which key is given twice and that the output path is ignored."""
    texts = []
    if document.duplicate:
        texts.append(f"{document.duplicate}; the first one counts")
    if "outputpath" in document.values:
        texts.append(f"{document.place(['outputpath'])}: is ignored; --out says where results go")
    return tuple(texts)
