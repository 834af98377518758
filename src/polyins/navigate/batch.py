"""A recording through the engine, whole or stretch by stretch, and what comes out as a Solution."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.kernels import bank, covariance, dense
from polyins.kernels.bank import LANES
from polyins.model.attitude import euler_angles
from polyins.model.findings import SILENT, Finding, notes
from polyins.model.methods import Method, find_method
from polyins.model.recording import Recording
from polyins.model.rig import Rig
from polyins.model.solution import OffsetEstimate, Solution, Trajectory
from polyins.model.states import IMU_ERRORS, NAVIGATION, place
from polyins.model.status import USUAL, status_of
from polyins.navigate import bridging, deviations, engine, events, layout, outcome, receiver, restart, sharing
from polyins.navigate import start as search
from polyins.navigate import state as places
from polyins.navigate.choice import Choice, choose
from polyins.navigate.events import Events
from polyins.navigate.layout import Bank
from polyins.navigate.restart import BROKEN, HOPELESS_STATE
from polyins.navigate.state import Further, Inputs, Navigators, Outputs, Plan, State, further_work
from polyins.prepare import alignment, rigid, timesync, wheels
from polyins.prepare.alignment import Start
from polyins.prepare.data_findings import of_data
from polyins.prepare.radii import of_radii
from polyins.prepare.timesync import Aligned

Array = NDArray[np.float64]

USUAL_AIDING = 1 + USUAL
"""latest positions and speeds, which tell how often they usually come"""

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
    schedule: wheels.Schedule
    """when it measures by itself after these epochs"""
    aided: list[float]
    """s: the latest times at which a position or a speed was accepted before these epochs, or the start"""
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

    @property
    def hopeless_after(self) -> float:
        """The end of what is worth something of the state, s, see `receiver`; infinity: all is."""
        scalars = self.state.scalars
        if scalars[places.RECEIVER + receiver.IS_HOPELESS] == 0.0:
            return np.inf
        return float(scalars[places.RECEIVER + receiver.HOPELESS_AT]) + self.recording.options.gnss_snap

    @cached_property
    def further(self) -> Further | None:
        """What some runs need besides."""
        return further_work(self.state, self.plan)

    def stated(self, rows: slice | list[int]) -> Array:
        """Return the variances of some epochs, with what is unknown of the place and heading that they go on from."""
        states, variances = self.outputs.states[rows], self.outputs.variances[rows]
        return restart.with_datum(states, variances, self.start, self.recording.geodetic)

    def advance(self, first: int, last: int) -> None:
        """Take epochs first ... last - 1; the first of a run is 1."""
        further, epochs = self.further, slice(first, last)
        self.loop(self.navigators, self.inputs, self.outputs, further, self.full_matrices, epochs)

    def until(self, end: int) -> Prepared:
        """Return a run that is over as if it had ended before an epoch."""
        inputs, outputs, aligned = self.inputs, self.outputs, self.aligned
        used = int(np.searchsorted(inputs.event_time, inputs.time[end - 1] + self.recording.options.gnss_snap, "right"))
        logged = int((end - 2) // self.plan.settings[places.LOG_EVERY]) + 1
        ends = (end, end, used, used, logged, logged)
        kept = (array[:count] for array, count in zip(outputs, ends, strict=True))
        epochs = (array[:end] for array in inputs[:4])
        events = (array[:used] for array in inputs[4:])
        part = Aligned(aligned.time[:end], aligned.increments[:end], aligned.findings, aligned.missing[:end])
        return replace(self, aligned=part, inputs=Inputs(*epochs, *events), outputs=Outputs(*kept))

    def at(self, stretch: Aligned) -> Prepared:
        """Return the run at further epochs, of which the first is the last that it has taken."""
        begin = float(stretch.time[0]) + self.recording.options.gnss_snap
        inputs = inputs_of(self, stretch, begin)
        outputs = empty_outputs(inputs, self.plan, self.outputs.log.shape[2])
        for first in (places.NEXT_EVENT, places.NEXT_LOG):
            self.state.scalars[first] = 0.0
        return replace(self, aligned=stretch, inputs=inputs, outputs=outputs)


def run(
    recording: Recording,
    method: str = "enav-fusion",
    *,
    imu: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Solution:
    """Navigate a recording with one method and return its solution.

    After a pause in which no IMU has data the state is found anew, see `restart`. `imu` is the index of the IMU that
    `single` uses. `progress` is called with the share of epochs done. Raises InputError for a method that is unknown or
    data that give no start.
    """
    taken = choose(find_method(method), recording.rig, imu).all
    of_them = recording.subset(taken)

    def of_part(
        part: Recording, before: restart.Known | None, pause: restart.Pause | None
    ) -> Iterator[tuple[Solution, restart.Known]]:
        prepared = prepare(restart.begun(part, before, pause), method, imu=imu, before=before)
        yield navigated(prepared, progress)

    parts = restart.parts_of(recording, restart.pauses(of_them))
    whole = Solution.joined(list(restart.run_parts(parts, of_part, restart.rest_of)))
    return replace(whole, recording_span=_span(of_them), findings=(*whole.findings, *of_radii(recording)))


def known(run: Prepared, last: int, *, ended: str = "") -> restart.Known:
    """Return what a run knows which has taken all epochs up to its row `last`; `ended`: see `restart.Known`.

    A run whose state is no number, or is given up, knows of its IMUs what it began with.
    """
    row, variance = run.outputs.states[last], run.stated([last])[0]
    begun = zip(run.recording.rig.imus, run.start.imu_errors, run.start.imu_error_std, strict=True)
    return restart.Known(
        time=float(run.inputs.time[last]),
        position=row[0:3].copy(),
        velocity=row[3:6].copy(),
        heading=float(euler_angles(row[None, 6:10])[0, 2]),
        position_std=np.sqrt(variance[0:3]),
        heading_std=float(np.sqrt(variance[11])),
        imu_errors={imu.name: (own, std) for imu, own, std in begun} if ended else _imu_errors(run),
        ended=ended,
    )


def _imu_errors(run: Prepared) -> dict[str, tuple[Array, Array]]:
    """Return what a run has found of its IMUs, and the std of it."""
    state = run.state
    errors = {}
    for s, (begin, end) in enumerate(run.bank.spans):
        std = np.sqrt([deviations.variance(state, run.plan, s, covariance.NAV + k) for k in range(IMU_ERRORS)])
        for lane in range(begin, end):
            first = bank.ERRORS + lane % LANES
            own = state.rows[lane // LANES, first : first + IMU_ERRORS * LANES : LANES].copy()
            errors[run.bank.members[lane].imu.name] = own, std
    return errors


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
    return solution_of(prepared, filter_s, first_call_s)


def navigated(prepared: Prepared, progress: Callable[[float], None] | None = None) -> tuple[Solution, restart.Known]:
    """Take the epochs of a run up to the first whose state is no number or given up; returns what is known there, too.

    Raises InputError if it is the first one.
    """
    solution = navigate(prepared, progress)
    broken, hopeless = np.flatnonzero(~solution.is_finite), np.flatnonzero(solution.time > prepared.hopeless_after)
    ends = [(int(rows[0]), why) for rows, why in ((broken, BROKEN), (hopeless, HOPELESS_STATE)) if len(rows)]
    if not ends:
        return solution, known(prepared, -1)
    end, why = min(ends)
    if not end and why == BROKEN:
        raise InputError(
            f"{prepared.method.name}: diverged at {solution.time[0]:.2f} s;"
            " expected wheel radii, mounts, clocks and a start heading that fit the motion"
        )
    cut = prepared.until(max(end, 1) + 1)
    return solution_of(cut, solution.filter_s, solution.first_call_s), known(cut, -1, ended=why)


def prepare(
    recording: Recording,
    method: str,
    *,
    imu: int = 0,
    dense_covariance: bool = False,
    before: restart.Known | None = None,
) -> Prepared:
    """Lay a run out, as `run` does before its first epoch.

    `before`: what was known before the pause that the recording follows. The dense covariance is the papers' form with
    full matrices, there to be compared with.
    """
    row = find_method(method)
    choice = choose(row, recording.rig, imu)
    recording = recording.subset(choice.all)
    aligned = timesync.align(recording.imus, bridge=not recording.rig.has_wheels)
    of_them = of_data(recording, aligned, float(aligned.time[-1]))
    aligned = replace(aligned, findings=(*aligned.findings, *of_them))
    start = start_of(row, recording, aligned, before)
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


def start_of(row: Method, recording: Recording, aligned: Aligned, before: restart.Known | None = None) -> Start:
    """Find the start of a method over a recording whose IMUs are on one time base; `before`: see `prepare`."""
    start = search.find(recording, aligned, lambda blind: run(blind, row.name))
    if before is None or not restart.is_lost(recording):
        return start
    return restart.as_lost(start, before, recording.geodetic)


def lay_out(
    row: Method, choice: Choice, recording: Recording, aligned: Aligned, start: Start, *, gaps: bool | None = None
) -> Prepared:
    """Lay out the IMUs of a choice from the epoch at which they start; the events are those of the recording.

    `gaps`: whether any IMU falls silent, where `aligned` is but the beginning of the run.
    """
    interval = float(aligned.time[1] - aligned.time[0])
    start = alignment.levelled(start, recording.rig, aligned.increments[0], interval)
    seats = layout.seat(row, choice, recording.rig, start)
    rates = aligned.increments[0][:, seats.order] / interval
    memory, navigators = layout.lay_out(row, choice, seats, recording, start, rates)
    settings = navigators.plan.settings
    settings[places.LOG_EVERY] = log_every(aligned)
    settings[places.MAY_BE_SILENT] = _may_be_silent(recording, aligned.missing) if gaps is None else gaps
    nothing = np.empty(0)
    run = Prepared(
        method=row,
        recording=recording,
        aligned=aligned,
        start=start,
        choice=choice,
        bank=seats,
        memory=memory,
        navigators=navigators,
        inputs=Inputs(nothing, nothing, nothing, nothing, *events.merged()),
        outputs=Outputs(nothing, nothing, nothing, nothing, nothing, nothing),
        schedule=schedule_of(row, choice, recording, start),
        aided=[start.time],
    )
    inputs = inputs_of(run, aligned, float(aligned.time[0]))
    engine.begin(navigators, inputs.increments[0], interval)
    return replace(run, inputs=inputs, outputs=empty_outputs(inputs, run.plan, logged_errors(recording)))


def log_every(aligned: Aligned) -> int:
    """Return after how many epochs the errors of the IMUs are logged: about a second."""
    return max(1, round(aligned.rate_hz))


def _may_be_silent(recording: Recording, missing: NDArray[np.bool_]) -> bool:
    """Whether IMUs have gaps; where none has data, an array is bridged."""
    some = missing.any(axis=1)
    return bool(some.any() if recording.rig.has_wheels else (some & ~missing.all(axis=1)).any())


def logged_errors(recording: Recording) -> int:
    """Return how many of the errors that are estimated go into the log."""
    rig = recording.rig
    return layout.states_of(rig) - NAVIGATION if rig.has_wheels or rig.sensors else IMU_ERRORS


def inputs_of(run: Prepared, aligned: Aligned, begin: float) -> Inputs:
    """Return further epochs of a run as the engine takes them, with what is measured after `begin`, s."""
    rig, missing, start, choice = run.recording.rig, aligned.missing, run.start, run.choice
    whole = rigid.completed(rig, aligned, start.imu_errors)
    present = np.empty((0, len(run.order)), dtype=np.uint8)
    if run.plan.settings[places.MAY_BE_SILENT]:
        present = np.ascontiguousarray(present_of(run.recording, missing)[:, run.order])
    intervals = np.diff(aligned.time, prepend=2.0 * aligned.time[0] - aligned.time[1])
    travel = np.empty((0, 2))
    if choice.speed:
        lacking = rigid.presence(rig, missing) == rigid.NOTHING
        travel = wheels.travel(rig, choice.speed, whole.increments, intervals, lacking, start.imu_errors[:, :3])
    options = run.recording.options
    shown = events.of_recording(run.recording, begin, float(aligned.time[-1]) + options.gnss_snap)
    lateral = travel[1:, 1] if len(travel) else np.zeros(len(intervals) - 1)
    due = run.schedule.events(aligned.time[1:], intervals[1:], lateral)
    increments = np.ascontiguousarray(whole.increments[:, :, run.order])
    unknown = bridged(rig, aligned.time, increments, missing, options.gnss_snap)
    queue = events.merged(unknown, events.scheduled(due, aligned.time[1:], options, rig), shown)
    return Inputs(aligned.time, increments, present, travel, *queue)


def bridged(rig: Rig, time: Array, increments: Array, missing: NDArray[np.bool_], snap: float) -> Events:
    """Return the noise of epochs in which no IMU has data; the first row of the epochs was taken before."""
    nothing = np.asarray(missing.all(axis=1))
    if rig.has_wheels:
        return bridging.of_wheels(time, nothing, snap)
    return bridging.of_array(time, increments, nothing, snap)


def present_of(recording: Recording, missing: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return what each IMU has in each epoch, (T, N). Without wheels an epoch in which none has data is bridged."""
    present = rigid.presence(recording.rig, missing)
    if not recording.rig.has_wheels:
        present[missing.all(axis=1)] = rigid.MEASURED
    return present


def schedule_of(method: Method, choice: Choice, recording: Recording, start: Start) -> wheels.Schedule:
    """Return when a run measures by itself."""
    several = len(choice.blocks) > 1 and recording.rig.has_wheels
    compared = sharing.compares(method, recording.options, choice.blocks)
    return wheels.Schedule(start.time, recording.options, wheels=bool(choice.speed), several=several, compared=compared)


def empty_outputs(inputs: Inputs, plan: Plan, errors: int) -> Outputs:
    """Return empty arrays for what a run writes of its inputs; `errors` are the slow ones that are logged."""
    epochs, count, imus = len(inputs.time), len(inputs.event_time), inputs.increments.shape[2]
    log_rows = int((epochs - 2) // plan.settings[places.LOG_EVERY]) + 1 if epochs > 1 else 0
    return Outputs(
        states=np.empty((epochs, 10)),
        variances=np.empty((epochs, 12)),
        event_status=np.zeros(count, dtype=np.int8),
        innovations=np.zeros((count, places.INNOVATION)),
        log_time=np.empty(log_rows),
        log=np.empty((log_rows, 2, errors, imus)),
    )


def solution_of(run: Prepared, filter_s: float = 0.0, first_call_s: float = 0.0) -> Solution:
    """Return what a run has written, as a solution."""
    recording, aligned, outputs = run.recording, run.aligned, run.outputs
    states, variances = outputs.states[1:], run.stated(slice(1, None))
    track = Trajectory(
        time=aligned.time[1:],
        position=states[:, 0:3],
        velocity=states[:, 3:6],
        attitude=states[:, 6:10],
        position_variance=variances[:, 0:3],
        velocity_variance=variances[:, 3:6],
        phi_covariance=variances[:, 6:12],
    )
    point = recording.rig.imus[0].position if run.method.bank == "one" and not recording.rig.has_wheels else np.zeros(3)
    lanes = run.bank.lanes
    log = outputs.log[:, :, :, lanes].transpose(0, 1, 3, 2)
    rows = outcome.rows_of(run.inputs, outputs, slice(None), len(run.inputs.time) - 1)
    taken = outcome.aided_at(run.inputs.event_kind, outputs.event_status, run.inputs.event_time)
    aided = np.concatenate([run.aided, taken])
    run.aided[:] = aided[-USUAL_AIDING:]
    return Solution(
        method=run.method.name,
        geodetic=recording.geodetic,
        **track._asdict(),
        point=point,
        imus=len(recording.rig.imus),
        imu_names=tuple(run.bank.members[i].imu.name for i in lanes),
        imu_error_time=outputs.log_time,
        imu_errors=log[:, 0, :, :12],
        imu_error_std=log[:, 1, :, :12],
        measurements=outcome.innovations_of(rows, outcome.speed_wheels(run.choice, recording.rig)),
        comparisons=outcome.comparisons_of(rows, lanes),
        offsets=offsets_of(run, lanes),
        mounting=log[:, 0, :, 12:15] if recording.rig.has_wheels else None,
        mounting_std=log[:, 1, :, 12:15] if recording.rig.has_wheels else None,
        start={"time_s": run.start.time, **run.start.sources},
        filter_s=filter_s,
        first_call_s=first_call_s,
        status=status_of(track, aided, recording.options.gnss_snap),
        recording_span=_span(recording),
        heights=recording.heights,
        utc_of_zero=recording.utc_of_zero,
        findings=(
            *notes(recording.warnings),
            *recording.findings,
            *aligned.findings,
            *(
                silences(run.method, run.choice, recording, aligned, recording.gnss is not None)
                if recording.rig.has_wheels
                else ()
            ),
        ),
    )


def _span(recording: Recording) -> tuple[float, float] | None:
    stamps = [stream.time[[0, -1]] for stream in recording.imus if stream.time.size]
    return (float(np.min(stamps)), float(np.max(stamps))) if stamps else None


def offsets_of(run: Prepared, lanes: list[int]) -> dict[str, OffsetEstimate]:
    """Return what was estimated of the sensors' offsets and scales, by the state's name."""
    found = {}
    for sensor in run.recording.rig.sensors:
        if sensor.offset_std > 0.0:
            name = layout.offset_of(sensor)
            log = run.outputs.log[:, :, place(name) - NAVIGATION][:, :, lanes]
            found[name] = OffsetEstimate(log[:, 0].mean(axis=1), log[:, 1].mean(axis=1))
    return found


def silences(row: Method, choice: Choice, recording: Recording, aligned: Aligned, fixes: bool) -> tuple[Finding, ...]:
    """Return which IMUs of a choice were silent for how long and what became of it; `fixes`: whether there is GNSS."""
    found: list[Finding] = []
    if not fixes and not row.joined and len(choice.blocks) > 1:
        every = stretches(np.asarray(aligned.missing.all(axis=1)))
        gaps = [restart.Pause(float(aligned.time[max(k - 1, 0)]), float(aligned.time[end - 1])) for k, end in every]
        found += restart.coasted(gaps)
    for i, imu in enumerate(recording.rig.imus):
        for first, end in stretches(aligned.missing[:, i]):
            begin, last = aligned.time[max(first - 1, 0)], aligned.time[end - 1]
            outcome = _outcome(choice, i, aligned, first, end)
            begin, last = float(begin), float(last)
            text = f"IMU {imu.name}: silent for {last - begin:.2f} s from {begin:.2f} s; {outcome}"
            found.append(Finding(SILENT, text, stream=imu.name, from_s=begin, to_s=last, size=last - begin))
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


def stretches(where: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return where something holds: the first of each stretch and the one after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], where.astype(int), [0]])))
    return [(int(first), int(end)) for first, end in zip(edges[::2], edges[1::2], strict=True)]
