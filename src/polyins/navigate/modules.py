"""Which modules of a rig with wheels a method takes, and what the engine is told of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.aiding import rolling as places
from polyins.aiding.rolling import Joint, Rolling
from polyins.errors import InputError
from polyins.kernels import bank, joint, share
from polyins.kernels.bank import LANES
from polyins.model.geodesy import metres_per_unit
from polyins.model.methods import Method
from polyins.model.recording import Recording, RollingOptions
from polyins.model.rig import DEG, Imu, Rig
from polyins.prepare import alignment
from polyins.prepare.alignment import Start
from polyins.prepare.timesync import Aligned

Array = NDArray[np.float64]

ZERO_VELOCITY_STD = 0.01  # m/s
ZERO_RATE_STD = 0.05 * DEG  # rad/s, of the mean over a window; an idling engine shakes more than gyros are noisy
STILL_RATE = 0.6 * DEG  # rad/s, above what is left of biases and vibration, below a wheel that creeps


@dataclass(frozen=True)
class Modules:
    """Indices of IMUs, by module."""

    navigate: tuple[tuple[int, ...], ...]
    """a share each: wheels first"""
    speed: tuple[tuple[int, ...], ...]
    """the modules on wheels that give the speed"""

    @property
    def all(self) -> list[int]:
        """Indices of all IMUs that are needed, those that navigate first."""
        own = [i for module in self.navigate for i in module]
        return own + [i for module in self.speed for i in module if i not in own]


def choose(row: Method, rig: Rig) -> Modules:
    """Choose the modules of a method: those that it names, then in the order of the rig.

    Raises InputError where the rig lacks what the method needs.
    """
    if not rig.rolling:
        raise InputError(f"method: {row.name} needs an IMU on a wheel; expected `wheel` in one of the imus")
    modules = rig.modules()
    members = {name: tuple(indices) for name, indices in modules.items()}
    for name in row.chosen:
        if name not in modules and name not in [imu.name for imu in rig.imus]:
            raise InputError(f"method: {row.name}: {name!r} is no IMU or module; expected one of {', '.join(modules)}")
        for module, indices in modules.items():
            if name != module and name in [rig.imus[i].name for i in indices]:
                members[module] = tuple(i for i in indices if rig.imus[i].name in row.chosen)
    wheels_, bodies = [], []
    for name in sorted(modules, key=lambda name: _rank(name, members[name], row, rig)):
        first = rig.imus[modules[name][0]]
        if first.wheel is None:
            bodies.append(members[name])
        elif not first.wheel.steering or _is_named(name, members[name], row, rig):
            wheels_.append(members[name])
    speed = tuple(wheels_[: row.wheels])
    body = tuple(bodies[: row.bodies])
    _check_enough(row, len(wheels_), len(bodies))
    _check_taken(row, [i for module in (*speed, *body) for i in module], rig)
    return Modules((*speed, *body) if row.wheels_navigate else body, speed)


def _is_named(name: str, indices: tuple[int, ...], row: Method, rig: Rig) -> bool:
    return name in row.chosen or any(rig.imus[i].name in row.chosen for i in indices)


def _rank(name: str, indices: tuple[int, ...], row: Method, rig: Rig) -> int:
    return 0 if _is_named(name, indices, row, rig) else 1


def _check_enough(row: Method, wheels_: int, bodies: int) -> None:
    many = row.wheels > 2
    wanted_wheels, wanted_bodies = (1, 0) if many else (row.wheels, row.bodies)
    if many and wheels_ + bodies < 2:
        raise InputError(f"method: {row.name} needs two modules or more; this rig has {wheels_ + bodies}")
    if wheels_ < wanted_wheels:
        raise InputError(
            f"method: {row.name} needs {wanted_wheels} wheels that do not steer; this rig has {wheels_} with an IMU"
        )
    if bodies < wanted_bodies:
        raise InputError(f"method: {row.name} needs an IMU on the body; expected one without `wheel` among the imus")


def _check_taken(row: Method, taken: list[int], rig: Rig) -> None:
    """Raise InputError for a name that the method has no place for."""
    names = {name for i in taken for name in (rig.imus[i].name, rig.imus[i].module)}
    for word in row.chosen:
        if word not in names:
            wheels_, bodies = ("any" if count > 2 else str(count) for count in (row.wheels, row.bodies))
            raise InputError(
                f"method: {row.name} has no place for {word!r}; "
                f"expected modules on wheels: {wheels_}, on the body: {bodies}"
            )


def available(rig: Rig) -> list[str]:
    """Return the methods with wheels that a rig has the modules for."""
    from polyins.model.methods import METHODS

    names = []
    for row in METHODS.values():
        if row.rolling:
            try:
                choose(row, rig)
            except InputError:
                continue
            names.append(row.name)
    return names


def completed(
    modules: Modules,
    imus: tuple[Imu, ...],
    increments: Array,
    intervals: Array,
    missing: NDArray[np.bool_],
    errors: Array,
) -> tuple[Array, NDArray[np.bool_]]:
    """Give a chip that is silent what the other chips of its module measure, so that the module goes on.

    `increments` is (T, 6, N), `intervals` (T,), `missing` (T, N), `errors`, the slow ones at the start, (N, 12).
    Returns the increments and what is still missing.
    """
    found, lacking = increments.copy(), missing.copy()
    for module in dict.fromkeys((*modules.navigate, *modules.speed)):
        for i in module:
            others = [j for j in module if j != i]
            epochs = np.flatnonzero(missing[:, i] & ~missing[:, others].all(axis=1))
            if len(epochs):
                part = increments[epochs][:, :, others], intervals[epochs, None], ~missing[epochs][:, others]
                found[epochs, :, i] = _from_others(i, others, imus, *part, errors)
                lacking[epochs, i] = False
    return found, lacking


def _from_others(
    i: int,
    others: list[int],
    imus: tuple[Imu, ...],
    increments: Array,
    intervals: Array,
    have: NDArray[np.bool_],
    errors: Array,
) -> Array:
    """Return what chip i would measure, with its own biases and at its own place, shape (K, 6)."""
    weights = have / have.sum(axis=1, keepdims=True)
    found = np.einsum("tkj,tj->tk", increments, weights)
    found -= weights @ (errors[others, :6] - errors[i, :6]) * intervals
    spots = np.array([imu.position if imu.wheel is None else -imu.wheel.lever_arm for imu in imus])
    apart = spots[i] - weights @ spots[others]
    rate = found[:, :3] / intervals - errors[i, :3]
    found[:, 3:] += np.cross(rate, np.cross(rate, apart)) * intervals
    return np.asarray(found)


def usual_method(rig: Rig) -> str:
    """Return the method for a rig unless one is named: the richest up to `triple-ins` with wheels."""
    if not rig.rolling:
        return "enav-fusion" if len(rig.imus) > 1 else "single"
    order = ("triple-ins", "body-wheel-ins", "dual-wheel-ins", "wheel-ins")
    known = available(rig)
    return next(name for name in order if name in known)


def lanes(modules: Modules) -> tuple[list[tuple[int, int]], list[int]]:
    """Return the span of lanes of each share, and which IMU (counted among those that navigate) each lane takes.

    Several chips of a module begin with a block of their own; lanes in between repeat the chip before.
    """
    spans: list[tuple[int, int]] = []
    order: list[int] = []
    number = 0
    crowded = any(len(module) > 1 for module in modules.navigate)
    for module in modules.navigate:
        while crowded and len(order) % LANES:
            order.append(number - 1)
        spans.append((len(order), len(order) + len(module)))
        order += range(number, number + len(module))
        number += len(module)
    return spans, order


def rolling(
    modules: Modules, spans: list[tuple[int, int]], recording: Recording, aligned: Aligned, start_bias: Array
) -> Rolling:
    """Lay out what the engine needs of the wheels, whose modules are those of this recording.

    `start_bias`: gyro biases at the start, rad/s, shape (N, 3).
    """
    options = recording.options.rolling
    here = modules.navigate
    imus = recording.rig.imus
    bodies = [s for s, module in enumerate(here) if imus[module[0]].wheel is None]
    intervals = np.diff(aligned.time, prepend=2.0 * aligned.time[0] - aligned.time[1])
    missing = aligned.missing
    memory = np.zeros(places.MEMORY)
    memory[places.LAST_SPEED] = memory[places.LAST_POINT] = aligned.time[0]
    memory[places.FILLED] = -1.0
    return Rolling(
        lenders=np.array([bodies[0] if bodies and s not in bodies else -1 for s in range(len(here))], dtype=np.int64),
        noise=np.array([options.body_speed_std if s in bodies else options.wheel_speed_std for s in range(len(here))])
        ** 2,
        settings=_settings(options, _mean_radius(modules, recording.rig)),
        antenna=recording.rig.antenna,
        travel=travel(modules, recording.rig, aligned.increments, intervals, missing, start_bias),
        present=present(modules, missing if missing.any() else missing[:0]),
        memory=memory,
        silent=np.full(len(here), -1.0),
        returned=np.full(len(here), -1.0),
        given=np.zeros(places.GIVEN),
    )


def _settings(options: RollingOptions, radius: float) -> Array:
    settings = np.zeros(places.SETTINGS)
    settings[places.SPEED_INTERVAL] = options.speed_interval
    settings[places.SPEED_WINDOW] = options.speed_window
    settings[places.POINT_INTERVAL] = options.constraint_interval
    settings[places.AT_END] = float(options.predict == "end")
    settings[places.STANDSTILL] = float(options.standstill)
    settings[places.POINT_VARIANCE] = options.constraint_std**2
    settings[places.ZERO_VELOCITY_VARIANCE] = ZERO_VELOCITY_STD**2
    settings[places.ZERO_RATE_VARIANCE] = ZERO_RATE_STD**2
    settings[places.STILL_RATE] = STILL_RATE
    settings[places.RADIUS] = radius
    return settings


def _mean_radius(modules: Modules, rig: Rig) -> float:
    wheels = [[rig.imus[i].wheel for i in module] for module in modules.speed]
    return float(np.mean([np.mean([wheel.radius for wheel in module if wheel]) for module in wheels]))


def present(modules: Modules, missing: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return where all IMUs of a share have data, shape (T, shares), from where each lacks them, shape (T, N)."""
    return np.ascontiguousarray(
        np.array([~missing[:, module].any(axis=1) for module in modules.navigate], dtype=np.uint8).T
    )


def travel(
    modules: Modules,
    rig: Rig,
    increments: Array,
    intervals: Array,
    missing: NDArray[np.bool_],
    start_bias: Array,
) -> Array:
    """Return what the wheels rolled in each interval and where the mean of those that speak is, shape (T, 2), m.

    v = -r w_x, with the rate as the gyro shows it less its bias at the start; chips of a module are averaged.
    `increments` is (T, 6, N), `intervals` (T,), `missing` (T, N), `start_bias` (N, 3).
    """
    total, places, count = np.zeros(len(intervals)), np.zeros(len(intervals)), np.zeros(len(intervals))
    for module in modules.speed:
        rolled = np.zeros(len(intervals))
        speaks = np.ones(len(intervals), dtype=bool)
        for i in module:
            wheel = rig.imus[i].wheel
            assert wheel is not None
            rolled -= wheel.radius * (increments[:, 0, i] - start_bias[i, 0] * intervals) / len(module)
            speaks &= ~missing[:, i]
        total += np.where(speaks, rolled, 0.0)
        places += np.where(speaks, rig.imus[module[0]].position[1], 0.0)
        count += speaks
    with np.errstate(invalid="ignore", divide="ignore"):
        lateral = np.where(count > 0, places / count, 0.0)
        return np.ascontiguousarray(np.column_stack([np.where(count > 0, total / count, np.nan), lateral]))


def joined(shares: int) -> Joint:
    """Return the joined covariance of that many shares, empty, and its work arrays."""
    size = shares * share.STATES
    return Joint(
        whole=np.zeros((size, size)),
        h=np.zeros((3, size)),
        hp=np.zeros((3, size)),
        gain=np.zeros((3, size)),
        ah=np.zeros((3, size)),
        rows=np.zeros((shares, 3, size)),
        correction=np.zeros(size),
        z=np.zeros(3),
        work=np.zeros(joint.SIZE),
    )


def fill_lane(w: Array, lane: int, imu: Imu, start: Start, attitude: Array, errors: Array, geodetic: bool) -> None:
    """Put an IMU where it is mounted on the vehicle, which stands or moves straight on.

    `attitude`: roll, pitch, heading of the IMU, rad; `errors`: its twelve slow errors.
    """
    c = alignment.rotation_matrix(attitude)
    to_wheel = np.zeros(3) if imu.wheel is None else imu.wheel.lever_arm
    place = alignment.rotation_matrix(start.attitude) @ imu.position - c @ to_wheel
    bank.put(w, bank.POSITION, lane, start.position + place / metres_per_unit(start.position, geodetic))
    bank.put(w, bank.VELOCITY, lane, start.velocity)
    bank.put(w, bank.QUATERNION, lane, alignment.quaternion(attitude))
    bank.put(w, bank.ERRORS, lane, errors)
    bank.put(w, bank.WHEEL, lane, np.array([0.0 if imu.wheel is None else imu.wheel.radius]))
    bank.put(w, bank.TO_WHEEL, lane, to_wheel)
    bank.put(w, bank.IN_VEHICLE, lane, imu.position)
    beside = np.array([imu.position[1], 0.0, 0.0])
    bank.put(w, bank.TO_SPEED, lane, -imu.position if imu.wheel is None else to_wheel - beside)


def mounting_std(imu: Imu, speed: list[Imu]) -> Array:
    """Return the initial std of the mounting states of an IMU, see `kernels.share`, shape (3,).

    The relative error of the mean speed is that of radii which err independently.
    """
    radii = np.array([one.wheel.radius_std for one in speed if one.wheel])
    own = imu.mount_std if imu.wheel is None else imu.wheel.lever_arm_std
    return np.array([np.sqrt(np.sum(radii**2)) / len(radii), own, own])


def silences(modules: Modules, recording: Recording, aligned: Aligned) -> tuple[str, ...]:
    """Return in words which IMUs were silent for how long, among those of `modules.all`, and what became of them."""
    found = []
    for i, imu in enumerate(recording.rig.imus):
        for first, end in _stretches(aligned.missing[:, i]):
            begin, last = aligned.time[max(first - 1, 0)], aligned.time[end - 1]
            outcome = _outcome(modules, i, aligned, first, end)
            found.append(f"IMU {imu.name}: silent for {last - begin:.2f} s from {begin:.2f} s; {outcome}")
    return tuple(found)


def _outcome(modules: Modules, i: int, aligned: Aligned, first: int, end: int) -> str:
    """Say what a vehicle did while one of its IMUs was silent, in epochs first ... end - 1."""

    def silent(module: tuple[int, ...]) -> NDArray[np.bool_]:
        return np.asarray(aligned.missing[first:end, module].all(axis=1))

    (own,) = {module for module in (*modules.navigate, *modules.speed) if i in module}
    every = np.all([silent(module) for module in modules.navigate], axis=0)
    if not silent(own).any():
        return "its module went on without it"
    if own not in modules.navigate:
        return "the others gave the speed" if len(modules.speed) > 1 else "there was no wheel speed"
    if every.all():
        return "the vehicle coasted"
    if every.any():
        alone = float(np.sum(np.diff(aligned.time, prepend=aligned.time[0])[first:end][every]))
        return f"for {alone:.2f} s of it every IMU was, and the vehicle coasted"
    return "the others carried it along"


def _stretches(where: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], where.astype(int), [0]])))
    return [(int(first), int(end)) for first, end in zip(edges[::2], edges[1::2], strict=True)]
