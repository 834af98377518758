"""What a live run has to say of itself at its end beside its states, as a batch run does."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.comparisons import NO_COMPARISONS, Comparisons
from polyins.model.findings import Finding
from polyins.model.methods import Method
from polyins.model.recording import Recording
from polyins.model.solution import Innovations
from polyins.navigate import batch, outcome
from polyins.navigate.choice import Choice
from polyins.prepare.assembly import Epoch
from polyins.prepare.timesync import Aligned, gap_finding
from polyins.prepare.votes import Windows

Array = NDArray[np.float64]


@dataclass
class Segment:
    """What there is between two pauses."""

    windows: Windows
    """in which the IMUs vote"""
    time: list[float] = field(default_factory=list)
    """s, of epochs at which other IMUs have data than before, and of those before them"""
    missing: list[NDArray[np.bool_]] = field(default_factory=list)
    """which have none there"""
    last: float = math.nan
    """s, of the newest epoch"""

    def take(self, epoch: Epoch) -> None:
        """Note what an epoch lacks."""
        known = self.missing[-1] if self.missing else np.zeros_like(epoch.missing)
        if not np.array_equal(known, epoch.missing):
            if not self.time or self.time[-1] != self.last:
                self._note(self.last, known)
            self._note(epoch.time, epoch.missing.copy())
        self.last = epoch.time
        self.windows.add(epoch.time, epoch.increments, epoch.missing)

    def _note(self, time: float, missing: NDArray[np.bool_]) -> None:
        self.time.append(time)
        self.missing.append(missing)

    def findings(self, row: Method, choice: Choice, recording: Recording, fixes: bool) -> list[Finding]:
        """Return gaps, disagreements, and what became of IMUs that fell silent; `fixes`: whether there is GNSS."""
        found = []
        if self.time:
            time, missing = np.array([*self.time, self.last]), np.array([*self.missing, self.missing[-1]])
            for i, imu in enumerate(recording.rig.imus):
                gaps = [(float(time[max(k - 1, 0)]), float(time[end - 1])) for k, end in batch.stretches(missing[:, i])]
                found += [gap_finding(imu.name, gaps)] if gaps else []
            if recording.rig.has_wheels:
                found += batch.silences(row, choice, recording, Aligned(time, np.empty(0), (), missing), fixes)
        return [*found, *self.windows.disagreements(recording.rig)]


@dataclass
class Record:
    """What is kept of a run."""

    begin: float = math.nan
    """s, of the first IMU data"""
    interval: float = math.nan
    """s, of the first epoch"""
    first: float = math.nan
    """s, of the first state"""
    last: float = math.nan
    epochs: int = 0
    broken: int = 0
    """states that are not finite"""
    ended: list[Array] = field(default_factory=list)
    """rows of the measurements of each part that a pause ended, see `outcome`"""
    findings: list[Finding] = field(default_factory=list)
    """of those parts and of the pauses"""
    part: Segment | None = None

    def take(self, time: float, state: Array, variances: Array) -> None:
        """Count a state."""
        self.first = time if self.epochs == 0 else self.first
        self.last = time
        self.epochs += 1
        self.broken += not math.isfinite(state.sum() + variances.sum())

    def measurements(self, rows: Array | None, wheels: tuple[str, ...]) -> dict[str, Innovations]:
        """Return what became of the measurements; `rows`: of the part that goes on, `wheels`: that give a speed."""
        parts = [outcome.innovations_of(each, wheels) for each in (*self.ended, *(() if rows is None else (rows,)))]
        names = dict.fromkeys(name for part in parts for name in part)
        return {name: Innovations.joined([part[name] for part in parts if name in part]) for name in names}

    def comparisons(self, rows: Array | None, lanes: Sequence[int]) -> Comparisons:
        """Return how the IMUs of blocks kept together; `rows`: of the part that goes on, `lanes`: of the navigators."""
        parts = [*self.ended, *(() if rows is None else (rows,))]
        return Comparisons.joined([NO_COMPARISONS, *(outcome.comparisons_of(each, lanes) for each in parts)])

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return all but the findings, for a file."""
        found: dict[str, NDArray[Any]] = {
            "counts": np.array([self.begin, self.interval, self.first, self.last, self.epochs, self.broken])
        }
        found |= {f"ended{n}": rows for n, rows in enumerate(self.ended)}
        if self.part is not None:
            part = self.part
            found |= {"time": np.array([*part.time, part.last]), "missing": np.array(part.missing)}
            found |= part.windows.arrays()
        return found

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Become the record whose arrays these are."""
        self.begin, self.interval, self.first, self.last, epochs, broken = (float(one) for one in arrays["counts"])
        self.epochs, self.broken = int(epochs), int(broken)
        self.ended = [arrays[f"ended{n}"] for n in range(sum(name.startswith("ended") for name in arrays))]
        if "time" in arrays:
            *time, last = (float(stamp) for stamp in arrays["time"])
            self.part = Segment(Windows.restored(arrays), time, list(arrays["missing"]), last)
