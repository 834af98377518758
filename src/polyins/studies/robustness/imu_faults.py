"""Faults of one IMU among several, or of half of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from polyins.model.recording import ImuStream, Recording, usual_interval
from polyins.model.rig import DEG
from polyins.studies.robustness.fault import DRAWN, Array, Draw, Fault, Injection, Mask, with_imu, with_rows

Change = Callable[[Array, Mask, float, Draw], None]
"""of rates (rad/s and m/s^2, shape (T, 6)) in place, from an instant on, at an interval (s)"""

GYRO, ACCEL = 0, 3
"""first columns"""
DIFFERS = ("disagreement", "mount", "noise")
LEFT_OUT = ("left out", "silent", "gap")
CLOCK = ("delay", "clock", "disagreement", *LEFT_OUT)


def _rates(change: Change) -> Injection:
    """Make a fault of one IMU of what it does to its rates."""

    def inject(recording: Recording, draw: Draw) -> Recording:
        return _changed(recording, draw, change, draw.imu)

    return inject


def _half(change: Change) -> Injection:
    """Make a fault of the first half of the IMUs of what it does to the rates of each."""

    def inject(recording: Recording, draw: Draw) -> Recording:
        for index in range(len(recording.imus) // 2):
            recording = _changed(recording, draw, change, index)
        return recording

    return inject


def _changed(recording: Recording, draw: Draw, change: Change, index: int) -> Recording:
    stream = recording.imus[index]
    interval = usual_interval(stream.time)
    rates = np.hstack([stream.dtheta, stream.dvel]) / interval
    change(rates, stream.time >= draw.at, interval, draw)
    return with_imu(
        recording, index, ImuStream(stream.name, stream.time, rates[:, :3] * interval, rates[:, 3:] * interval)
    )


def _set(rates: Array, after: Mask, _: float, draw: Draw, *, always: bool, value: float | None) -> None:
    """Give all six the same value, or None: the last one, from an instant on or always."""
    where = np.ones_like(after) if always else after
    rates[where] = rates[np.argmax(where)] if value is None else value


def _stuck(rates: Array, after: Mask, _: float, draw: Draw, *, first: int, value: float | None) -> None:
    """Let one axis stay at a value, or None: the last one."""
    column = first + draw.axis()
    rates[after, column] = rates[np.argmax(after), column] if value is None else value


def _bias(rates: Array, after: Mask, _: float, draw: Draw, *, first: int, sizes: tuple[float, float]) -> None:
    rates[after, first + draw.axis()] += draw.sign() * draw.between(*sizes)


def _noise(rates: Array, after: Mask, _: float, draw: Draw, *, factors: tuple[float, float]) -> None:
    factor = draw.between(*factors)
    for column in range(6):
        # what differs from sample to sample at rest is noise
        own = np.median(np.abs(np.diff(rates[:500, column]))) / 0.954
        rates[after, column] += draw.rng.normal(0.0, factor * own, int(after.sum()))


def _spikes(rates: Array, after: Mask, _: float, draw: Draw) -> None:
    rows = np.flatnonzero(after & (draw.rng.random(len(after)) < 0.005))
    scales = np.array([2000.0 * DEG] * 3 + [16.0 * 9.8] * 3)
    for column in range(6):
        rates[rows, column] = scales[column] * draw.rng.choice([-1.0, 1.0], len(rows))


def _scale(rates: Array, _: Mask, __: float, draw: Draw) -> None:
    rates *= 1.0 + draw.sign() * draw.between(0.02, 0.08)


def _swap(rates: Array, _: Mask, __: float, draw: Draw) -> None:
    a, b = draw.rng.choice(3, 2, replace=False)
    for first in (GYRO, ACCEL):
        rates[:, [first + a, first + b]] = rates[:, [first + b, first + a]]


def _mirror(rates: Array, _: Mask, __: float, ___: Draw, *, columns: tuple[int, ...]) -> None:
    rates[:, columns] *= -1.0


def _burst(rates: Array, after: Mask, interval: float, _: Draw, *, value: float) -> None:
    first = int(np.argmax(after))
    rates[first : first + round(1.0 / interval)] = value


def _saturate(rates: Array, _: Mask, __: float, ___: Draw, *, limit: float) -> None:
    rates[:, :3] = np.clip(rates[:, :3], -limit, limit)


def _one(rates: Array, after: Mask, interval: float, draw: Draw, *, first: int, value: float) -> None:
    """Add to one sample an increment, rad or m/s."""
    rates[int(np.argmax(after)), first + draw.axis()] += value / interval


def _huge(rates: Array, after: Mask, _: float, draw: Draw) -> None:
    rates[after, GYRO + draw.axis()] = 1e30


def _late_samples(rates: Array, _: Mask, __: float, ___: Draw) -> None:
    rates[10:] = rates[:-10].copy()


def _stamps(recording: Recording, draw: Draw, *, change: Callable[[Array, float], Array]) -> Recording:
    """Change the stamps of one IMU: a function of them and of when the fault begins."""
    stream = recording.imus[draw.imu]
    time = change(stream.time.copy(), draw.at)
    return with_imu(recording, draw.imu, ImuStream(stream.name, time, stream.dtheta, stream.dvel))


def _leap(time: Array, at: float, *, step: float) -> Array:
    return np.asarray(np.where(time >= at, time + step, time))


def _offset(time: Array, _: float, *, step: float) -> Array:
    return time + step


def _drift(time: Array, _: float, *, ppm: float) -> Array:
    return np.asarray(time[0] + (time - time[0]) * (1.0 + 1e-6 * ppm))


def _repeated(time: Array, at: float) -> Array:
    row = int(np.argmax(time >= at))
    time[row] = time[row - 1]
    return time


def _without(recording: Recording, draw: Draw, *, length: float) -> Recording:
    time = recording.imus[draw.imu].time
    return with_rows(recording, draw.imu, (time < draw.at) | (time >= draw.at + length))


def _begins_late(recording: Recording, draw: Draw) -> Recording:
    return with_rows(recording, draw.imu, recording.imus[draw.imu].time >= draw.at)


def _imu(name: str, change: Change, kinds: tuple[str, ...] = DIFFERS) -> Fault:
    return Fault(name, "imu", _rates(change), kinds, whose=DRAWN)


def _clock(name: str, change: Callable[[Array, float], Array]) -> Fault:
    return Fault(name, "clock", partial(_stamps, change=change), CLOCK, whose=DRAWN)


ONE = (
    _imu("dead: zeros all along", partial(_set, always=True, value=0.0), LEFT_OUT),
    _imu("dead: zeros", partial(_set, always=False, value=0.0), LEFT_OUT),
    _imu("frozen all along", partial(_set, always=True, value=None), LEFT_OUT),
    _imu("frozen", partial(_set, always=False, value=None), LEFT_OUT),
    _imu("gyro stuck at 0", partial(_stuck, first=GYRO, value=0.0)),
    _imu("gyro stuck at its last value", partial(_stuck, first=GYRO, value=None)),
    _imu("gyro stuck at 2 deg/s", partial(_stuck, first=GYRO, value=2.0 * DEG)),
    _imu("accelerometer stuck at 0", partial(_stuck, first=ACCEL, value=0.0)),
    _imu("gyro bias step, small", partial(_bias, first=GYRO, sizes=(0.05 * DEG, 0.5 * DEG))),
    _imu("gyro bias step, large", partial(_bias, first=GYRO, sizes=(0.5 * DEG, 5.0 * DEG))),
    _imu("accelerometer bias step, small", partial(_bias, first=ACCEL, sizes=(0.05, 0.5))),
    _imu("accelerometer bias step, large", partial(_bias, first=ACCEL, sizes=(0.5, 5.0))),
    _imu("noise x 5 to 20", partial(_noise, factors=(5.0, 20.0))),
    _imu("noise x 50 to 200", partial(_noise, factors=(50.0, 200.0))),
    _imu("spikes of full scale, 1 in 200", _spikes, (*DIFFERS, *LEFT_OUT)),
    _imu("scale 2 to 8 %", _scale),
    _imu("axes swapped", _swap),
    _imu("gyro z sign", partial(_mirror, columns=(2,))),
    _imu("accelerometer x sign", partial(_mirror, columns=(3,))),
    _imu("all signs", partial(_mirror, columns=(0, 1, 2, 3, 4, 5))),
    _imu("NaN for 1 s", partial(_burst, value=np.nan), LEFT_OUT),
    _imu("inf for 1 s", partial(_burst, value=np.inf), LEFT_OUT),
    _imu("saturation at 10 deg/s", partial(_saturate, limit=10.0 * DEG)),
    _imu("1e30 in one sample", partial(_one, first=GYRO, value=1e30), LEFT_OUT),
    _imu("1e30 from then on", _huge, LEFT_OUT),
    _imu("5 rad in one sample", partial(_one, first=GYRO, value=5.0), LEFT_OUT),
    _imu("200 m/s in one sample", partial(_one, first=ACCEL, value=200.0), LEFT_OUT),
    _imu("samples 10 rows late", _late_samples, ("delay", *DIFFERS)),
    Fault("no data for 5 s", "imu", partial(_without, length=5.0), LEFT_OUT, whose=DRAWN),
    Fault("dies: rows end", "imu", partial(_without, length=np.inf), LEFT_OUT, whose=DRAWN),
    Fault("begins late", "imu", _begins_late, ("late begin", *LEFT_OUT), whose=DRAWN),
    _clock("clock leaps by 20 ms", partial(_leap, step=0.02)),
    _clock("clock leaps by 1 s", partial(_leap, step=1.0)),
    _clock("clock leaps back by 1 s", partial(_leap, step=-1.0)),
    _clock("clock off by 20 ms", partial(_offset, step=0.02)),
    _clock("clock off by 1 s", partial(_offset, step=1.0)),
    _clock("clock drifts by 100 ppm", partial(_drift, ppm=100.0)),
    _clock("clock drifts by 2000 ppm", partial(_drift, ppm=2000.0)),
    _clock("a repeated stamp", _repeated),
)
"""of one IMU"""

HALF = (
    Fault("half: gyro bias step", "imu", _half(partial(_bias, first=GYRO, sizes=(0.2 * DEG, 2.0 * DEG))), DIFFERS),
    Fault("half: dead: zeros", "imu", _half(partial(_set, always=False, value=0.0)), LEFT_OUT),
    Fault("half: noise x 10 to 50", "imu", _half(partial(_noise, factors=(10.0, 50.0))), DIFFERS),
    Fault("half: scale 2 to 8 %", "imu", _half(_scale), DIFFERS),
)
"""of half of the IMUs"""
