"""What is mounted where: IMUs with their noise, rotation and lever arm, and the GNSS antenna.

Everything is SI inside. Datasheet units (deg/h, mGal, ppm, deg/sqrt(h)) appear only in the constructors.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.errors import InputError

Vector = NDArray[np.float64]
"""A float64 array of shape (3,)."""

DEG = np.pi / 180.0
MGAL = 1e-5  # m/s^2
PPM = 1e-6
HOUR = 3600.0
STANDARD_GRAVITY = 9.80665  # m/s^2, the unit g

MAX_LEVER_ARM_M = 100.0
MAX_RADIUS_M = 5.0


def _vector(value: ArrayLike) -> Vector:
    return np.broadcast_to(np.asarray(value, dtype=float), (3,)).copy()


def zero_vector() -> Vector:
    """Return the vector of three zeros."""
    return np.zeros(3)


@dataclass(frozen=True)
class NoiseGrade:
    """The error statistics of one IMU, per axis, SI, shape (3,) each.

    Biases and scale factors are first-order Gauss-Markov processes with the steady-state standard deviations given
    here and one correlation time (paper A, section III-B2). Biases may have a constant besides, which differs from one
    switch-on to the next.
    """

    angle_random_walk: Vector
    """rad/sqrt(s)"""
    velocity_random_walk: Vector
    """m/s/sqrt(s)"""
    gyro_bias_std: Vector
    """rad/s"""
    accel_bias_std: Vector
    """m/s^2"""
    gyro_scale_std: Vector
    """relative"""
    accel_scale_std: Vector
    """relative"""
    correlation_time: float
    """s"""
    gyro_turn_on: Vector = field(default_factory=zero_vector)
    """rad/s, std of the constant in the bias"""
    accel_turn_on: Vector = field(default_factory=zero_vector)
    """m/s^2"""

    def __post_init__(self) -> None:
        for name in ("angle_random_walk", "velocity_random_walk", "gyro_bias_std", "accel_bias_std",
                     "gyro_scale_std", "accel_scale_std", "gyro_turn_on", "accel_turn_on"):  # fmt: skip
            value = getattr(self, name)
            if not np.all(np.isfinite(value)) or np.any(value < 0.0):
                raise InputError(f"noise: {name} is {value}, expected numbers that are not negative")
        if not self.correlation_time > 0.0:
            raise InputError(f"noise: correlation_time is {self.correlation_time}, expected a positive number")

    @classmethod
    def from_datasheet(
        cls,
        *,
        angle_random_walk_deg_sqrt_h: ArrayLike,
        velocity_random_walk_m_s_sqrt_h: ArrayLike,
        gyro_bias_deg_h: ArrayLike,
        accel_bias_mgal: ArrayLike,
        gyro_scale_ppm: ArrayLike,
        accel_scale_ppm: ArrayLike,
        correlation_time_h: float,
        gyro_turn_on_deg_s: ArrayLike = 0.0,
        accel_turn_on_m_s2: ArrayLike = 0.0,
    ) -> NoiseGrade:
        """Build from the units of datasheets; each value is one number or one per axis."""
        return cls(
            angle_random_walk=_vector(angle_random_walk_deg_sqrt_h) * DEG / np.sqrt(HOUR),
            velocity_random_walk=_vector(velocity_random_walk_m_s_sqrt_h) / np.sqrt(HOUR),
            gyro_bias_std=_vector(gyro_bias_deg_h) * DEG / HOUR,
            accel_bias_std=_vector(accel_bias_mgal) * MGAL,
            gyro_scale_std=_vector(gyro_scale_ppm) * PPM,
            accel_scale_std=_vector(accel_scale_ppm) * PPM,
            correlation_time=correlation_time_h * HOUR,
            gyro_turn_on=_vector(gyro_turn_on_deg_s) * DEG,
            accel_turn_on=_vector(accel_turn_on_m_s2),
        )

    def steady_std(self) -> NDArray[np.float64]:
        """Return the standard deviations of the twelve slow errors in the order of the filter's states, (12,)."""
        return np.concatenate([self.gyro_bias_std, self.accel_bias_std, self.gyro_scale_std, self.accel_scale_std])

    def turn_on_std(self) -> NDArray[np.float64]:
        """Return the standard deviations of the constants in them, (12,)."""
        return np.concatenate([self.gyro_turn_on, self.accel_turn_on, np.zeros(6)])

    def slow_std(self) -> ImuErrors:
        """Return what is unknown of them at the start, constants and all."""
        return ImuErrors(*np.split(np.hypot(self.steady_std(), self.turn_on_std()), 4))

    def damping(self) -> NDArray[np.float64]:
        """Return at which rate the twelve slow errors forget what they were, 1/s, (12,).

        A constant of variance c and a drift of variance d with correlation time T stay correlated by
        (c + d exp(-t/T)) / (c + d), which for small t decays at d / (c + d) / T: one Gauss-Markov process of variance
        c + d and that rate is driven by the noise of the drift, 2 d / T, and is as unsure in the long run.
        """
        drift, constant = self.steady_std() ** 2, self.turn_on_std() ** 2
        share = np.where(constant > 0.0, drift / np.maximum(drift + constant, np.finfo(float).tiny), 1.0)
        return share / self.correlation_time

    @classmethod
    def typical(cls, grades: Sequence[NoiseGrade]) -> NoiseGrade:
        """Return the grade that stands for several: the means of what drives and what damps their errors."""
        damping = np.array([1.0 / grade.correlation_time for grade in grades])

        def rms(values: list[Vector], weights: NDArray[np.float64] | None = None) -> Vector:
            return np.asarray(np.sqrt(np.average(np.square(values), axis=0, weights=weights)))

        return cls(
            rms([grade.angle_random_walk for grade in grades]),
            rms([grade.velocity_random_walk for grade in grades]),
            rms([grade.gyro_bias_std for grade in grades], damping),
            rms([grade.accel_bias_std for grade in grades], damping),
            rms([grade.gyro_scale_std for grade in grades], damping),
            rms([grade.accel_scale_std for grade in grades], damping),
            float(1.0 / damping.mean()),
            rms([grade.gyro_turn_on for grade in grades]),
            rms([grade.accel_turn_on for grade in grades]),
        )


@dataclass(frozen=True)
class ImuErrors:
    """What is known of the twelve slow errors of one IMU at the start, in array axes, shape (3,) each."""

    gyro_bias: Vector = field(default_factory=zero_vector)
    """rad/s"""
    accel_bias: Vector = field(default_factory=zero_vector)
    """m/s^2"""
    gyro_scale: Vector = field(default_factory=zero_vector)
    """relative"""
    accel_scale: Vector = field(default_factory=zero_vector)
    """relative"""

    def as_array(self) -> NDArray[np.float64]:
        """Return the twelve errors in the order of the filter's states, shape (12,)."""
        return np.concatenate([self.gyro_bias, self.accel_bias, self.gyro_scale, self.accel_scale])


@dataclass(frozen=True)
class Wheel:
    """The wheel that an IMU turns with. The module's axes: x along the axle to the right, y and z in the wheel."""

    radius: float
    """m: rolling forward, speed = -radius x rate about x, as the gyro shows it less its bias at the start"""
    lever_arm: Vector = field(default_factory=zero_vector)
    """from the IMU to the wheel's centre, m, in the module's axes"""
    steering: bool = False
    """its heading is not the vehicle's: it gives no speed and does not navigate"""
    radius_std: float = 0.0
    """relative; above zero the filter estimates the radius"""
    lever_arm_std: float = 0.0
    """m, of both components in the wheel; above zero the filter estimates them"""

    def __post_init__(self) -> None:
        if not 0.0 < self.radius <= MAX_RADIUS_M:
            raise InputError(f"wheel: radius is {self.radius:g} m; expected more than 0 and at most {MAX_RADIUS_M:g} m")
        check_lever_arm("wheel: lever arm", self.lever_arm)


@dataclass(frozen=True)
class Imu:
    """One IMU: its name, its mount and what is known of its errors.

    On a rig with wheels the array frame is the vehicle frame v, forward-right-down from the middle of the rear axle.
    """

    name: str
    noise: NoiseGrade
    rotation: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    """C_ab, shape (3, 3): maps vectors from the sensor's axes to the array's, on a wheel to the module's. Readers apply
    it."""
    position: Vector = field(default_factory=zero_vector)
    """Where it sits in the array frame, m, from the array origin; on a wheel: where the wheel's centre is."""
    initial_errors: ImuErrors = field(default_factory=ImuErrors)
    initial_std: ImuErrors | None = None
    """How sure `initial_errors` is; None: the noise grade's steady-state values. That of the gyro bias is the chip's
    turn-on bias: a standstill that shows the bias itself takes its place."""
    wheel: Wheel | None = None
    """None: it is fixed to the body"""
    module: str = ""
    """of the board that it shares with other chips at the same place; without one it is a module of its own"""
    mount_std: float = 0.0
    """rad, of pitch and yaw of an IMU on a vehicle's body; above zero the filter estimates them"""

    def __post_init__(self) -> None:
        check_lever_arm(f"IMU {self.name}: position", self.position)
        if not np.allclose(self.rotation @ self.rotation.T, np.eye(3), atol=1e-6) or np.linalg.det(self.rotation) < 0:
            raise InputError(f"IMU {self.name}: the mount is not a rotation; expected right-handed orthogonal axes")

    def start_std(self) -> NDArray[np.float64]:
        """Return the initial standard deviation of the twelve errors, shape (12,)."""
        if self.initial_std is not None:
            return self.initial_std.as_array()
        return self.noise.slow_std().as_array()


@dataclass(frozen=True)
class AidingSensor:
    """A barometer, a compass, an odometer: where it measures, and what the filter estimates of its error."""

    kind: str
    """height, heading or odometer"""
    position: Vector = field(default_factory=zero_vector)
    """the point whose height or velocity it shows, m in the array frame"""
    offset_std: float = 0.0
    """at the start; of a height m, of a heading rad, of an odometer relative; above zero the filter estimates it"""
    offset_random_walk: float = 0.0
    """the same unit per sqrt(s): the larger, the faster the estimate may follow a drift"""

    def __post_init__(self) -> None:
        check_lever_arm(f"{self.kind}: position", self.position)


@dataclass(frozen=True)
class Rig:
    """The array: its IMUs, the GNSS antenna, and what else measures."""

    imus: tuple[Imu, ...]
    antenna: Vector = field(default_factory=zero_vector)
    """Position of the GNSS antenna in the array frame, m."""
    sensors: tuple[AidingSensor, ...] = ()
    """at most one of each kind"""

    def __post_init__(self) -> None:
        check_lever_arm("antenna: position", self.antenna)
        if not self.imus:
            raise InputError("rig: no IMU; expected at least one")
        names = [imu.name for imu in self.imus]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"imus: two IMUs are named {name!r}; expected a name of its own for each")

    @property
    def has_wheels(self) -> bool:
        """Whether there is an IMU on a wheel."""
        return any(imu.wheel is not None for imu in self.imus)

    def sensor(self, kind: str) -> AidingSensor:
        """Return the sensor of a kind, or one at the array origin that has no error beyond its noise."""
        return next((one for one in self.sensors if one.kind == kind), AidingSensor(kind))

    def modules(self) -> dict[str, list[int]]:
        """Return the indices of the IMUs of each module, by the module's name."""
        found: dict[str, list[int]] = {}
        for index, imu in enumerate(self.imus):
            found.setdefault(imu.module or imu.name, []).append(index)
        return found

    def subset(self, indices: Iterable[int]) -> Rig:
        """Return the rig with just the IMUs of those indices."""
        return replace(self, imus=tuple(self.imus[i] for i in indices))


def check_lever_arm(what: str, vector: Vector) -> None:
    """Raise InputError for a lever arm that is not finite or longer than any rig (100 m)."""
    if not np.all(np.isfinite(vector)) or np.linalg.norm(vector) > MAX_LEVER_ARM_M:
        raise InputError(f"{what} is {np.asarray(vector).tolist()} m; expected at most {MAX_LEVER_ARM_M:.0f} m")
