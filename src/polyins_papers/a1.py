"""Paper A, Table I: floating-point operations of each step, and what they add up to in a second.

The paper's side is its table, with the rows of the two fusions exchanged: only so does its total of
20,761,810 + 209,442 N come out. polyins's side is counted: see `operations`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from polyins_papers import operations

RATE_HZ = 200
COUNTS = (6, 16, 100)

PAPER = {
    "mechanization": (179, 134),
    "transition": (535, 732),
    "noise": (32004, 33706),
    "covariance": (18081, 18522),
    "prediction": (50620, 52960),
    "design": (9, 6),
    "gain": (2862, 3054),
    "covariance_update": (19656, 20223),
    "residual": (65, 46),
    "correction": (42, 63),
    "feedback": (38, 48),
    "measurement_fusion": (18, 33),
    "solution_fusion": (144, 196),
}
"""Additions and multiplications; residual, correction, feedback and fusions are for each IMU."""

EACH = ("residual", "correction", "feedback")
UPDATE = ("design", "gain", "covariance_update", *EACH)

Steps = dict[str, dict[str, int]]


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Count the operations and return the document; `quick` changes nothing, it takes seconds."""
    paper: Steps = {
        name: {"additions": additions, "multiplications": products, "sum": additions + products}
        for name, (additions, products) in PAPER.items()
    }
    counted = operations.measure(imus=2)["steps"]
    if progress:
        progress(1.0)
    return {
        "target": "a1",
        "paper": {"steps": paper, **totals(paper)},
        "polyins": {
            "steps": counted["dense"],
            **totals(counted["dense"]),
            "structured": {"steps": counted["structured"], **totals(counted["structured"])},
        },
        "settings": {
            "counted": "the kernels' Python form on counting numbers",
            "per_second": f"Table II: IMUs at {RATE_HZ} Hz, one fix",
            "form": "steps and totals with the dense covariance, 21 x 21, and under structured with the product's",
        },
    }


def totals(steps: Steps) -> dict[str, Any]:
    """Return what a second costs: one IMU, and eNav-Fusion of N as fixed + per_imu N, with the ratios."""
    cost = {name: tally["sum"] for name, tally in steps.items()}
    each = sum(cost[name] for name in EACH)
    update = sum(cost[name] for name in UPDATE)
    single = RATE_HZ * (cost["mechanization"] + cost["prediction"]) + update
    fixed = RATE_HZ * cost["prediction"] + update - each
    per_imu = RATE_HZ * (cost["mechanization"] + cost["measurement_fusion"]) + each
    per_imu += (2 * RATE_HZ + 1) * cost["solution_fusion"]
    nav = single + RATE_HZ * cost["solution_fusion"]
    return {
        "single_per_s": single,
        "enav_fixed_per_s": fixed,
        "enav_per_imu_per_s": per_imu,
        "enav_ratio": {str(n): (fixed + per_imu * n) / single for n in COUNTS},
        "nav_ratio": {str(n): nav * n / single for n in COUNTS},
    }
