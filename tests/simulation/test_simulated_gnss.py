import numpy as np
import pytest
from pymap3d import geodetic2ned

from polyins.errors import InputError
from polyins.simulation.gnss import GnssReceiver, fixes, with_wrong_fixes
from polyins.simulation.path import drive

DRIVE = drive(200.0, static=20.0, seed=1)
ANTENNA = np.array([-0.3, 0.2, -1.0])


def received(path, seed, position_std, **others):
    spread = {name: np.broadcast_to(std, 3) for name, std in others.items() if name.endswith("_std")}
    receiver = GnssReceiver(ANTENNA, np.broadcast_to(position_std, 3), **(others | spread))
    return fixes(path, receiver, np.random.default_rng(seed))


def offsets(position, truth):
    """Return metres north, east, down from the truth to the positions, shape (M, 3)."""
    return np.array([geodetic2ned(*p, *t, deg=False) for p, t in zip(position, truth, strict=True)])


def test_perfect_fixes_are_the_antenna_s_true_states():
    stream = received(DRIVE, 0, 0.0, velocity_std=0.0, phase=0.3)
    truth = DRIVE.truth(stream.time, ANTENNA)
    np.testing.assert_array_equal(stream.position, truth.position)
    np.testing.assert_array_equal(stream.velocity, truth.velocity)
    apart = offsets(stream.position, DRIVE.truth(stream.time).position)
    np.testing.assert_allclose(np.linalg.norm(apart, axis=1), np.linalg.norm(ANTENNA), atol=1e-6)


@pytest.mark.parametrize(("rate", "phase", "count"), [(1.0, 0.3012, 200), (5.0, 0.0, 1001), (0.5, 1.5, 100)])
def test_fixes_come_at_their_rate_and_phase(rate, phase, count):
    stream = received(DRIVE, 0, 1.0, rate=rate, phase=phase)
    assert stream.time.size == count
    assert stream.time[0] == phase
    assert stream.time[-1] <= DRIVE.duration
    np.testing.assert_allclose(np.diff(stream.time), 1.0 / rate, atol=1e-12)
    assert stream.velocity is None


def test_noise_is_what_the_stream_claims():
    std, velocity_std = np.array([0.5, 1.0, 2.0]), np.array([0.1, 0.2, 0.3])
    stream = received(DRIVE, 2, std, velocity_std=velocity_std, rate=50.0)
    truth = DRIVE.truth(stream.time, ANTENNA)
    noise = offsets(stream.position, truth.position)
    np.testing.assert_allclose(noise.std(axis=0), std, rtol=0.04)
    np.testing.assert_allclose((stream.velocity - truth.velocity).std(axis=0), velocity_std, rtol=0.04)
    np.testing.assert_array_equal(stream.position_std, np.tile(std, (stream.time.size, 1)))
    np.testing.assert_array_equal(stream.velocity_std, np.tile(velocity_std, (stream.time.size, 1)))


def test_slow_errors_wander_within_their_time_and_are_not_what_the_stream_claims():
    long, white, slow, stated = drive(2000.0, static=20.0, seed=1), 0.05, np.array([0.5, 1.0, 2.0]), [0.3, 0.2, 0.1]
    stream = received(long, 5, white, slow_std=slow, slow_time=5.0, stated_std=stated, rate=10.0)
    errors = offsets(stream.position, long.truth(stream.time, ANTENNA).position)
    np.testing.assert_allclose(errors.std(axis=0), np.hypot(white, slow), rtol=0.15)
    np.testing.assert_array_equal(stream.position_std, np.tile(stated, (stream.time.size, 1)))
    # after the correlation time 1/e is left
    later = [np.corrcoef(errors[:-50, axis], errors[50:, axis])[0, 1] for axis in range(3)]
    np.testing.assert_allclose(later, np.exp(-1.0), atol=0.15)
    # from one fix to the next the white part is what changes most
    np.testing.assert_allclose(
        np.diff(errors, axis=0).std(axis=0), np.sqrt(2.0) * np.hypot(white, slow * np.sqrt(1 - np.exp(-0.02))), rtol=0.1
    )


def test_lies_are_of_their_size_and_nowhere_else():
    honest = received(DRIVE, 3, 0.01)
    among = np.arange(50, 150)
    lying, chosen = with_wrong_fixes(honest, among, 8, 30.0, np.random.default_rng(4))
    apart = offsets(lying.position, honest.position)
    assert chosen.size == 8
    assert np.isin(chosen, among).all()
    np.testing.assert_array_equal(np.flatnonzero(np.abs(apart).max(axis=1) > 1.0), chosen)
    np.testing.assert_allclose(np.linalg.norm(apart[chosen, :2], axis=1), 30.0, atol=1e-3)
    np.testing.assert_allclose(apart[chosen, 2], 0.0, atol=1e-3)
    np.testing.assert_array_equal(lying.position_std, honest.position_std)


def test_more_lies_than_fixes_are_refused():
    honest = received(DRIVE, 3, 0.01)
    with pytest.raises(InputError, match="4 lies among 3 fixes"):
        with_wrong_fixes(honest, np.arange(3), 4, 30.0, np.random.default_rng(4))
