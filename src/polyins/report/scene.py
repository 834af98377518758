"""What the figures draw: the recording and each run with its errors and its colour."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.documents import CompareDocument, RunDocument
from polyins.evaluation.errors import Errors, compare_to_reference
from polyins.evaluation.outages import Interval
from polyins.evaluation.summary import on_wheels
from polyins.model.attitude import rotation_matrices
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import Recording, usual_interval
from polyins.model.solution import Solution
from polyins.prepare import timesync
from polyins.report.palette import OUTAGE, SILENCE, method_styles

Array = NDArray[np.float64]

LEAST_SILENCE = 0.1
"""s: a shorter gap in an IMU's data is too narrow to see"""


@dataclass(frozen=True)
class Shade:
    """A stretch of time to mark, s since the start."""

    begin: float
    end: float
    colour: str
    name: str
    """of the IMU that is silent; empty: a GNSS outage"""


@dataclass(frozen=True)
class Run:
    """One method's solution, its figures and how it is drawn."""

    name: str
    solution: Solution
    summary: RunDocument
    errors: Errors | None
    colour: str
    dash: str

    @property
    def label(self) -> str:
        """The name as Plotly takes it, which reads some HTML."""
        return escape(self.name)

    @property
    def on_wheels(self) -> bool:
        """Whether wheels aided it."""
        return on_wheels(self.summary)

    def at_epochs(self, part: Callable[[Errors], Array | None]) -> Array:
        """Spread a part of the errors over the solution's epochs, shape (T, 3), with NaN where it is unknown."""
        spread = np.full((self.solution.time.size, 3), np.nan)
        if self.errors is not None and (known := part(self.errors)) is not None:
            spread[self.errors.covered] = known
        return spread


@dataclass(frozen=True)
class Scene:
    """Everything that one page shows."""

    recording: Recording
    runs: tuple[Run, ...]
    gaps: Mapping[str, Sequence[Interval]]
    """where an IMU has no data, by its name, s, s"""

    @classmethod
    def of(
        cls,
        runs: Mapping[str, tuple[Solution, RunDocument]],
        recording: Recording,
        comparison: CompareDocument | None = None,
        errors: Mapping[str, Errors | None] | None = None,
        gaps: Mapping[str, Sequence[Interval]] | None = None,
    ) -> Scene:
        """Lay out runs, by name solution and figures; a comparison's figures stand in for those of one IMU.

        `errors`, of runs by name, and `gaps`, of IMUs by name, are found from the recording unless given. Raises
        InputError if its reference cannot be compared with.
        """
        figures = comparison["methods"] if comparison else {}
        if errors is None:
            errors = {name: _errors(solution, recording) for name, (solution, _) in runs.items()}
        styles = method_styles(list(runs))
        made = tuple(
            Run(name, solution, figures.get(name, summary), errors[name], *style)
            for (name, (solution, summary)), style in zip(runs.items(), styles, strict=True)
        )
        if gaps is None:
            gaps = dict(zip((imu.name for imu in recording.rig.imus), gaps_of(recording), strict=True))
        return cls(recording, made, gaps)

    @property
    def start(self) -> float:
        """The first epoch of any run, s: the figures' time zero."""
        return float(min(run.solution.time[0] for run in self.runs))

    @property
    def duration(self) -> float:
        """From the start to the last epoch of any run, s."""
        return float(max(run.solution.time[-1] for run in self.runs)) - self.start

    def since_start(self, time: Array) -> NDArray[np.float32]:
        """Return the time since the start, s."""
        return np.asarray(time - self.start, dtype=np.float32)

    @property
    def outages(self) -> list[tuple[float, float]]:
        """The outages, s since the start."""
        return [(begin - self.start, end - self.start) for begin, end in self.recording.outages]

    @property
    def shades(self) -> list[Shade]:
        """What figures over time mark: the outages, and gaps in the data of IMUs that navigate."""
        navigators = {name for run in self.runs for name in run.solution.imu_names}
        found = [Shade(begin, end, OUTAGE, "") for begin, end in self.outages]
        for name in navigators & self.gaps.keys():
            for first, last in self.gaps[name]:
                begin, end = first - self.start, last - self.start
                if last - first > LEAST_SILENCE and end > 0.0 and begin < self.duration:
                    found.append(Shade(begin, end, SILENCE, escape(name)))
        return found

    def at_reference_point(self, run: Run) -> Array:
        """Return a run's positions at the point that the reference follows, shape (T, 3)."""
        solution, reference = run.solution, self.recording.reference
        if reference is None:
            return solution.position
        moved = rotation_matrices(solution.attitude) @ (reference.lever_arm - solution.point)
        return solution.position + moved / metres_per_unit(solution.position, solution.geodetic)

    @property
    def origin(self) -> Array:
        """The position from which tracks are measured: the first solution's start."""
        start: Array = self.runs[0].solution.position[0]
        return start


def _errors(solution: Solution, recording: Recording) -> Errors | None:
    return None if recording.reference is None else compare_to_reference(solution, recording.reference)


def gaps_of(recording: Recording) -> list[list[Interval]]:
    """Return where each IMU of a recording has no data, s, s."""
    return [timesync.gaps_of(stream.time, usual_interval(stream.time)) for stream in recording.imus]
