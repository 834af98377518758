"""Position and velocity of the antenna: residuals, and design matrices by finite differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from reference_filter import Ellipsoid, FlatEarth, State, position_residual, velocity_residual
from reference_filter import Fix as ReferenceFix
from scipy.spatial.transform import Rotation

from polyins.aiding import gnss
from polyins.kernels import bank, earth, kalman, share, strapdown
from polyins.kernels.bank import LANES

Array = np.ndarray

DT = 0.01
ARM = np.array([0.4, -0.7, -1.1])
PLACE = np.array([0.53, 0.1, 250.0])
RATE = np.array([0.6, -0.3, 0.5])
LANE = 3
STEPS = np.repeat([1.0, 1.0, 1e-4, 1e-3, 1e-1, 1e-3, 1e-3], 3)
MEASURED = np.array([0.1, -0.2, 0.3])


def field(w: Array, name: int, count: int) -> Array:
    """A view of one lane's numbers."""
    return w[name + LANE : name + LANE + count * LANES : LANES]


def with_error(dx: Array, on_earth: bool) -> Array:
    """A bank whose one lane is off by dx, in the convention of the error states; others hold nonsense."""
    w = np.full(bank.SIZE, 1e3)
    attitude = Rotation.from_euler("ZYX", [2.0, -0.4, 0.3])
    estimated = Rotation.from_rotvec(-dx[6:9]) * attitude  # C_hat = (I - phi x) C
    metres = np.empty(3)
    earth.metric(PLACE, on_earth, metres)
    field(w, bank.POSITION, 3)[:] = PLACE + dx[:3] / metres
    field(w, bank.VELOCITY, 3)[:] = np.array([3.0, -5.0, 0.8]) + dx[3:6]
    field(w, bank.QUATERNION, 4)[:] = estimated.as_quat(scalar_first=True)
    field(w, bank.ERRORS, 12)[:] = np.repeat([1e-3, 1e-2, 0.0, 0.0], 3) - dx[9:]
    field(w, bank.RAW_DTHETA, 3)[:] = (RATE + 1e-3) * DT
    field(w, bank.RAW_DVEL, 3)[:] = 0.0
    field(w, bank.TO_ANTENNA, 3)[:] = ARM
    field(w, bank.WEIGHT, 1)[:] = 1.0 / 3.0
    strapdown.update_matrix(w)
    strapdown.update_sensitivity(w)
    strapdown.compensate(w, 1.0, DT)
    if on_earth:
        rate = earth.EARTH_RATE_RAD_S
        field(w, bank.EARTH_RATE, 2)[:] = rate * np.array([np.cos(PLACE[0]), -np.sin(PLACE[0])])
    else:
        field(w, bank.EARTH_RATE, 2)[:] = 0.0
    return w


def fix_at_place() -> Array:
    return np.concatenate([PLACE, np.ones(3)])


def residual_of_position(dx: Array, on_earth: bool) -> Array:
    metres, m = np.empty(3), np.zeros(kalman.SIZE)
    earth.metric(PLACE, on_earth, metres)
    gnss.position_residuals(
        with_error(dx, on_earth)[None], LANE, LANE + 1, fix_at_place(), metres, on_earth, m
    )  # fmt: skip
    return m[kalman.RESIDUAL : kalman.RESIDUAL + 3].copy()


def residual_of_velocity(dx: Array, on_earth: bool) -> Array:
    m = np.zeros(kalman.SIZE)
    gnss.velocity_residuals(
        with_error(dx, on_earth)[None], LANE, LANE + 1, np.concatenate([MEASURED, np.ones(3)]), DT, m
    )
    return m[kalman.RESIDUAL : kalman.RESIDUAL + 3].copy()


def jacobian(residual: Callable[[Array, bool], Array], on_earth: bool) -> Array:
    columns = [
        (residual(e, on_earth) - residual(-e, on_earth)) / (2.0 * h) for h, e in zip(STEPS, np.diag(STEPS), strict=True)
    ]
    return np.stack(columns, axis=-1)


def share_at_truth(w: Array) -> Array:
    g = np.zeros(share.SIZE)
    g[share.MATRIX : share.MATRIX + 9] = field(w, bank.MATRIX, 9)
    g[share.ANTENNA : share.ANTENNA + 3] = ARM
    g[share.RATE : share.RATE + 3] = field(w, bank.DTHETA, 3) / DT
    return g


def design(m: Array) -> Array:
    return m[kalman.H : kalman.H + 3 * share.STRIDE].reshape(3, share.STRIDE)


@pytest.mark.parametrize("on_earth", [True, False], ids=["wgs84", "plane"])
def test_the_position_design_is_the_derivative_of_the_residual(on_earth: bool) -> None:
    m = np.full(kalman.SIZE, 7.0)
    gnss.position_design(share_at_truth(with_error(np.zeros(21), on_earth)), m)
    expected = jacobian(residual_of_position, on_earth)
    np.testing.assert_allclose(design(m)[:, :21], expected, atol=2e-8)
    assert np.abs(expected[:, 6:9]).max() > 0.5
    np.testing.assert_array_equal(design(m)[:, 21:], 0.0)


@pytest.mark.parametrize("on_earth", [True, False], ids=["wgs84", "plane"])
def test_the_velocity_design_is_the_derivative_of_the_residual(on_earth: bool) -> None:
    w, m = with_error(np.zeros(21), on_earth), np.full(kalman.SIZE, 7.0)
    gnss.velocity_design(share_at_truth(w), m, *field(w, bank.EARTH_RATE, 2))
    expected = jacobian(residual_of_velocity, on_earth)
    # scale errors enter as w / (1 + ds): even second order cancels in the central difference, the third does not
    np.testing.assert_allclose(design(m)[:, :21], expected, rtol=2e-6, atol=2e-9)
    assert np.all(np.abs(expected[:, [6, 7, 8, 9, 10, 11]]).max(axis=0) > 0.1)
    assert np.all(np.abs(expected[:, 15:18]).max(axis=0) > 0.1)
    np.testing.assert_array_equal(design(m)[:, 21:], 0.0)


@pytest.mark.parametrize("on_earth", [True, False], ids=["wgs84", "plane"])
def test_residuals_are_predicted_minus_measured_at_the_antenna(on_earth: bool) -> None:
    on = Ellipsoid() if on_earth else FlatEarth()
    dx = STEPS * np.random.default_rng(1).standard_normal(21)
    w = with_error(dx, on_earth)
    state = State(*(field(w, name, count).copy() for name, count in
                    ((bank.POSITION, 3), (bank.VELOCITY, 3), (bank.QUATERNION, 4), (bank.ERRORS, 12))))  # fmt: skip
    fix = ReferenceFix(0.0, PLACE, np.ones(3), MEASURED, np.ones(3))
    expected = position_residual(on, state, ARM, fix)
    np.testing.assert_allclose(residual_of_position(dx, on_earth), expected, atol=1e-6)  # metric at the fix
    expected = velocity_residual(on, state, field(w, bank.DTHETA, 3) / DT, ARM, fix)
    np.testing.assert_allclose(residual_of_velocity(dx, on_earth), expected, atol=1e-10)


@pytest.mark.parametrize("turns", [-1, 1])
def test_longitudes_are_compared_around_the_globe(turns: int) -> None:
    fix, metres, m = fix_at_place(), np.empty(3), np.zeros(kalman.SIZE)
    earth.metric(PLACE, True, metres)
    fix[1] += 2.0 * np.pi * turns
    gnss.position_residuals(with_error(np.zeros(21), True)[None], LANE, LANE + 1, fix, metres, True, m)
    expected = residual_of_position(np.zeros(21), True)
    np.testing.assert_allclose(m[kalman.RESIDUAL : kalman.RESIDUAL + 3], expected, atol=1e-8)


def test_each_member_has_its_residual_and_the_share_their_weighted_mean() -> None:
    rng, metres, m = np.random.default_rng(2), np.ones(3), np.zeros(kalman.SIZE)
    blocks = np.zeros((2, bank.SIZE))
    for w in blocks:
        w[bank.QUATERNION : bank.QUATERNION + LANES] = 1.0
        w[bank.WEIGHT : bank.WEIGHT + LANES] = 0.1
        strapdown.update_matrix(w)
        w[bank.POSITION : bank.POSITION + 3 * LANES] = rng.standard_normal(3 * LANES)
    gnss.position_residuals(blocks, 5, 12, np.zeros(12), metres, False, m)
    lanes = [(i // LANES, i % LANES) for i in range(5, 12)]
    own = np.array([blocks[b, bank.POSITION + lane : bank.POSITION + lane + 3 * LANES : LANES] for b, lane in lanes])
    kept = np.array(
        [blocks[b, bank.CORRECTION + lane : bank.CORRECTION + lane + 3 * LANES : LANES] for b, lane in lanes]
    )
    np.testing.assert_array_equal(kept, own)
    np.testing.assert_allclose(m[kalman.RESIDUAL : kalman.RESIDUAL + 3], own.mean(axis=0), rtol=1e-14)
    K = rng.standard_normal((21, 3))
    m[kalman.K : kalman.K + 63] = K.ravel()
    gnss.residuals_to_corrections(blocks, 5, 12, m)
    for (b, lane), z in zip(lanes, own, strict=True):
        dx = blocks[b, bank.CORRECTION + lane : bank.CORRECTION + lane + 21 * LANES : LANES]
        np.testing.assert_allclose(dx, K @ z, rtol=1e-13, atol=1e-14)
