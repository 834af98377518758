"""A whole recording through the engine, and what comes out as a Solution."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from polyins.aiding import kinds
from polyins.errors import InputError
from polyins.kernels import dense
from polyins.model.methods import Method, find_method
from polyins.model.recording import Recording
from polyins.model.solution import Innovations, OffsetEstimate, Solution
from polyins.model.states import IMU_ERRORS, NAVIGATION, place
from polyins.navigate import engine, events, layout, update
from polyins.navigate import start as search
from polyins.navigate import state as places
from polyins.navigate.choice import Choice, choose
from polyins.navigate.events import Events
from polyins.navigate.layout import Bank
from polyins.navigate.state import Further, Inputs, Navigators, Outputs, Plan, State, further_work
from polyins.prepare import alignment, rigid, timesync, wheels
from polyins.prepare.alignment import Start
from polyins.prepare.timesync import Aligned

Array = NDArray[np.float64]

CHUNK = 4000
"""Epochs between two calls of `progress`."""


@dataclass(frozen=True)
class Prepared:
    """A run laid out as arrays, ready for `engine.run`."""

    method: Method
    recording: Recording
    aligned: Aligned
    start: Start
    choice: Choice
    bank: Bank
    memory: Array
    """all that the run remembers; the arrays of the state are parts of it"""
    navigators: Navigators
    inputs: Inputs
    outputs: Outputs
    full_matrices: tuple[Array, Array] | None = None
    """work arrays of the dense covariance"""
    loop: Callable[..., None] = engine.run
    """or its code for these arrays, see `jit.compiled_for`"""

    @property
    def order(self) -> list[int]:
        """Of each column of the increments the index of its IMU."""
        return list(self.choice.blocks[0]) if self.method.bank == "mean" else self.bank.order

    @property
    def state(self) -> State:
        """What the run remembers."""
        return self.navigators.state

    @property
    def plan(self) -> Plan:
        """What it is told."""
        return self.navigators.plan

    @cached_property
    def further(self) -> Further | None:
        """What some runs need besides."""
        return further_work(self.state, self.plan)

    def advance(self, first: int, last: int) -> None:
        """Take epochs first ... last - 1; the first of a run is 1."""
        further, epochs = self.further, slice(first, last)
        self.loop(self.navigators, self.inputs, self.outputs, further, self.full_matrices, epochs)


def run(
    recording: Recording,
    method: str = "enav-fusion",
    *,
    imu: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Solution:
    """Navigate a recording with one method and return its solution.

    `imu` is the index of the IMU that `single` uses. `progress` is called with the share of epochs done. Raises
    InputError for a method that is unknown or data that give no start.
    """
    return navigate(prepare(recording, method, imu=imu), progress)


def navigate(prepared: Prepared, progress: Callable[[float], None] | None = None) -> Solution:
    """Take all epochs of a run that is laid out and return its solution."""
    begin = clock.perf_counter()
    prepared.advance(1, 1)  # compiles the loop, or loads it from the cache
    first_call_s = clock.perf_counter() - begin
    epochs = len(prepared.inputs.time)
    filter_s = 0.0
    for first in range(1, epochs, CHUNK):
        last = min(first + CHUNK, epochs)
        begin = clock.thread_time()
        prepared.advance(first, last)
        filter_s += clock.thread_time() - begin
        if progress:
            progress(last / epochs)
    if prepared.recording.rig.has_wheels:
        _check_finite(prepared)
    return solution_of(prepared, filter_s, first_call_s)


def _check_finite(run: Prepared) -> None:
    broken = np.flatnonzero(~np.isfinite(run.outputs.states[1:]).all(axis=1))
    if len(broken):
        raise InputError(
            f"{run.method.name}: diverged at {run.aligned.time[1:][broken[0]]:.2f} s;"
            " expected wheel radii, mounts, clocks and a start heading that fit the motion"
        )


def prepare(recording: Recording, method: str, *, imu: int = 0, dense_covariance: bool = False) -> Prepared:
    """Lay a run out, as `run` does before its first epoch.

    The dense covariance is the papers' form with full matrices, there to be compared with.
    """
    row = find_method(method)
    choice = choose(row, recording.rig, imu)
    recording = recording.subset(choice.all)
    aligned = timesync.align(recording.imus, bridge=not recording.rig.has_wheels)
    start = start_of(row, recording, aligned)
    end = aligned.time[-1] if recording.start.end_time is None else recording.start.end_time
    aligned = aligned.between(start.time, end)
    if len(aligned.time) < 2:
        raise InputError(f"start: at {start.time:.3f} s, with an end at {end:.3f} s; expected an end after the start")
    prepared = lay_out(row, choice.renumbered(), recording, aligned, start)
    joined = prepared.state.joint.shape[0] > 0
    count = len(prepared.bank.spans) if joined else 1
    return replace(prepared, full_matrices=dense.workspace(count) if dense_covariance else None)


def find_start(recording: Recording, method: str = "enav-fusion", *, imu: int = 0) -> Start:
    """Find the start that `run` has, of the IMUs that the method takes; raise InputError where nothing gives it."""
    row = find_method(method)
    taken = recording.subset(choose(row, recording.rig, imu).all)
    return start_of(row, taken, timesync.align(taken.imus, bridge=not taken.rig.has_wheels))


def start_of(row: Method, recording: Recording, aligned: Aligned) -> Start:
    """Find the start of a method over a recording whose IMUs are on one time base."""
    return search.find(recording, aligned, lambda blind: run(blind, row.name))


def lay_out(
    row: Method, choice: Choice, recording: Recording, aligned: Aligned, start: Start, end: float | None = None
) -> Prepared:
    """Lay out the IMUs of a choice from the epoch at which they start; the events are those of the recording.

    `end`: of the run, where `aligned` is but its beginning, s.
    """
    interval = float(aligned.time[1] - aligned.time[0])
    start = alignment.levelled(start, recording.rig, aligned.increments[0], interval)
    seats = layout.seat(row, choice, recording.rig, start)
    order = list(choice.blocks[0]) if row.bank == "mean" else seats.order
    rates = aligned.increments[0][:, seats.order] / interval
    memory, navigators = layout.lay_out(row, choice, seats, recording, start, rates)
    navigators.plan.settings[places.LOG_EVERY] = max(1, round(aligned.rate_hz))
    inputs = inputs_of(choice, order, recording, aligned, start, end)
    navigators.plan.settings[places.MAY_BE_SILENT] = len(inputs.present) > 0
    engine.begin(navigators, inputs.increments[0], interval)
    return Prepared(
        method=row,
        recording=recording,
        aligned=aligned,
        start=start,
        choice=choice,
        bank=seats,
        memory=memory,
        navigators=navigators,
        inputs=inputs,
        outputs=empty_outputs(
            len(aligned.time), len(inputs.event_time), len(order), navigators.plan, logged_errors(recording)
        ),
    )


def logged_errors(recording: Recording) -> int:
    """Return how many of the errors that are estimated go into the log."""
    rig = recording.rig
    return layout.states_of(rig) - NAVIGATION if rig.has_wheels or rig.sensors else IMU_ERRORS


def inputs_of(
    choice: Choice, order: list[int], recording: Recording, aligned: Aligned, start: Start, end: float | None = None
) -> Inputs:
    """Return the aligned recording as the engine takes it; `order`: of each lane the IMU that stands in it."""
    rig, missing = recording.rig, aligned.missing
    whole = rigid.completed(rig, aligned, start.imu_errors)
    present = np.empty((0, len(order)), dtype=np.uint8)
    if (missing.any() and not (missing.all(axis=1) | ~missing.any(axis=1)).all()) or (missing.any() and rig.has_wheels):
        present = np.ascontiguousarray(present_of(recording, missing)[:, order])
    intervals = np.diff(aligned.time, prepend=2.0 * aligned.time[0] - aligned.time[1])
    travel = np.empty((0, 2))
    if choice.speed:
        lacking = rigid.presence(rig, missing) == rigid.NOTHING
        travel = wheels.travel(rig, choice.speed, whole.increments, intervals, lacking, start.imu_errors[:, :3])
    shown = events.of_recording(recording, aligned.time[0], aligned.time[-1] if end is None else end)
    schedule = schedule_of(choice, recording, start)
    lateral = travel[1:, 1] if len(travel) else np.zeros(len(intervals) - 1)
    due = schedule.events(aligned.time[1:], intervals[1:], lateral)
    queue = events.merged(events.scheduled(due, aligned.time[1:], recording.options, recording.rig), shown)
    return Inputs(aligned.time, np.ascontiguousarray(whole.increments[:, :, order]), present, travel, *queue)


def present_of(recording: Recording, missing: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return what each IMU has in each epoch, (T, N). Without wheels an epoch in which none has data is bridged."""
    present = rigid.presence(recording.rig, missing)
    if not recording.rig.has_wheels:
        present[missing.all(axis=1)] = rigid.MEASURED
    return present


def schedule_of(choice: Choice, recording: Recording, start: Start) -> wheels.Schedule:
    """Return when a run measures by itself."""
    several = len(choice.blocks) > 1 and recording.rig.has_wheels
    return wheels.Schedule(start.time, recording.options, wheels=bool(choice.speed), several=several)


def empty_outputs(epochs: int, count: int, imus: int, plan: Plan, errors: int) -> Outputs:
    """Return empty arrays for what a run with so many events writes; `errors` are the slow ones that are logged."""
    log_rows = int((epochs - 2) // plan.settings[places.LOG_EVERY]) + 1 if epochs > 1 else 0
    return Outputs(
        states=np.empty((epochs, 10)),
        variances=np.empty((epochs, 12)),
        event_status=np.zeros(count, dtype=np.int8),
        innovations=np.zeros((count, 7)),
        log_time=np.empty(log_rows),
        log=np.empty((log_rows, 2, errors, imus)),
    )


def solution_of(run: Prepared, filter_s: float = 0.0, first_call_s: float = 0.0) -> Solution:
    """Return what a run has written, as a solution."""
    recording, aligned, outputs = run.recording, run.aligned, run.outputs
    states, variances = outputs.states[1:], outputs.variances[1:]
    point = recording.rig.imus[0].position if run.method.bank == "one" and not recording.rig.has_wheels else np.zeros(3)
    lanes = run.bank.lanes
    log = outputs.log[:, :, :, lanes].transpose(0, 1, 3, 2)
    return Solution(
        method=run.method.name,
        geodetic=recording.geodetic,
        time=aligned.time[1:],
        position=states[:, 0:3],
        velocity=states[:, 3:6],
        attitude=states[:, 6:10],
        position_variance=variances[:, 0:3],
        velocity_variance=variances[:, 3:6],
        phi_covariance=variances[:, 6:12],
        point=point,
        imus=len(recording.imus),
        imu_names=tuple(run.bank.members[i].imu.name for i in lanes),
        imu_error_time=outputs.log_time,
        imu_errors=log[:, 0, :, :12],
        imu_error_std=log[:, 1, :, :12],
        measurements=innovations_of(run),
        offsets=offsets_of(run, lanes),
        mounting=log[:, 0, :, 12:15] if recording.rig.has_wheels else None,
        mounting_std=log[:, 1, :, 12:15] if recording.rig.has_wheels else None,
        faults=silences(run.choice, recording, aligned) if recording.rig.has_wheels else (),
        start={"time_s": run.start.time, **run.start.sources},
        filter_s=filter_s,
        first_call_s=first_call_s,
        warnings=recording.warnings + aligned.warnings,
    )


def innovations_of(run: Prepared) -> dict[str, Innovations]:
    """Return what became of the measurements, by kind; of GNSS positions in any case."""
    queue, outputs = Events(*run.inputs[4:8]), run.outputs
    velocity = np.flatnonzero(queue.kind == kinds.GNSS_VELOCITY)
    lost = queue.time[velocity][outputs.event_status[velocity] == update.REJECTED]
    found = {}
    for number, kind in enumerate(kinds.KINDS):
        shown = np.flatnonzero((queue.kind == number) & (outputs.event_status != update.UNUSED))
        if number == kinds.GNSS_POSITION:
            shown = np.flatnonzero(queue.kind == number)
        elif not len(shown) or not kind.axes:
            continue
        status, rows, axes = outputs.event_status[shown], outputs.innovations[shown], len(kind.axes)
        of_fix = number == kinds.GNSS_POSITION
        found[kind.name] = Innovations(
            time=queue.time[shown],
            residual=rows[:, :axes],
            std=np.sqrt(rows[:, 3 : 3 + axes]),
            nis=rows[:, 6],
            accepted=status != update.REJECTED,
            reopened=status == update.REOPENED,
            velocity_rejected=np.isin(queue.time[shown], lost) if of_fix else np.zeros(len(shown), dtype=bool),
            rows=(queue.variance[shown] > 0.0).sum(axis=1),
            axes=kind.axes,
            unit=kind.unit,
        )
    return found


def offsets_of(run: Prepared, lanes: list[int]) -> dict[str, OffsetEstimate]:
    """Return what was estimated of the sensors' offsets and scales, by the state's name."""
    found = {}
    for sensor in run.recording.rig.sensors:
        if sensor.offset_std > 0.0:
            name = layout.offset_of(sensor)
            log = run.outputs.log[:, :, place(name) - NAVIGATION][:, :, lanes]
            found[name] = OffsetEstimate(log[:, 0].mean(axis=1), log[:, 1].mean(axis=1))
    return found


def silences(choice: Choice, recording: Recording, aligned: Aligned) -> tuple[str, ...]:
    """Return in words which IMUs were silent for how long, of a choice and what became of them."""
    found = []
    for i, imu in enumerate(recording.rig.imus):
        for first, end in _stretches(aligned.missing[:, i]):
            begin, last = aligned.time[max(first - 1, 0)], aligned.time[end - 1]
            outcome = _outcome(choice, i, aligned, first, end)
            found.append(f"IMU {imu.name}: silent for {last - begin:.2f} s from {begin:.2f} s; {outcome}")
    return tuple(found)


def _outcome(choice: Choice, i: int, aligned: Aligned, first: int, end: int) -> str:
    """Say what a vehicle did while one of its IMUs was silent, in epochs first ... end - 1."""

    def silent(module: tuple[int, ...]) -> NDArray[np.bool_]:
        return np.asarray(aligned.missing[first:end, module].all(axis=1))

    (own,) = {module for module in (*choice.blocks, *choice.speed) if i in module}
    every = np.all([silent(module) for module in choice.blocks], axis=0)
    if not silent(own).any():
        return "its module went on without it"
    if own not in choice.blocks:
        return "the others gave the speed" if len(choice.speed) > 1 else "there was no wheel speed"
    if every.all():
        return "the vehicle coasted"
    if every.any():
        alone = float(np.sum(np.diff(aligned.time, prepend=aligned.time[0])[first:end][every]))
        return f"for {alone:.2f} s of it every IMU was, and the vehicle coasted"
    return "the others carried it along"


def _stretches(where: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], where.astype(int), [0]])))
    return [(int(first), int(end)) for first, end in zip(edges[::2], edges[1::2], strict=True)]
