"""The report's words and figures: what was run, the table of the methods, the warnings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from polyins.evaluation.documents import CompareDocument, OutageFigures, RunDocument, sentence
from polyins.evaluation.summary import on_wheels
from polyins.formats.documents import plain
from polyins.model.recording import Recording
from polyins.report.scene import Run, Scene

Cell = tuple[str, str]
"""a column's heading and what stands under it"""


@dataclass(frozen=True)
class Table:
    """The methods' figures as text; columns in which nothing is known are left out."""

    headings: tuple[str, ...]
    rows: tuple[tuple[str, str, tuple[str, ...]], ...]
    """method, its colour, its figures"""


UNKNOWN = "\N{EM DASH}"

COLUMNS: tuple[tuple[str, int, Callable[[RunDocument], float | None]], ...] = (
    ("outages: rms of max. (m)", 2, lambda run: run["outages"]["horizontal_max_rms_m"]),
    ("drift rate (%)", 2, lambda run: run["drift"]["rate_percent"] if on_wheels(run) else None),
    ("end point (%)", 2, lambda run: run["drift"]["end_percent"] if on_wheels(run) else None),
    ("horizontal rms (m)", 3, lambda run: run["reference"]["horizontal_rms_m"]),
    ("horizontal max. (m)", 2, lambda run: run["reference"]["horizontal_max_m"]),
    ("vertical rms (m)", 3, lambda run: run["reference"]["vertical_rms_m"]),
    ("roll rmse (deg)", 3, lambda run: run["reference"]["roll_rmse_deg"]),
    ("pitch rmse (deg)", 3, lambda run: run["reference"]["pitch_rmse_deg"]),
    ("heading rmse (deg)", 3, lambda run: run["reference"]["heading_rmse_deg"]),
    ("NEES position", 2, lambda run: run["consistency"]["nees_position"]),
    ("NIS GNSS", 2, lambda run: run["consistency"]["nis_gnss"]),
    ("fixes rejected", 0, lambda run: run["gnss"]["rejected"] if run["gnss"]["fixes"] else None),
    ("time per epoch (µs)", 2, lambda run: run["us_per_epoch"]),
)
RATIOS: tuple[tuple[str, Callable[[CompareDocument], dict[str, float | None]]], ...] = (
    ("error, {0} / method", lambda document: document["ratio_to_single"]),
    ("time, method / {0}", lambda document: document["time_ratio_to_single"]),
)


def figures_table(scene: Scene, comparison: CompareDocument | None) -> Table:
    """Return the table of figures, one row for each run."""
    rows = [_figures(run, comparison) for run in scene.runs]
    known = [column for column, cells in enumerate(zip(*rows, strict=True)) if {text for _, text in cells} != {UNKNOWN}]
    headings = tuple(rows[0][column][0] for column in known)
    lines = ((run.name, run.colour, row) for run, row in zip(scene.runs, rows, strict=True))
    return Table(
        headings, tuple((name, colour, tuple(row[column][1] for column in known)) for name, colour, row in lines)
    )


def facts(scene: Scene) -> list[Cell]:
    """Return what was run, as pairs of a term and its value."""
    recording, first = scene.recording, scene.runs[0]
    duration, rate = first.summary["duration_s"], first.summary["rate_hz"]
    return [
        ("IMUs", _imus(recording)),
        ("solution", f"{duration:.1f} s, {first.summary['epochs']:,} epochs at {_number(rate, 1)} Hz"),
        ("time zero", f"{scene.start:.3f} s"),
        ("GNSS", "none" if recording.gnss is None else f"{recording.gnss.time.size:,} fixes"),
        *([("outages", _outages(first.summary["outages"]))] if recording.gnss else []),
        ("reference", _reference(recording)),
        ("positions", "geodetic (WGS 84)" if recording.geodetic else "local tangent plane, no Earth rate"),
        *((f"navigators of {run.name}", ", ".join(run.solution.imu_names)) for run in scene.runs if run.on_wheels),
        *((f"start: {key.replace('_', ' ')}", _value(value)) for key, value in first.solution.start.items()),
    ]


def findings_by_text(scene: Scene) -> list[tuple[str, str, str]]:
    """Return severity and sentence of each finding once, the worst first, with the runs that it is of if not of all."""
    given: dict[tuple[str, str], list[str]] = {}
    for run in scene.runs:
        for finding in run.summary["verdict"]["findings"]:
            names = given.setdefault((finding["severity"], sentence(finding)), [])
            names.extend([run.name] if run.name not in names else [])
    known = [(*of, "" if len(names) == len(scene.runs) else ", ".join(names)) for of, names in given.items()]
    texts = {text for _, text, _ in known}
    known += [("note", text, "") for text in dict.fromkeys(scene.recording.sentences) if text not in texts]
    return sorted(known, key=lambda one: ("serious", "doubt", "note").index(one[0]))


def verdicts(scene: Scene) -> list[tuple[str, str]]:
    """Return each level once, with the runs that have it; without a name if all have."""
    given: dict[str, list[str]] = {}
    for run in scene.runs:
        given.setdefault(run.summary["verdict"]["level"], []).append(run.name)
    return [(level, "" if len(given) == 1 else ", ".join(names)) for level, names in given.items()]


def _figures(run: Run, comparison: CompareDocument | None) -> list[Cell]:
    own = [(heading, _number(pick(run.summary), digits)) for heading, digits, pick in COLUMNS]
    if comparison is None:
        return own
    alone = "wheel-ins" if run.on_wheels else "single"
    return own + [(heading.format(alone), _number(pick(comparison).get(run.name), 2)) for heading, pick in RATIOS]


def _number(value: float | None, digits: int) -> str:
    return UNKNOWN if value is None else f"{value:.{digits}f}"


def _imus(recording: Recording) -> str:
    names = [imu.name for imu in recording.rig.imus]
    shown = names if len(names) <= 4 else [names[0], names[1], "…", names[-1]]
    return f"{len(names)} ({', '.join(shown)})"


def _outages(outages: OutageFigures) -> str:
    if not outages["count"]:
        return "none"
    length = "" if outages["length_s"] is None else f" of {outages['length_s']:g} s"
    return f"{outages['count']}{length}"


def _reference(recording: Recording) -> str:
    reference = recording.reference
    if reference is None:
        return "none: errors are unknown, bands only"
    parts = {"position": reference.position, "velocity": reference.velocity, "attitude": reference.attitude}
    known = ", ".join(name for name, part in parts.items() if part is not None)
    return f"{known}; {reference.time.size:,} epochs"


def _value(value: object) -> str:
    simple = plain(value)
    if isinstance(simple, float):
        return f"{simple:.9g}"
    if isinstance(simple, Sequence) and not isinstance(simple, str):
        return ", ".join(_value(item) for item in simple)
    return UNKNOWN if simple is None else str(simple)
