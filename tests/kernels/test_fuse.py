"""Projection to the array origin, means over IMUs, and each IMU's own correction."""

from __future__ import annotations

import numpy as np
import pytest
from lanes import EARTHS, Array, attitudes, block, get, near_of, put, random_state
from reference_filter import (
    Earth,
    Ellipsoid,
    State,
    feed_back,
    move_position,
    move_velocity,
    virtual_imu,
)
from scipy.spatial.transform import Rotation

from polyins.kernels import bank, earth, fuse, strapdown
from polyins.kernels import covariance as cov
from polyins.kernels.bank import LANES
from polyins.kernels.covariance import STRIDE
from polyins.navigate.state import block_size


def around(place: State, spread: float, seed: int) -> list[State]:
    """Eight states within metres and `spread` radians of one."""
    rng, attitude = np.random.default_rng(seed), Rotation.from_quat(place.quaternion, scalar_first=True)
    turns = Rotation.from_rotvec(spread * rng.standard_normal((8, 3))) * attitude
    quaternions = turns.as_quat(scalar_first=True)
    quaternions *= np.sign(quaternions @ place.quaternion)[:, None]
    metres = Ellipsoid().metres_per_unit(place.position) if abs(place.position[0]) < 1.5 else 1.0
    return [
        State(place.position + rng.standard_normal(3) / metres, place.velocity + rng.standard_normal(3), q)
        for q in quaternions
    ]


def empty_block() -> Array:
    return np.zeros(block_size(STRIDE))


def sums() -> Array:
    return np.zeros(fuse.SUMS)


def bank_of(states: list[State]) -> Array:
    w = block()
    put(w, bank.POSITION, np.array([s.position for s in states]))
    put(w, bank.VELOCITY, np.array([s.velocity for s in states]))
    put(w, bank.QUATERNION, np.array([s.quaternion for s in states]))
    put(w, bank.ERRORS, np.array([s.errors for s in states]))
    strapdown.update_matrix(w)
    strapdown.evaluate_at_own_state(w)
    return w


@pytest.mark.parametrize("on", EARTHS.values(), ids=EARTHS)
def test_states_are_seen_at_the_array_origin(on: Earth) -> None:
    rng = np.random.default_rng(1)
    place, dt = random_state(rng, on), 0.01
    states, arms = around(place, 0.1, 2), rng.uniform(-1.0, 1.0, (8, 3))
    rates, w = rng.uniform(-2.0, 2.0, (8, 3)), bank_of(states)
    put(w, bank.TO_POINT, arms)
    put(w, bank.DTHETA, rates * dt)
    near = near_of(on, place.position[0])
    earth.evaluate(w, *near[1:4]) if near[0] else earth.evaluate_plane(w, near[4])
    fuse.project_to_point(w, dt)
    everything = list(zip(states, rates, arms, strict=True))
    positions = np.array([move_position(on, s, arm) for s, _, arm in everything])
    velocities = np.array([move_velocity(on, s, rate, arm) for s, rate, arm in everything])
    metres = on.metres_per_unit(place.position)
    assert np.abs((get(w, bank.POINT_POSITION, 3) - positions) * metres).max() < 1e-8
    np.testing.assert_allclose(get(w, bank.POINT_VELOCITY, 3), velocities, rtol=1e-13, atol=1e-12)
    assert np.abs(velocities - [s.velocity for s in states]).max() > 0.5


@pytest.mark.parametrize("pitch", [0.0, 80.0, -89.0])
@pytest.mark.parametrize("heading", [0.0, 90.0, 180.0, -179.9])
def test_the_mean_attitude_lies_between_its_members_at_any_heading_and_pitch(heading: float, pitch: float) -> None:
    middle = Rotation.from_euler("ZYX", [heading, pitch, 10.0], degrees=True)
    apart = np.radians([[3.0, 0.0, 0.0], [-3.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, -2.0, 0.0]])
    pairs = Rotation.concatenate([Rotation.from_rotvec(apart) * middle] * 2)
    quaternions = pairs.as_quat(scalar_first=True)
    quaternions *= np.sign(quaternions @ middle.as_quat(scalar_first=True))[:, None]
    w, g = block(), empty_block()
    put(w, bank.QUATERNION, quaternions)
    fuse.fuse_states(w[None], 0, LANES, g, sums(), 0.01)
    merged = Rotation.from_matrix(g[cov.MATRIX : cov.MATRIX + 9].reshape(3, 3))
    assert (merged.inv() * middle).magnitude() < 1e-15
    assert np.linalg.norm(g[cov.QUATERNION : cov.QUATERNION + 4]) == pytest.approx(1.0, abs=1e-15)


def test_means_run_over_the_lanes_of_a_block_across_rows() -> None:
    """Eleven of sixteen lanes; whatever stands in those without an IMU has no weight."""
    rng = np.random.default_rng(3)
    blocks, g = np.array([block(), block()]), empty_block()
    positions = np.array([0.5, 2.0, 30.0]) + 1e-7 * rng.standard_normal((16, 3))
    velocities = rng.standard_normal((16, 3))
    velocities[11:] = 1e6
    weights = np.where(np.arange(16) < 11, 1.0 / 11.0, 0.0)[:, None]
    for b, w in enumerate(blocks):
        lanes = slice(LANES * b, LANES * b + LANES)
        put(w, bank.WEIGHT, weights[lanes])
        put(w, bank.POINT_POSITION, positions[lanes])
        put(w, bank.POINT_VELOCITY, velocities[lanes])
        put(w, bank.DTHETA, 0.01 * velocities[lanes])
        put(w, bank.DVEL, -0.01 * velocities[lanes])
    own = sums()
    fuse.add_all(blocks, 0, 11, own)
    fuse.finish_states(own, g)
    fuse.finish_measurements(own, g, 0.005)
    mean = velocities[:11].mean(axis=0)
    np.testing.assert_allclose(g[cov.POSITION : cov.POSITION + 3], positions[:11].mean(axis=0), rtol=1e-15)
    np.testing.assert_allclose(g[cov.VELOCITY : cov.VELOCITY + 3], mean, atol=1e-14)
    np.testing.assert_allclose(g[cov.RATE : cov.RATE + 3], 2.0 * mean, atol=1e-14)
    np.testing.assert_allclose(g[cov.FORCE : cov.FORCE + 3], -2.0 * mean, atol=1e-14)


def test_one_imu_is_itself_at_its_own_place() -> None:
    w, g = block(Rotation.from_euler("ZYX", [170.0, 60.0, 5.0], degrees=True), (0.5, 2.0, 30.0)), empty_block()
    w[bank.POINT_POSITION : bank.POINT_POSITION + 6 * LANES] = np.nan
    fuse.fuse_states(w[None], 3, 4, g, sums(), 0.01)
    np.testing.assert_array_equal(g[cov.POSITION : cov.POSITION + 3], [0.5, 2.0, 30.0])
    np.testing.assert_array_equal(g[cov.QUATERNION : cov.QUATERNION + 4], get(w, bank.QUATERNION, 4)[3])


def test_equal_members_average_to_themselves_exactly() -> None:
    """Three thirds do not add up to one in binary; a mean of offsets does not need them to."""
    w, g = block(), empty_block()
    put(w, bank.WEIGHT, np.where(np.arange(LANES) < 3, 1.0 / 3.0, 0.0)[:, None])
    put(w, bank.POINT_POSITION, [0.1, 2.3, 31.7])
    own = sums()
    fuse.add_all(w[None], 0, 3, own)
    fuse.finish_states(own, g)
    np.testing.assert_array_equal(g[cov.POSITION : cov.POSITION + 3], [0.1, 2.3, 31.7])


@pytest.mark.parametrize("imus", [1, 3, 11])
def test_the_virtual_imu_is_the_mean_moved_to_the_origin(imus: int) -> None:
    rng = np.random.default_rng(5)
    dt, time = 0.005, 0.005 * np.arange(1, 21)
    raw = 0.01 * rng.standard_normal((20, 6, imus))
    positions = rng.uniform(-1.0, 1.0, (imus, 3))
    expected = np.hstack(virtual_imu(time, raw[:, :3].swapaxes(1, 2), raw[:, 3:].swapaxes(1, 2), positions))
    blocks, before = np.zeros((1, bank.SIZE)), np.zeros(4)
    for k in range(20):
        fuse.average_increments(raw[k], dt, -positions.mean(axis=0), before, blocks)
        np.testing.assert_allclose(get(blocks[0], bank.RAW_DTHETA, 6)[0], expected[k], rtol=1e-12, atol=1e-15)
    assert np.abs(expected[:, 3:] - raw[:, 3:].mean(axis=2)).max() > 1e-3


def test_the_virtual_imu_divides_by_the_time_between_the_middles_of_unequal_intervals() -> None:
    """A steady angular acceleration is found whatever the intervals are."""
    time = np.cumsum([0.01, 0.01, 0.03, 0.01, 0.02])
    intervals = np.diff(time, prepend=0.0)
    acceleration, arm = np.array([0.0, 0.0, 2.0]), np.array([0.5, 0.0, 0.0])
    blocks, before = np.zeros((1, bank.SIZE)), np.zeros(4)
    for k, (t, dt) in enumerate(zip(time, intervals, strict=True)):
        raw = np.zeros((6, 1))
        raw[:3, 0] = acceleration * (t - 0.5 * dt) * dt
        fuse.average_increments(raw, dt, arm, before, blocks)
        if k:
            tangential = get(blocks[0], bank.RAW_DVEL, 3)[0, 1] / dt
            assert tangential == pytest.approx(1.0, rel=1e-12)


def test_corrections_feed_back_as_the_error_states_are_defined() -> None:
    rng = np.random.default_rng(6)
    place = random_state(rng, EARTHS["wgs84"])
    states, w = around(place, 0.3, 7), None
    states = [State(s.position, s.velocity, s.quaternion, rng.standard_normal(12)) for s in states]
    w = bank_of(states)
    dx = rng.standard_normal((8, 21)) * np.repeat([5.0, 1.0, 0.3, 1.0, 1.0, 1.0, 1.0], 3)
    dx[2, 6:9] = 0.0
    dx[3, 6:9] = 1e-11
    put(w, bank.CORRECTION, dx)
    metres = np.empty(3)
    earth.metric(place.position, True, metres)
    fuse.correct_members(w[None], 1, 7, metres, 21)

    class Held(Ellipsoid):
        """One metric for all members of a cov."""

        def metres_per_unit(self, position: Array) -> Array:
            return metres

    for i, state in enumerate(states):
        expected = feed_back(Held(), state, dx[i]) if 1 <= i < 7 else state
        np.testing.assert_allclose(get(w, bank.POSITION, 3)[i], expected.position, rtol=1e-15)
        np.testing.assert_allclose(get(w, bank.VELOCITY, 3)[i], expected.velocity, rtol=1e-14)
        np.testing.assert_allclose(get(w, bank.QUATERNION, 4)[i], expected.quaternion, atol=1e-15)
        np.testing.assert_allclose(get(w, bank.ERRORS, 12)[i], expected.errors, atol=1e-15)
    assert attitudes(w)[2].approx_equal(Rotation.from_quat(states[2].quaternion, scalar_first=True), atol=1e-15)
