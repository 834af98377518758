"""GNSS fixes of an antenna on a path: white and slow errors, outages left to the recording, lies on demand."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.model.recording import GnssStream
from polyins.model.rig import Vector, zero_vector
from polyins.simulation import earth
from polyins.simulation.imu_errors import gauss_markov
from polyins.simulation.path import Path, World

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GnssReceiver:
    """A GNSS receiver: where its antenna is, when its fixes come and how good they are."""

    antenna: Vector
    """in the array frame, m"""
    position_std: Vector
    """of the white noise, m north, east, down"""
    slow_std: Vector = field(default_factory=zero_vector)
    """of an error besides that wanders, m north, east, down"""
    slow_time: float = 60.0
    """its correlation time, s"""
    stated_std: Vector | None = None
    """what the fixes claim, m; None: `position_std`"""
    velocity_std: Vector | None = None
    """of the velocity's noise, m/s, which is what the fixes claim; None: there are no velocities"""
    rate: float = 1.0
    """fixes per second"""
    phase: float = 0.0
    """time of the first fix, s"""


def fixes(path: Path, receiver: GnssReceiver, rng: np.random.Generator) -> GnssStream:
    """Return the fixes of a receiver on a path."""
    rate, phase = receiver.rate, receiver.phase
    time = phase + np.arange(int(np.floor((path.duration - phase) * rate + 1e-9)) + 1) / rate
    truth = path.truth(time, receiver.antenna)
    errors = receiver.position_std * rng.standard_normal((time.size, 3))
    if receiver.slow_std.any():
        errors += receiver.slow_std * gauss_markov(time.size, 1.0 / (rate * receiver.slow_time), rng)[:, :3]
    position = truth.position + path.world.displacement(truth.position, errors)
    stated = receiver.position_std if receiver.stated_std is None else receiver.stated_std
    stream = GnssStream(time, position, np.tile(stated, (time.size, 1)))
    if receiver.velocity_std is None:
        return stream
    velocity_std = np.tile(receiver.velocity_std, (time.size, 1))
    velocity = truth.velocity + velocity_std * rng.standard_normal(velocity_std.shape)
    return replace(stream, velocity=velocity, velocity_std=velocity_std)


def with_wrong_fixes(
    stream: GnssStream,
    among: NDArray[np.intp],
    count: int,
    size: float,
    rng: np.random.Generator,
    world: World = earth,
) -> tuple[GnssStream, NDArray[np.intp]]:
    """Return the stream with some fixes displaced in random horizontal directions, and the indices of these.

    `among` are the indices to choose from, `size` the displacement in m; the claimed standard deviations stay.

    Raises InputError if there are fewer fixes than that.
    """
    if count > among.size:
        raise InputError(f"gnss.lies: {count} lies among {among.size} fixes; expected no more lies than fixes")
    chosen = np.sort(rng.choice(among, count, replace=False))
    direction = rng.uniform(-np.pi, np.pi, count)
    offset = size * np.stack([np.cos(direction), np.sin(direction), np.zeros(count)], axis=-1)
    position = stream.position.copy()
    position[chosen] += world.displacement(position[chosen], offset)
    return replace(stream, position=position), chosen
