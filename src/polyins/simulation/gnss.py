"""GNSS fixes of an antenna on a path: white noise, outages left to the recording, lies on demand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.errors import InputError
from polyins.recording import GnssStream
from polyins.simulation import earth
from polyins.simulation.path import Path, World

Array = NDArray[np.float64]


def fixes(
    path: Path,
    antenna: ArrayLike,
    *,
    rng: np.random.Generator,
    position_std: ArrayLike,
    velocity_std: ArrayLike | None = None,
    rate_hz: float = 1.0,
    phase: float = 0.0,
) -> GnssStream:
    """Return the fixes of an antenna at a place in the array frame, m, shape (3,).

    Fixes come at phase + k / rate_hz, in s; the standard deviations, m and m/s north, east, down, are both the noise
    and what the stream claims. `velocity_std` None: no velocities.
    """
    time = phase + np.arange(int(np.floor((path.duration - phase) * rate_hz + 1e-9)) + 1) / rate_hz
    truth = path.truth(time, antenna)
    std = np.broadcast_to(np.asarray(position_std, dtype=float), (time.size, 3)).copy()
    noise = std * rng.standard_normal(std.shape)
    stream = GnssStream(time, truth.position + path.world.displacement(truth.position, noise), std)
    if velocity_std is None:
        return stream
    velocity_std = np.broadcast_to(np.asarray(velocity_std, dtype=float), (time.size, 3)).copy()
    velocity = truth.velocity + velocity_std * rng.standard_normal(velocity_std.shape)
    return replace(stream, velocity=velocity, velocity_std=velocity_std)


def with_lies(
    stream: GnssStream,
    among: NDArray[np.intp],
    count: int,
    size: float,
    rng: np.random.Generator,
    world: World = earth,
) -> tuple[GnssStream, NDArray[np.intp]]:
    """Return the stream with some fixes displaced in random horizontal directions, and the indices of these.

    `among` are the indices to choose from, `size` the displacement in m; the claimed standard deviations stay.

    Raises InputError if there are fewer fixes than lies.
    """
    if count > among.size:
        raise InputError(f"gnss.lies: {count} lies among {among.size} fixes; expected no more lies than fixes")
    chosen = np.sort(rng.choice(among, count, replace=False))
    direction = rng.uniform(-np.pi, np.pi, count)
    offset = size * np.stack([np.cos(direction), np.sin(direction), np.zeros(count)], axis=-1)
    position = stream.position.copy()
    position[chosen] += world.displacement(position[chosen], offset)
    return replace(stream, position=position), chosen
