"""Fixes from a running gpsd: TPV reports of its JSON protocol (gpsd_json(5))."""

from __future__ import annotations

import json
from datetime import datetime
from typing import Any

import numpy as np

from polyins.live.lines import geodetic_position
from polyins.live.source import RefusedError
from polyins.model.rig import DEG
from polyins.navigate.samples import Array, GnssFix

PORT = 2947
WATCH = b'?WATCH={"enable":true,"json":true};\n'
LONGEST = 10240
"""bytes of a report, from the protocol"""
SIGMAS = 1.96
"""gpsd's errors are of 95 % confidence, here in one component"""
SIGMAS_2D = 2.45
"""the same of the radius of a circle"""
THREE_DIMENSIONS = 3


def parse(line: bytes) -> GnssFix | None:
    """Return the fix of a TPV report in three dimensions, None for reports of other kinds.

    Stamps are seconds of Unix time, UTC. Raises RefusedError with the kind of what is wrong.
    """
    if len(line) > LONGEST:
        raise RefusedError("oversized")
    try:
        report = json.loads(line)
        if report["class"] != "TPV":
            return None
        if report.get("mode", 0) < THREE_DIMENSIONS or "time" not in report:
            raise RefusedError("no fix in three dimensions")
        return _fix(report)
    except (ValueError, KeyError, TypeError):
        raise RefusedError("malformed") from None


def _fix(report: dict[str, Any]) -> GnssFix:
    # altHAE is absent where the receiver gives heights above the sea only
    height = report.get("altHAE", report.get("altMSL"))
    if height is None:
        raise RefusedError("no height")
    velocity, velocity_std = _velocity(report)
    return GnssFix(
        datetime.fromisoformat(report["time"]).timestamp(),
        geodetic_position(report["lat"], report["lon"], height),
        _position_std(report),
        velocity,
        velocity_std,
        above_sea="altHAE" not in report,
    )


def _std(report: dict[str, Any], *names: str) -> Array | None:
    if any(not report.get(name) for name in names):
        return None
    return np.array([report[name] / SIGMAS for name in names], dtype=float)


def _position_std(report: dict[str, Any]) -> Array | None:
    """Return north, east, down from the errors of each, else of the horizontal circle."""
    std = _std(report, "epy", "epx", "epv")
    if std is not None or not report.get("eph") or not report.get("epv"):
        return std
    horizontal = report["eph"] / SIGMAS_2D
    return np.array([horizontal, horizontal, report["epv"] / SIGMAS], dtype=float)


def _velocity(report: dict[str, Any]) -> tuple[Array | None, Array | None]:
    """Return velocity and std, from north-east-down where the receiver has it, else from course, speed and climb."""
    std = _std(report, "eps", "eps", "epc")
    if "velN" in report:
        return np.array([report["velN"], report["velE"], report["velD"]], dtype=float), std
    if "track" not in report or "speed" not in report or "climb" not in report:
        return None, None
    course, speed = report["track"] * DEG, report["speed"]
    return np.array([speed * np.cos(course), speed * np.sin(course), -report["climb"]]), std
