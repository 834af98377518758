"""A calibration as a JSON document and as the rows of a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from polyins.calibration.drive import ASIDE, Calibration, Estimate
from polyins.model.recording import Offset
from polyins.model.rig import PPM
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
        "clock_offsets": {one.name: clock_document(one) for one in calibration.clock_offsets},
        "warnings": list(calibration.warnings),
    }


def rows(calibration: Calibration) -> list[list[str]]:
    """Return a table's rows, each as long as `COLUMNS`."""
    settings = [
        [f"{name}  {one.key.removeprefix(ASIDE)}", *(_cell(part, one.key) for part in _parts(one))]
        for name, estimates in calibration.imus.items()
        for one in estimates
    ]
    return settings + [row for one in calibration.clock_offsets for row in _clock_rows(one)]


def clock_document(one: Offset) -> dict[str, Any]:
    """Return what was found of a clock as JSON has it."""
    return {
        "offset_s": one.offset_s,
        "std_s": one.std_s,
        "correlation": one.correlation,
        "drift_ppm": one.drift / PPM,
        "drift_std_ppm": one.drift_std / PPM,
        "reference_s": one.reference_s,
        "leaps": [{"stamp_s": at, "added_s": size, "std_s": std} for at, size, std in one.leaps],
    }


def _clock_rows(one: Offset) -> list[list[str]]:
    offset = [f"{one.name}  clock offset, s", f"{one.offset_s:.4f}", f"{one.std_s:.4f}", "-"]
    drift = [f"{one.name}  clock drift, ppm", f"{one.drift / PPM:.1f}", f"{one.drift_std / PPM:.1f}", "-"]
    leaps = [[f"{one.name}  leap at {at:.3f} s", f"{size:.4f}", f"{std:.4f}", "-"] for at, size, std in one.leaps]
    return [offset, drift, *leaps]


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
