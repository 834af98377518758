"""A method over a rig from its start, laid out as the arrays that the engine works on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.aiding.kinds import KINDS, number
from polyins.kernels import bank, covariance
from polyins.kernels.bank import LANES
from polyins.model.geodesy import metres_per_unit
from polyins.model.methods import Method
from polyins.model.recording import FilterOptions, Recording
from polyins.model.rig import DEG, AidingSensor, Imu, NoiseGrade, Rig
from polyins.model.states import IMU_ERRORS, NAVIGATION, place, stride_for
from polyins.navigate import receiver, sharing, slip
from polyins.navigate import state as places
from polyins.navigate.choice import Choice
from polyins.navigate.state import Navigators, Plan, State, empty_state, empty_work
from polyins.prepare import alignment, wheels
from polyins.prepare.alignment import Start

Array = NDArray[np.float64]

STILL_RATE = 0.6 * DEG  # rad/s, above what is left of biases and vibration, below a wheel that creeps


@dataclass(frozen=True)
class Member:
    """What stands in one lane: a real IMU, or the virtual one that stands for all."""

    imu: Imu
    index: int
    """of the IMU among those of the recording, whose increments it takes"""
    errors: Array
    """slow errors at the start, (12,)"""
    error_std: Array
    """(12,)"""
    attitude: Array
    """roll, pitch, heading at the start, rad"""


@dataclass(frozen=True)
class Bank:
    """Who stands in which lane."""

    members: tuple[Member, ...]
    """by lane; lanes between two blocks repeat the one before"""
    spans: tuple[tuple[int, int], ...]
    """first lane of each block and the one after its last"""

    @property
    def lanes(self) -> list[int]:
        """The lanes in which someone navigates."""
        return [lane for first, last in self.spans for lane in range(first, last)]

    @property
    def order(self) -> list[int]:
        """Of each lane the index of the IMU whose increments it takes."""
        return [member.index for member in self.members]


def seat(row: Method, choice: Choice, rig: Rig, start: Start) -> Bank:
    """Seat the IMUs of a choice: several of a block begin with a row of their own."""
    if row.bank == "mean":
        return Bank((_virtual(choice, rig, start),), ((0, 1),))
    spans: list[tuple[int, int]] = []
    order: list[int] = []
    crowded = any(len(block) > 1 for block in choice.blocks)
    for block in choice.blocks:
        while crowded and len(order) % LANES:
            order.append(order[-1])
        spans.append((len(order), len(order) + len(block)))
        order += block
    attitudes = start.imu_attitudes
    members = tuple(
        Member(
            rig.imus[i],
            i,
            start.imu_errors[i],
            start.imu_error_std[i],
            start.attitude if attitudes is None else attitudes[i],
        )
        for i in order
    )
    return Bank(members, tuple(spans))


def _virtual(choice: Choice, rig: Rig, start: Start) -> Member:
    """Return the mean of all IMUs at the array origin.

    The papers give it the noise of one: then its gains are those of the other methods.
    """
    taken = list(choice.blocks[0])
    grade = NoiseGrade.typical([rig.imus[i].noise for i in taken])
    std = np.sqrt((start.imu_error_std[taken] ** 2).mean(axis=0))
    return Member(Imu("mean", grade), taken[0], start.imu_errors[taken].mean(axis=0), std, start.attitude)


def lay_out(
    row: Method, choice: Choice, seats: Bank, recording: Recording, start: Start, rates: Array
) -> tuple[Array, Navigators]:
    """Return the array of all that a run remembers, and the navigators at their start, whose parts lie in it.

    `rates`: rates and forces at the start as the IMUs show them, (6, lanes).
    """
    count, rig = len(seats.spans), recording.rig
    joined = row.joined and count > 1
    merged = count > 1 or rig.has_wheels
    stride = stride_for(states_of(recording.rig))
    rows = -(-len(seats.members) // LANES)
    compared = sharing.compares(row, recording.options, choice.blocks)
    memory, state = empty_state(
        rows, count, len(choice.speed), merged=merged, stride=stride, joined=joined, compared=compared
    )
    _fill_lanes(state.rows, seats, recording, start, rates)
    for s, (begin, end) in enumerate(seats.spans):
        _fill_block(state.blocks[s], seats.members[begin:end], recording, choice, start)
    noise = np.array([sharing.noise_of(block) for block in state.blocks[:count]])
    for s, (begin, end) in enumerate(seats.spans):
        of = len(choice.blocks[0]) if row.bank == "mean" else end - begin
        rotation = alignment.rotation_matrix(seats.members[begin].attitude)
        sharing.share_out(state.blocks[s], state.deviations[s] if compared else None, of, recording.options, rotation)
    if joined and row.bank == "all":
        _share_start(state, count, stride)
    plan = _plan(row, choice, seats, recording, rows, stride)._replace(noise=noise)
    if row.bank == "all" and count > 1 and not joined and recording.options.common_share < 1.0:
        plan.settings[places.TOGETHER] = 1.0
        state.blocks[-1] = state.blocks[0]
        sharing.share_out(state.blocks[-1], None, count, recording.options, np.eye(3))
    _fill_scalars(state.scalars, recording, start)
    state.silent[:2] = -1.0
    return memory, Navigators(state, plan, empty_work(count, joined))


def states_of(rig: Rig) -> int:
    """Return how many error states the filters of a rig have: up to the last that is estimated."""
    offsets = [place(offset_of(sensor)) + 1 for sensor in rig.sensors if sensor.offset_std > 0.0]
    return max([place("mount") + 2, *offsets])


def offset_of(sensor: AidingSensor) -> str:
    """Return the name of the state that stands for a sensor's offset or scale."""
    return KINDS[number(sensor.kind)].offset


def _fill_lanes(rows: Array, seats: Bank, recording: Recording, start: Start, rates: Array) -> None:
    """Put members where they are mounted: an array may turn, a vehicle with wheels stands or moves straight on.

    `rates`: as the gyros show them, rad/s, (6, lanes) with forces behind.
    """
    geodetic, c_nv = recording.geodetic, alignment.rotation_matrix(start.attitude)
    metres, earth_rate = metres_per_unit(start.position, geodetic), alignment.earth_rate(start.position, geodetic)
    rows[:, bank.QUATERNION : bank.QUATERNION + LANES] = 1.0
    for i, member in enumerate(seats.members):
        lanes, lane, imu = rows[i // LANES], i % LANES, member.imu
        c = alignment.rotation_matrix(member.attitude)
        to_wheel = np.zeros(3) if imu.wheel is None else imu.wheel.lever_arm
        lever_arm = c_nv @ imu.position - c @ to_wheel
        velocity = start.velocity
        if not recording.rig.has_wheels:
            rate = (rates[:3, i] - member.errors[:3]) / (1.0 + member.errors[6:9])
            velocity = velocity + np.cross(c @ rate - earth_rate, lever_arm)
        bank.put(lanes, bank.POSITION, lane, start.position + lever_arm / metres)
        bank.put(lanes, bank.VELOCITY, lane, velocity)
        bank.put(lanes, bank.QUATERNION, lane, alignment.quaternion(member.attitude))
        bank.put(lanes, bank.ERRORS, lane, member.errors)
        bank.put(lanes, bank.RADIUS, lane, np.array([0.0 if imu.wheel is None else imu.wheel.radius]))
        bank.put(lanes, bank.TO_WHEEL, lane, to_wheel)
        bank.put(lanes, bank.IN_VEHICLE, lane, imu.position)
    for first, last in seats.spans:
        for i in range(first, last):
            lanes, lane = rows[i // LANES], i % LANES
            lanes[bank.WEIGHT + lane] = 1.0 / (last - first)
            if last - first > 1 and seats.members[i].imu.wheel is None:
                bank.put(lanes, bank.TO_POINT, lane, -seats.members[i].imu.position)


def _fill_block(block: Array, members: tuple[Member, ...], recording: Recording, choice: Choice, start: Start) -> None:
    """Give a block the noise of its mean member, and what is known of it at the start."""
    noise = NoiseGrade.typical([member.imu.noise for member in members])
    std = np.zeros(stride_for(states_of(recording.rig)))
    std[:NAVIGATION] = np.concatenate([start.position_std, start.velocity_std, start.attitude_std])
    errors = slice(NAVIGATION, NAVIGATION + IMU_ERRORS)
    std[errors] = np.sqrt(np.mean([member.error_std**2 for member in members], axis=0))
    std[place("speed_scale")], std[place("mount") : place("mount") + 2] = mounting_std(
        members[0].imu, [recording.rig.imus[module[0]] for module in choice.speed]
    )
    for sensor in recording.rig.sensors:
        if sensor.offset_std > 0.0:
            offset = place(offset_of(sensor))
            std[offset] = sensor.offset_std
            block[covariance.ERROR_PSD + offset - NAVIGATION] = sensor.offset_random_walk**2
    for i, one in enumerate(std):
        block[covariance.P + i * (len(std) + 1)] = one**2
    block[covariance.ERROR_PSD : covariance.ERROR_PSD + IMU_ERRORS] = (
        2.0 * noise.steady_std() ** 2 / noise.correlation_time
    )
    block[covariance.DECAY : covariance.DECAY + IMU_ERRORS] = noise.damping()
    block[covariance.FASTEST] = 1.0 / noise.correlation_time
    block[covariance.GYRO_PSD : covariance.GYRO_PSD + 3] = noise.angle_random_walk**2
    block[covariance.ACCEL_PSD : covariance.ACCEL_PSD + 3] = noise.velocity_random_walk**2
    block[covariance.COUNTS] = 1.0
    if len(members) == 1 or members[0].imu.wheel is not None:
        block[covariance.PLACE : covariance.PLACE + 3] = members[0].imu.position


def mounting_std(imu: Imu, speed: list[Imu]) -> tuple[float, float]:
    """Return the initial std of the errors of the mounting of an IMU: of the mean speed, and of its own mount.

    The relative error of the mean speed is that of radii which err independently.
    """
    radii = np.array([one.wheel.radius_std for one in speed if one.wheel])
    own = imu.mount_std if imu.wheel is None else imu.wheel.lever_arm_std
    return float(np.sqrt(np.sum(radii**2)) / len(radii)) if len(radii) else 0.0, own


def _share_start(state: State, count: int, stride: int) -> None:
    """Let joined blocks of an array have their start in common: one GNSS and one levelling gave it."""
    for i in range(NAVIGATION):
        variance = state.blocks[0, covariance.P + i * (stride + 1)]
        for s in range(count):
            for t in range(s + 1, count):
                state.joint[s * stride + i, t * stride + i] = variance


def _fill_scalars(scalars: Array, recording: Recording, start: Start) -> None:
    latitude = start.position[0]
    scalars[places.TIME] = start.time
    scalars[places.REJECTED_AT] = -np.inf
    scalars[places.WINDOW_FILLED] = -1.0
    scalars[places.SLIP_USUAL] = 1.0
    scalars[places.SLIP_COUNT] = slip.SOON
    scalars[places.SLIP_SINCE] = np.inf
    scalars[places.SLIP_TRUSTED] = scalars[places.SLIP_BELIEVED + 1] = -np.inf
    scalars[places.EARTH : places.EARTH + 5] = (
        float(recording.geodetic),
        latitude,
        np.sin(latitude),
        np.cos(latitude),
        recording.options.gravity,
    )
    if start.fix_std is not None:
        receiver.expect(scalars, start.fix_std)


def _plan(row: Method, choice: Choice, seats: Bank, recording: Recording, rows: int, stride: int) -> Plan:
    options: FilterOptions = recording.options
    bodies = [s for s, (first, _) in enumerate(seats.spans) if seats.members[first].imu.wheel is None]
    count = len(seats.spans)
    row_blocks = np.full(rows, -1, dtype=np.int64)
    for s, (first, last) in enumerate(seats.spans):
        if last - first > 1:
            row_blocks[first // LANES : -(-last // LANES)] = s
    rolling = options.rolling
    settings = np.zeros(places.SETTINGS)
    settings[places.VIRTUAL] = row.bank == "mean"
    settings[places.SHARED_MECHANIZATION] = row.shared_mechanization
    settings[places.GATE_LIMIT] = np.inf if options.gate_limit is None else options.gate_limit
    settings[places.SNAP] = options.gnss_snap
    settings[places.LOG_EVERY] = 1
    settings[places.STRIDE] = stride
    settings[places.STILL_RATE] = STILL_RATE
    settings[places.RADIUS] = wheels.mean_radius(recording.rig, choice.speed)
    settings[places.SPEED_AT_END] = rolling.predict == "end"
    taken = [i for block in choice.blocks for i in block]
    settings[places.COMMON_SHARE] = options.common_share
    settings[places.COMPARED_EVERY] = options.relative_interval or 0.0
    settings[places.EXCLUDES] = options.exclusion
    settings[places.HELD : places.HELD + 3] = np.square(sharing.HOLDS)
    settings[places.ADAPTS] = options.own_noise == "auto"
    return Plan(
        noise=np.empty((count, 0)),
        spans=np.array(seats.spans, dtype=np.int64),
        lenders=np.array([bodies[0] if bodies and s not in bodies else -1 for s in range(count)], dtype=np.int64),
        row_blocks=row_blocks,
        speed_variance=np.array(
            [rolling.body_speed_std if s in bodies else rolling.wheel_speed_std for s in range(count)]
        )
        ** 2,
        wheels=np.array([recording.rig.imus[module[0]].position[1] for module in choice.speed]),
        origin=-np.mean([recording.rig.imus[i].position for i in taken], axis=0),
        settings=settings,
    )
