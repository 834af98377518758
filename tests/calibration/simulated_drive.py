"""A vehicle with IMUs on rear wheels and body, on roads of known slope: exact mean rates, written down from physics."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from polyins.model.recording import GnssStream, ImuStream, Recording
from polyins.model.rig import Imu, NoiseGrade, Rig, Wheel

GRAVITY = 9.80665
RATE_HZ = 100.0
FINE = 10  # instants per interval
GRADE = NoiseGrade.from_datasheet(
    angle_random_walk_deg_sqrt_h=0.2,
    velocity_random_walk_m_s_sqrt_h=0.2,
    gyro_bias_deg_h=50.0,
    accel_bias_mgal=250.0,
    gyro_scale_ppm=0.0,
    accel_scale_ppm=0.0,
    correlation_time_h=1.0,
)


@dataclass(frozen=True)
class Drive:
    """Speed, yaw rate (to the right) and slope of the middle of the axle, at `FINE` instants per interval."""

    time: np.ndarray
    speed: np.ndarray
    yaw_rate: np.ndarray
    slope: np.ndarray

    @property
    def heading(self) -> np.ndarray:
        return np.cumsum(self.yaw_rate) * (self.time[1] - self.time[0])

    def position(self, right: float) -> np.ndarray:
        """Metres north, east, down of a point beside the middle of the axle."""
        step = self.time[1] - self.time[0]
        along = self.speed * np.cos(self.slope)
        velocity = [along * np.cos(self.heading), along * np.sin(self.heading), -self.speed * np.sin(self.slope)]
        aside = [-np.sin(self.heading) * right, np.cos(self.heading) * right, 0.0 * right * self.heading]
        return np.cumsum(velocity, axis=1).T * step + np.transpose(aside)


def drive(seed: int = 1, seconds: float = 120.0, rest: float = 8.0, slope: float = 0.03) -> Drive:
    """Rest, then hills of speed and turns to both sides whose sizes and times are drawn, then rest."""
    draw = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 1.0 / RATE_HZ / FINE)
    speed, yaw = np.zeros(len(time)), np.zeros(len(time))
    begin = rest
    while begin < seconds - rest - 12.0:
        length = draw.uniform(6.0, 14.0)
        inside = (time > begin) & (time < begin + length)
        speed[inside] += draw.uniform(2.0, 7.0) * np.sin(np.pi * (time[inside] - begin) / length) ** 2
        begin += draw.uniform(0.4, 0.8) * length
    for middle in np.arange(rest + 4.0, seconds - rest - 4.0, 6.0):
        turn = draw.normal(0.0, 0.25) * np.exp(-(((time - middle - draw.uniform(-2.0, 2.0)) / 1.5) ** 2))
        yaw += turn * np.minimum(speed, 1.0)
    return Drive(time, speed, yaw, slope * np.sin(2.0 * np.pi * time / seconds))


def wheel_stream(
    trip: Drive, name: str, right: float, radius: float, place: np.ndarray, mount: np.ndarray, bias: np.ndarray
) -> ImuStream:
    """Of a wheel at `right`, m, from the axle's middle, whose IMU is at `place` in the module, m.

    `mount` maps the module's axes to the stream's.
    The frame that does not turn is right, down, forward; the module's x is right and rolling forward turns about -x.
    """
    step = trip.time[1] - trip.time[0]
    speed = trip.speed - trip.yaw_rate * right
    spin = -speed / radius
    angle = np.cumsum(spin) * step
    change = np.gradient(spin, step)
    zero = np.zeros(len(spin))
    rate = np.column_stack([spin, *turned(trip.yaw_rate, zero, angle)])
    ahead = np.gradient(speed, step) + GRAVITY * np.sin(trip.slope)
    force = np.column_stack([speed * trip.yaw_rate, *turned(-GRAVITY * np.cos(trip.slope), ahead, angle)])
    force += np.cross(np.column_stack([change, zero, zero]), place)
    axle = np.column_stack([spin, zero, zero])
    force += np.cross(axle, np.cross(axle, place))
    return averaged(trip, name, rate @ mount.T + bias, force @ mount.T)


def turned(down: np.ndarray, forward: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Components of a vector along the module's y and z, which have turned by `angle` from down and forward."""
    return down * np.cos(angle) + forward * np.sin(angle), forward * np.cos(angle) - down * np.sin(angle)


def body_stream(trip: Drive, name: str, mount: np.ndarray) -> ImuStream:
    """`mount` maps the vehicle's axes (forward, right, down) to the stream's."""
    step = trip.time[1] - trip.time[0]
    zero = np.zeros(len(trip.time))
    ahead = np.gradient(trip.speed, step) + GRAVITY * np.sin(trip.slope)
    force = np.column_stack([ahead, trip.speed * trip.yaw_rate, -GRAVITY * np.cos(trip.slope)])
    return averaged(trip, name, np.column_stack([zero, zero, trip.yaw_rate]) @ mount.T, force @ mount.T)


def averaged(trip: Drive, name: str, rate: np.ndarray, force: np.ndarray) -> ImuStream:
    count = len(trip.time) // FINE
    means = [values[: count * FINE].reshape(count, FINE, 3).mean(axis=1) / RATE_HZ for values in (rate, force)]
    return ImuStream(name, (np.arange(count) + 1) / RATE_HZ, *means)


def fixes(trip: Drive, right: float, rate_hz: float = 5.0) -> GnssStream:
    every = round(RATE_HZ * FINE / rate_hz)
    rows = slice(every - 1, None, every)
    # a running sum holds what happened up to the end of its instant
    position = trip.position(right)[rows] * [1.0, 1.0, -1.0]
    time = trip.time[rows] + trip.time[1] - trip.time[0]
    return GnssStream(time, position, np.full((len(time), 3), 0.01))


def later(stream: ImuStream, seconds: float) -> ImuStream:
    return replace(stream, time=stream.time + seconds)


def wheel_imu(name: str, right: float, rotation: np.ndarray | None = None, steering: bool = False) -> Imu:
    return Imu(
        name,
        GRADE,
        np.eye(3) if rotation is None else rotation,
        np.array([0.0, right, 0.0]),
        wheel=Wheel(0.3, steering=steering),
    )


def recording(imus: list[Imu], streams: list[ImuStream], gnss: GnssStream | None, antenna: float = 0.0) -> Recording:
    return Recording(Rig(tuple(imus), np.array([0.0, antenna, 0.0])), tuple(streams), gnss, geodetic=False)
