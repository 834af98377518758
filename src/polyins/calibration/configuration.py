"""A configuration with what was estimated in it."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

from polyins.calibration.estimates import ASIDE, Calibration, Estimate
from polyins.config import Config
from polyins.config.clock import ClockSettings
from polyins.config.yaml_document import write_yaml
from polyins.model.recording import Offset
from polyins.model.rig import PPM

Values = dict[str, Any]
DIGITS = 7
STREAMS = ("gnss", "height", "heading", "odometer", "reference")
"""sections beside those of IMUs whose clocks may have been found"""
NAMES = {"gnss": "GNSS"}
"""of streams that are not called as their section is"""
WEAKEST = {"mount_deg": 1.5}
"""A component whose std is larger than this does not take the place of what was configured."""


def calibrated(values: Values, config: Config, calibration: Calibration, folder: Path | None = None) -> str:
    """Return `values`, what a configuration says, as YAML with the estimates in the place of what was there.

    `config`: the same, filled in. Components that the recording hardly tells (`WEAKEST`) stay as they are. With
    `folder` relative file names are put into it, so that the text may stand in another one. Clock offsets that were
    found take the place of `time_offset: estimate`.
    """
    new = deepcopy(values)
    found = {offset.name: offset for offset in calibration.clock_offsets}
    for raw, entry in zip(new["imus"], config.imus, strict=True):
        for estimate in calibration.imus.get(entry.name, ()):
            _put(raw, estimate)
        _settle(raw, entry, found.get(entry.name))
    (new.get("imu_defaults") or {}).pop("time_offset", None)
    for section in STREAMS:
        other = getattr(config, section)
        if other is not None:
            _settle(new[section], other, found.get(NAMES.get(section, section)))
    if folder is not None and "dataset" not in new:
        for section in (*new["imus"], *map(new.get, STREAMS)):
            if section and section.get("file"):
                section["file"] = str(folder / Path(section["file"]).expanduser())
    return _heading(calibration) + write_yaml(new)


def _put(raw: Values, estimate: Estimate) -> None:
    """Write an estimate under its key, making sections as needed."""
    if estimate.key.startswith(ASIDE):
        return
    *sections, key = estimate.key.split(".")
    for section in sections:
        raw = raw.setdefault(section, {})
    believed = _plain(_believed(key, estimate))
    raw[key] = [believed[row : row + 3] for row in (0, 3, 6)] if key.endswith("_matrix") else believed


def _believed(key: str, estimate: Estimate) -> tuple[float, ...] | str:
    """Return the estimate, but what was configured where the recording hardly tells."""
    value, std, configured = estimate.value, estimate.std, estimate.configured
    if key not in WEAKEST or std is None or isinstance(value, str) or isinstance(configured, str):
        return value
    return tuple(v if s <= WEAKEST[key] else c for v, s, c in zip(value, std, configured, strict=True))


def _plain(value: tuple[float, ...] | str) -> Any:
    if isinstance(value, str):
        return value.split(", ") if "," in value else value
    rounded = [round(number, DIGITS) for number in value]
    return rounded if len(rounded) > 1 else rounded[0]


def _settle(raw: Values, entry: ClockSettings, found: Offset | None) -> None:
    """Write what was found of a clock; of a drift that is far from sure, too, for the offset holds with it."""
    if found is None:
        return
    known = entry.settled(found.clock)
    raw.pop("time_offset", None)
    del known["time_offset"]
    leaps = [[round(value, DIGITS) for value in leap] for leap in known.pop("clock_leaps_s", ())]
    raw |= {key: round(value, DIGITS) for key, value in known.items()}
    if leaps:
        raw["clock_leaps_s"] = leaps


def _heading(calibration: Calibration) -> str:
    """Say how sure the estimates are, in comments."""
    lines = ["# Calibrated from a recording by polyins; standard deviations:"]
    for name, estimates in calibration.imus.items():
        parts = [f"{one.key} {_numbers(one.std)}" for one in estimates if one.std and not one.key.startswith(ASIDE)]
        lines.append(f"#   {name}: " + "; ".join(parts))
    lines += [
        f"#   clock of {one.name}: {one.std_s:.4f} s, {one.drift_std / PPM:.1f} ppm"
        for one in calibration.clock_offsets
    ]
    return "\n".join(lines) + "\n"


def _numbers(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.2g}" for value in values)
