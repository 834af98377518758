"""A calibration as a JSON document and as the rows of a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from polyins.calibration.drive import ASIDE, Calibration, Estimate
from polyins.version import __version__

COLUMNS = ["setting", "estimate", "std", "configured"]
DECIMALS = {"m": 5, "deg": 3}
"""by the unit at the end of a setting's name"""


def document(calibration: Calibration) -> dict[str, Any]:
    """Return the document that `polyins calibrate --json` prints."""
    return {
        "polyins": __version__,
        "imus": {
            name: {one.key.removeprefix(ASIDE): _entry(one) for one in estimates}
            for name, estimates in calibration.imus.items()
        },
        "forward_from": calibration.forward_from,
        "clock_offsets": {
            one.name: {"offset_s": one.offset_s, "std_s": one.std_s, "correlation": one.correlation}
            for one in calibration.clock_offsets
        },
        "warnings": list(calibration.warnings),
    }


def rows(calibration: Calibration) -> list[list[str]]:
    """Return a table's rows, each as long as `COLUMNS`."""
    settings = [
        [f"{name}  {one.key.removeprefix(ASIDE)}", *(_cell(part, one.key) for part in _parts(one))]
        for name, estimates in calibration.imus.items()
        for one in estimates
    ]
    return settings + [
        [f"{one.name}  clock offset, s", f"{one.offset_s:.4f}", f"{one.std_s:.4f}", "-"]
        for one in calibration.clock_offsets
    ]


def _parts(one: Estimate) -> tuple[tuple[float, ...] | str | None, ...]:
    return one.value, one.std, one.configured


def _entry(one: Estimate) -> dict[str, Any]:
    return {key: _json(part) for key, part in zip(("value", "std", "configured"), _parts(one), strict=True)}


def _json(value: Sequence[float] | str | None) -> Any:
    if value is None or isinstance(value, str):
        return value
    return value[0] if len(value) == 1 else list(value)


def _cell(value: Sequence[float] | str | None, key: str) -> str:
    if value is None or isinstance(value, str):
        return value or "-"
    decimals = DECIMALS[key.rpartition("_")[2]]
    return ", ".join(f"{number:.{decimals}f}" for number in value)
