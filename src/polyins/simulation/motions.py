"""Short motions of what carries an array, as waves: at rest, in flight, on foot, hovering; and drives under way."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from polyins.model.rig import DEG
from polyins.simulation.path import Curve, Path, Profile, drive, path

Array = NDArray[np.float64]

MOVING = 3.0
"""m/s: a drive that is as fast is under way"""
LONGEST_STOP = 200.0
"""s of a drive, within which it gets that fast"""
GRAVITY = 9.8  # m/s^2, for the bank of a turn


def _none() -> Array:
    return np.zeros(0)


@dataclass(frozen=True)
class Undulation:
    """A mean, a drift, and sines: a curve with all derivatives."""

    mean: float = 0.0
    drift: float = 0.0
    """per s"""
    amplitude: Array = field(default_factory=_none)
    """shape (K,)"""
    rate: Array = field(default_factory=_none)
    """rad/s, shape (K,)"""
    phase: Array = field(default_factory=_none)
    """rad, shape (K,)"""

    def __call__(self, time: Array, nu: int = 0) -> Array:
        """Return the `nu`-th derivative at the times."""
        at = np.asarray(time, dtype=float)[..., None]
        waves = self.amplitude * self.rate**nu * np.sin(self.rate * at + self.phase + 0.5 * np.pi * nu)
        steady = (self.mean + self.drift * at[..., 0]) if nu == 0 else np.full(at.shape[:-1], self.drift * (nu == 1))
        return np.asarray(steady + waves.sum(axis=-1))

    @classmethod
    def drawn(
        cls, rng: np.random.Generator, sizes: Array, periods: Array, mean: float = 0.0, drift: float = 0.0
    ) -> Undulation:
        """Return waves of some sizes and periods, s, which are drawn within 30 %, with any phase."""
        count = len(sizes)
        stretch = rng.uniform(0.7, 1.3, (2, count))
        rate = 2.0 * np.pi / (np.asarray(periods) * stretch[0])
        return cls(mean, drift, np.asarray(sizes) * stretch[1], rate, rng.uniform(-np.pi, np.pi, count))


@dataclass(frozen=True)
class Later:
    """A curve from a time on."""

    curve: Curve
    by: float
    """s"""

    def __call__(self, time: Array, nu: int = 0) -> Array:
        """Return the `nu`-th derivative at the times."""
        return self.curve(np.asarray(time) + self.by, nu)


@dataclass(frozen=True)
class CoordinatedRoll:
    """The roll of a turn in which nothing pulls sideways, for a speed and small changes of it."""

    heading: Undulation
    speed: float
    """m/s"""

    def __call__(self, time: Array, nu: int = 0) -> Array:
        """Return the `nu`-th derivative at the times."""
        return np.asarray(self.speed / GRAVITY * self.heading(time, nu + 1))


def any_heading(rng: np.random.Generator) -> float:
    """Draw a heading, rad."""
    return float(rng.uniform(-np.pi, np.pi))


def lying(rng: np.random.Generator, duration: float) -> Path:
    """Return an array at rest in any attitude: on its side, nose up, upside down."""
    roll, pitch = rng.uniform(-180.0, 180.0) * DEG, rng.uniform(-75.0, 75.0) * DEG
    profile = Profile(Undulation(), Undulation(float(roll)), Undulation(float(pitch)), Undulation(any_heading(rng)))
    return path(profile, duration=duration)


def drive_after_rest(rng: np.random.Generator, duration: float) -> Path:
    """Return a drive that begins with 4 to 20 s of rest."""
    return drive(duration, static=rng.uniform(4.0, 20.0), seed=int(rng.integers(1 << 31)))


def drive_under_way(rng: np.random.Generator, duration: float) -> Path:
    """Return a part of a drive that begins under way."""
    whole = drive(duration + LONGEST_STOP, static=0.0, seed=int(rng.integers(1 << 31)))
    time = np.arange(0.0, LONGEST_STOP, 0.5)
    begin = float(rng.choice(time[whole.speed(time) > MOVING]))
    return replace(
        whole,
        duration=duration,
        speed=Later(whole.speed, begin),
        roll=Later(whole.roll, begin),
        pitch=Later(whole.pitch, begin),
        heading=Later(whole.heading, begin),
        position=Later(whole.position, begin),
    )


def flight(rng: np.random.Generator, duration: float) -> Path:
    """Return a flight of wings, in the air from the first instant on: turns in which it banks, climbs, gusts."""
    speed = float(rng.uniform(12.0, 40.0))
    # banked by 20 degrees
    swing = np.array([0.36 * GRAVITY / speed * 15.0 / (2.0 * np.pi), 0.01])
    heading = Undulation.drawn(rng, swing, np.array([15.0, 2.0]), any_heading(rng))
    pace = Undulation.drawn(rng, speed * np.array([0.1, 0.01]), np.array([20.0, 3.0]), speed)
    pitch = Undulation.drawn(rng, np.array([4.0, 0.5]) * DEG, np.array([18.0, 1.5]))
    side = Undulation.drawn(rng, np.array([0.01 * speed]), np.array([8.0]))
    return path(Profile(pace, CoordinatedRoll(heading, speed), pitch, heading, side), duration=duration)


def walk(rng: np.random.Generator, duration: float) -> Path:
    """Return a walk with the sensor in hand: steps, sway, bends."""
    speed, step = float(rng.uniform(0.8, 1.6)), float(rng.uniform(0.5, 0.65))
    bends = np.array([30.0, 3.0]) * DEG
    heading = Undulation.drawn(rng, bends, np.array([25.0, 2.0 * step]), any_heading(rng))
    pace = Undulation.drawn(rng, np.array([0.15, 0.1]), np.array([step, 12.0]), speed)
    side = Undulation.drawn(rng, np.array([0.05]), np.array([2.0 * step]), 0.02 * speed * float(rng.normal()))
    roll = Undulation.drawn(rng, np.array([2.0]) * DEG, np.array([2.0 * step]))
    pitch = Undulation.drawn(rng, np.array([3.0]) * DEG, np.array([step]))
    return path(Profile(pace, roll, pitch, heading, side), duration=duration)


def hover(rng: np.random.Generator, duration: float) -> Path:
    """Return a hover in gusts: to and fro by half a metre or so, turning slowly, whatever the heading."""
    size = float(rng.uniform(0.1, 0.5))
    to_and_fro = [Undulation.drawn(rng, np.array([size, 0.3 * size]), np.array([6.0, 2.0])) for _ in range(2)]
    heading = Undulation.drawn(rng, np.array([10.0]) * DEG, np.array([15.0]), any_heading(rng))
    roll, pitch = (Undulation.drawn(rng, np.array([3.0, 1.0]) * DEG, np.array([6.0, 2.0])) for _ in range(2))
    return path(Profile(to_and_fro[0], roll, pitch, heading, to_and_fro[1]), duration=duration)


def sideways(rng: np.random.Generator, duration: float) -> Path:
    """Return a flight of rotors: it goes where it likes, at some m/s, and looks elsewhere."""
    ahead, aside = rng.normal(0.0, 3.0, 2)
    speeds = [
        Undulation.drawn(rng, np.array([1.5, 0.3]), np.array([10.0, 3.0]), float(mean)) for mean in (ahead, aside)
    ]
    heading = Undulation.drawn(rng, np.array([15.0]) * DEG, np.array([12.0]), any_heading(rng))
    roll, pitch = (Undulation.drawn(rng, np.array([6.0, 1.0]) * DEG, np.array([8.0, 2.0])) for _ in range(2))
    return path(Profile(speeds[0], roll, pitch, heading, speeds[1]), duration=duration)
