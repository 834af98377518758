"""A drivable path on the rotating Earth or on a plane, smooth enough that its rates are exact derivatives.

The velocity points along the body's x axis, so heading is course and pitch is slope, unless the body slips sideways.
Speed, yaw rate, pitch and roll are piecewise polynomials of degree 7 with three continuous derivatives; heading is the
integral of the yaw rate, position the integral of the velocity.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.model.attitude import euler_jacobian, quaternions, rotation_matrices, wrap
from polyins.model.rig import DEG
from polyins.simulation import earth

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

Array = NDArray[np.float64]

START = (30.5278 * DEG, 114.3557 * DEG, 35.0)
"""Wuhan: latitude rad, longitude rad, height m."""

POSITION_STEP = 0.01  # s; the cubic between such nodes is exact to nanometres
PICARD_STEPS = 4  # each shrinks the error by distance over Earth radius
PEAK = 35.0 / 16.0  # of the derivative of the smooth step, over its mean


class Curve(Protocol):
    """A function of time and its derivatives."""

    def __call__(self, time: Array, nu: int = 0) -> Array:
        """Return the `nu`-th derivative at the times."""


class World(Protocol):
    """What a path lies on, vectorized over time: the module `earth`, or a `plane.Plane`."""

    def gravity(self, position: Array) -> Array:
        """Return gravity, m/s^2 downwards, shape (T,)."""

    def gravity_gradient(self, position: Array) -> Array:
        """Return d(gravity vector)/d(displacement), 1/s^2, shape (T, 3, 3)."""

    def earth_rate(self, position: Array) -> Array:
        """Return w_ie in n, rad/s, shape (T, 3)."""

    def transport_rate(self, position: Array, velocity: Array) -> Array:
        """Return w_en in n, rad/s, shape (T, 3)."""

    def displacement(self, position: Array, metres: Array) -> Array:
        """Return the change of the coordinates for small displacements NED, m, shape (T, 3)."""


@dataclass(frozen=True)
class Truth:
    """The true state of one point of the body."""

    time: Array
    """s, shape (T,)"""
    position: Array
    """latitude rad, longitude rad, ellipsoidal height m, or north m, east m, height m, shape (T, 3)"""
    velocity: Array
    """m/s north, east, down, shape (T, 3)"""
    attitude: Array
    """roll, pitch, heading in [-pi, pi), rad, shape (T, 3)"""

    @property
    def quaternion(self) -> Array:
        """q_nb, scalar first, shape (T, 4)."""
        return quaternions(self.attitude)


@dataclass(frozen=True)
class BodyMotion:
    """Position, attitude and rates of the body at some instants."""

    position: Array
    """in the world's coordinates, shape (T, 3)"""
    velocity: Array
    """m/s NED, shape (T, 3)"""
    attitude: Array
    """roll, pitch, heading, rad, shape (T, 3)"""
    C_nb: Array
    """shape (T, 3, 3)"""
    earth_rate: Array
    """w_ie in b, rad/s, shape (T, 3)"""
    angular_rate: Array
    """w_ib in b, rad/s, shape (T, 3)"""


@dataclass(frozen=True)
class Path:
    """A path of the array origin."""

    duration: float
    """s"""
    static: float
    """s: length of the standing start"""
    speed: Curve
    """m/s along the body's x axis"""
    roll: Curve
    """rad"""
    pitch: Curve
    """rad, between -pi/2 and pi/2"""
    heading: Curve
    """rad, continuous"""
    position: Curve
    """in the world's coordinates: (T,) -> (T, 3)"""
    world: World = earth
    """what it lies on"""
    side_speed: Curve | None = None
    """m/s along the body's y axis, where the body slips sideways"""
    warnings: tuple[str, ...] = ()
    """what is doubtful about the data that it was made from"""

    def truth(self, time: ArrayLike, point: ArrayLike = (0.0, 0.0, 0.0)) -> Truth:
        """Return the true state at times, shape (T,), of a point given in the array frame, m, shape (3,).

        The point has its own local level: attitude and velocity are those in the n frame at the point.
        """
        motion, lever_arm = self.motion(np.asarray(time, dtype=float)), np.asarray(point, dtype=float)
        arm = motion.C_nb @ lever_arm
        swing = (motion.C_nb @ np.cross(motion.angular_rate - motion.earth_rate, lever_arm)[..., None])[..., 0]
        # local level turns by 1.6e-7 rad per metre: first order is exact
        turn = self.world.transport_rate(motion.position, arm)
        attitude = motion.attitude - (euler_jacobian(motion.attitude) @ turn[..., None])[..., 0]
        attitude[:, 2] = wrap(attitude[:, 2])
        velocity = motion.velocity + swing
        return Truth(
            time=np.asarray(time, dtype=float),
            position=motion.position + self.world.displacement(motion.position, arm),
            velocity=velocity - np.cross(turn, velocity),
            attitude=attitude,
        )

    def motion(self, time: Array) -> BodyMotion:
        """Return position, velocity, attitude and rates of the array origin at times, shape (T,)."""
        attitude = np.column_stack([self.roll(time), self.pitch(time), self.heading(time)])
        C_nb = np.ascontiguousarray(rotation_matrices(quaternions(attitude)))
        position = self.position(time)
        velocity = _to_level(C_nb, self.body_velocity(time))
        earth_rate = self.world.earth_rate(position)
        level_rate = _to_body(C_nb, earth_rate + self.world.transport_rate(position, velocity))
        angular_rate = level_rate + self._body_rate(time, attitude)
        return BodyMotion(position, velocity, attitude, C_nb, _to_body(C_nb, earth_rate), angular_rate)

    def body_velocity(self, time: Array, nu: int = 0) -> Array:
        """Return the velocity along the body's axes, m/s, or a derivative of it, at times, shape (T, 3)."""
        none = np.zeros_like(time)
        side = none if self.side_speed is None else self.side_speed(time, nu)
        return np.column_stack([self.speed(time, nu), side, none])

    def _body_rate(self, time: Array, attitude: Array) -> Array:
        """Return w_nb in b, rad/s, shape (T, 3), from the derivatives of roll, pitch and heading."""
        roll_rate, pitch_rate, heading_rate = self.roll(time, 1), self.pitch(time, 1), self.heading(time, 1)
        (sr, sp, _), (cr, cp, _) = np.sin(attitude.T), np.cos(attitude.T)
        return np.column_stack(
            [
                roll_rate - heading_rate * sp,
                pitch_rate * cr + heading_rate * sr * cp,
                heading_rate * cr * cp - pitch_rate * sr,
            ]
        )


@dataclass(frozen=True)
class Driving:
    """How a road vehicle is driven, and over which roads."""

    top_speed: float = 16.0
    """m/s"""
    acceleration: float = 2.0
    """m/s^2, at most, along"""
    lateral_acceleration: float = 2.0
    """m/s^2, at most"""
    turn_radius: float = 10.0
    """m, of the tightest turn"""
    slope_std: float = 1.5 * DEG
    steepest: float = 4.0 * DEG
    """rad: no slope is above this"""
    camber_std: float = 0.7 * DEG
    roll_per_acceleration: float = 0.6 * DEG
    """rad per m/s^2 of lateral acceleration: the body leans out of the turn"""


class Profile(NamedTuple):
    """How the body moves and is turned over time."""

    speed: Curve
    """m/s along its x axis"""
    roll: Curve
    """rad"""
    pitch: Curve
    """rad, between -pi/2 and pi/2"""
    heading: Curve
    """rad, continuous"""
    side_speed: Curve | None = None
    """m/s along its y axis, where it slips sideways"""


def path(
    profile: Profile, *, duration: float, static: float = 0.0, start: ArrayLike = START, world: World = earth
) -> Path:
    """Return the path that starts at a position, in the world's coordinates, and moves as its profile says."""
    from scipy.interpolate import CubicSpline

    speed, roll, pitch, heading, side_speed = profile
    time = np.linspace(0.0, duration, int(np.ceil(duration / POSITION_STEP)) + 1)
    p, y = pitch(time), heading(time)
    velocity = speed(time)[:, None] * np.stack([np.cos(p) * np.cos(y), np.cos(p) * np.sin(y), -np.sin(p)], axis=-1)
    if side_speed is not None:
        (sr, sp, sy), (cr, cp, cy) = (f([roll(time), p, y]) for f in (np.sin, np.cos))
        velocity += side_speed(time)[:, None] * np.stack([sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, sr * cp], -1)
    begin = np.asarray(start, dtype=float)
    position = np.broadcast_to(begin, (time.size, 3))
    for _ in range(PICARD_STEPS):
        integral = CubicSpline(time, world.displacement(position, velocity)).antiderivative()
        integral.c[-1] += begin
        position = integral(time)
    return Path(duration, static, speed, roll, pitch, heading, integral, world, side_speed)


def drive(
    duration: float = 1000.0,
    *,
    static: float = 60.0,
    seed: int | np.random.SeedSequence = 0,
    start: ArrayLike = START,
    driving: Driving = Driving(),
    world: World = earth,
) -> Path:
    """Return a drive of a road vehicle: a standing start, then turns, slopes and stops.

    `duration` includes the standing start of length `static`, both in s; `start` is in the world's coordinates, those
    of the Earth being latitude rad, longitude rad, ellipsoidal height m. Another seed gives another drive of the same
    kind.
    """
    rng = np.random.default_rng(seed)
    knots = _plan(duration, static, driving, rng)
    speed, yaw_rate, pitch, roll = (smooth_steps(knots[:, 0], column) for column in knots[:, 1:].T)
    heading = yaw_rate.antiderivative()
    heading.c[-1] += rng.uniform(-np.pi, np.pi)
    return path(Profile(speed, roll, pitch, heading), duration=duration, static=static, start=start, world=world)


def smooth_steps(time: Array, value: Array) -> PPoly:
    """Return the curve through the values that stands still at each knot: three derivatives are zero there."""
    from scipy.interpolate import PPoly

    span, rise = np.diff(time), np.diff(value)
    flat = np.zeros_like(rise)
    shape = [-20.0 * rise / span**7, 70.0 * rise / span**6, -84.0 * rise / span**5, 35.0 * rise / span**4]
    return PPoly(np.stack([*shape, flat, flat, flat, value[:-1]]), time)


def _plan(duration: float, static: float, driving: Driving, rng: np.random.Generator) -> Array:
    """Return knots (time, speed, yaw rate, pitch, roll), shape (K, 5), from time 0 beyond the duration.

    Speed and yaw rate change by the same smooth step, so between knots the curvature stays within that of the knots.
    """
    rest = np.array([0.0, 0.0, 0.0, *_road(driving, rng)])
    knots = [rest]
    if static > 0.0:
        knots.append(_standing(rest, static))
    while knots[-1][0] <= duration:
        for _ in range(rng.integers(5, 14)):
            knots.append(_leg(knots[-1], rng.uniform(0.25, 1.0) * driving.top_speed, driving, rng))
        knots.append(_leg(knots[-1], 0.0, driving, rng))
        knots.append(_standing(knots[-1], rng.uniform(4.0, 15.0)))
    return np.array(knots)


def _standing(knot: Array, length: float) -> Array:
    """Return the knot at the end of a stop."""
    later = knot.copy()
    later[0] += length
    return later


def _leg(last: Array, speed: float, driving: Driving, rng: np.random.Generator) -> Array:
    """Return the next knot of a vehicle that reaches the given speed there."""
    span = max(rng.uniform(4.0, 9.0), PEAK * abs(speed - last[1]) / driving.acceleration)
    turning = rng.uniform(-1.0, 1.0) * (rng.random() < 0.7)
    tightest = min(driving.lateral_acceleration / speed, speed / driving.turn_radius) if speed > 0.0 else 0.0
    yaw_rate = turning * tightest
    pitch, camber = _road(driving, rng)
    lean = driving.roll_per_acceleration * speed * yaw_rate
    return np.array([last[0] + span, speed, yaw_rate, pitch, camber - lean])


def _road(driving: Driving, rng: np.random.Generator) -> tuple[float, float]:
    """Return slope and camber, rad."""
    slope, camber = rng.normal(0.0, (driving.slope_std, driving.camber_std))
    return float(np.clip(slope, -driving.steepest, driving.steepest)), float(camber)


def _to_level(C_nb: Array, vector: Array) -> Array:
    """Return vectors of b, shape (T, 3), in n."""
    return np.asarray(np.einsum("tij,tj->ti", C_nb, vector))


def _to_body(C_nb: Array, vector: Array) -> Array:
    """Return vectors of n, shape (T, 3), in b."""
    return np.asarray(np.einsum("tji,tj->ti", C_nb, vector))
