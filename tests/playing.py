"""A recording played through a navigator, sample by sample."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.model.recording import Recording
from polyins.navigate import batch
from polyins.navigate.navigator import Navigator, NavigatorState

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Event:
    """One sample, or with `imu` -1 one fix."""

    arrives: float
    imu: int
    row: int


def navigator_for(prepared: batch.Prepared, **options: float) -> Navigator:
    """A navigator with the start of a batch run, for the IMUs that the run takes."""
    recording = prepared.recording
    return Navigator(
        recording.rig,
        prepared.start,
        method=prepared.method.name,
        options=recording.options,
        geodetic=recording.geodetic,
        **options,  # type: ignore[arg-type]
    )


def events(recording: Recording, lateness: float = -0.001) -> list[Event]:
    """All samples by their stamps, and the fixes that much later than theirs, s."""
    found = [Event(time, i, row) for i, stream in enumerate(recording.imus) for row, time in enumerate(stream.time)]
    if recording.gnss is not None:
        withheld = np.zeros(len(recording.gnss.time), dtype=bool)
        for begin, end in recording.outages:
            withheld |= (recording.gnss.time > begin) & (recording.gnss.time < end)
        fixes = np.flatnonzero(~withheld)
        found += [Event(recording.gnss.time[row] + lateness, -1, int(row)) for row in fixes]
    return sorted(found, key=lambda event: (event.arrives, event.imu))


def feed(navigator: Navigator, recording: Recording, event: Event) -> None:
    """Hand one event over."""
    gnss = recording.gnss
    if event.imu >= 0:
        stream = recording.imus[event.imu]
        navigator.imu(stream.time[event.row], stream.dtheta[event.row], stream.dvel[event.row], event.imu)
    elif gnss is not None and gnss.velocity is not None and gnss.velocity_std is not None:
        k = event.row
        navigator.gnss(gnss.time[k], gnss.position[k], gnss.position_std[k], gnss.velocity[k], gnss.velocity_std[k])
    elif gnss is not None:
        navigator.gnss(gnss.time[event.row], gnss.position[event.row], gnss.position_std[event.row])


def play(navigator: Navigator, recording: Recording, played: Iterable[Event]) -> dict[float, Array]:
    """Play events and return position, velocity, attitude and variances as they first were at each epoch, (22,)."""
    states: dict[float, Array] = {}

    def read() -> None:
        for state in navigator.history(next(reversed(states), -np.inf)):
            states[state.time] = row(state)

    for event in played:
        feed(navigator, recording, event)
        read()
    navigator.flush()
    read()
    return states


def row(state: NavigatorState) -> Array:
    """Position, velocity, attitude, std of position and velocity, and covariance of phi, (22,)."""
    std = [state.position_std, state.velocity_std]
    return np.concatenate([state.position, state.velocity, state.attitude, *std, state.phi_covariance])


def rows(solution: batch.Solution) -> Array:
    """The same of every epoch, (T, 22)."""
    std = np.sqrt(np.hstack([solution.position_variance, solution.velocity_variance]))
    return np.hstack([solution.position, solution.velocity, solution.attitude, std, solution.phi_covariance])
