"""The track seen from above: solutions over the reference, outages, fixes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.geodesy import displacement
from polyins.model.solution import Innovations
from polyins.report.decimation import kept_for_display
from polyins.report.figure import Figure, Trace, scatter
from polyins.report.palette import FIXES, OUTAGE_TRACK, REFERENCE, REJECTED
from polyins.report.scene import Run, Scene
from polyins.report.style import finish

Array = NDArray[np.float64]

POINTS = 4000


def trajectory_figure(scene: Scene) -> Figure:
    """Draw east against north, m from the first solution's start, with equal scales."""
    figure = Figure([*_outages(scene), *_fixes(scene), *_reference(scene), *_solutions(scene), *_rejected(scene)])
    finish(figure, height=600)
    figure.update_layout(
        xaxis={"title": {"text": "east (m)"}},
        yaxis={"title": {"text": "north (m)"}, "scaleanchor": "x", "scaleratio": 1.0},
    )
    return figure


def _track(scene: Scene, position: Array) -> Array:
    """Return east and north, m, shape (T, 2)."""
    geodetic = scene.runs[0].solution.geodetic
    return displacement(position, scene.origin, geodetic)[:, [1, 0]]


def _points(track: Array, **style: Any) -> Trace:
    east, north = track.astype(np.float32).T
    return scatter(x=east, y=north, **style)


def _line(track: Array, **style: Any) -> Trace:
    return _points(track[kept_for_display(track, POINTS)], mode="lines", **style)


def _known_track(scene: Scene) -> tuple[Array, Array]:
    """Return times and positions to mark outages on: the reference's, or else the first solution's."""
    reference = scene.recording.reference
    first = scene.runs[0].solution
    return (first.time, first.position) if reference is None else (reference.time, reference.position)


def _outages(scene: Scene) -> list[Trace]:
    if not scene.recording.outages:
        return []
    time, position = _known_track(scene)
    inside = np.zeros(time.shape, dtype=bool)
    for begin, end in scene.recording.outages:
        inside |= (time >= begin) & (time <= end)
    track = np.where(inside[:, None], _track(scene, position), np.nan)
    style = {"color": OUTAGE_TRACK, "width": 9}
    return [_line(track, name="GNSS outage", line=style, hoverinfo="skip")]


def _fixes(scene: Scene) -> list[Trace]:
    gnss = scene.recording.gnss
    if gnss is None:
        return []
    drawn = slice(None, None, -(-gnss.time.size // POINTS) or None)
    track = _track(scene, gnss.position[drawn])
    return [_points(track, name="GNSS fixes", mode="markers", marker={"color": FIXES, "size": 3}, hoverinfo="skip")]


def _reference(scene: Scene) -> list[Trace]:
    reference = scene.recording.reference
    if reference is None:
        return []
    track = _track(scene, reference.position)
    return [_line(track, name="reference", line={"color": REFERENCE, "width": 1.4})]


def _solutions(scene: Scene) -> list[Trace]:
    return [_solution(scene, run) for run in scene.runs]


def _solution(scene: Scene, run: Run) -> Trace:
    track = _track(scene, scene.at_reference_point(run))
    return _line(track, name=run.label, line={"color": run.colour, "dash": run.dash, "width": 1.8})


def _rejected(scene: Scene) -> list[Trace]:
    """Mark each fix that any run rejected, and say in its label by which."""
    gnss = scene.recording.gnss
    by_time: dict[float, list[str]] = {}
    for run in scene.runs:
        for time in _rejected_times(run.solution.innovations):
            by_time.setdefault(time, []).append(run.label)
    if gnss is None or not by_time:
        return []
    nearest = [int(np.argmin(np.abs(gnss.time - time))) for time in by_time]
    labels = [f"{time - scene.start:.2f} s, rejected by {', '.join(names)}" for time, names in by_time.items()]
    marker = {"color": REJECTED, "size": 9, "symbol": "x-thin", "line": {"color": REJECTED, "width": 2}}
    track = _track(scene, gnss.position[nearest])
    return [_points(track, name="rejected fixes", mode="markers", marker=marker, text=labels, hoverinfo="text")]


def _rejected_times(innovations: Innovations) -> list[float]:
    return [float(time) for time in innovations.time[~innovations.accepted]]
