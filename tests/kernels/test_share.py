"""The error model and the covariance prediction against the plain matrices of the reference filter."""

from __future__ import annotations

import numpy as np
import pytest
import reference_filter as reference
from array_recordings import NOISE
from hypothesis import given, settings
from hypothesis import strategies as st
from lanes import (
    EARTHS,
    Array,
    close_in_sigmas,
    covariance,
    group,
    near_of,
    random_covariance,
    random_state,
    set_covariance,
)

from polyins.kernels import dense, share

DT = 0.01


def random_group(seed: int, earth: reference.Earth) -> tuple[Array, Array, reference.State, Array, Array]:
    """A share in motion with its error model written, and P, state, rate and force that went into it."""
    rng = np.random.default_rng(seed)
    state, rate, force = random_state(rng, earth), rng.uniform(-3.0, 3.0, 3), rng.uniform(-20.0, 20.0, 3)
    g, P = group(state, rate, force, NOISE), random_covariance(rng)
    set_covariance(g, P)
    # the place that the kernels are told is within 5e-4 rad of the one where the share is
    share.error_model(g, DT, near_of(earth, state.position[0] + rng.uniform(-5e-4, 5e-4)))
    return g, P, state, rate, force


def phi(g: Array) -> Array:
    """Phi, as the dense form spells it out; P is advanced."""
    squares, shaping = dense.workspace()
    dense.predict(g, DT, squares, shaping)
    return squares[dense.PHI].copy()


@pytest.mark.parametrize("earth", EARTHS.values(), ids=EARTHS)
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_f_is_that_of_the_reference(earth: reference.Earth, seed: int) -> None:
    g, _, state, rate, force = random_group(seed, earth)
    F = (phi(g) - np.eye(21)) / DT
    expected = reference.error_dynamics(earth, state, rate, force, NOISE.correlation_time)
    # what is lost when one is added to F dt and taken away again
    rounding = np.where(np.eye(21) == 1.0, 4e-16 / DT, 0.0)
    assert np.all(np.abs(F - expected) <= 1e-11 * np.abs(expected).max(axis=1, keepdims=True) + rounding)
    # small terms beside large ones in a row are compared by themselves
    off = ~np.eye(21, dtype=bool) & (np.abs(expected) > 1e-18)
    np.testing.assert_allclose(F[off], expected[off], rtol=1e-9, atol=1e-21)
    np.testing.assert_array_equal(F[expected == 0.0], 0.0)


@pytest.mark.parametrize("earth", EARTHS.values(), ids=EARTHS)
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_structured_and_dense_predictions_are_phi_p_phi_and_trapezoidal_noise(
    earth: reference.Earth, seed: int
) -> None:
    structured, P, state, rate, force = random_group(seed, earth)
    matrices = structured.copy()
    share.predict(structured, DT)
    Phi = phi(matrices)
    Q = reference.noise_density(state.C, NOISE) * DT
    expected = Phi @ P @ Phi.T + 0.5 * (Phi @ Q @ Phi.T + Q)
    close_in_sigmas(covariance(structured), expected, 1e-12)
    close_in_sigmas(covariance(matrices), expected, 1e-12)
    whole = reference.predict(earth, P, state, rate, force, DT, NOISE)
    close_in_sigmas(covariance(structured), whole, 1e-11)


@pytest.mark.parametrize("earth", EARTHS.values(), ids=EARTHS)
def test_noise_alone_is_compared_where_p_is_zero(earth: reference.Earth) -> None:
    """Beside a large P the noise of one epoch is lost; from zero it is all there is."""
    g, _, state, rate, force = random_group(1, earth)
    set_covariance(g, np.zeros((21, 21)))
    expected = np.zeros((21, 21))
    near = near_of(earth, state.position[0])
    for _ in range(50):
        share.error_model(g, DT, near)
        share.predict(g, DT)
        expected = reference.predict(earth, expected, state, rate, force, DT, NOISE)
    close_in_sigmas(covariance(g), expected, 1e-11)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_prediction_keeps_p_symmetric_to_the_last_bit(seed: int) -> None:
    g, *_ = random_group(seed, EARTHS["wgs84"])
    for _ in range(20):
        share.predict(g, DT)
    P = covariance(g)
    np.testing.assert_array_equal(P, P.T)
    sigma = np.sqrt(np.diag(P))
    assert np.linalg.eigvalsh(P / np.outer(sigma, sigma)).min() > 0.0
