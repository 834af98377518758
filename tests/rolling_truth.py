"""A rolling vehicle in closed form: what its IMUs go through and what error-free ones on it show.

The vehicle rolls without slipping on a plane that may be tilted, on an earth that does not turn. Distance and heading
are closed functions of time, hence so are attitudes, rates and specific forces; positions and increments are integrals
over them, by Gauss-Legendre quadrature.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from reference_wheels import WheelState
from scipy.spatial.transform import Rotation

from polyins.model.recording import FilterOptions, ImuStream, Recording, RollingOptions
from polyins.model.rig import Imu, NoiseGrade, Rig, Wheel

Array = NDArray[np.float64]

MODULE = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""C_v<-module at wheel angle 0: x along the axle to the right, z down"""

NOISE = NoiseGrade.from_datasheet(
    angle_random_walk_deg_sqrt_h=0.24,
    velocity_random_walk_m_s_sqrt_h=3.0,
    gyro_bias_deg_h=200.0,
    accel_bias_mgal=1000.0,
    gyro_scale_ppm=1500.0,
    accel_scale_ppm=1500.0,
    correlation_time_h=1.0,
)


def on_wheel(
    name: str, y: float, radius: float = 0.1, lever_arm: Sequence[float] = (0.0, 0.0, 0.0), **rest: float
) -> Imu:
    """An IMU on the wheel whose centre is at y."""
    wheel = Wheel(radius, np.array(lever_arm), **rest)
    return Imu(name, NOISE, position=np.array([0.0, y, 0.0]), wheel=wheel)


def on_body(name: str, position: Sequence[float], mount_std: float = 0.0) -> Imu:
    return Imu(name, NOISE, position=np.array(position), mount_std=mount_std)


ROBOT = (
    on_wheel("left", -0.18, 0.097, (0.004, 0.012, -0.009)),
    on_wheel("right", 0.21, 0.095, (-0.006, -0.008, 0.015)),
    on_body("body", (0.15, 0.04, -0.12)),
)


@dataclass(frozen=True)
class RollingTruth:
    """speed = v0 + v1 sin(f t), heading = h0 + h1 t + h2 sin(g t); `tilt` turns the plane's axes into n's."""

    imus: Sequence[Imu] = ROBOT
    v: tuple[float, float, float] = (1.3, 0.4, 0.7)
    h: tuple[float, float, float, float] = (0.4, 0.15, 0.5, 0.8)
    tilt: Array = field(default_factory=lambda: np.eye(3))
    wheel_angles: Sequence[float] = (0.3, 2.0, -1.1, 0.7)
    gravity: float = 9.80665

    def distance(self, t: Array) -> Array:
        v0, v1, f = self.v
        return v0 * t + v1 / f * (1.0 - np.cos(f * t))

    def speed(self, t: Array) -> Array:
        return self.v[0] + self.v[1] * np.sin(self.v[2] * t)

    def acceleration(self, t: Array) -> Array:
        return self.v[1] * self.v[2] * np.cos(self.v[2] * t)

    def headings(self, t: Array) -> tuple[Array, Array, Array]:
        """Heading in the plane and its two derivatives."""
        h0, h1, h2, g = self.h
        return h0 + h1 * t + h2 * np.sin(g * t), h1 + h2 * g * np.cos(g * t), -h2 * g * g * np.sin(g * t)

    def vehicle_attitude(self, t: Array) -> Array:
        """C_n<-v, shape (T, 3, 3)."""
        return self.tilt @ Rotation.from_rotvec(np.outer(self.headings(t)[0], [0.0, 0.0, 1.0])).as_matrix()

    def module_in_vehicle(self, i: int, t: Array) -> Array:
        """C_v<-b, shape (T, 3, 3). A wheel's centre goes forward at speed - yaw rate x y."""
        imu = self.imus[i]
        if imu.wheel is None:
            return np.broadcast_to(np.eye(3), (len(t), 3, 3))
        heading = self.headings(t)[0] - self.headings(np.zeros(1))[0]
        angle = self.wheel_angles[i] - (self.distance(t) - heading * imu.position[1]) / imu.wheel.radius
        return MODULE @ Rotation.from_rotvec(np.outer(angle, [1.0, 0.0, 0.0])).as_matrix()

    def rates(self, i: int, t: Array) -> tuple[Array, Array]:
        """w_nb in b and its derivative, shape (T, 3) each."""
        imu, C = self.imus[i], self.module_in_vehicle(i, t)
        _, yaw_rate, yaw_acceleration = self.headings(t)
        w = C[:, 2, :] * yaw_rate[:, None]
        change = C[:, 2, :] * yaw_acceleration[:, None]
        if imu.wheel is not None:
            x = np.array([1.0, 0.0, 0.0])
            y, r = imu.position[1], imu.wheel.radius
            spin = np.outer(-(self.speed(t) - yaw_rate * y) / r, x)
            change += np.outer(-(self.acceleration(t) - yaw_acceleration * y) / r, x) - np.cross(spin, w)
            w = w + spin
        return w, change

    def specific_force(self, i: int, t: Array) -> Array:
        imu, C = self.imus[i], self.module_in_vehicle(i, t)
        _, yaw_rate, yaw_acceleration = self.headings(t)
        o = np.zeros_like(t)
        turn, turn_change = (np.column_stack([o, o, rate]) for rate in (yaw_rate, yaw_acceleration))
        q = imu.position
        of_vehicle = np.column_stack([self.acceleration(t), self.speed(t) * yaw_rate, o])
        of_vehicle += np.cross(turn_change, q) + np.cross(turn, np.cross(turn, q))
        gravity = np.einsum("kji,j->ki", self.vehicle_attitude(t), [0.0, 0.0, self.gravity])
        force = np.einsum("kji,kj->ki", C, of_vehicle - gravity)
        if imu.wheel is not None:
            w, change = self.rates(i, t)
            force -= np.cross(change, imu.wheel.lever_arm) + np.cross(w, np.cross(w, imu.wheel.lever_arm))
        return force

    def reference_point(self, time: Array) -> Array:
        """North, east, down from where it is at time[0], shape (T, 3)."""

        def velocity(t: Array) -> Array:
            return self.speed(t)[:, None] * self.vehicle_attitude(t)[:, :, 0]

        return np.vstack([np.zeros(3), np.cumsum(integrals(velocity, time), axis=0)])

    def states(self, i: int, time: Array) -> list[WheelState]:
        """What the navigator of IMU i should say at each epoch; height is up."""
        imu, C_v = self.imus[i], self.vehicle_attitude(time)
        C = C_v @ self.module_in_vehicle(i, time)
        arm = np.zeros(3) if imu.wheel is None else imu.wheel.lever_arm
        w, _ = self.rates(i, time)
        yaw_rate = np.column_stack([np.zeros((len(time), 2)), self.headings(time)[1]])
        of_centre = np.column_stack([self.speed(time), np.zeros((len(time), 2))]) + np.cross(yaw_rate, imu.position)
        position = self.reference_point(time) + C_v @ imu.position - C @ arm
        velocity = np.einsum("kij,kj->ki", C_v, of_centre) - np.einsum("kij,kj->ki", C, np.cross(w, arm))
        quaternions = Rotation.from_matrix(C).as_quat(scalar_first=True)
        return [WheelState(p * [1.0, 1.0, -1.0], v, q) for p, v, q in zip(position, velocity, quaternions, strict=True)]

    def stream(self, i: int, time: Array) -> ImuStream:
        """Error-free increments; the first covers an interval as long as the second."""
        edges = np.concatenate([[2.0 * time[0] - time[1]], time])
        dtheta = integrals(lambda t: self.rates(i, t)[0], edges)
        return ImuStream(self.imus[i].name, time, dtheta, integrals(lambda t: self.specific_force(i, t), edges))

    def recording(
        self, time: Array, errors: Array | None = None, rolling: RollingOptions | None = None, seed: int | None = None
    ) -> Recording:
        """With constant errors (n, 12) and, given a seed, the white noise of the grade."""
        streams = [self.stream(i, time) for i in range(len(self.imus))]
        if errors is not None:
            streams = [spoil(stream, e) for stream, e in zip(streams, errors, strict=True)]
        if seed is not None:
            rng = np.random.default_rng(seed)
            streams = [add_noise(stream, NOISE, rng) for stream in streams]
        options = FilterOptions(gravity=self.gravity, rolling=rolling or RollingOptions(standstill=False))
        return Recording(Rig(tuple(self.imus)), tuple(streams), geodetic=False, options=options, name="rolling truth")


def integrals(function, edges: Array) -> Array:  # type: ignore[no-untyped-def]
    """Over each interval between edges, of a function of (T,) that gives (T, 3)."""
    nodes, weights = np.polynomial.legendre.leggauss(6)
    half = 0.5 * np.diff(edges)
    t = (0.5 * (edges[1:] + edges[:-1]))[:, None] + half[:, None] * nodes
    values = function(t.ravel()).reshape(*t.shape, 3)
    return np.asarray(np.einsum("kqa,q->ka", values, weights) * half[:, None])


def spoil(stream: ImuStream, errors: Array) -> ImuStream:
    """raw = true (1 + scale) + bias dt."""
    bg, ba, sg, sa = errors.reshape(4, 3)
    dt = np.diff(stream.time, prepend=2.0 * stream.time[0] - stream.time[1])[:, None]
    return ImuStream(stream.name, stream.time, stream.dtheta * (1.0 + sg) + bg * dt, stream.dvel * (1.0 + sa) + ba * dt)


def add_noise(stream: ImuStream, noise: NoiseGrade, rng: np.random.Generator) -> ImuStream:
    root = np.sqrt(np.median(np.diff(stream.time)))
    shape = stream.dtheta.shape
    return ImuStream(
        stream.name,
        stream.time,
        stream.dtheta + rng.normal(size=shape) * noise.angle_random_walk * root,
        stream.dvel + rng.normal(size=shape) * noise.velocity_random_walk * root,
    )


def tilted(angle: float, direction: float) -> Array:
    """A plane that falls off by an angle in a direction."""
    return np.asarray(Rotation.from_rotvec(angle * np.array([-np.sin(direction), np.cos(direction), 0.0])).as_matrix())
