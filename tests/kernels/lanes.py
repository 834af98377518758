"""Blocks of the bank and covariance groups, filled and read by field."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from reference_filter import Earth, Ellipsoid, FlatEarth, State
from scipy.spatial.transform import Rotation

from polyins.kernels import bank, strapdown
from polyins.kernels import covariance as cov
from polyins.kernels.bank import LANES
from polyins.kernels.covariance import STRIDE
from polyins.model.rig import NoiseGrade
from polyins.navigate.state import block_size

Array = NDArray[np.float64]

NEAR_PLANE = np.array([0.0, 0.0, 0.0, 1.0, 9.80665])


def near(latitude: float) -> Array:
    """What the kernels are told of the place on the ellipsoid."""
    return np.array([1.0, latitude, np.sin(latitude), np.cos(latitude), 9.80665])


def put(w: Array, field: int, values: ArrayLike) -> None:
    """Write values of shape (LANES, n), or (n,) for all lanes, into a field of n components."""
    values = np.broadcast_to(np.asarray(values, dtype=float), (LANES, np.shape(values)[-1]))
    w[field : field + values.size] = values.T.ravel()


def get(w: Array, field: int, count: int) -> Array:
    """Read a field of `count` components, shape (LANES, count)."""
    return w[field : field + count * LANES].reshape(count, LANES).T.copy()


def block(attitude: Rotation | None = None, position: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """A block at rest, all eight weights equal; attitude of one or eight rotations."""
    w = np.zeros(bank.SIZE)
    quaternions = (attitude or Rotation.identity()).as_quat(canonical=True, scalar_first=True)
    put(w, bank.QUATERNION, quaternions)
    put(w, bank.POSITION, position)
    put(w, bank.WEIGHT, [1.0 / LANES])
    strapdown.update_matrix(w)
    strapdown.update_sensitivity(w)
    return w


def attitudes(w: Array) -> Rotation:
    return Rotation.from_quat(get(w, bank.QUATERNION, 4), scalar_first=True)


def covariance(g: Array) -> Array:
    cov.complete(g, STRIDE)
    return g[cov.P : cov.P + 21 * STRIDE].reshape(21, STRIDE)[:, :21].copy()


def set_covariance(g: Array, P: Array) -> None:
    g[cov.P : cov.P + 21 * STRIDE].reshape(21, STRIDE)[:, :21] = P


SIZES = np.repeat([10.0, 0.5, 0.02, 1e-4, 0.02, 1e-3, 1e-3], 3)
"""plausible standard deviations of the 21 states"""


def random_covariance(rng: np.random.Generator) -> Array:
    """Symmetric, positive definite, with correlations of every sign."""
    root = rng.standard_normal((21, 30)) * SIZES[:, None]
    P = root @ root.T
    return np.asarray(0.5 * (P + P.T))


def close_in_sigmas(actual: Array, expected: Array, tolerance: float) -> None:
    """Compare covariances, each element relative to the standard deviations of its row and column."""
    sigma = np.sqrt(np.diag(expected))
    assert np.abs((actual - expected) / np.outer(sigma, sigma)).max() < tolerance


def group(
    state: State, rate: ArrayLike = (0.0, 0.0, 0.0), force: ArrayLike = (0.0, 0.0, 0.0), noise: NoiseGrade | None = None
) -> Array:
    """A row of groups at a state, driven by a rate, a specific force and the noise of one member."""
    g = np.zeros(block_size(STRIDE))
    g[cov.POSITION : cov.POSITION + 3] = state.position
    g[cov.VELOCITY : cov.VELOCITY + 3] = state.velocity
    g[cov.QUATERNION : cov.QUATERNION + 4] = state.quaternion
    g[cov.MATRIX : cov.MATRIX + 9] = state.C.ravel()
    g[cov.RATE : cov.RATE + 3] = rate
    g[cov.FORCE : cov.FORCE + 3] = force
    if noise is not None:
        std = [noise.gyro_bias_std, noise.accel_bias_std, noise.gyro_scale_std, noise.accel_scale_std]
        g[cov.GYRO_PSD : cov.GYRO_PSD + 3] = noise.angle_random_walk**2
        g[cov.ACCEL_PSD : cov.ACCEL_PSD + 3] = noise.velocity_random_walk**2
        g[cov.ERROR_PSD : cov.ERROR_PSD + 12] = 2.0 * np.concatenate(std) ** 2 / noise.correlation_time
        g[cov.DECAY : cov.DECAY + 12] = 1.0 / noise.correlation_time
    return g


def random_state(rng: np.random.Generator, earth: Earth) -> State:
    """Anywhere below 85 degrees of latitude, up to 200 m/s."""
    flat = isinstance(earth, FlatEarth)
    position = rng.uniform([-1.48, -3.1, -300.0], [1.48, 3.1, 9000.0]) if not flat else rng.uniform(-1e3, 1e3, 3)
    quaternion = Rotation.random(random_state=rng).as_quat(canonical=True, scalar_first=True)
    return State(position, rng.uniform(-200.0, 200.0, 3), quaternion)


EARTHS: dict[str, Earth] = {"wgs84": Ellipsoid(), "plane": FlatEarth()}


def near_of(earth: Earth, latitude: float) -> Array:
    return near(latitude) if isinstance(earth, Ellipsoid) else NEAR_PLANE
