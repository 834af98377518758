"""Whether `check` names every fault, puts it right, and says nothing of recordings without one."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from polyins.config.yaml_document import read_yaml
from polyins.errors import InputError
from polyins.formats.documents import plain
from polyins.model.findings import Finding
from polyins.navigate.choice import usual_method
from polyins.reading.loading import load
from polyins.screen import print_table
from polyins.studies.data_faults.bundle import Bundle
from polyins.studies.data_faults.faults import FAULTS, Fault, Injected
from polyins.studies.data_faults.good import GOOD, good
from polyins.tools import navigation
from polyins.tools.check import Checked, check, write_fixed
from polyins.tools.parallel import run_all

SEEDS = (1, 3, 5)
"""odd ones: thresholds were set on even ones"""
DRAWS = 6311
QUICK_GOOD = ("Horizontal/path_2", "kfgins-parity", "two-grades", "wheelins-parity")


@dataclass(frozen=True)
class Row:
    """What one case came to."""

    fault: str
    recording: str
    size: str
    named: bool
    repairable: bool
    fixed: bool
    said: tuple[str, ...]
    """kinds and streams of what was found that is more than a note"""
    set: tuple[str, ...] = ()
    """by `--fix`"""


@dataclass(frozen=True)
class Case:
    """A fault, and what chance decides of it."""

    fault: Fault
    recording: str
    seed: int
    number: int

    def injected(self) -> Injected:
        """Put it into its recording."""
        return self.fault.inject(good(self.recording), np.random.default_rng([DRAWS, self.seed, self.number, 1]))


def cases(seeds: Sequence[int]) -> list[Case]:
    """Draw a recording for every fault and seed."""
    found = []
    for seed in seeds:
        for number, fault in enumerate(FAULTS):
            rng = np.random.default_rng([DRAWS, seed, number])
            found.append(Case(fault, str(rng.choice(fault.recordings)), seed, number))
    return found


def reproduce(quick: bool = False, progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Check every case and all good recordings, or with `quick` those of one seed and a few; return the document."""
    chosen = cases(SEEDS[: 1 if quick else None])
    names = QUICK_GOOD if quick else tuple(GOOD)
    rows = run_all([partial(_row, case) for case in chosen], progress=progress)
    alarms = {name: said for name in names if (said := false_alarms(good(name)))}
    return {
        "target": "checks",
        "paper": {},
        "polyins": plain({"cases": [asdict(row) for row in rows], "summary": summary(rows, alarms, len(names))}),
        "settings": {"seeds": sorted({case.seed for case in chosen})},
    }


def summary(rows: Sequence[Row], alarms: Mapping[str, Sequence[str]], count: int) -> dict[str, Any]:
    """Return the shares and what was said of `count` good recordings."""
    repairable = [row for row in rows if row.repairable]
    return {
        "faults": len(rows),
        "named_percent": 100.0 * float(np.mean([row.named for row in rows])),
        "repairable": len(repairable),
        "fixed_percent": 100.0 * float(np.mean([row.fixed for row in repairable])),
        "good": count,
        "false_alarms": {name: list(said) for name, said in alarms.items()},
    }


def false_alarms(bundle: Bundle) -> tuple[str, ...]:
    """Return what is said of a good recording that is more than a note."""
    with tempfile.TemporaryDirectory() as folder:
        return _said(check([bundle.write(Path(folder))]).findings)


def _row(case: Case, progress: Callable[[float], None]) -> Row:
    row = judged(case)
    progress(1.0)
    return row


def judged(case: Case) -> Row:
    """Check one case, write the configuration that is right, and check and run that."""
    fault, injected = case.fault, case.injected()
    with tempfile.TemporaryDirectory() as folder:
        checked = check([injected.bundle.write(Path(folder))])
        named = any(_names(one, fault, injected) for one in checked.findings)
        fixed = injected.right is not None and _is_fixed(checked, injected, fault, Path(folder))
    settings = tuple(one.sentence for one in checked.settings)
    repairable = injected.right is not None
    return Row(fault.name, case.recording, injected.size, named, repairable, fixed, _said(checked.findings), settings)


def _names(finding: Finding, fault: Fault, injected: Injected) -> bool:
    return finding.kind in fault.kinds and injected.whose in f"{finding.stream} {finding.text}"


def _is_fixed(checked: Checked, injected: Injected, fault: Fault, folder: Path) -> bool:
    """Whether the setting is the true one, and what it makes is run without that finding."""
    assert injected.right is not None
    out = folder / "fixed.yaml"
    try:
        write_fixed(checked, out)
        if not injected.right(read_yaml(out).values):
            return False
        again = check([out])
        left = [one for one in again.findings if _names(one, fault, injected) and one.severity != "note"]
        if left or again.refused:
            return False
        recording = load(out)
        navigation.run(recording, usual_method(recording.rig))
    except InputError:
        return False
    return True


def _said(findings: Sequence[Finding]) -> tuple[str, ...]:
    return tuple(f"{one.kind} {one.stream} {one.axis or ''}".strip() for one in findings if one.severity != "note")


def print_tables(figures: Mapping[str, Any]) -> None:
    """Print a row for each kind of fault."""
    by_fault: dict[str, list[Mapping[str, Any]]] = {}
    for row in figures["cases"]:
        by_fault.setdefault(row["fault"], []).append(row)
    rows = []
    for name, some in by_fault.items():
        repairable = [row for row in some if row["repairable"]]
        fixed = f"{sum(row['fixed'] for row in repairable)} of {len(repairable)}" if repairable else "-"
        rows.append([name, f"{sum(row['named'] for row in some)} of {len(some)}", fixed])
    print_table("injected faults", ["fault", "named", "put right"], rows)
    known = figures["summary"]
    alarms = "; ".join(f"{name}: {', '.join(said)}" for name, said in known["false_alarms"].items()) or "none"
    print_table(
        "all",
        ["named, %", "put right, %", f"false alarms of {known['good']}"],
        [[f"{known['named_percent']:.1f}", f"{known['fixed_percent']:.1f}", alarms]],
    )
