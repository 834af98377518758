"""The error model and the covariance prediction against the plain matrices of the reference filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import reference_filter as reference
from array_recordings import NOISE
from hypothesis import given, settings
from hypothesis import strategies as st
from lanes import (
    EARTHS,
    SIZES,
    Array,
    close_in_sigmas,
    covariance,
    group,
    near_of,
    random_covariance,
    random_state,
    set_covariance,
)

from polyins.kernels import covariance as cov
from polyins.kernels import dense
from polyins.kernels.covariance import WORK
from polyins.navigate.state import block_size

DT = 0.01


@dataclass(frozen=True)
class Drawn:
    """A block in motion with its error model written, and P, state, rate and force that went into it."""

    block: Array
    work: Array
    P: Array
    state: reference.State
    rate: Array
    force: Array


def drawn(seed: int, earth: reference.Earth) -> Drawn:
    rng = np.random.default_rng(seed)
    state, rate, force = random_state(rng, earth), rng.uniform(-3.0, 3.0, 3), rng.uniform(-20.0, 20.0, 3)
    g, P = group(state, rate, force, NOISE), random_covariance(rng)
    set_covariance(g, P)
    # the place that the kernels are told is within 5e-4 rad of the one where the block is
    work = np.zeros(WORK)
    cov.error_model(g, work, DT, near_of(earth, state.position[0] + rng.uniform(-5e-4, 5e-4)))
    return Drawn(g, work, P, state, rate, force)


def phi(g: Array, work: Array) -> Array:
    """Phi, as the dense form spells it out; P is advanced."""
    squares, shaping = dense.workspace()
    dense.predict(g, work, DT, squares, shaping)
    return squares[dense.PHI].copy()


@pytest.mark.parametrize("earth", EARTHS.values(), ids=EARTHS)
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_f_is_that_of_the_reference(earth: reference.Earth, seed: int) -> None:
    one = drawn(seed, earth)
    F = (phi(one.block, one.work) - np.eye(21)) / DT
    expected = reference.error_dynamics(earth, one.state, one.rate, one.force, NOISE.correlation_time)
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
    one = drawn(seed, earth)
    structured, matrices = one.block, one.block.copy()
    cov.predict(structured, one.work, DT)
    Phi = phi(matrices, one.work)
    Q = reference.noise_density(one.state.C, NOISE) * DT
    expected = Phi @ one.P @ Phi.T + 0.5 * (Phi @ Q @ Phi.T + Q)
    close_in_sigmas(covariance(structured), expected, 1e-12)
    close_in_sigmas(covariance(matrices), expected, 1e-12)
    whole = reference.predict(earth, one.P, one.state, one.rate, one.force, DT, NOISE)
    close_in_sigmas(covariance(structured), whole, 1e-11)


@pytest.mark.parametrize("earth", EARTHS.values(), ids=EARTHS)
def test_noise_alone_is_compared_where_p_is_zero(earth: reference.Earth) -> None:
    """Beside a large P the noise of one epoch is lost; from zero it is all there is."""
    one = drawn(1, earth)
    g, state = one.block, one.state
    set_covariance(g, np.zeros((21, 21)))
    expected = np.zeros((21, 21))
    near = near_of(earth, state.position[0])
    for _ in range(50):
        cov.error_model(g, one.work, DT, near)
        cov.predict(g, one.work, DT)
        expected = reference.predict(earth, expected, state, one.rate, one.force, DT, NOISE)
    close_in_sigmas(covariance(g), expected, 1e-11)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_prediction_keeps_p_symmetric_to_the_last_bit(seed: int) -> None:
    one = drawn(seed, EARTHS["wgs84"])
    for _ in range(20):
        cov.predict(one.block, one.work, DT)
    P = covariance(one.block)
    np.testing.assert_array_equal(P, P.T)
    sigma = np.sqrt(np.diag(P))
    assert np.linalg.eigvalsh(P / np.outer(sigma, sigma)).min() > 0.0


@pytest.mark.parametrize("earth", EARTHS.values(), ids=EARTHS)
@pytest.mark.parametrize("stride", [cov.STRIDE, cov.LARGEST])
def test_the_prediction_for_any_number_of_states_is_the_structured_one(earth: reference.Earth, stride: int) -> None:
    """States beyond the first ones stay, grow by their noise, and keep their correlations as Phi moves them."""
    one = drawn(3, earth)
    rng = np.random.default_rng(4)
    structured = one.block
    extra = np.zeros((24, 24))
    extra[:21, :21] = one.P
    root = rng.standard_normal((24, 30)) * np.append(SIZES, [0.01, 0.02, 0.03])[:, None]
    extra += root @ root.T
    structured[cov.P : cov.P + 24 * cov.STRIDE] = extra.ravel()
    structured[cov.ERROR_PSD + 12 : cov.ERROR_PSD + 15] = [1e-4, 2e-4, 3e-4]
    general = np.zeros(block_size(stride))
    general[: cov.P] = structured[: cov.P]
    P = general[cov.P : cov.P + stride**2].reshape(stride, stride)
    P[:24, :24] = extra
    work, near = one.work.copy(), near_of(earth, one.state.position[0])
    for _ in range(30):
        cov.error_model(structured, one.work, DT, near)
        cov.predict(structured, one.work, DT)
        cov.error_model(general, work, DT, near)
        cov.predict_any(general, work, DT, stride)
    cov.complete(structured, cov.STRIDE)
    cov.complete(general, stride)
    close_in_sigmas(P[:24, :24], structured[cov.P : cov.P + 24 * 24].reshape(24, 24), 1e-12)
    assert not P[24:].any()
