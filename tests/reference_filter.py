"""The array filters once more, in plain dense NumPy: what the compiled engine is compared with.

Written from the equations, for reading. Nothing is structured, shared or saved for speed. n is north-east-down,
b the IMU's body frame, C maps vectors from b to n. Positions are latitude, longitude (rad) and height (m), or on a flat
Earth metres north, metres east and height. Vectors have shape (3,).

Error states, 21: position (m, in n), velocity, phi, gyro bias, accelerometer bias, gyro scale, accelerometer scale:

    r_hat = r + D^-1 dr,   v_hat = v + dv,   C_hat = (I - phi x) C,   bias_hat = bias - db,   scale_hat = scale - ds

The bias and scale states are what is still missing in the estimates: the feedback adds them and subtracts the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.model.rig import NoiseGrade

Array = NDArray[np.float64]

R, V, PHI, BG, BA, SG, SA = (slice(3 * i, 3 * i + 3) for i in range(7))
I3 = np.eye(3)

SECOND_ORDER = 1.0 / 6.0
"""of the rotation within an interval; KF-GINS and Wheel-INS leave it out"""
METHODS = ("single", "imu-fusion", "nav-fusion", "enav-fusion", "enav-fusion-shared-mechanization")


# --- vectors and attitude ---------------------------------------------------------------------------------------------


def cross(a: Array, b: Array) -> Array:
    """a x b."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def skew(a: Array) -> Array:
    """The matrix (a x), so that skew(a) @ b = a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def quaternion_product(p: Array, q: Array) -> Array:
    """p q, scalar first."""
    return np.array([
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    ])  # fmt: skip


def quaternion_of_vector(rotation: Array) -> Array:
    """The quaternion of a rotation vector."""
    angle = np.sqrt(rotation @ rotation)
    sine_over_angle = 0.5 * np.sinc(angle / (2.0 * np.pi))
    return np.array([np.cos(0.5 * angle), *(sine_over_angle * rotation)])


def vector_of_quaternion(q: Array) -> Array:
    """The rotation vector of a quaternion, at most pi long."""
    q = q if q[0] >= 0.0 else -q
    sine = np.linalg.norm(q[1:])
    return 2.0 * q[1:] if sine == 0.0 else 2.0 * np.arctan2(sine, q[0]) / sine * q[1:]


def matrix_of_quaternion(q: Array) -> Array:
    """C of a unit quaternion."""
    w, x, y, z = q
    return np.array([
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ])  # fmt: skip


def quaternion_of_euler(roll: float, pitch: float, yaw: float) -> Array:
    """q of C = C3(yaw) C2(pitch) C1(roll), radians."""
    about = [quaternion_of_vector(angle * axis) for angle, axis in zip((roll, pitch, yaw), I3, strict=True)]
    return quaternion_product(about[2], quaternion_product(about[1], about[0]))


def euler_of_matrix(C: Array) -> Array:
    """Roll, pitch, yaw (rad) of C = C3(yaw) C2(pitch) C1(roll)."""
    pitch = np.arctan2(-C[2, 0], np.hypot(C[2, 1], C[2, 2]))
    return np.array([np.arctan2(C[2, 1], C[2, 2]), pitch, np.arctan2(C[1, 0], C[0, 0])])


def mean_quaternion(quaternions: Sequence[Array]) -> Array:
    """The normalized sum; q and -q are the same attitude, so each takes the sign of the first."""
    total = sum(q if q @ quaternions[0] >= 0.0 else -q for q in quaternions)
    return total / np.sqrt(total @ total)


# --- earth ------------------------------------------------------------------------------------------------------------


class Ellipsoid:
    """WGS-84: what navigation needs to know at a position."""

    a = 6378137.0
    e2 = 0.00669437999014
    rate = 7.2921151467e-5

    def radii(self, position: Array) -> tuple[float, float]:
        """Meridian and prime vertical radius, plus the height, m."""
        root = np.sqrt(1.0 - self.e2 * np.sin(position[0]) ** 2)
        return self.a * (1.0 - self.e2) / root**3 + position[2], self.a / root + position[2]

    def metres_per_unit(self, position: Array) -> Array:
        """The diagonal of D: metres north, east, down per radian, radian, metre of height."""
        north, east = self.radii(position)
        return np.array([north, east * np.cos(position[0]), -1.0])

    def gravity(self, position: Array) -> float:
        """Gravity along down, m/s^2."""
        s2, h = np.sin(position[0]) ** 2, position[2]
        series = 1.0 + s2 * (0.0052790414 + s2 * (0.0000232718 + s2 * (0.0000001262 + s2 * 0.0000000007)))
        return 9.7803267715 * series - (3.0877e-6 - 4.3e-9 * s2) * h + 0.72e-12 * h**2

    def earth_rate(self, position: Array) -> Array:
        """w_ie in n, rad/s."""
        return self.rate * np.array([np.cos(position[0]), 0.0, -np.sin(position[0])])

    def transport(self, position: Array) -> Array:
        """T of w_en = T v, rad/m: how n turns when it moves."""
        north, east = self.radii(position)
        tan = np.tan(position[0])
        return np.array([[0.0, 1.0 / east, 0.0], [-1.0 / north, 0.0, 0.0], [0.0, -tan / east, 0.0]])

    def earth_rate_gradient(self, position: Array) -> Array:
        """d w_ie / d r, rad/s per metre: the earth rate depends on the latitude."""
        gradient = np.zeros((3, 3))
        north, _ = self.radii(position)
        gradient[:, 0] = self.rate / north * np.array([-np.sin(position[0]), 0.0, -np.cos(position[0])])
        return gradient

    def transport_gradient(self, position: Array, velocity: Array) -> Array:
        """d (T v) / d r, rad/s per metre, radii of curvature taken as constant."""
        north, east = self.radii(position)
        tan, cos = np.tan(position[0]), np.cos(position[0])
        gradient = np.zeros((3, 3))
        gradient[2, 0] = -velocity[1] / (east * north * cos**2)
        gradient[:, 2] = velocity[1] / east**2, -velocity[0] / north**2, -velocity[1] * tan / east**2
        return gradient

    def gravity_gradient(self, position: Array) -> float:
        """d g / d (metres down), 1/s^2."""
        north, east = self.radii(position)
        h = position[2]
        return 2.0 * self.gravity(position) / (np.sqrt((north - h) * (east - h)) + h)


@dataclass
class FlatEarth:
    """A local tangent plane that does not turn; constant gravity."""

    g: float = 9.80665

    def metres_per_unit(self, position: Array) -> Array:
        return np.array([1.0, 1.0, -1.0])

    def gravity(self, position: Array) -> float:
        return self.g

    def earth_rate(self, position: Array) -> Array:
        return np.zeros(3)

    def transport(self, position: Array) -> Array:
        return np.zeros((3, 3))

    def earth_rate_gradient(self, position: Array) -> Array:
        return np.zeros((3, 3))

    def transport_gradient(self, position: Array, velocity: Array) -> Array:
        return np.zeros((3, 3))

    def gravity_gradient(self, position: Array) -> float:
        return 0.0


Earth = Ellipsoid | FlatEarth


# --- navigation state and mechanization -------------------------------------------------------------------------------


@dataclass(frozen=True)
class State:
    """Where one navigator is, and the twelve errors it ascribes to its IMU (bg, ba, sg, sa)."""

    position: Array
    velocity: Array
    quaternion: Array
    errors: Array = field(default_factory=lambda: np.zeros(12))

    @property
    def C(self) -> Array:  # noqa: N802
        return matrix_of_quaternion(self.quaternion)


@dataclass(frozen=True)
class Increment:
    """What an IMU gathers over an interval: angle (rad), velocity (m/s), length (s)."""

    dtheta: Array
    dvel: Array
    dt: float

    @property
    def rate(self) -> Array:
        return self.dtheta / self.dt

    @property
    def force(self) -> Array:
        return self.dvel / self.dt


def compensate(raw: Increment, errors: Array) -> Increment:
    """(increment - bias dt) / (1 + scale)."""
    bg, ba, sg, sa = errors.reshape(4, 3)
    return Increment((raw.dtheta - bg * raw.dt) / (1.0 + sg), (raw.dvel - ba * raw.dt) / (1.0 + sa), raw.dt)


def coning_factor(previous: float, current: float, rescale: bool) -> float:
    """The weight of dtheta_prev x dtheta, for an angular rate that is linear in time over both intervals.

    With w = w0 + w1 t the coning integral over the current interval T2 is w0 x w1 T2^3 / 12 and the product of the
    increments w0 x w1 T1 T2 (T1 + T2) / 2. Their ratio is 1/12 for equal intervals, which is what is used always when
    `rescale` is False.
    """
    return current**2 / (6.0 * previous * (previous + current)) if rescale else 1.0 / 12.0


def velocity_change(earth: Earth, position: Array, velocity: Array, dvel_n: Array, dt: float) -> Array:
    """The change of v over dt: specific force, n turning below it, gravity, Coriolis; rates at the given point."""
    w_ie = earth.earth_rate(position)
    w_en = earth.transport(position) @ velocity
    gravity = np.array([0.0, 0.0, earth.gravity(position)])
    force = dvel_n - cross(0.5 * dt * (w_ie + w_en), dvel_n)
    return force + (gravity - cross(2.0 * w_ie + w_en, velocity)) * dt


def mechanize(earth: Earth, own: State, previous: Increment, current: Increment, rescale_coning: bool) -> State:
    """Advance `own` by one interval: velocity, position, attitude.

    Rates, gravity and Coriolis are taken at the middle of the interval, reached by half a step with those of its start.
    """
    dt = current.dt
    factor = coning_factor(previous.dt, dt, rescale_coning)
    first = cross(current.dtheta, current.dvel)
    rotation = 0.5 * first + SECOND_ORDER * cross(current.dtheta, first)
    sculling = factor * (cross(previous.dtheta, current.dvel) + cross(previous.dvel, current.dtheta))
    coning = factor * cross(previous.dtheta, current.dtheta)
    dvel_n = own.C @ (current.dvel + rotation + sculling)

    half_change = 0.5 * velocity_change(earth, own.position, own.velocity, dvel_n, dt)
    mid_velocity = own.velocity + half_change
    mid_position = own.position + 0.5 * dt * mid_velocity / earth.metres_per_unit(own.position)

    velocity = own.velocity + velocity_change(earth, mid_position, mid_velocity, dvel_n, dt)
    mean_velocity = 0.5 * (own.velocity + velocity)
    position = own.position + dt * mean_velocity / earth.metres_per_unit(mid_position)

    w_in = earth.earth_rate(mid_position) + earth.transport(mid_position) @ mid_velocity
    turned = quaternion_product(own.quaternion, quaternion_of_vector(current.dtheta + coning))
    quaternion = quaternion_product(quaternion_of_vector(-w_in * dt), turned)
    return State(position, velocity, quaternion / np.sqrt(quaternion @ quaternion), own.errors)


# --- error model and covariance ---------------------------------------------------------------------------------------


def error_dynamics(earth: Earth, state: State, rate: Array, force: Array, correlation_time: float) -> Array:
    """F of dx' = F dx, shape (21, 21).

    Perturb the equations of motion. The frame n at the estimated position is turned by T dr against n at the true one:

        dr'  = dv - w_en x dr + (T dr) x v
        dv'  = (C f) x phi + C df - (2 w_ie + w_en) x dv - (2 dw_ie + dw_en) x v + dg
        phi' = -w_in x phi + dw_in - C dw
        dw_ie = A dr,   dw_en = B dr + T dv,   dw = db_g + w ds_g,   df = db_a + f ds_a
    """
    C, v = state.C, state.velocity
    w_ie = earth.earth_rate(state.position)
    T = earth.transport(state.position)
    w_en = T @ v
    A = earth.earth_rate_gradient(state.position)
    B = earth.transport_gradient(state.position, v)
    v_cross = skew(v)

    F = np.zeros((21, 21))
    F[R, R] = -skew(w_en) - v_cross @ T
    F[R, V] = I3
    F[V, R] = v_cross @ (2.0 * A + B)
    F[5, 2] += earth.gravity_gradient(state.position)
    F[V, V] = v_cross @ T - skew(2.0 * w_ie + w_en)
    F[V, PHI] = skew(C @ force)
    F[V, BA] = C
    F[V, SA] = C * force
    F[PHI, R] = A + B
    F[PHI, V] = T
    F[PHI, PHI] = -skew(w_ie + w_en)
    F[PHI, BG] = -C
    F[PHI, SG] = -C * rate
    F[9:, 9:] = -np.eye(12) / correlation_time
    return F


def noise_density(C: Array, noise: NoiseGrade) -> Array:
    """G Qc G', shape (21, 21): the random walks enter through C, bias and scale are Gauss-Markov processes."""
    G = np.zeros((21, 18))
    G[V, 0:3] = C
    G[PHI, 3:6] = -C
    G[9:, 6:] = np.eye(12)
    std = np.concatenate([noise.gyro_bias_std, noise.accel_bias_std, noise.gyro_scale_std, noise.accel_scale_std])
    Qc = np.concatenate([
        noise.velocity_random_walk**2, noise.angle_random_walk**2, 2.0 * std**2 / noise.correlation_time
    ])  # fmt: skip
    return (G * Qc) @ G.T


def predict(earth: Earth, P: Array, state: State, rate: Array, force: Array, dt: float, noise: NoiseGrade) -> Array:
    """Phi P Phi' + Qd with Phi = I + F dt and Qd = (Phi Q Phi' + Q) / 2, all at the start of the interval."""
    Phi = np.eye(21) + error_dynamics(earth, state, rate, force, noise.correlation_time) * dt
    Q = noise_density(state.C, noise) * dt
    return Phi @ P @ Phi.T + 0.5 * (Phi @ Q @ Phi.T + Q)


def gain(P: Array, H: Array, Rm: Array) -> Array:
    """K = P H' (H P H' + R)^-1."""
    return P @ H.T @ np.linalg.inv(H @ P @ H.T + Rm)


def joseph(P: Array, K: Array, H: Array, Rm: Array) -> Array:
    """(I - K H) P (I - K H)' + K R K', symmetric by construction up to rounding, which is removed."""
    rest = np.eye(len(P)) - K @ H
    P = rest @ P @ rest.T + K @ Rm @ K.T
    return 0.5 * (P + P.T)


def feed_back(earth: Earth, state: State, dx: Array) -> State:
    """Take the estimated errors out of the state."""
    quaternion = quaternion_product(quaternion_of_vector(dx[PHI]), state.quaternion)
    return State(
        state.position - dx[R] / earth.metres_per_unit(state.position),
        state.velocity - dx[V],
        quaternion / np.sqrt(quaternion @ quaternion),
        state.errors + dx[9:],
    )


# --- lever arms and GNSS ----------------------------------------------------------------------------------------------


def move_position(earth: Earth, state: State, arm: Array) -> Array:
    """Position of the point at `arm` (m, in b): r + D^-1 C l."""
    return state.position + state.C @ arm / earth.metres_per_unit(state.position)


def move_velocity(earth: Earth, state: State, rate: Array, arm: Array) -> Array:
    """Velocity of the point at `arm`: v + (C w_ib - w_ie) x (C l)."""
    return state.velocity + cross(state.C @ rate - earth.earth_rate(state.position), state.C @ arm)


@dataclass(frozen=True)
class Fix:
    """One GNSS fix of the antenna: position as in `State`, std in metres north, east, down; velocity in n if there."""

    time: float
    position: Array
    std: Array
    velocity: Array | None = None
    velocity_std: Array | None = None


def position_residual(earth: Earth, state: State, arm: Array, fix: Fix) -> Array:
    """Predicted minus measured antenna position, metres."""
    return earth.metres_per_unit(state.position) * (move_position(earth, state, arm) - fix.position)


def position_design(C: Array, arm: Array) -> Array:
    """H of the position: C_hat l = C l + (C l) x phi."""
    H = np.zeros((3, 21))
    H[:, R] = I3
    H[:, PHI] = skew(C @ arm)
    return H


def velocity_residual(earth: Earth, state: State, rate: Array, arm: Array, fix: Fix) -> Array:
    """Predicted minus measured antenna velocity, m/s."""
    return move_velocity(earth, state, rate, arm) - fix.velocity


def velocity_design(earth: Earth, position: Array, C: Array, rate: Array, arm: Array) -> Array:
    """H of the velocity. With u = C l:

    dz = dv + [(C w) x phi + C dw - A dr] x u + (C w - w_ie) x (u x phi)
    and, by Jacobi's identity, the factor of phi is ((C w) x u) x - (w_ie x)(u x).
    """
    u, w = C @ arm, C @ rate
    H = np.zeros((3, 21))
    H[:, R] = skew(u) @ earth.earth_rate_gradient(position)
    H[:, V] = I3
    H[:, PHI] = skew(cross(w, u)) - skew(earth.earth_rate(position)) @ skew(u)
    H[:, BG] = -skew(u) @ C
    H[:, SG] = -skew(u) @ C * rate
    return H


# --- one covariance per IMU: single and Nav-Fusion --------------------------------------------------------------------


@dataclass
class Bank:
    """N navigators that step side by side, all axes parallel to the array's.

    `positions` (N, 3) and `antenna` (3,) are in the array frame, from its origin. With one IMU there is no array to
    speak of: the fused state is that IMU's own, at its own place.
    """

    earth: Earth
    noise: NoiseGrade
    positions: Array
    antenna: Array
    states: list[State]
    previous: list[Increment]
    """compensated increments of the interval that has just ended"""
    rescale_coning: bool
    covariances: list[Array]
    innovations: list[tuple[float, Array]] = field(default_factory=list)

    def fused(self) -> State:
        """The mean of the states projected to the array origin (mean errors: nobody uses them)."""
        if len(self.states) == 1:
            return self.states[0]
        members = list(zip(self.states, self.previous, self.positions, strict=True))
        return State(
            np.mean([move_position(self.earth, s, -p) for s, _, p in members], axis=0),
            np.mean([move_velocity(self.earth, s, inc.rate, -p) for s, inc, p in members], axis=0),
            mean_quaternion([s.quaternion for s in self.states]),
            np.mean([s.errors for s in self.states], axis=0),
        )

    def mean_rate(self) -> Array:
        return np.mean([increment.rate for increment in self.previous], axis=0)

    def propagate(self, raw: list[Increment]) -> None:
        raise NotImplementedError

    def update(self, fix: Fix) -> None:
        """Position first, fed back; then velocity, if the fix has one."""
        arms = self.antenna - self.positions
        residuals = [position_residual(self.earth, s, arm, fix) for s, arm in zip(self.states, arms, strict=True)]
        self.innovations.append((fix.time, np.array(residuals)))
        self.correct(residuals, self.position_designs(), np.diag(fix.std**2))
        if fix.velocity is not None and fix.velocity_std is not None:
            residuals = [
                velocity_residual(self.earth, s, inc.rate, arm, fix)
                for s, inc, arm in zip(self.states, self.previous, arms, strict=True)
            ]
            self.correct(residuals, self.velocity_designs(), np.diag(fix.velocity_std**2))

    def position_designs(self) -> list[Array]:
        """One H per covariance."""
        raise NotImplementedError

    def velocity_designs(self) -> list[Array]:
        raise NotImplementedError

    def correct(self, residuals: list[Array], designs: list[Array], Rm: Array) -> None:
        """One gain per covariance; each IMU its own residual, times the gain of its covariance."""
        gains = [gain(P, H, Rm) for P, H in zip(self.covariances, designs, strict=True)]
        self.covariances = [joseph(P, K, H, Rm) for P, K, H in zip(self.covariances, gains, designs, strict=True)]
        gain_of_imu = gains if len(gains) == len(self.states) else gains * len(self.states)
        self.states = [
            feed_back(self.earth, s, K @ z) for s, K, z in zip(self.states, gain_of_imu, residuals, strict=True)
        ]


class NavFusion(Bank):
    """N complete filters that know nothing of each other; with N = 1 the single IMU."""

    def propagate(self, raw: list[Increment]) -> None:
        for i, state in enumerate(self.states):
            current = compensate(raw[i], state.errors)
            self.covariances[i] = predict(
                self.earth, self.covariances[i], state, current.rate, current.force, current.dt, self.noise
            )
            self.states[i] = mechanize(self.earth, state, self.previous[i], current, self.rescale_coning)
            self.previous[i] = current

    def position_designs(self) -> list[Array]:
        return [position_design(s.C, self.antenna - p) for s, p in zip(self.states, self.positions, strict=True)]

    def velocity_designs(self) -> list[Array]:
        return [
            velocity_design(self.earth, s.position, s.C, inc.rate, self.antenna - p)
            for s, inc, p in zip(self.states, self.previous, self.positions, strict=True)
        ]


# --- one covariance for all: eNav-Fusion ------------------------------------------------------------------------------


@dataclass
class EnavFusion(Bank):
    """N mechanizations, one covariance and one gain, both from the fused state (paper A, section III-B3)."""

    share_mechanization: bool = False

    def begin_at_fused_state(self, fused: State) -> None:
        """Give all IMUs the fused attitude, and the fused velocity less what each seems to be off from it."""
        seen = [
            move_velocity(self.earth, s, inc.rate, -p)
            for s, inc, p in zip(self.states, self.previous, self.positions, strict=True)
        ]
        self.states = [
            replace(s, velocity=s.velocity + fused.velocity - at_origin, quaternion=fused.quaternion)
            for s, at_origin in zip(self.states, seen, strict=True)
        ]

    def propagate(self, raw: list[Increment]) -> None:
        fused = self.fused()
        if self.share_mechanization and len(self.states) > 1:
            self.begin_at_fused_state(fused)
        current = [compensate(inc, s.errors) for inc, s in zip(raw, self.states, strict=True)]
        rate = np.mean([inc.rate for inc in current], axis=0)
        force = np.mean([inc.force for inc in current], axis=0)
        self.covariances = [predict(self.earth, self.covariances[0], fused, rate, force, raw[0].dt, self.noise)]
        self.states = [
            mechanize(self.earth, s, self.previous[i], current[i], self.rescale_coning)
            for i, s in enumerate(self.states)
        ]
        self.previous = current

    def lever_arm(self) -> Array:
        """From the point of the fused state to the antenna."""
        return self.antenna - self.positions[0] if len(self.states) == 1 else self.antenna

    def position_designs(self) -> list[Array]:
        return [position_design(self.fused().C, self.lever_arm())]

    def velocity_designs(self) -> list[Array]:
        fused = self.fused()
        return [velocity_design(self.earth, fused.position, fused.C, self.mean_rate(), self.lever_arm())]


# --- one virtual IMU: IMU-Fusion --------------------------------------------------------------------------------------


def virtual_imu(time: Array, dtheta: Array, dvel: Array, positions: Array) -> tuple[Array, Array]:
    """The mean of raw increments (T, N, 3), moved to the array origin; two arrays of shape (T, 3).

    With l from the IMU to the origin f_origin = f + w x (w x l) + w' x l (paper A, equation 13, whose minus signs
    belong to the opposite l). All IMUs are taken to turn alike, so the mean arm does for the mean force. The angular
    acceleration is the difference of two neighbouring mean rates over the time between the middles of their intervals;
    the first interval has none.
    """
    arm = -positions.mean(axis=0)
    mean_dtheta, mean_dvel = dtheta.mean(axis=1), dvel.mean(axis=1)
    dt = np.diff(time, prepend=2.0 * time[0] - time[1])
    rate = mean_dtheta / dt[:, None]
    acceleration = np.zeros_like(rate)
    acceleration[1:] = np.diff(rate, axis=0) / (0.5 * (dt[1:] + dt[:-1]))[:, None]
    moved = np.cross(rate, np.cross(rate, arm)) + np.cross(acceleration, arm)
    return mean_dtheta, mean_dvel + moved * dt[:, None]


# --- the timeline -----------------------------------------------------------------------------------------------------


def advance(bank: Bank, now: float, then: float, dtheta: Array, dvel: Array, fixes: list[Fix], snap: float) -> None:
    """Go from one IMU epoch to the next, updating at every fix on the way (taken from the front of `fixes`).

    A fix within `snap` of an epoch, or of the fix before it, is used there as it is; any other one splits the
    increments linearly. What is left after the update is compensated with the new errors.
    """
    while fixes and fixes[0].time < then - snap:
        fix = fixes.pop(0)
        if fix.time - now > snap:
            share = (fix.time - now) / (then - now)
            bank.propagate(increments(share * dtheta, share * dvel, fix.time - now))
            dtheta, dvel, now = dtheta - share * dtheta, dvel - share * dvel, fix.time
        bank.update(fix)
    bank.propagate(increments(dtheta, dvel, then - now))
    while fixes and fixes[0].time <= then + snap:
        bank.update(fixes.pop(0))


def increments(dtheta: Array, dvel: Array, dt: float) -> list[Increment]:
    """One `Increment` per row."""
    return [Increment(*pair, dt) for pair in zip(dtheta, dvel, strict=True)]


def starts(earth: Earth, start: State | Sequence[State], first: list[Increment], positions: Array) -> list[State]:
    """One start state per IMU: as given, or moved from the array origin to each IMU (one IMU: as given)."""
    if not isinstance(start, State):
        return list(start)
    if len(positions) == 1:
        return [start]
    rates = [compensate(raw, start.errors).rate for raw in first]
    return [
        replace(
            start,
            position=move_position(earth, start, arm),
            velocity=move_velocity(earth, start, rate, arm),
        )
        for arm, rate in zip(positions, rates, strict=True)
    ]


def run(
    method: str,
    time: Array,
    dtheta: Array,
    dvel: Array,
    positions: Array,
    antenna: Array,
    gnss: Sequence[Fix],
    start: State | Sequence[State],
    start_std: Array,
    noise: NoiseGrade,
    *,
    earth: Earth | None = None,
    gnss_snap: float = 1e-3,
    rescale_coning: bool = True,
) -> dict[str, Any]:
    """Navigate with one of `METHODS`.

    time (T,) are the ends of the intervals of the raw increments dtheta, dvel (T, N, 3); the start state holds at
    time[0], so the first increment only serves as the previous one of the second (its interval is taken as long as the
    second's). positions (N, 3) and antenna (3,) in the array frame. start: at the array origin, or one per IMU, or with
    one IMU that IMU's. start_std (21,) in the order of the error states. Fixes at or before time[0] are left out.

    IMU-Fusion has one virtual IMU at the array origin, with the noise of one IMU as in the paper.

    Returns time (T,), fused position, velocity (T, 3), quaternion (T, 4); of each navigator imu_position, imu_velocity
    (T, N, 3), imu_quaternion (T, N, 4), errors (T, N, 12); variance (T, M, 21) of the M covariances and the last
    covariance (M, 21, 21); of each fix innovation_time (K,), innovation (K, N, 3), metres.
    """
    earth = earth or Ellipsoid()
    if method == "imu-fusion":
        mean_dtheta, mean_dvel = virtual_imu(time, dtheta, dvel, positions)
        dtheta, dvel, positions = mean_dtheta[:, None], mean_dvel[:, None], np.zeros((1, 3))
        if not isinstance(start, State):
            raise ValueError("imu-fusion starts at the array origin: one state, not one per IMU")
    if method == "single" and dtheta.shape[1] != 1:
        raise ValueError("single takes one IMU")

    first = increments(dtheta[0], dvel[0], time[1] - time[0])
    states = starts(earth, start, first, positions)
    previous = [compensate(raw, s.errors) for raw, s in zip(first, states, strict=True)]
    P = np.diag(start_std**2)
    common = (earth, noise, positions, antenna, states, previous, rescale_coning)
    bank: Bank
    if method.startswith("enav-fusion"):
        bank = EnavFusion(*common, [P], share_mechanization=method == "enav-fusion-shared-mechanization")
    elif method in METHODS:
        bank = NavFusion(*common, [P.copy() for _ in states])
    else:
        raise ValueError(f"method is {method!r}, expected one of {METHODS}")
    return timeline(bank, time, dtheta, dvel, [fix for fix in gnss if fix.time > time[0]], gnss_snap)


def timeline(bank: Bank, time: Array, dtheta: Array, dvel: Array, fixes: list[Fix], snap: float) -> dict[str, Any]:
    """Advance the bank from epoch to epoch and write down what it says."""
    while fixes and fixes[0].time <= time[0] + snap:
        bank.update(fixes.pop(0))
    rows = [snapshot(bank)]
    for k in range(1, len(time)):
        advance(bank, time[k - 1], time[k], dtheta[k], dvel[k], fixes, snap)
        rows.append(snapshot(bank))
    return {
        "time": time,
        **{name: np.array([row[name] for row in rows]) for name in rows[0]},
        "covariance": np.array(bank.covariances),
        "innovation_time": np.array([t for t, _ in bank.innovations]),
        "innovation": np.array([z for _, z in bank.innovations]),
    }


def snapshot(bank: Bank) -> dict[str, Any]:
    """One row of each result."""
    fused = bank.fused()
    return {
        "position": fused.position,
        "velocity": fused.velocity,
        "quaternion": fused.quaternion,
        "imu_position": [s.position for s in bank.states],
        "imu_velocity": [s.velocity for s in bank.states],
        "imu_quaternion": [s.quaternion for s in bank.states],
        "errors": [s.errors for s in bank.states],
        "variance": [np.diag(P) for P in bank.covariances],
    }


def run_single(
    time: Array,
    dtheta: Array,
    dvel: Array,
    lever_arm: Array,
    gnss: Sequence[Fix],
    start: State,
    start_std: Array,
    noise: NoiseGrade,
    **options: Any,
) -> dict[str, Any]:
    """One IMU with increments (T, 3) and its antenna lever arm; the results of `run` without the axis of IMUs."""
    result = run(
        "single", time, dtheta[:, None], dvel[:, None], np.zeros((1, 3)), lever_arm, gnss, start, start_std, noise,
        **options,
    )  # fmt: skip
    return {
        "time": time,
        "position": result["position"],
        "velocity": result["velocity"],
        "quaternion": result["quaternion"],
        "errors": result["errors"][:, 0],
        "variance": result["variance"][:, 0],
        "covariance": result["covariance"][0],
        "innovation_time": result["innovation_time"],
        "innovation": result["innovation"].reshape(-1, 3),
    }
