"""Recordings of a small array that is shaken along a known path: every term of the engine has something to do."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import FilterOptions, GnssStream, ImuStream, Recording, Reference, StartOptions
from polyins.model.rig import DEG, Imu, ImuErrors, NoiseGrade, Rig
from polyins.simulation.increments import increments
from polyins.simulation.path import START, Path, Profile, path

Array = NDArray[np.float64]

NOISE = NoiseGrade.from_datasheet(
    angle_random_walk_deg_sqrt_h=(0.2, 0.3, 0.25),
    velocity_random_walk_m_s_sqrt_h=(0.25, 0.2, 0.3),
    gyro_bias_deg_h=(50.0, 60.0, 40.0),
    accel_bias_mgal=(250.0, 200.0, 300.0),
    gyro_scale_ppm=1000.0,
    accel_scale_ppm=800.0,
    correlation_time_h=1.0,
)
ANTENNA = np.array([0.4, -0.6, -0.9])
POSITION_STD, VELOCITY_STD, ATTITUDE_STD = np.full(3, 0.1), np.full(3, 0.05), np.array([0.5, 0.6, 1.0]) * DEG


@dataclass(frozen=True)
class Swing:
    """value + slope t + amplitude sin(frequency t), and its derivatives; t in s."""

    value: float
    slope: float = 0.0
    amplitude: float = 0.0
    frequency: float = 1.0

    def __call__(self, time: Array, nu: int = 0) -> Array:
        wave = self.amplitude * self.frequency**nu * np.sin(self.frequency * time + nu * np.pi / 2.0)
        line = (self.value + self.slope * time, self.slope + 0.0 * time)[nu] if nu < 2 else 0.0
        return np.asarray(line + wave)


def shaken_path(duration: float, *, start: ArrayLike = START, **changes: Any) -> Path:
    """Roll, pitch, heading and speed swing at rates of up to 1 rad/s; each can be replaced."""
    curves = {
        "speed": Swing(12.0, 0.0, 4.0, 0.9),
        "roll": Swing(0.1, 0.0, 0.25, 2.3),
        "pitch": Swing(-0.05, 0.0, 0.2, 3.1),
        "heading": Swing(2.5, 0.3, 0.4, 1.7),
    }
    return path(Profile(**(curves | changes)), duration=duration, start=start)


def scaled(noise: NoiseGrade, factor: float) -> NoiseGrade:
    """All standard deviations times a factor, the correlation time divided by it."""
    names = ("angle_random_walk", "velocity_random_walk", "gyro_bias_std", "accel_bias_std", "gyro_scale_std",
             "accel_scale_std")  # fmt: skip
    changes: dict[str, Any] = {name: factor * getattr(noise, name) for name in names}
    return replace(noise, correlation_time=noise.correlation_time / factor, **changes)


def board(count: int, seed: int, *, equal: bool = False, spread: float = 0.4) -> Rig:
    """IMUs within `spread` m of the origin in each axis, each with noise of its own unless they are equal."""
    rng = np.random.default_rng([seed, 1])
    imus = []
    for i in range(count):
        noise = NOISE if equal else scaled(NOISE, rng.uniform(0.5, 2.0))
        sizes = (noise.gyro_bias_std, noise.accel_bias_std, noise.gyro_scale_std, noise.accel_scale_std)
        errors = ImuErrors(*(0.3 * size * rng.standard_normal(3) for size in sizes))
        imus.append(Imu(f"imu{i + 1}", noise, position=rng.uniform(-spread, spread, 3), initial_errors=errors))
    return Rig(tuple(imus), ANTENNA)


def sensed(truth: Path, rig: Rig, seed: int, rate_hz: float) -> tuple[ImuStream, ...]:
    """What the IMUs put out: exact increments with biases, scale errors and white noise."""
    exact, streams = increments(truth, rate_hz), []
    for i, imu in enumerate(rig.imus):
        rng = np.random.default_rng([seed, 2, i])
        bg, ba, sg, sa = 0.5 * imu.start_std().reshape(4, 3) * rng.standard_normal((4, 3))
        dtheta, dvel = exact.at(imu.position)
        root = np.sqrt(exact.interval)
        dtheta = dtheta * (1.0 + sg) + bg * exact.interval
        dvel = dvel * (1.0 + sa) + ba * exact.interval
        dtheta += imu.noise.angle_random_walk * root * rng.standard_normal(dtheta.shape)
        dvel += imu.noise.velocity_random_walk * root * rng.standard_normal(dvel.shape)
        streams.append(ImuStream(imu.name, exact.time, dtheta, dvel))
    return tuple(streams)


def received(truth: Path, antenna: Array, times: Array, seed: int) -> GnssStream:
    """Fixes of the antenna with 2 cm and 5 cm/s of noise."""
    rng, at = np.random.default_rng([seed, 3]), truth.truth(times, antenna)
    noise = 0.02 * rng.standard_normal((len(times), 3))
    position = at.position + noise / metres_per_unit(at.position[0], True)
    velocity = at.velocity + 0.05 * rng.standard_normal((len(times), 3))
    return GnssStream(times, position, np.full((len(times), 3), 0.02), velocity, np.full((len(times), 3), 0.05))


def start_at(truth: Path, time: float) -> StartOptions:
    """The true state of the array origin, all given."""
    at = truth.truth(np.array([time]))
    return StartOptions(
        time=time,
        position=at.position[0],
        velocity=at.velocity[0],
        roll_pitch=at.attitude[0, :2],
        heading=float(at.attitude[0, 2]),
        position_std=POSITION_STD,
        velocity_std=VELOCITY_STD,
        attitude_std=ATTITUDE_STD,
        estimate_gyro_bias=False,
    )


def shaken_recording(
    count: int,
    duration: float = 6.0,
    *,
    fixes: Array | None = None,
    seed: int = 1,
    rate_hz: float = 200.0,
    equal: bool = False,
    spread: float = 0.4,
    truth: Path | None = None,
    place: Array | None = None,
) -> Recording:
    """An array that is shaken from its start, with GNSS at the times of `fixes`; no velocities, no gate."""
    truth = truth or shaken_path(duration, start=START if place is None else place)
    rig = board(count, seed, equal=equal, spread=spread)
    times = np.arange(0.4, duration, 0.4) if fixes is None else fixes
    gnss = received(truth, rig.antenna, times, seed)
    reference_time = np.arange(1.0, np.floor(duration * 10.0)) / 10.0
    at = truth.truth(reference_time)
    return Recording(
        rig,
        sensed(truth, rig, seed, rate_hz),
        gnss=replace(gnss, velocity=None, velocity_std=None),
        reference=Reference(reference_time, at.position, at.velocity, at.attitude),
        start=start_at(truth, 1.0 / rate_hz),
        options=FilterOptions(gate_limit=None),
    )


def on_a_plane(recording: Recording) -> Recording:
    """The same with positions in metres from the start; what the Earth's rotation adds stays in the increments."""
    origin = recording.start.position
    assert origin is not None
    assert recording.gnss is not None

    def metres(position: Array) -> Array:
        return np.asarray((position - origin) * metres_per_unit(origin, True) * [1.0, 1.0, -1.0])

    return replace(
        recording,
        geodetic=False,
        gnss=replace(recording.gnss, position=metres(recording.gnss.position)),
        start=replace(recording.start, position=np.zeros(3)),
        reference=None,
    )
