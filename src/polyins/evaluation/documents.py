"""The types of the documents that `run` and `compare` print: dictionaries that JSON takes, None for what is unknown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NotRequired, TypedDict

from polyins.model.findings import Level, Severity
from polyins.model.recording import Heights


class ErrorFigures(TypedDict):
    """Errors against the reference."""

    horizontal_rms_m: float | None
    horizontal_max_m: float | None
    vertical_rms_m: float | None
    roll_rmse_deg: float | None
    pitch_rmse_deg: float | None
    heading_rmse_deg: float | None


class OutageFigures(TypedDict):
    """The greatest horizontal error of each outage."""

    count: int
    length_s: NotRequired[float | None]
    horizontal_max_rms_m: float | None
    each_m: NotRequired[list[float | None]]


class DriftFigures(TypedDict):
    """Drift over the distance travelled."""

    step_m: NotRequired[float | None]
    distance_m: float | None
    rate_percent: float | None
    end_percent: float | None


class ConsistencyFigures(TypedDict):
    """3 each where the filter is consistent."""

    nees_position: float | None
    nis_gnss: float | None


class GnssCounts(TypedDict):
    """What became of the fixes."""

    fixes: int
    rejected: int
    resets: int
    velocities_rejected: int
    rejected_times_s: NotRequired[list[float]]


class MeasurementCounts(TypedDict):
    """What became of the measurements of one kind."""

    count: int
    rejected: int
    resets: int
    mean_nis: float | None


class OffsetFigures(TypedDict):
    """The last estimate of a sensor's offset or scale."""

    estimate: float
    std: float


class MountingEstimate(TypedDict):
    """The last estimate of how one IMU is mounted, see `Solution.mounting`."""

    estimate: list[float]
    std: list[float]


class CoverageFigures(TypedDict):
    """From when to when there is a solution."""

    from_s: float
    to_s: float
    of_recording: float | None
    """share; None: the recording's length is not known"""


class FindingDocument(TypedDict):
    """A finding, see `model.findings.Finding`."""

    severity: Severity
    kind: str
    text: str
    stream: str
    axis: str | None
    from_s: float | None
    to_s: float | None
    size: float | str | None
    expected: float | str | None
    remedy: str


def sentence(finding: Mapping[str, Any]) -> str:
    """Return what a finding is and what to do."""
    return f"{finding['text']}; {finding['remedy']}" if finding["remedy"] else str(finding["text"])


class VerdictDocument(TypedDict):
    """Whether the run can be built on."""

    level: Level
    findings: list[FindingDocument]


class MethodDocument(TypedDict):
    """What the documents of one run and of several recordings together have in common."""

    method: str
    duration_s: float
    epochs: int
    us_per_epoch: float | None
    reference: ErrorFigures
    outages: OutageFigures
    drift: DriftFigures
    consistency: ConsistencyFigures
    gnss: GnssCounts


class RunDocument(MethodDocument):
    """One run."""

    polyins: str
    imus: int
    rate_hz: float | None
    filter_s: float | None
    first_call_s: float
    measurements: dict[str, MeasurementCounts]
    offsets: dict[str, OffsetFigures]
    start: dict[str, object]
    verdict: VerdictDocument
    coverage: CoverageFigures
    heights: Heights | None
    """what they count from; None: positions are on a local plane"""
    utc_of_zero_s: float | None
    """Unix time at which the clock shows zero"""
    exclusions: list[dict[str, object]]
    faults: list[str]
    mounting: dict[str, MountingEstimate]
    warnings: list[str]
    imu: NotRequired[str]
    """of a single IMU its name"""
    each: NotRequired[list[RunDocument]]
    """of single IMUs, which the figures are those of all of"""


class CompareDocument(TypedDict):
    """Several methods over one recording."""

    polyins: str
    methods: dict[str, RunDocument]
    ratio_to_single: dict[str, float | None]
    time_ratio_to_single: dict[str, float | None]
    sqrt_n: float


class PooledDocument(TypedDict):
    """Several methods over several recordings."""

    methods: dict[str, MethodDocument]
    ratio_to_single: dict[str, float | None]
    time_ratio_to_single: dict[str, float | None]


class SeveralDocument(TypedDict):
    """Several methods over several recordings, each and all together."""

    polyins: str
    recordings: dict[str, CompareDocument]
    pooled: PooledDocument
