"""Compilation ahead of time: the loop is compiled once for each family of runs, and kept on disk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from polyins.kernels.compilation import watched
from polyins.model.recording import GnssStream, Recording
from polyins.version import __version__

SECONDS = 70.0
"""of the recordings that the kernels are compiled for: enough for a start"""


def warm_up(progress: Callable[[float], None] | None = None) -> dict[str, Any]:
    """Compile what every family of methods needs, unless the cache has it; return the `warmup` document."""
    from polyins.kernels.jit import CACHE_FOLDER

    families = []
    with watched() as seconds:
        cases = _families()
        for number, (name, run) in enumerate(cases):
            before = seconds()
            run()
            families.append({"name": name, "compiled_s": seconds() - before})
            if progress:
                progress((number + 1) / len(cases))
    return {"polyins": __version__, "cache": str(CACHE_FOLDER), "compiled_s": seconds(), "families": families}


def _families() -> list[tuple[str, Callable[[], None]]]:
    """Return a name and a run for each set of types that something is compiled for."""
    from polyins.tools import bench

    under_way = bench.array(2, SECONDS)
    array, vehicle = _headed(under_way), _headed(bench.vehicle(SECONDS))
    with_gnss = _with_fixes(vehicle)
    batches = [
        ("arrays with GNSS", "enav-fusion", under_way),
        ("arrays with GNSS velocity", "enav-fusion", _with_velocities(array)),
        ("arrays without GNSS", "enav-fusion", _without_fixes(array)),
        ("wheels", "triple-ins", vehicle),
        ("wheels with GNSS", "triple-ins", with_gnss),
        ("wheels, centralized", "triple-ins/centralized", vehicle),
        ("wheels, centralized, with GNSS", "triple-ins/centralized", with_gnss),
    ]
    runs = [(name, partial(_begin, method, recording)) for name, method, recording in batches]
    return [*runs, ("clocks of their own, live", partial(_begin_live, array))]


def _begin(method: str, recording: Recording) -> None:
    from polyins.navigate import batch

    batch.prepare(recording, method).advance(1, 1)


def _begin_live(recording: Recording) -> None:
    from polyins.navigate.navigator import Navigator
    from polyins.prepare import alignment, timesync

    first, second = recording.imus
    recording = replace(recording, imus=(first, replace(second, time=second.time - 0.5 / second.rate_hz)))
    start = alignment.find_start(recording, timesync.align(recording.imus))
    navigator = Navigator(recording.rig, start)
    for row in range(int(np.searchsorted(first.time, start.time)) + 3):
        for i, stream in enumerate(recording.imus):
            navigator.imu(stream.time[row], stream.dtheta[row], stream.dvel[row], i)
    navigator.flush()


def _with_velocities(recording: Recording) -> Recording:
    assert recording.gnss is not None
    still = np.zeros_like(recording.gnss.position)
    return replace(recording, gnss=replace(recording.gnss, velocity=still, velocity_std=still + 0.1))


def _without_fixes(recording: Recording) -> Recording:
    return replace(recording, gnss=None, outages=())


def _with_fixes(recording: Recording) -> Recording:
    reference = recording.reference
    assert reference is not None
    fixes = GnssStream(reference.time, reference.position, np.ones_like(reference.position))
    return replace(recording, gnss=fixes)


def _headed(recording: Recording) -> Recording:
    return replace(recording, start=replace(recording.start, heading=0.0, heading_from="value"))
