"""A whole recording through the engine: what the method table says, as arrays, and what comes out, as a Solution."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.aiding.rolling import Joint, Rolling
from polyins.errors import InputError
from polyins.kernels import bank, dense, kalman, layout, share
from polyins.kernels.bank import LANES
from polyins.model.geodesy import metres_per_unit
from polyins.model.methods import Method, find_method
from polyins.model.recording import Recording
from polyins.model.rig import Imu, NoiseGrade, Rig
from polyins.model.solution import Innovations, Solution
from polyins.navigate import engine, modules
from polyins.navigate.engine import Inputs, Outputs, Plan, State
from polyins.navigate.modules import Modules
from polyins.prepare import alignment, course, timesync
from polyins.prepare.alignment import Start
from polyins.prepare.timesync import Aligned

Array = NDArray[np.float64]

CHUNK = 4000
"""Epochs between two calls of `progress`."""


@dataclass(frozen=True)
class Member:
    """One navigator of the bank: a real IMU, or the virtual one that stands for all."""

    imu: Imu
    start_errors: Array
    start_error_std: Array
    to_origin: Array
    """m, in array axes"""
    to_antenna: Array


@dataclass(frozen=True)
class Prepared:
    """A run laid out as arrays, ready for `engine.run_epochs`."""

    method: Method
    recording: Recording
    aligned: Aligned
    start: Start
    members: list[Member]
    state: State
    plan: Plan
    inputs: Inputs
    outputs: Outputs
    work: tuple[Array, Array] | None
    """of the dense covariance"""
    origin: Array | None
    """mean vector from the IMUs to the origin of an array, m"""
    modules: Modules | None
    """of a rig with wheels"""
    rolling: Rolling | None
    joined: Joint | None
    loop: Callable[..., None] = engine.run_epochs
    """or its code for these arrays, see `jit.compiled_for`"""

    def advance(self, first: int, last: int) -> None:
        """Take epochs first ... last - 1; the first of a run is 1."""
        self.loop(*self.arguments(first, last))

    def arguments(self, first: int, last: int) -> tuple[Any, ...]:
        """Return what `engine.run_epochs` is called with for these epochs."""
        fixes = self.inputs.fixes if len(self.inputs.fixes) else None
        return (
            self.state,
            self.plan,
            self.inputs,
            self.outputs,
            first,
            last,
            fixes,
            self.work,
            self.origin,
            self.rolling,
            self.joined,
        )


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
    if prepared.rolling is not None:
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
    recording = recording.subset(taken(row, recording.rig, imu))
    aligned = timesync.align(recording.imus, bridge=not row.rolling)
    if row.rolling and course.is_wanted(recording):
        start = _start_on_course(row, recording, aligned)
    else:
        start = alignment.find_start(recording, aligned)
    end = aligned.time[-1] if recording.start.end_time is None else recording.start.end_time
    aligned = aligned.between(start.time, end)
    if len(aligned.time) < 2:
        raise InputError(f"start: at {start.time:.3f} s, with an end at {end:.3f} s; expected an end after the start")
    return lay_out(row, recording, aligned, start, dense_covariance=dense_covariance)


def taken(row: Method, rig: Rig, imu: int = 0) -> list[int]:
    """Return the indices of the IMUs that a method takes, in its order; `single` takes `imu`."""
    if rig.rolling and not row.rolling:
        raise InputError(f"method: {row.name} is for arrays; this rig has wheels: expected one like wheel-ins")
    if row.bank == "one":
        if not 0 <= imu < len(rig.imus):
            raise InputError(f"imu: {imu} is not an index of {len(rig.imus)} IMUs; they count from 0")
        return [imu]
    return modules.choose(row, rig).all if row.rolling else list(range(len(rig.imus)))


def lay_out(
    row: Method,
    recording: Recording,
    aligned: Aligned,
    start: Start,
    *,
    dense_covariance: bool = False,
    end: float | None = None,
) -> Prepared:
    """Lay out the IMUs that a method takes from the epoch at which it starts; the fixes are those of the recording.

    `end`: of an array's run, where `aligned` is but its beginning, s.
    """
    if row.rolling:
        return _lay_out_rolling(row, recording, aligned, start, dense_covariance)
    members = _members(row, recording.rig, start)
    plan, inputs = build_plan(row, recording, aligned), build_inputs(recording, aligned, end)
    return Prepared(
        method=row,
        recording=recording,
        aligned=aligned,
        start=start,
        members=members,
        state=build_state(row, recording, members, start, plan, inputs),
        plan=plan,
        inputs=inputs,
        outputs=build_outputs(len(aligned.time), len(inputs.fix_time), len(members), plan.log_every),
        work=dense.workspace() if dense_covariance else None,
        origin=_mean_to_origin(recording.rig),
        modules=None,
        rolling=None,
        joined=None,
    )


def _start_on_course(row: Method, recording: Recording, aligned: Aligned) -> Start:
    """Find the start of a vehicle whose heading is to come from GNSS."""
    begin = alignment.find_start(course.blind(recording), aligned).time
    found = course.find(recording, begin, lambda blind: run(blind, row.name))
    known = replace(recording.start, heading=found.heading, heading_from="value")
    start = alignment.find_start(replace(recording, start=known), aligned)
    std = start.attitude_std
    if recording.start.attitude_std is None:
        std = np.array([std[0], std[1], found.std])
    return replace(start, attitude_std=std, sources={**start.sources, "heading": found.source})


def _lay_out_rolling(
    row: Method, recording: Recording, aligned: Aligned, start: Start, dense_covariance: bool
) -> Prepared:
    chosen = modules.choose(row, recording.rig)
    spans, order = modules.lanes(chosen)
    imus = recording.rig.imus
    members = [
        Member(imus[i], start.imu_errors[i], start.imu_error_std[i], -imus[i].position, np.zeros(3)) for i in order
    ]
    intervals = np.diff(aligned.time, prepend=2.0 * aligned.time[0] - aligned.time[1])
    found, lacking = modules.completed(chosen, imus, aligned.increments, intervals, aligned.missing, start.imu_errors)
    complete = replace(aligned, increments=found, missing=lacking)
    rolling = modules.rolling(chosen, spans, recording, complete, start.imu_errors[:, :3])
    joined = modules.joined(len(spans)) if row.joined else None
    plan = build_plan(row, recording, aligned)
    inputs = build_inputs(recording, replace(complete, increments=complete.increments[:, :, order]))
    speed = [imus[module[0]] for module in chosen.speed]
    blocks = layout.zeros((len(order) + LANES - 1) // LANES, bank.SIZE)
    blocks[:, bank.QUATERNION : bank.QUATERNION + LANES] = 1.0
    assert start.imu_attitudes is not None
    for lane, i in enumerate(order):
        modules.fill_lane(
            blocks[lane // LANES],
            lane % LANES,
            imus[i],
            start,
            start.imu_attitudes[i],
            start.imu_errors[i],
            recording.geodetic,
        )
    groups = layout.zeros(len(spans) + 1, share.SIZE)
    for g, (first, last) in zip(groups, spans, strict=False):
        g[share.WEIGHTS] = last - first
        for lane in range(first, last):
            blocks[lane // LANES, bank.WEIGHT + lane % LANES] = 1.0
        _fill_share(g, members[first:last], start, recording.rig)
        for k, std in enumerate(modules.mounting_std(members[first].imu, speed)):
            g[share.P + (share.INERTIAL + k) * (share.STRIDE + 1)] = std**2
    state = _state(recording, blocks, groups, spans, start, inputs)
    engine.begin(state, plan, inputs.increments[0], state.clock[1], None, rolling)
    return Prepared(
        method=row,
        recording=recording,
        aligned=aligned,
        start=start,
        members=members,
        state=state,
        plan=plan,
        inputs=inputs,
        outputs=build_outputs(len(aligned.time), len(inputs.fix_time), len(order), plan.log_every, errors=15),
        work=dense.workspace(len(spans) if row.joined else 1) if dense_covariance else None,
        origin=None,
        modules=chosen,
        rolling=rolling,
        joined=joined,
    )


def _members(row: Method, rig: Rig, start: Start) -> list[Member]:
    if row.bank == "mean":
        # the papers give the virtual IMU the noise of one: then its gains are those of the other methods
        virtual = Imu("mean", NoiseGrade.typical([imu.noise for imu in rig.imus]))
        std = np.sqrt((start.imu_error_std**2).mean(axis=0))
        return [Member(virtual, start.imu_errors.mean(axis=0), std, np.zeros(3), rig.antenna)]
    return [
        Member(imu, start.imu_errors[i], start.imu_error_std[i], -imu.position, rig.antenna - imu.position)
        for i, imu in enumerate(rig.imus)
    ]


def build_state(
    row: Method, recording: Recording, members: list[Member], start: Start, plan: Plan, inputs: Inputs
) -> State:
    """Lay out bank and covariance blocks for a method at its start."""
    count = len(members)
    spans = [(0, count)] if row.shares == "all" else [(i, i + 1) for i in range(count)]
    blocks = layout.zeros((count + LANES - 1) // LANES, bank.SIZE)
    blocks[:, bank.QUATERNION : bank.QUATERNION + LANES] = 1.0
    interval = inputs.time[1] - inputs.time[0]
    errors = np.array([member.start_errors for member in members])
    rates = (inputs.increments[0, :3, :count].T / interval - errors[:, :3]) / (1.0 + errors[:, 6:9])
    _fill_lanes(blocks, members, start, rates, recording.geodetic)
    groups = layout.zeros(len(spans) + (len(spans) > 1), share.SIZE)
    groups[-1, share.WEIGHTS] = 1.0
    for g, (first, last) in zip(groups, spans, strict=False):
        g[share.WEIGHTS] = (last - first) / count
        _fill_share(g, members[first:last], start, recording.rig)
    state = _state(recording, blocks, groups, spans, start, inputs)
    engine.begin(state, plan, inputs.increments[0], interval, _mean_to_origin(recording.rig), None)
    return state


def _mean_to_origin(rig: Rig) -> Array:
    return np.asarray(-np.mean([imu.position for imu in rig.imus], axis=0))


def _state(
    recording: Recording, blocks: Array, groups: Array, spans: list[tuple[int, int]], start: Start, inputs: Inputs
) -> State:
    latitude = start.position[0]
    near = np.array(
        [float(recording.geodetic), latitude, np.sin(latitude), np.cos(latitude), recording.options.gravity]
    )
    return State(
        blocks=blocks,
        groups=groups,
        members=np.array(spans, dtype=np.int64),
        measurements=layout.zeros(len(spans), kalman.SIZE),
        near=near,
        before=np.zeros(4),
        clock=np.array([start.time, inputs.time[1] - inputs.time[0]]),
        counters=np.zeros(3, dtype=np.int64),
    )


def _fill_lanes(blocks: Array, members: list[Member], start: Start, rates: Array, geodetic: bool) -> None:
    """Put members where they are mounted, moving as the turning array does: `rates` are their own, rad/s, (N, 3)."""
    c, q = alignment.rotation_matrix(start.attitude), alignment.quaternion(start.attitude)
    metres, earth_rate = metres_per_unit(start.position, geodetic), alignment.earth_rate(start.position, geodetic)
    for i, (member, rate) in enumerate(zip(members, rates, strict=True)):
        w, lane = blocks[i // LANES], i % LANES
        lever_arm = c @ -member.to_origin
        bank.put(w, bank.POSITION, lane, start.position + lever_arm / metres)
        bank.put(w, bank.VELOCITY, lane, start.velocity + np.cross(c @ rate - earth_rate, lever_arm))
        bank.put(w, bank.QUATERNION, lane, q)
        bank.put(w, bank.ERRORS, lane, member.start_errors)
        bank.put(w, bank.TO_ORIGIN, lane, member.to_origin)
        bank.put(w, bank.TO_ANTENNA, lane, member.to_antenna)
        w[bank.WEIGHT + lane] = 1.0 / len(members)


def _fill_share(g: Array, members: list[Member], start: Start, rig: Rig) -> None:
    """Give a share the noise of its mean member."""
    noise = NoiseGrade.typical([member.imu.noise for member in members])
    std = np.sqrt(np.mean([member.start_error_std**2 for member in members], axis=0))
    variances = np.concatenate([start.position_std, start.velocity_std, start.attitude_std, std]) ** 2
    for i, variance in enumerate(variances):
        g[share.P + i * (share.STRIDE + 1)] = variance
    g[share.ERROR_PSD : share.ERROR_PSD + 12] = 2.0 * noise.steady_std() ** 2 / noise.correlation_time
    g[share.DECAY : share.DECAY + 12] = 1.0 / noise.correlation_time
    g[share.FASTEST] = np.max(1.0 / noise.correlation_time)
    g[share.GYRO_PSD : share.GYRO_PSD + 3] = noise.angle_random_walk**2
    g[share.ACCEL_PSD : share.ACCEL_PSD + 3] = noise.velocity_random_walk**2
    g[share.ANTENNA : share.ANTENNA + 3] = members[0].to_antenna if len(members) == 1 else rig.antenna


def build_plan(row: Method, recording: Recording, aligned: Aligned) -> Plan:
    """Return what the engine is told by the method and the options."""
    options = recording.options
    return Plan(
        virtual=row.bank == "mean",
        shared_mechanization=row.shared_mechanization,
        gate_limit=np.inf if options.gate_limit is None else float(options.gate_limit),
        reopen_after=options.gate_reopen_after,
        gnss_snap=options.gnss_snap,
        log_every=max(1, round(aligned.rate_hz)),
    )


def build_inputs(recording: Recording, aligned: Aligned, end: float | None = None) -> Inputs:
    """Return the aligned increments and the fixes that the filter is shown, up to `end` or that of the increments."""
    gnss = recording.gnss
    if gnss is None:
        return Inputs(aligned.time, np.ascontiguousarray(aligned.increments), np.empty(0), np.empty((0, 6)), None)
    shown = (gnss.time > aligned.time[0]) & (gnss.time <= (aligned.time[-1] if end is None else end))
    for begin, end in recording.outages:
        shown &= ~((gnss.time > begin) & (gnss.time < end))
    velocities = None
    if gnss.velocity is not None and gnss.velocity_std is not None and not recording.rig.rolling:
        velocities = np.hstack([gnss.velocity, gnss.velocity_std**2])[shown]
    fixes = np.hstack([gnss.position, gnss.position_std**2])[shown]
    return Inputs(aligned.time, np.ascontiguousarray(aligned.increments), gnss.time[shown], fixes, velocities)


def build_outputs(epochs: int, fixes: int, imus: int, log_every: int, errors: int = 12) -> Outputs:
    """Return empty arrays for what a run writes; `errors` are the slow ones that are logged."""
    log_rows = (epochs - 2) // log_every + 1 if epochs > 1 else 0
    return Outputs(
        states=np.empty((epochs, 10)),
        variances=np.empty((epochs, 12)),
        fix_status=np.zeros(fixes, dtype=np.int8),
        innovations=np.zeros((fixes, 7)),
        log_time=np.empty(log_rows),
        log=np.empty((log_rows, 2, errors, imus)),
    )


def solution_of(run: Prepared, filter_s: float = 0.0, first_call_s: float = 0.0) -> Solution:
    """Return what a run has written, as a solution."""
    recording, aligned, outputs = run.recording, run.aligned, run.outputs
    states, variances = outputs.states[1:], outputs.variances[1:]
    point = recording.rig.imus[0].position if run.method.bank == "one" else np.zeros(3)
    status = outputs.fix_status
    lanes = [i for first, last in run.state.members for i in range(first, last)]
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
        imu_names=tuple(run.members[i].imu.name for i in lanes),
        imu_error_time=outputs.log_time,
        imu_errors=log[:, 0, :, :12],
        imu_error_std=log[:, 1, :, :12],
        innovations=Innovations(
            time=run.inputs.fix_time,
            residual=outputs.innovations[:, 0:3],
            std=np.sqrt(outputs.innovations[:, 3:6]),
            nis=outputs.innovations[:, 6],
            accepted=(status & 3) != engine.REJECTED,
            reopened=(status & 3) == engine.REOPENED,
            velocity_rejected=status >= engine.VELOCITY_REJECTED,
        ),
        mounting=log[:, 0, :, 12:] if run.rolling else None,
        mounting_std=log[:, 1, :, 12:] if run.rolling else None,
        faults=modules.silences(run.modules, recording, aligned) if run.modules else (),
        start={"time_s": run.start.time, **run.start.sources},
        filter_s=filter_s,
        first_call_s=first_call_s,
        warnings=recording.warnings + aligned.warnings + _unused(run),
    )


def _unused(run: Prepared) -> tuple[str, ...]:
    gnss = run.recording.gnss
    if run.rolling is not None and gnss is not None and gnss.velocity is not None:
        return ("gnss: velocities are not used with wheels, which give the speed; positions are",)
    return ()
