"""Measurements as events of the engine's queue: what each stream of a recording says, in order of time."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.aiding import kinds
from polyins.errors import InputError
from polyins.model.recording import AidingStream, FilterOptions, Recording
from polyins.model.rig import DEG, Rig
from polyins.navigate.state import VALUES
from polyins.prepare.wheels import Scheduled

Array = NDArray[np.float64]

SENSORS = ("height", "heading", "odometer")
ZERO_VELOCITY_STD = 0.01  # m/s
ZERO_RATE_STD = 0.05 * DEG  # rad/s, of the mean over a window; an idling engine shakes more than gyros are noisy


class Events(NamedTuple):
    """Any number of events, in order of time."""

    time: Array
    """s (M,)"""
    kind: NDArray[np.int8]
    """see `aiding.kinds`"""
    value: Array
    """(M, VALUES)"""
    variance: Array
    """(M, 3)"""

    def at(self, rows: slice | NDArray[np.bool_] | NDArray[np.intp]) -> Events:
        """Return some of them."""
        return Events(self.time[rows], self.kind[rows], self.value[rows], self.variance[rows])


def events(kind: int, time: ArrayLike, value: ArrayLike, std: ArrayLike) -> Events:
    """Return events of one kind: times (M,), values (M, .) and standard deviations (M, .), of at most 3 components.

    A std that is not positive means that the component is not measured.
    """
    stamps = np.atleast_1d(np.asarray(time, dtype=np.float64))
    values, variances = np.zeros((len(stamps), VALUES)), np.zeros((len(stamps), 3))
    given, stds = np.atleast_2d(value), np.atleast_2d(std)
    values[:, : given.shape[1]] = given
    variances[:, : stds.shape[1]] = np.sign(stds) * np.square(stds)
    return Events(stamps, np.full(len(stamps), kind, dtype=np.int8), values, variances)


def of_point(kind: int, time: ArrayLike, value: ArrayLike, place: ArrayLike, std: ArrayLike) -> Events:
    """Return events that measure a point of the vehicle, whose place follows three numbers of the value."""
    given = np.atleast_2d(value)
    values = np.zeros((given.shape[0], 6))
    values[:, : given.shape[1]] = given
    values[:, 3:] = place
    return events(kind, time, values, std)


def merged(*streams: Events) -> Events:
    """Return the events of several streams in order of time; those of equal time in the order of the streams."""
    if not streams:
        return events(kinds.GNSS_POSITION, np.empty(0), np.empty((0, 1)), np.empty((0, 1)))
    together = Events(*(np.concatenate(columns) for columns in zip(*streams, strict=True)))
    return together.at(np.argsort(together.time, kind="stable"))


def of_recording(recording: Recording, begin: float, end: float) -> Events:
    """Return what the streams of a recording say after `begin` and up to `end`, s, but for outages of GNSS."""
    return merged(*_of_gnss(recording, begin, end), *_of_sensors(recording, begin, end))


def _of_gnss(recording: Recording, begin: float, end: float) -> list[Events]:
    gnss, antenna = recording.gnss, recording.rig.antenna
    if gnss is None:
        return []
    shown = _within(gnss.time, begin, end)
    for first, last in recording.outages:
        shown &= ~((gnss.time > first) & (gnss.time < last))
    rows = np.flatnonzero(shown)
    found = [of_point(kinds.GNSS_POSITION, gnss.time[rows], gnss.position[rows], antenna, gnss.position_std[rows])]
    if gnss.velocity is not None and gnss.velocity_std is not None:
        rows = np.flatnonzero(shown & (gnss.velocity_std > 0.0).any(axis=1))
        std = gnss.velocity_std[rows]
        found.append(of_point(kinds.GNSS_VELOCITY, gnss.time[rows], gnss.velocity[rows], antenna, std))
    return found


def _of_sensors(recording: Recording, begin: float, end: float) -> list[Events]:
    found = []
    for stream in recording.aiding:
        shown = _within(stream.time, begin, end)
        part = replace(stream, time=stream.time[shown], value=stream.value[shown], std=stream.std[shown])
        found.append(of_sensor(part, recording.rig))
    return found


def _within(time: Array, begin: float, end: float) -> NDArray[np.bool_]:
    return (time > begin) & (time <= end)


def of_sensor(stream: AidingStream, rig: Rig) -> Events:
    """Return what a sensor of the rig says; raises InputError for a kind that there is not."""
    if stream.kind not in SENSORS:
        raise InputError(f"{stream.kind}: is not a kind of sensor; expected {', '.join(SENSORS)}")
    place = rig.sensor(stream.kind).position
    return of_point(kinds.number(stream.kind), stream.time, stream.value[:, None], place, stream.std)


def scheduled(due: Scheduled, time: Array, options: FilterOptions, rig: Rig) -> Events:
    """Return what a schedule says as events of epochs with these stamps: before all else that is at the same epoch."""
    epochs = np.array([epoch for epoch, _, _ in due], dtype=np.intp)
    kind = np.array([kind for _, kind, _ in due], dtype=np.int8)
    std = np.ones((len(due), 3))
    rest = options.standstill
    std[kind == kinds.ZERO_VELOCITY] = ZERO_VELOCITY_STD if rest is None else rest.velocity_std
    std[kind == kinds.ZERO_RATE] = ZERO_RATE_STD if rest is None else rest.rate_std
    std[kind == kinds.REFERENCE_POINT] = options.rolling.constraint_std
    values = np.zeros((len(due), 6))
    values[:, 0] = [value for _, _, value in due]
    if options.nonholonomic is not None:
        assumed = kind == kinds.ODOMETER
        std[assumed] = [0.0, *options.nonholonomic.std]
        values[assumed, 3:] = rig.sensor("odometer").position
    return events(kinds.WINDOW, time[epochs] - options.gnss_snap, values, std)._replace(kind=kind)
