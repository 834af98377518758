"""Faults of IMUs on wheels, of the wheels, and of the IMU on the body beside them."""

from __future__ import annotations

from functools import partial

import numpy as np

from polyins.model.recording import ImuStream, Recording
from polyins.model.rig import DEG
from polyins.simulation.scenario import Scenario
from polyins.simulation.wheel_scenario import Slip
from polyins.studies.robustness.fault import Draw, Fault, unchanged, with_imu, with_rows

SLIP = ("slip", "wheel")
SICK = ("left out", "silent", "gap", "disagreement", "slip")
ALL_SILENT = ("pause", "restart", *SICK)
WORDS = ("spin", "wheel", "same values", "number")


def _slip(scenario: Scenario, draw: Draw, *, size: float, length: float, all_wheels: bool) -> Scenario:
    """Let wheels turn more than they roll, by up to that share, for a while, every 40 s."""
    share = Slip(constant=0.0, size=size, length_s=length, every_s=40.0)
    return _on_wheels(scenario, share, all_wheels)


def _scale(scenario: Scenario, draw: Draw, *, all_wheels: bool) -> Scenario:
    return _on_wheels(scenario, Slip(constant=draw.sign() * draw.between(0.04, 0.08)), all_wheels)


def _on_wheels(scenario: Scenario, slip: Slip, all_wheels: bool) -> Scenario:
    first, *others = scenario.wheels
    wheels = [first, *others] if all_wheels else [first]
    slipping = [wheel.model_copy(update={"slip": slip}) for wheel in wheels]
    return scenario.model_copy(update={"wheels": (*slipping, *([] if all_wheels else others))})


def _index(recording: Recording, name: str) -> list[int]:
    return [i for i, imu in enumerate(recording.rig.imus) if imu.name.startswith(name)]


def _part(recording: Recording, draw: Draw, *, names: tuple[str, ...], length: float, value: str) -> Recording:
    """Let IMUs show zeros, their last value, NaN or nothing for a while, or the gyros of the wheels zero: locked."""
    for index in (i for name in names for i in _index(recording, name)):
        stream = recording.imus[index]
        where = (stream.time >= draw.at) & (stream.time < draw.at + length)
        if value == "nothing":
            recording = with_rows(recording, index, ~where)
            continue
        dtheta, dvel = stream.dtheta.copy(), stream.dvel.copy()
        first = int(np.argmax(where))
        for values in (dtheta, dvel):
            values[where] = {"zeros": 0.0, "frozen": values[first], "nan": np.nan}[value]
        recording = with_imu(recording, index, ImuStream(stream.name, stream.time, dtheta, dvel))
    return recording


def _gyro(
    recording: Recording, draw: Draw, *, name: str, axis: int, factor: float = 1.0, bias: float = 0.0, always: bool
) -> Recording:
    """Multiply a gyro axis, and add a bias, rad/s."""
    (index,) = _index(recording, name)
    stream = recording.imus[index]
    where = (stream.time >= draw.at) | always
    dtheta = stream.dtheta.copy()
    interval = np.diff(stream.time, prepend=2.0 * stream.time[0] - stream.time[1])
    dtheta[where, axis] = factor * dtheta[where, axis] + bias * interval[where]
    return with_imu(recording, index, ImuStream(stream.name, stream.time, dtheta, stream.dvel))


def _accel(recording: Recording, draw: Draw, *, name: str, bias: float) -> Recording:
    (index,) = _index(recording, name)
    stream = recording.imus[index]
    dvel = stream.dvel.copy()
    interval = np.diff(stream.time, prepend=2.0 * stream.time[0] - stream.time[1])
    where = stream.time >= draw.at
    dvel[where, draw.axis()] += bias * interval[where]
    return with_imu(recording, index, ImuStream(stream.name, stream.time, stream.dtheta, dvel))


def _one(recording: Recording, draw: Draw, *, name: str, value: float) -> Recording:
    """Add to one gyro sample, rad."""
    (index,) = _index(recording, name)
    stream = recording.imus[index]
    dtheta = stream.dtheta.copy()
    dtheta[int(np.argmax(stream.time >= draw.at)), draw.axis()] += value
    return with_imu(recording, index, ImuStream(stream.name, stream.time, dtheta, stream.dvel))


def _noisy(recording: Recording, draw: Draw, *, name: str, factor: float) -> Recording:
    (index,) = _index(recording, name)
    stream = recording.imus[index]
    where = stream.time >= draw.at
    values = np.hstack([stream.dtheta, stream.dvel])
    own = np.median(np.abs(np.diff(values[:500], axis=0)), axis=0) / 0.954
    values[where] += draw.rng.normal(0.0, 1.0, (int(where.sum()), 6)) * factor * own
    return with_imu(recording, index, ImuStream(stream.name, stream.time, values[:, :3], values[:, 3:]))


def _leap(recording: Recording, draw: Draw, *, name: str, step: float) -> Recording:
    (index,) = _index(recording, name)
    stream = recording.imus[index]
    time = np.where(stream.time >= draw.at, stream.time + step, stream.time)
    return with_imu(recording, index, ImuStream(stream.name, time, stream.dtheta, stream.dvel))


def _slips(name: str, size: float, length: float, all_wheels: bool) -> Fault:
    change = partial(_slip, size=size, length=length, all_wheels=all_wheels)
    return Fault(name, "wheel", unchanged, SLIP, WORDS, scenario=change)


def _parts(name: str, names: tuple[str, ...], length: float, value: str) -> Fault:
    inject = partial(_part, names=names, length=length, value=value)
    if len(names) > 1:
        return Fault(name, "wheel", inject, ALL_SILENT, WORDS)
    return Fault(name, "wheel", inject, SICK, WORDS, whose=names[0])


LEFT, BODY, BOTH = ("left",), ("body",), ("left", "right")

ON_WHEELS = (
    _slips("one wheel slips up to 20 % for 5 s", 0.2, 5.0, False),
    _slips("one wheel slips up to 20 % for 1 s", 0.2, 1.0, False),
    _slips("one wheel slips up to 100 % for 3 s", 1.0, 3.0, False),
    _slips("both wheels slip up to 20 % for 5 s", 0.2, 5.0, True),
    _slips("both wheels slip up to 100 % for 3 s", 1.0, 3.0, True),
    Fault("radius of one wheel 4 to 8 % off", "wheel", unchanged, SLIP, WORDS,
          scenario=partial(_scale, all_wheels=False)),
    *(
        Fault(f"{who}: spin {what}", "wheel", partial(_gyro, name=who, axis=0, factor=factor, bias=bias, always=always),
              ("disagreement", *SLIP), WORDS)
        for who, what, factor, bias, always in (
            ("left", "of the wrong sign", -1.0, 0.0, True),
            ("left", "of the wrong sign from then on", -1.0, 0.0, False),
            ("left", "biased by 5 deg/s", 1.0, 5.0 * DEG, False),
            ("left", "5 % too large from then on", 1.05, 0.0, False),
        )
    ),
    Fault("left: gyro y biased by 5 deg/s", "wheel",
          partial(_gyro, name="left", axis=1, bias=5.0 * DEG, always=False), SICK, WORDS),
    *(
        _parts(f"{' and '.join(names)}: {value} {f'for {length:g} s' if np.isfinite(length) else 'from then on'}",
               names, length, value)
        for names, length, value in (
            (LEFT, np.inf, "zeros"), (LEFT, np.inf, "frozen"), (LEFT, np.inf, "nothing"),
            (LEFT, 5.0, "zeros"), (LEFT, 5.0, "frozen"), (LEFT, 5.0, "nothing"), (LEFT, 1.0, "nan"),
            (BOTH, 5.0, "nothing"), (BOTH, np.inf, "zeros"),
        )
    ),
    Fault("left: 5 rad in one sample", "wheel", partial(_one, name="left", value=5.0), SICK, WORDS),
    Fault("left: 1e30 in one sample", "wheel", partial(_one, name="left", value=1e30), SICK, WORDS),
    Fault("left: noise x 100", "wheel", partial(_noisy, name="left", factor=100.0), SICK, WORDS),
    Fault("left: clock leaps by 1 s", "wheel", partial(_leap, name="left", step=1.0), ("clock", *SICK), WORDS),
)  # fmt: skip
"""of an IMU on a wheel, or of a wheel"""
ON_BODY = (
    *(
        _parts(f"body: {value} {f'for {length:g} s' if np.isfinite(length) else 'from then on'}", BODY, length, value)
        for length, value in (
            (np.inf, "zeros"), (np.inf, "frozen"), (np.inf, "nothing"),
            (5.0, "zeros"), (5.0, "frozen"), (5.0, "nothing"), (1.0, "nan"),
        )
    ),
    Fault("body: 5 rad in one sample", "wheel", partial(_one, name="body", value=5.0), SICK, WORDS),
    Fault("body: gyro z biased by 0.5 deg/s", "wheel",
          partial(_gyro, name="body", axis=2, bias=0.5 * DEG, always=False), SICK, WORDS),
    Fault("body: gyro z biased by 5 deg/s", "wheel",
          partial(_gyro, name="body", axis=2, bias=5.0 * DEG, always=False), SICK, WORDS),
    Fault("body: accelerometer biased by 0.5 m/s^2", "wheel", partial(_accel, name="body", bias=0.5), SICK, WORDS),
    Fault("body: noise x 100", "wheel", partial(_noisy, name="body", factor=100.0), SICK, WORDS),
    Fault("body: clock leaps by 1 s", "wheel", partial(_leap, name="body", step=1.0), ("clock", *SICK), WORDS),
)  # fmt: skip
"""of the one on the body"""
