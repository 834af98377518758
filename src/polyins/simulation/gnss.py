"""GNSS fixes of an antenna on a path: white and slow errors, outages left to the recording, lies on demand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.errors import InputError
from polyins.model.recording import GnssStream
from polyins.simulation import earth
from polyins.simulation.imu_errors import gauss_markov
from polyins.simulation.path import Path, World

Array = NDArray[np.float64]


def fixes(
    path: Path,
    antenna: ArrayLike,
    *,
    rng: np.random.Generator,
    position_std: ArrayLike,
    slow_std: ArrayLike = 0.0,
    slow_time: float = 60.0,
    stated_std: ArrayLike | None = None,
    velocity_std: ArrayLike | None = None,
    rate_hz: float = 1.0,
    phase: float = 0.0,
) -> GnssStream:
    """Return the fixes of an antenna at a place in the array frame, m, shape (3,).

    Fixes come at phase + k / rate_hz, in s. `position_std`, m north, east, down, is the white noise, and what the
    stream claims unless `stated_std` is given; `slow_std` is of an error besides that wanders within `slow_time`, s.
    `velocity_std`, m/s, is both the noise and what the stream claims; None: no velocities.
    """
    time = phase + np.arange(int(np.floor((path.duration - phase) * rate_hz + 1e-9)) + 1) / rate_hz
    truth = path.truth(time, antenna)
    white, slow = np.asarray(position_std, dtype=float), np.asarray(slow_std, dtype=float)
    errors = white * rng.standard_normal((time.size, 3))
    if slow.any():
        errors += slow * gauss_markov(time.size, 1.0 / (rate_hz * slow_time), rng)[:, :3]
    position = truth.position + path.world.displacement(truth.position, errors)
    stated = white if stated_std is None else np.asarray(stated_std, dtype=float)
    stream = GnssStream(time, position, np.broadcast_to(stated, position.shape).copy())
    if velocity_std is None:
        return stream
    velocity_std = np.broadcast_to(np.asarray(velocity_std, dtype=float), (time.size, 3)).copy()
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
