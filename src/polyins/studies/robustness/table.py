"""Run every case as a user would, from files, and say what it cost, what the verdict was and what was named."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from polyins.errors import InputError
from polyins.evaluation.errors import Errors
from polyins.formats.documents import plain
from polyins.model.findings import DO_NOT_USE, TRUST, Finding
from polyins.model.recording import Recording
from polyins.model.solution import Solution
from polyins.reading.loading import load
from polyins.screen import number, print_table
from polyins.simulation.files import write
from polyins.studies.robustness.case import PARTS, Case, cases, good
from polyins.studies.robustness.stated_errors import stated_errors
from polyins.tools.navigation import run
from polyins.tools.parallel import run_all

SEEDS = (1, 3)
"""odd ones: thresholds were set on even ones"""
GOOD_SEEDS = (1, 3, 5)
QUICK_EVERY = 7
REFUSED = "refused"
COSTS, HARMLESS = 1.5, 1.2
"""times the error without the fault: a fault that costs something, and one that does not"""
COVERED = 5.0
"""standard deviations: an error that they cover stays below all along"""
WRONG = 10.0
"""standard deviations of an error that nothing but silence makes worse"""


@dataclass(frozen=True)
class Row:
    """What one case came to."""

    name: str
    stream: str
    method: str
    error_ratio: float | None
    """horizontal rms over that without the fault"""
    error_over_std: float | None
    """the largest, of horizontal position and heading"""
    verdict: str
    named: bool
    findings: tuple[str, ...]
    """what was said that is more than a note, or the refusal"""
    finite: bool = True

    @property
    def figures(self) -> tuple[float, float] | None:
        """Ratio and error over std, or None of a refusal."""
        if self.error_ratio is None or self.error_over_std is None:
            return None
        return self.error_ratio, self.error_over_std


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Run all cases, or with `quick` every seventh, and return the document."""
    chosen = cases(SEEDS)[:: QUICK_EVERY if quick else 1]
    rows = run_all([partial(_judged, case) for case in chosen], progress=progress)
    false = _false_findings(GOOD_SEEDS[: 1 if quick else None])
    return {
        "target": "robustness",
        "paper": {},
        "polyins": document(rows, false),
        "settings": {"seeds": list(SEEDS), "costs": COSTS, "harmless": HARMLESS, "covered": COVERED, "wrong": WRONG},
    }


def document(rows: list[Row], false: list[str]) -> dict[str, Any]:
    """Return each case and the sums as other programs read them; `false`: said of recordings without a fault."""
    return cast(dict[str, Any], plain({"cases": [asdict(row) for row in rows], "summary": summary(rows, false)}))


def _judged(case: Case, progress: Callable[[float], None]) -> Row:
    row = judged(case)
    progress(1.0)
    return row


def judged(case: Case) -> Row:
    """Run one case."""
    fault = case.fault
    try:
        solution, errors, verdict, findings = _run(case.recording(), case.method)
    except InputError as refusal:
        text = str(refusal)
        named = any(word in text for word in fault.words) or any(kind in text for kind in fault.kinds)
        return Row(case.name, fault.stream, case.method, None, None, REFUSED, named, (text,))
    error, over = _errors(solution, errors)
    known = _errors(*_run(good(case.scenario, case.seed), case.method)[:2])[0]
    said = tuple(f"{one.kind} {one.stream}: {one.text}" for one in findings if one.severity != "note")
    finite = bool(np.isfinite(solution.position).all() and np.isfinite(solution.position_variance).all())
    named = any(_names(one, case) for one in findings)
    return Row(case.name, fault.stream, case.method, error / known, over, verdict, named, said, finite)


def _names(finding: Finding, case: Case) -> bool:
    """Whether a finding is of the right kind, and of an IMU, where one has the fault, names that one."""
    if finding.kind not in case.fault.kinds:
        return False
    return case.blamed in f"{finding.stream} {finding.text}"


def _run(recording: Recording, method: str) -> tuple[Solution, Errors, str, tuple[Finding, ...]]:
    with tempfile.TemporaryDirectory() as folder:
        outcome = run(load(write(recording, Path(folder))), method)
    assert outcome.errors is not None
    verdict = outcome.summary["verdict"]
    return outcome.solution, outcome.errors, verdict["level"], tuple(Finding(**one) for one in verdict["findings"])


def _errors(solution: Solution, errors: Errors) -> tuple[float, float]:
    """Return the horizontal rms error, m, and the largest error over its standard deviation."""
    return float(np.sqrt(np.mean(errors.horizontal**2))), float(np.max(stated_errors(solution, errors).over))


def _false_findings(seeds: tuple[int, ...]) -> list[str]:
    """Return what is said of recordings without a fault that is more than a note."""
    runs = dict.fromkeys((scenario, method) for scenario, _, methods in PARTS for method in methods)
    return [
        f"{scenario}, {method}: {one.text}"
        for scenario, method in runs
        for seed in seeds
        for one in _run(good(scenario, seed), method)[3]
        if one.severity != "note"
    ]


def summary(rows: list[Row], false: list[str]) -> dict[str, Any]:
    """Return how many were wrong in silence, named, and trusted."""
    told = [(row, *row.figures) for row in rows if row.figures is not None]
    silent = [row for row, _, over in told if row.verdict == TRUST and not over <= WRONG]
    costly = [row for row, ratio, _ in told if not ratio <= COSTS]
    harmless = [row for row, ratio, over in told if ratio < HARMLESS and over <= COVERED]
    return {
        "cases": len(rows),
        "refused": len(rows) - len(told),
        "silent_wrong": len(silent),
        "nan": sum(not row.finite and row.verdict != DO_NOT_USE for row in rows),
        "costly": len(costly),
        "named_percent": _percent([row.named for row in costly]),
        "harmless": len(harmless),
        "trusted_if_harmless_percent": _percent([row.verdict == TRUST for row in harmless]),
        "false_findings": len(false),
        "refused_named_percent": _percent([row.named for row in rows if row.verdict == REFUSED]),
    }


def _percent(values: list[bool]) -> float | None:
    return 100.0 * float(np.mean(values)) if values else None


def print_tables(figures: Mapping[str, Any]) -> None:
    """Print a row for each case, then the sums."""
    rows = [
        [
            one["name"],
            one["method"],
            number(one["error_ratio"], 3),
            number(one["error_over_std"], 3),
            one["verdict"],
            "yes" if one["named"] else "no",
        ]
        for one in figures["cases"]
    ]
    print_table("robustness", ["fault", "method", "error ratio", "error over std", "verdict", "named"], rows)
    print_table("of all", ["figure", "value"], [[key, number(value)] for key, value in figures["summary"].items()])
