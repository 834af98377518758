"""Wheel dead reckoning once more, in plain dense NumPy: what the compiled engine is compared with.

Written from the geometry, for reading; earth, attitude, mechanization and error model are those of `reference_filter`.
All IMUs live in one n frame. v is the vehicle frame, forward-right-down from the middle of the rear axle. An IMU on a
wheel has x along the axle to the right; `position` is its wheel's centre in v. An IMU on the body has v's axes, up to
the small rotation m that the filter may estimate: C_v<-b = exp(m x).

Error states, 24 per IMU: the 21 of `reference_filter` and three of the mounting:

    wheel: relative error of the measured speed, lever arm y, lever arm z (m)
    body:  the same, pitch and yaw of the mount (rad)

Slow errors are truth minus estimate, navigation errors estimate minus truth. `..._derivative` is always that of the
estimate by the error states.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from reference_filter import (
    BG,
    I3,
    PHI,
    SG,
    Array,
    Earth,
    Ellipsoid,
    FlatEarth,
    Increment,
    R,
    State,
    V,
    compensate,
    cross,
    error_dynamics,
    feed_back,
    gain,
    joseph,
    mechanize,
    noise_density,
    skew,
)
from scipy.spatial.transform import Rotation

from polyins.model.recording import Recording, RollingOptions
from polyins.model.rig import DEG, Imu

N = 24
SPEED_ERROR = 21
MOUNT = slice(22, 24)
"""lever arm y, z of an IMU on a wheel; pitch, yaw of the mount of one on the body"""
STILL_RATE = 0.6 * DEG
"""rad/s: an IMU that turns less stands"""


@dataclass(frozen=True)
class WheelState(State):
    """A navigator with the three errors of its mounting."""

    mounting: Array = field(default_factory=lambda: np.zeros(3))


# --- geometry ---------------------------------------------------------------------------------------------------------


def heading(direction: Array) -> float:
    """Of a direction in n, seen from above."""
    return float(np.arctan2(direction[1], direction[0]))


def heading_derivative(direction: Array, change: Array) -> float:
    """The change of `heading` with a change of the direction."""
    return float((direction[0] * change[1] - direction[1] * change[0]) / (direction[0] ** 2 + direction[1] ** 2))


def about_down(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def lever_arm(imu: Imu, state: WheelState) -> Array:
    """From the IMU to its wheel's centre, in its axes; on the body none."""
    return np.zeros(3) if imu.wheel is None else imu.wheel.lever_arm + np.array([0.0, *state.mounting[1:]])


def body_matrix(state: WheelState) -> Array:
    """C_n<-v as an IMU on the body has it."""
    return state.C @ np.asarray(Rotation.from_rotvec([0.0, *state.mounting[1:]]).as_matrix()).T


def body_matrix_derivative(state: WheelState) -> Array:
    """Shape (24, 3, 3). C_hat = (I - phi x) C, and m_hat = m - dm."""
    derivative = np.zeros((N, 3, 3))
    for j in range(3):
        derivative[6 + j] = -skew(I3[j]) @ body_matrix(state)
    m = np.array([0.0, *state.mounting[1:]])
    angle = float(np.linalg.norm(m))
    # exp((m + dm) x) = exp(m x) exp((J dm) x)
    jacobian = I3
    if angle > 0.0:
        first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
        jacobian = I3 - first * skew(m) + second * skew(m) @ skew(m)
    for j in (1, 2):
        derivative[21 + j] = state.C @ skew(jacobian[:, j]) @ Rotation.from_rotvec(m).as_matrix().T
    return derivative


def vehicle_matrix(imu: Imu, state: WheelState, lender: WheelState | None) -> Array:
    """C_n<-v as one IMU has it.

    On a wheel: roll and pitch of the body's matrix, turned about down until the axles point alike; without a body the
    vehicle is level.
    """
    if imu.wheel is None:
        return body_matrix(state)
    axle = state.C[:, 0]
    if lender is None:
        return about_down(heading(axle) - 0.5 * np.pi)
    lent = body_matrix(lender)
    return about_down(heading(axle) - heading(lent[:, 1])) @ lent


def vehicle_matrix_derivative(imu: Imu, state: WheelState, lender: WheelState | None) -> tuple[Array, Array]:
    """By the IMU's own errors and by the lender's, shape (24, 3, 3) each."""
    if imu.wheel is None:
        return body_matrix_derivative(state), np.zeros((N, 3, 3))
    own, lent = np.zeros((N, 3, 3)), np.zeros((N, 3, 3))
    matrix, axle = vehicle_matrix(imu, state, lender), state.C[:, 0]
    turning = skew(I3[2]) @ matrix
    for j in range(3):
        own[6 + j] = heading_derivative(axle, -cross(I3[j], axle)) * turning
    if lender is not None:
        body = body_matrix(lender)
        turn = about_down(heading(axle) - heading(body[:, 1]))
        for j, change in enumerate(body_matrix_derivative(lender)):
            lent[j] = turn @ change - heading_derivative(body[:, 1], change[:, 1]) * turning
    return own, lent


# --- measurements: predictions and their derivatives ------------------------------------------------------------------


def speed_arm(imu: Imu, state: WheelState, point: Array) -> Array:
    """From the IMU to the point whose velocity is measured, in its axes.

    `point` (in v) is the middle of the wheels that give speed. Along the axle a wheel's spin moves nothing.
    """
    if imu.wheel is None:
        return np.array([0.0, point[1], point[2]]) - imu.position
    return lever_arm(imu, state) + np.array([point[1] - imu.position[1], 0.0, 0.0])


def rate_over_ground(earth: Earth, state: State, rate: Array) -> Array:
    """w_eb in b."""
    return rate - state.C.T @ earth.earth_rate(state.position)


def point_velocity(
    earth: Earth, imu: Imu, state: WheelState, lender: WheelState | None, rate: Array, point: Array
) -> Array:
    """The velocity of the measured point in v (paper B, equations 5 and 6); rate: compensated."""
    turning = cross(rate_over_ground(earth, state, rate), speed_arm(imu, state, point))
    return vehicle_matrix(imu, state, lender).T @ (state.velocity + state.C @ turning)


def point_velocity_derivative(
    earth: Earth, imu: Imu, state: WheelState, lender: WheelState | None, rate: Array, point: Array
) -> tuple[Array, Array]:
    """By own and the lender's errors, shape (3, 24) each."""
    C, arm = state.C, speed_arm(imu, state, point)
    w = rate_over_ground(earth, state, rate)
    C_v = vehicle_matrix(imu, state, lender)
    velocity = state.velocity + C @ cross(w, arm)
    own = np.zeros((3, N))
    own[:, V] = I3
    own[:, PHI] = skew(C @ cross(w, arm))
    own[:, BG] = -C @ skew(arm)
    own[:, SG] = -C @ skew(arm) * rate
    if imu.wheel is not None:
        own[:, MOUNT] = -(C @ skew(w))[:, 1:]
    d_own, d_lent = vehicle_matrix_derivative(imu, state, lender)
    return C_v.T @ own + (velocity @ d_own).T, (velocity @ d_lent).T


def point_displacement(
    imu: Imu,
    before: WheelState,
    after: WheelState,
    lenders: tuple[WheelState | None, WheelState | None],
    dt: float,
    point: Array,
) -> Array:
    """The way of the measured point over one epoch, in v halfway: the mean of how v is seen before and after."""
    arm = speed_arm(imu, after, point)
    way = 0.5 * (before.velocity + after.velocity) * dt + after.C @ arm - before.C @ arm
    C_v = 0.5 * (vehicle_matrix(imu, before, lenders[0]) + vehicle_matrix(imu, after, lenders[1]))
    return C_v.T @ way


def vehicle_point(earth: Earth, imu: Imu, state: WheelState, lender: WheelState | None, point: Array) -> Array:
    """Position of a point of the vehicle (in v); the reference point is the origin (paper B, equation 7)."""
    arm = state.C @ lever_arm(imu, state) + vehicle_matrix(imu, state, lender) @ (point - imu.position)
    return state.position + arm / earth.metres_per_unit(state.position)


def vehicle_point_derivative(
    imu: Imu, state: WheelState, lender: WheelState | None, point: Array
) -> tuple[Array, Array]:
    """Metres, by own and the lender's errors, shape (3, 24) each."""
    d_own, d_lent = vehicle_matrix_derivative(imu, state, lender)
    own = (d_own @ (point - imu.position)).T
    own[:, R] += I3
    own[:, PHI] += skew(state.C @ lever_arm(imu, state))
    if imu.wheel is not None:
        own[:, MOUNT] -= state.C[:, 1:]
    return own, (d_lent @ (point - imu.position)).T


def velocity_derivative() -> Array:
    """Of the velocity, which is zero at a standstill, shape (3, 24)."""
    H = np.zeros((3, N))
    H[:, V] = I3
    return H


def rate_derivative(rate: Array) -> Array:
    """Of the rate over ground, which is zero as well; how the attitude error turns the earth rate is left out."""
    H = np.zeros((3, N))
    H[:, BG] = I3
    H[:, SG] = np.diag(rate)
    return H


# --- states and covariance --------------------------------------------------------------------------------------------


def remove_errors(earth: Earth, state: WheelState, dx: Array) -> WheelState:
    """The feedback of 24 errors."""
    fed = feed_back(earth, state, dx[:21])
    return WheelState(fed.position, fed.velocity, fed.quaternion, fed.errors, state.mounting + dx[21:])


def transition(earth: Earth, imu: Imu, state: WheelState, current: Increment) -> tuple[Array, Array]:
    """Phi = I + F dt and Q = G Qc G' dt of one IMU; the mounting stays as it is."""
    Phi, Q = np.eye(N), np.zeros((N, N))
    Phi[:21, :21] += error_dynamics(earth, state, current.rate, current.force, imu.noise.correlation_time) * current.dt
    Q[:21, :21] = noise_density(state.C, imu.noise) * current.dt
    return Phi, Q


def block_diagonal(blocks: Sequence[Array]) -> Array:
    size = sum(len(block) for block in blocks)
    out, at = np.zeros((size, size)), 0
    for block in blocks:
        out[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    return out


# --- the filter -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Update:
    """A measurement: residual (3,), design matrix (3, 24) or (3, 24 n), covariance of its noise (3, 3)."""

    residual: Array
    rows: Array
    noise: Array


@dataclass
class WheelFilter:
    """n navigators, each with its own covariance (`joined` False) or all in one of 24 n states."""

    earth: Earth
    imus: list[Imu]
    states: list[WheelState]
    previous: list[Increment]
    covariances: list[Array]
    """n of shape (24, 24), or one of shape (24 n, 24 n)"""
    joined: bool
    point: Array
    """the middle of the wheels that give speed, in v"""
    options: RollingOptions
    one_by_one: bool = False
    """joined: each measurement at the states that the one before has left, instead of all stacked"""
    epochs: deque[tuple[list[WheelState], list[WheelState], float]] = field(default_factory=deque)
    """states before and after each of the last propagations, and its length"""
    turned: deque[Array] = field(default_factory=deque)
    """and the corrected angle increments, shape (n, 3)"""

    @property
    def lender(self) -> int | None:
        """The IMU on the body whose roll and pitch the wheels borrow."""
        bodies = [i for i, imu in enumerate(self.imus) if imu.wheel is None]
        return bodies[0] if bodies else None

    def lender_state(self) -> WheelState | None:
        return None if self.lender is None else self.states[self.lender]

    def propagate(self, raw: list[Increment]) -> None:
        current = [compensate(inc, state.errors) for inc, state in zip(raw, self.states, strict=True)]
        models = [transition(self.earth, *member) for member in zip(self.imus, self.states, current, strict=True)]
        if self.joined:
            models = [(block_diagonal([Phi for Phi, _ in models]), block_diagonal([Q for _, Q in models]))]
        self.covariances = [
            Phi @ P @ Phi.T + 0.5 * (Phi @ Q @ Phi.T + Q) for P, (Phi, Q) in zip(self.covariances, models, strict=True)
        ]
        before, self.states = self.states, [
            self.advance(*member) for member in zip(self.states, self.previous, current, strict=True)
        ]  # fmt: skip
        self.previous = current
        self.epochs.append((before, list(self.states), raw[0].dt))
        self.turned.append(np.array([increment.dtheta for increment in current]))

    def advance(self, state: WheelState, previous: Increment, current: Increment) -> WheelState:
        moved = mechanize(self.earth, state, previous, current, True)
        return WheelState(moved.position, moved.velocity, moved.quaternion, moved.errors, state.mounting)

    def forget(self, length: float) -> None:
        """Keep the epochs of the last `length` seconds, to half an epoch."""
        while self.watched() > length + 0.5 * self.epochs[-1][2]:
            self.epochs.popleft()
            self.turned.popleft()

    def watched(self) -> float:
        """How long the kept epochs are."""
        return sum(dt for _, _, dt in self.epochs)

    def mean_velocity(self, i: int) -> Array:
        """Of the measured point in v over the kept epochs."""
        total = np.zeros(3)
        for before, after, dt in self.epochs:
            lenders = (None, None) if self.lender is None else (before[self.lender], after[self.lender])
            total += point_displacement(self.imus[i], before[i], after[i], lenders, dt, self.point)
        return total / self.watched()

    def axle(self) -> Array:
        """To the right along the rear axle, in n: what the navigators have of it, their mean."""
        members = zip(self.imus, self.states, strict=True)
        return np.mean([vehicle_matrix(*m, self.lender_state())[:, 1] for m in members], axis=0)

    def update_speed(self, speed: float, radius: float) -> None:
        """speed: as the wheels' radii and gyros have it, the mean over the wheels and the window.

        Those gyros measure the earth's rate about the axle as well: `radius` is their wheels' mean.
        """
        speed += radius * self.axle() @ self.earth.earth_rate(self.states[0].position)

        def measure(i: int) -> Update:
            imu, state = self.imus[i], self.states[i]
            geometry = self.earth, imu, state, self.lender_state(), self.previous[i].rate, self.point
            predicted = means[i] if self.options.predict == "window" else point_velocity(*geometry)
            own, lent = point_velocity_derivative(*geometry)
            own[0, SPEED_ERROR] = speed
            std = self.options.body_speed_std if imu.wheel is None else self.options.wheel_speed_std
            residual = predicted - np.array([(1.0 + state.mounting[0]) * speed, 0.0, 0.0])
            return Update(residual, self.rows(i, own, lent), np.diag(std**2))

        means = [self.mean_velocity(i) for i in range(len(self.imus))]
        self.correct(measure, len(self.imus))

    def reference_points(self) -> Array:
        """One a row, as positions."""
        members = zip(self.imus, self.states, strict=True)
        return np.array([vehicle_point(self.earth, *m, self.lender_state(), np.zeros(3)) for m in members])

    def update_reference_point(self) -> None:
        """Apart: each by the mean of all. Joined: neighbours coincide, n - 1 differences."""
        noise = self.options.constraint_std**2 * I3
        target = self.reference_points().mean(axis=0)
        if not self.joined:
            self.correct(lambda i: self.to_point(i, np.zeros(3), target, noise), len(self.imus))
            return

        def difference(i: int) -> Update:
            one, other = (self.to_point(j, np.zeros(3), target, noise) for j in (i + 1, i))
            return Update(one.residual - other.residual, one.rows - other.rows, noise)

        self.correct(difference, len(self.imus) - 1)

    def update_gnss(self, position: Array, std: Array, antenna: Array) -> None:
        """Apart: each by the fix. Joined: their mean by the fix, whose noise is one."""
        noise = np.diag(std**2)
        if not self.joined:
            self.correct(lambda i: self.to_point(i, antenna, position, noise), len(self.imus))
            return

        def mean(_: int) -> Update:
            updates = [self.to_point(i, antenna, position, noise) for i in range(len(self.imus))]
            residual = np.mean([u.residual for u in updates], axis=0)
            return Update(residual, np.mean([u.rows for u in updates], axis=0), noise)

        self.correct(mean, 1)

    def to_point(self, i: int, point: Array, target: Array, noise: Array) -> Update:
        """An external position of a point of the vehicle."""
        imu, state, lender = self.imus[i], self.states[i], self.lender_state()
        off = vehicle_point(self.earth, imu, state, lender, point) - target
        rows = self.rows(i, *vehicle_point_derivative(imu, state, lender, point))
        return Update(self.earth.metres_per_unit(state.position) * off, rows, noise)

    def update_standing(self, velocity_std: float, rate_std: float) -> None:
        """Zero rate, the mean over the kept epochs; then zero velocity."""
        rates = [np.sum(turned, axis=0) / self.watched() for turned in zip(*self.turned, strict=True)]
        none = np.zeros((3, N))

        def zero_velocity(i: int) -> Update:
            return Update(self.states[i].velocity, self.rows(i, velocity_derivative(), none), velocity_std**2 * I3)

        def zero_rate(i: int) -> Update:
            residual = rate_over_ground(self.earth, self.states[i], rates[i])
            return Update(residual, self.rows(i, rate_derivative(self.previous[i].rate), none), rate_std**2 * I3)

        self.correct(zero_rate, len(self.imus))
        self.correct(zero_velocity, len(self.imus))

    def stands(self) -> bool:
        """Whether no IMU has turned on the mean over the kept epochs."""
        turned = np.sum(self.turned, axis=0)
        return bool(np.all(np.linalg.norm(turned, axis=1) <= STILL_RATE * self.watched()))

    def rows(self, i: int, own: Array, lent: Array) -> Array:
        """Of the design matrix: apart (3, 24), joined (3, 24 n) with what the lender's errors do."""
        if not self.joined:
            return own
        H = np.zeros((3, N * len(self.imus)))
        H[:, N * i : N * i + N] = own
        if self.lender is not None and self.lender != i:
            H[:, N * self.lender : N * self.lender + N] = lent
        return H

    def correct(self, measure: Callable[[int], Update], count: int) -> None:
        """No measurement sees what another has taught at the same epoch, unless joined and `one_by_one`."""
        if self.joined and self.one_by_one:
            for i in range(count):
                self.correct_joined([measure(i)])
        elif self.joined:
            self.correct_joined([measure(i) for i in range(count)])
        else:
            for i, u in enumerate([measure(i) for i in range(count)]):
                K = gain(self.covariances[i], u.rows, u.noise)
                self.covariances[i] = joseph(self.covariances[i], K, u.rows, u.noise)
                self.states[i] = remove_errors(self.earth, self.states[i], K @ u.residual)

    def correct_joined(self, updates: list[Update]) -> None:
        """All at once."""
        H, noise = np.vstack([u.rows for u in updates]), block_diagonal([u.noise for u in updates])
        K = gain(self.covariances[0], H, noise)
        self.covariances = [joseph(self.covariances[0], K, H, noise)]
        errors = (K @ np.concatenate([u.residual for u in updates])).reshape(-1, N)
        self.states = [remove_errors(self.earth, s, dx) for s, dx in zip(self.states, errors, strict=True)]

    def headings(self) -> Array:
        """Of the vehicle, as each navigator has it."""
        members = zip(self.imus, self.states, strict=True)
        return np.array([heading(vehicle_matrix(*m, self.lender_state())[:, 0]) for m in members])

    def snapshot(self) -> dict[str, Any]:
        directions = self.headings()
        return {
            "position": self.reference_points().mean(axis=0),
            "heading": np.arctan2(np.sin(directions).sum(), np.cos(directions).sum()),
            "reference_points": self.reference_points(),
            "headings": directions,
            "imu_position": [s.position for s in self.states],
            "imu_velocity": [s.velocity for s in self.states],
            "imu_quaternion": [s.quaternion for s in self.states],
            "errors": [s.errors for s in self.states],
            "mounting": [s.mounting for s in self.states],
            "variance": np.concatenate([np.diag(P) for P in self.covariances]).reshape(-1, N),
        }


# --- the timeline -----------------------------------------------------------------------------------------------------


class MeanSpeed:
    """What the wheels say: -r (w_x - bias at the start), mean over wheels and over the window before an epoch."""

    def __init__(self, recording: Recording, wheels: Sequence[int], spin_bias: Sequence[float]) -> None:
        self.time = recording.imus[wheels[0]].time
        self.interval = float(np.median(np.diff(self.time)))
        self.window = recording.options.rolling.speed_window
        self.way = np.zeros(len(self.time))
        """of the wheels' mean over the interval that ends at each epoch"""
        dt = np.diff(self.time, prepend=2.0 * self.time[0] - self.time[1])
        self.radius = 0.0
        """the wheels' mean"""
        for j, bias in zip(wheels, spin_bias, strict=True):
            wheel = recording.rig.imus[j].wheel
            assert wheel is not None
            self.radius += wheel.radius / len(wheels)
            self.way -= wheel.radius * (recording.imus[j].dtheta[:, 0] - bias * dt) / len(wheels)

    def at(self, k: int) -> float:
        first = k
        while first > 1 and self.time[k] - self.time[first - 1] < self.window - 0.5 * self.interval:
            first -= 1
        return float(self.way[first : k + 1].sum() / (self.time[k] - self.time[first - 1]))


def make_filter(
    recording: Recording,
    indices: Sequence[int],
    wheels: Sequence[int],
    starts: Sequence[WheelState],
    start_std: Array,
    joined: bool,
) -> WheelFilter:
    """The filter at the first epoch, whose increment only serves as the previous one of the second."""
    earth: Earth = Ellipsoid() if recording.geodetic else FlatEarth(recording.options.gravity)
    imus = [recording.rig.imus[i] for i in indices]
    time = recording.imus[indices[0]].time
    first = increments_at(recording, indices, 0, float(time[1] - time[0]))
    blocks = [np.diag(std**2) for std in start_std]
    return WheelFilter(
        earth,
        imus,
        list(starts),
        [compensate(raw, state.errors) for raw, state in zip(first, starts, strict=True)],
        [block_diagonal(blocks)] if joined else blocks,
        joined,
        np.mean([recording.rig.imus[j].position for j in wheels], axis=0),
        recording.options.rolling,
    )


def increments_at(recording: Recording, indices: Sequence[int], k: int, dt: float) -> list[Increment]:
    return [Increment(recording.imus[i].dtheta[k], recording.imus[i].dvel[k], dt) for i in indices]


def run_reference(
    recording: Recording,
    indices: Sequence[int],
    starts: Sequence[WheelState],
    start_std: Array,
    *,
    joined: bool = False,
    one_by_one: bool = False,
    wheels: Sequence[int] | None = None,
    spin_bias: Sequence[float] | None = None,
    standing_std: tuple[float, float] = (0.01, 0.05 * DEG),
    gnss: Sequence[tuple[int, Array, Array]] = (),
) -> dict[str, Any]:
    """Dead reckoning with the IMUs of `indices`, all stamped alike, from given states at the first epoch.

    starts, start_std (n, 24): in the order of `indices`. `wheels` give the speed (None: all of the navigators that
    are on wheels), `spin_bias` their gyro biases about x (None: those of the start states). `gnss` are
    epochs with positions and std of the rig's antenna; `standing_std` are those of zero velocity (m/s) and zero rate
    (rad/s), which take the speed's place where the options look for standstills and no navigator turns.

    Order at an epoch: propagation, GNSS, speed or standstill, reference point.

    Returns per epoch time (T,), position of the reference point and heading, means over the navigators; of each
    navigator reference_points (T, n, 3), headings, imu_position, imu_velocity, imu_quaternion, errors, mounting,
    variance (T, n, 24); and the last covariances.
    """
    wheels = [i for i in indices if recording.rig.imus[i].wheel is not None] if wheels is None else wheels
    if spin_bias is None:
        spin_bias = [starts[list(indices).index(j)].errors[0] for j in wheels]
    filter_ = make_filter(recording, indices, wheels, starts, start_std, joined)
    filter_.one_by_one = one_by_one
    options, speed = recording.options.rolling, MeanSpeed(recording, wheels, spin_bias)
    time = recording.imus[indices[0]].time
    due = {"speed": time[0] + options.speed_interval, "constraint": time[0] + options.constraint_interval}
    fixes = {k: (position, std) for k, position, std in gnss}
    rows = [filter_.snapshot()]
    for k in range(1, len(time)):
        filter_.propagate(increments_at(recording, indices, k, time[k] - time[k - 1]))
        filter_.forget(options.speed_window)
        if k in fixes:
            filter_.update_gnss(*fixes[k], recording.rig.antenna)
        if time[k] >= due["speed"] - 0.5 * speed.interval:
            if options.standstill and filter_.stands():
                filter_.update_standing(*standing_std)
            else:
                filter_.update_speed(speed.at(k), speed.radius)
            due["speed"] = time[k] + options.speed_interval
        if len(indices) > 1 and time[k] >= due["constraint"] - 0.5 * speed.interval:
            filter_.update_reference_point()
            due["constraint"] = time[k] + options.constraint_interval
        rows.append(filter_.snapshot())
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return {"time": time, **columns, "covariances": filter_.covariances}


def with_errors(earth: Earth, truth: WheelState, dx: Array) -> WheelState:
    """The estimate that has these 24 errors; `remove_errors` undoes it to first order."""
    spoiled = remove_errors(earth, truth, -dx)
    return replace(spoiled, position=truth.position + dx[R] / earth.metres_per_unit(truth.position))
