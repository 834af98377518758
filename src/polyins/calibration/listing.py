"""A calibration as a JSON document and as the rows of a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from polyins.calibration.estimates import ASIDE, Agreement, Calibration, Estimate
from polyins.model.recording import Offset
from polyins.model.rig import DEG, PPM
from polyins.version import __version__

COLUMNS = ["setting", "estimate", "std", "configured"]
DECIMALS = {"m": 5, "deg": 3, "s": 6, "deg_s": 4, "m_s2": 4, "ppm": 0}
"""by the unit at the end of a setting's name"""
MATRIX_DECIMALS = 6


def document(calibration: Calibration) -> dict[str, Any]:
    """Return the document that `polyins calibrate --json` prints."""
    return {
        "polyins": __version__,
        "imus": {
            name: {one.key.removeprefix(ASIDE): _entry(one) for one in estimates}
            for name, estimates in calibration.imus.items()
        },
        "forward_from": calibration.forward_from or None,
        "poses": calibration.poses,
        "agreement": {name: _agreement(one) for name, one in calibration.agreement.items()},
        "clock_offsets": {one.name: clock_document(one) for one in calibration.clock_offsets},
        "warnings": list(calibration.warnings),
    }


def rows(calibration: Calibration) -> list[list[str]]:
    """Return a table's rows, each as long as `COLUMNS`."""
    settings = [row for name, estimates in calibration.imus.items() for one in estimates for row in _rows(name, one)]
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


def agreed(calibration: Calibration) -> str:
    """Say how far the IMUs of an array differ before and after."""
    before, after = (calibration.agreement[name] for name in ("configured", "calibrated"))
    return (
        f"the IMUs differ by {before.gyro / DEG:.3g} deg/s and {before.accel:.3g} m/s^2 (rms, smoothed) as configured, "
        f"by {after.gyro / DEG:.3g} deg/s and {after.accel:.3g} m/s^2 as calibrated"
    )


def _agreement(one: Agreement) -> dict[str, float]:
    return {"gyro_deg_s": one.gyro / DEG, "accel_m_s2": one.accel}


def _rows(name: str, one: Estimate) -> list[list[str]]:
    """Return the row of a setting, or three of a matrix."""
    label = f"{name}  {one.key.removeprefix(ASIDE)}"
    if not one.key.endswith("_matrix"):
        return [[label, *(_cell(part, one.key) for part in _parts(one))]]
    return [
        [f"{label} {axis}", *(_cell(part and part[row : row + 3], one.key) for part in _parts(one))]
        for axis, row in (("x", 0), ("y", 3), ("z", 6))
    ]


def _parts(one: Estimate) -> tuple[tuple[float, ...] | str | None, ...]:
    return one.value, one.std, one.configured


def _entry(one: Estimate) -> dict[str, Any]:
    matrix = one.key.endswith("_matrix")
    parts = zip(("value", "std", "configured"), _parts(one), strict=True)
    return {
        key: [_json(part[row : row + 3]) for row in (0, 3, 6)] if matrix and part else _json(part)
        for key, part in parts
    }


def _json(value: Sequence[float] | str | None) -> Any:
    if value is None or isinstance(value, str):
        return value
    return value[0] if len(value) == 1 else list(value)


def _cell(value: Sequence[float] | str | None, key: str) -> str:
    if value is None or isinstance(value, str):
        return value or "-"
    unit = max((unit for unit in DECIMALS if key.endswith(f"_{unit}")), key=len, default="")
    decimals = DECIMALS.get(unit, MATRIX_DECIMALS)
    return ", ".join(f"{number:.{decimals}f}" for number in value)
