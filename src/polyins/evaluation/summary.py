"""The documents that `run` and `compare` print: every figure of a run, null where there is none."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from polyins.evaluation.consistency import mean_nis
from polyins.evaluation.documents import (
    CompareDocument,
    ConsistencyFigures,
    DriftFigures,
    ErrorFigures,
    FindingDocument,
    GnssCounts,
    MeasurementCounts,
    MethodDocument,
    OutageFigures,
    PooledDocument,
    RunDocument,
)
from polyins.evaluation.drift import drift
from polyins.evaluation.errors import rms
from polyins.evaluation.figures import Figures
from polyins.evaluation.outages import Interval, outage_statistic
from polyins.evaluation.verdict import coverage, verdict
from polyins.formats.documents import plain
from polyins.model.findings import LEFT_OUT, LEVELS, Finding
from polyins.model.methods import METHODS
from polyins.model.recording import Reference
from polyins.model.solution import Innovations, Solution
from polyins.version import __version__

Array = NDArray[np.float64]
BETTER = 1.1
"""times the error of one IMU alone, above which a method is worse than it"""
GNSS_COUNTS = ("fixes", "rejected", "resets", "velocities_rejected")


def summarize(solution: Solution, reference: Reference | None, outages: Sequence[Interval] = ()) -> RunDocument:
    """Return the `run` document of one solution.

    Raises InputError if the reference cannot be compared with.
    """
    figures = Figures(reference, outages, solution.geodetic)
    figures.add(solution)
    return document(solution, figures)


def document(solution: Solution, figures: Figures) -> RunDocument:
    """Return the `run` document of figures; of the solution only what has no row per epoch is looked at."""
    epochs, errors = figures.epochs, figures.errors
    judged = verdict(solution, figures)
    whole = {
        "polyins": __version__,
        "method": solution.method,
        "imus": solution.imus,
        "rate_hz": round(1.0 / epochs.interval, 6),
        "duration_s": epochs.duration,
        "epochs": epochs.count,
        "filter_s": solution.filter_s,
        "us_per_epoch": 1e6 * solution.filter_s / epochs.count if epochs.count else None,
        "first_call_s": solution.first_call_s,
        "reference": figures.reference,
        "outages": outage_statistic(errors, figures.outages),
        "drift": drift(errors),
        "consistency": {"nees_position": figures.nees_position, "nis_gnss": mean_nis(solution.innovations)},
        "gnss": _gnss(solution.innovations),
        "measurements": {name: _measured(one) for name, one in solution.measurements.items()},
        "offsets": {
            name: {"estimate": float(one.value[-1]), "std": float(one.std[-1])}
            for name, one in solution.offsets.items()
            if one.value.size
        },
        "start": solution.start,
        "verdict": judged.document(),
        "coverage": coverage(solution.recording_span, figures.epochs),
        "heights": solution.heights if solution.geodetic else None,
        "utc_of_zero_s": solution.utc_of_zero,
        "exclusions": [
            {
                "imu": one.stream,
                "from_s": one.from_s,
                "to_s": one.to_s,
                "cause": one.axis or one.text,
                "statistic": one.size,
            }
            for one in judged.findings
            if one.kind == LEFT_OUT
        ],
        "faults": judged.faults,
        "mounting": _mounting(solution),
        "warnings": judged.warnings,
    }
    return cast(RunDocument, plain(whole))


def comparison(
    summaries: Mapping[str, RunDocument], each: Sequence[RunDocument], alone: str = "single"
) -> CompareDocument:
    """Return the `compare` document of the summaries of several methods and of each IMU alone, run by `alone`.

    A single IMU's figures are the root mean square (of maxima the maximum, of times the mean) over all IMUs. The ratio
    divides that figure by a method's: the outage statistic, or without outages the horizontal rms (paper A, section
    IV). The time ratio divides the method's time per epoch by a single IMU's.
    """
    methods = {name: _against(each, summary) for name, summary in summaries.items() if name != alone}
    single = pooled(each) if each else None
    imus = len(each) or max((summary["imus"] for summary in methods.values()), default=1)
    return {
        "polyins": __version__,
        "methods": {**({alone: single} if single else {}), **methods},
        "ratio_to_single": {name: _ratio(figure(single), figure(summary)) for name, summary in methods.items()},
        "time_ratio_to_single": {name: _ratio(_cost(summary), _cost(single)) for name, summary in methods.items()},
        "sqrt_n": float(np.sqrt(imus)),
    }


def _against(each: Sequence[RunDocument], summary: RunDocument) -> RunDocument:
    """Return a method's document with a finding if one IMU alone beats it."""
    known = [(found, one) for one in each if (found := figure(one)) is not None]
    own = figure(summary)
    if own is None or len(known) < 2:
        return summary
    best, of = min(known, key=lambda pair: pair[0])
    worst = max(known, key=lambda pair: pair[0])[1]
    if own <= BETTER * best:
        return summary
    finding = Finding(
        "single better",
        f"{of.get('imu', 'one IMU')} alone is better than all together: {best:.3g} against {own:.3g}",
        stream=worst.get("imu", ""),
        size=own / best,
        expected=1.0,
        remedy=f"look at {worst.get('imu', 'the worst IMU')}, which is the worst alone, or leave it out",
    )
    judged = summary["verdict"]
    said = cast(FindingDocument, plain(finding.document()))
    warnings = [*summary["warnings"], finding.sentence]
    return {**summary, "warnings": warnings, "verdict": {**judged, "findings": [*judged["findings"], said]}}


def pooled(each: Sequence[RunDocument]) -> RunDocument:
    """Return one `run` document for all IMUs' runs on their own, with the runs themselves under `each`."""
    first = each[0]
    return {
        **first,
        "filter_s": _pool([summary["filter_s"] for summary in each], np.mean),
        "us_per_epoch": _pool([summary["us_per_epoch"] for summary in each], np.mean),
        "first_call_s": max(summary["first_call_s"] for summary in each),
        "reference": _pooled_errors(each),
        "outages": _pooled_outages([summary["outages"] for summary in each]),
        "drift": cast(DriftFigures, _means([summary["drift"] for summary in each])),
        "consistency": cast(ConsistencyFigures, _means([summary["consistency"] for summary in each])),
        "gnss": {
            **_gnss_counts(each),
            "rejected_times_s": sorted({time for summary in each for time in summary["gnss"]["rejected_times_s"]}),
        },
        "verdict": max((summary["verdict"] for summary in each), key=lambda one: LEVELS.index(one["level"])),
        "warnings": list(dict.fromkeys(warning for summary in each for warning in summary["warnings"])),
        "each": list(each),
    }


def over_recordings(documents: Sequence[CompareDocument]) -> PooledDocument:
    """Return the figures of each method that all of some `compare` documents have, over all their recordings.

    Errors are root mean squares (of maxima the maximum) in which every recording counts the same, and of outages every
    outage; drift and times are means.
    """
    by_method = {
        name: [document["methods"][name] for document in documents]
        for name in documents[0]["methods"]
        if all(name in document["methods"] for document in documents)
    }
    methods = {name: _over_recordings(each) for name, each in by_method.items()}
    alone = next((methods[name] for name in ("single", "wheel-ins") if name in methods), None)
    others = {name: summary for name, summary in methods.items() if summary is not alone}
    return {
        "methods": methods,
        "ratio_to_single": {name: _ratio(figure(alone), figure(summary)) for name, summary in others.items()},
        "time_ratio_to_single": {name: _ratio(_cost(summary), _cost(alone)) for name, summary in others.items()},
    }


def _over_recordings(each: Sequence[RunDocument]) -> MethodDocument:
    maxima = [value for summary in each for value in summary["outages"]["each_m"]]
    drifts = _means([summary["drift"] for summary in each])
    return {
        "method": each[0]["method"],
        "duration_s": sum(summary["duration_s"] for summary in each),
        "epochs": sum(summary["epochs"] for summary in each),
        "us_per_epoch": _pool([_cost(summary) for summary in each], np.mean),
        "reference": _pooled_errors(each),
        "outages": {"count": len(maxima), "horizontal_max_rms_m": _pool(maxima, rms)},
        "drift": cast(DriftFigures, {key: known for key, known in drifts.items() if key != "step_m"}),
        "consistency": cast(ConsistencyFigures, _means([summary["consistency"] for summary in each])),
        "gnss": _gnss_counts(each),
    }


def _pooled_errors(each: Sequence[RunDocument]) -> ErrorFigures:
    every: list[Mapping[str, Any]] = [summary["reference"] for summary in each]
    found = {key: _pool([figures[key] for figures in every], np.max if "_max_" in key else rms) for key in every[0]}
    return cast(ErrorFigures, found)


def _gnss_counts(each: Sequence[RunDocument]) -> GnssCounts:
    every: list[Mapping[str, Any]] = [summary["gnss"] for summary in each]
    return cast(GnssCounts, {key: sum(counts[key] for counts in every) for key in GNSS_COUNTS})


def figure(summary: MethodDocument | None) -> float | None:
    """Return the figure that methods are compared by.

    The outage statistic, m; without outages with wheels the drift rate, %; or else the horizontal rms, m.
    """
    if summary is None:
        return None
    if on_wheels(summary) and not summary["outages"]["count"]:
        return summary["drift"]["rate_percent"]
    outages = summary["outages"]
    return outages["horizontal_max_rms_m"] if outages["count"] else summary["reference"]["horizontal_rms_m"]


def on_wheels(summary: Mapping[str, Any]) -> bool:
    """Return whether wheels aided the run; of a method that is not known, as in a solution from elsewhere, no."""
    row = METHODS.get(summary["method"].split("/")[0])
    return row is not None and row.for_wheels


def _gnss(innovations: Innovations) -> dict[str, object]:
    rejected = ~innovations.accepted
    return {
        "fixes": innovations.time.size,
        "rejected": int(np.count_nonzero(rejected)),
        "resets": int(np.count_nonzero(innovations.reset)),
        "velocities_rejected": int(np.count_nonzero(innovations.velocity_rejected)),
        "rejected_times_s": innovations.time[rejected],
    }


def _measured(innovations: Innovations) -> MeasurementCounts:
    """Count what became of the measurements of one kind; the NIS of the accepted, per degree of freedom."""
    accepted = innovations.accepted
    degrees = int(innovations.rows[accepted].sum())
    return {
        "count": innovations.time.size,
        "rejected": int(np.count_nonzero(~accepted)),
        "resets": int(np.count_nonzero(innovations.reset)),
        "mean_nis": float(innovations.nis[accepted].sum() / degrees) if degrees else None,
    }


def _mounting(solution: Solution) -> dict[str, object]:
    """Return the last estimate of what is estimated of the mounting of each IMU, and its std."""
    if solution.mounting is None or solution.mounting_std is None or not solution.imu_error_time.size:
        return {}
    return {
        name: {"estimate": value, "std": std}
        for name, value, std in zip(solution.imu_names, solution.mounting[-1], solution.mounting_std[-1], strict=True)
        if std.any()
    }


def _pooled_outages(statistics: Sequence[OutageFigures]) -> OutageFigures:
    maxima = [statistic["each_m"] for statistic in statistics]
    return {
        **statistics[0],
        "horizontal_max_rms_m": _pool([value for values in maxima for value in values], rms),
        "each_m": [_pool(values, rms) for values in zip(*maxima, strict=True)],
    }


def _means(parts: Sequence[Mapping[str, Any]]) -> dict[str, float | None]:
    return {key: _pool([part[key] for part in parts], np.mean) for key in parts[0]}


def _pool(values: Sequence[float | None], combine: Callable[[Array], Any]) -> float | None:
    known = np.array([value for value in values if value is not None])
    return float(combine(known)) if known.size else None


def _cost(summary: MethodDocument | None) -> float | None:
    return None if summary is None else summary["us_per_epoch"]


def _ratio(numerator: float | None, denominator: float | None) -> float | None:
    return numerator / denominator if numerator is not None and denominator else None
