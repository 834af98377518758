"""The overlapping Allan deviation against allantools, and what it is worth."""

from __future__ import annotations

import numpy as np
import pytest

from polyins.calibration.allan import curve, degrees_of_freedom, factors, variances
from polyins.calibration.noise_model import allan_variance_of

allantools = pytest.importorskip("allantools", reason="allantools is not installed")

RATE_HZ = 50.0
KINDS = {"white": (0, [1.0, 0.0, 0.0]), "flicker": (-1, [0.0, 1.0, 0.0]), "walk": (-2, [0.0, 0.0, 1.0])}
"""the exponent of the density, and N^2, B^2, K^2"""


def rates(count: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return 9.81 + rng.standard_normal(count) + 0.01 * np.cumsum(rng.standard_normal(count))


@pytest.mark.parametrize("count", [7, 400, 20_001])
def test_one_stretch_is_as_in_allantools(count: int) -> None:
    of = factors([count])
    taus, expected, _, _ = allantools.oadev(rates(count), RATE_HZ, "freq", of / RATE_HZ)
    np.testing.assert_allclose(np.sqrt(variances([rates(count)], of)), expected, rtol=1e-9)
    np.testing.assert_allclose(taus, of / RATE_HZ)


def test_stretches_weigh_by_their_terms() -> None:
    parts, of = [rates(900, 1), rates(350, 2) + 5.0, rates(30, 3)], factors([900])
    total, terms = np.zeros(len(of)), np.zeros(len(of))
    for part in parts:
        taus, deviation, _, count = allantools.oadev(part, 1.0, "freq", of.astype(float))
        rows = np.searchsorted(of, np.round(taus).astype(int))
        total[rows] += deviation**2 * count
        terms[rows] += count
    np.testing.assert_allclose(variances(parts, of), total / terms, rtol=1e-9)


@pytest.mark.parametrize("m", [10, 100, 500])
@pytest.mark.parametrize("kind", KINDS)
def test_degrees_of_freedom_are_those_of_greenhall(kind: str, m: int) -> None:
    exponent, squares = KINDS[kind]
    expected = allantools.edf_greenhall(exponent, 2, m, 4001, overlapping=True, modified=False)
    assert degrees_of_freedom(m, [4000], 0.1, np.array(squares)) == pytest.approx(expected, rel=0.1)


def test_two_stretches_are_worth_the_sum() -> None:
    squares = np.array([1.0, 0.1, 0.01])
    one = degrees_of_freedom(20, [2000], 1.0, squares)
    assert degrees_of_freedom(20, [2000, 2000], 1.0, squares) == pytest.approx(2.0 * one)


def test_intervals_hold_the_truth() -> None:
    """Of white noise, at every averaging time in at least nine of ten recordings."""
    squares, inside = np.array([1.0, 0.0, 0.0]), []
    for seed in range(200):
        white = np.random.default_rng(seed).standard_normal(500)
        found = curve([white], 1.0, squares)
        truth = np.sqrt(allan_variance_of(squares, found.tau))
        inside.append((found.low < truth) & (truth < found.high))
    share = np.mean(inside, axis=0)
    assert share.min() > 0.9
    assert share.mean() == pytest.approx(0.95, abs=0.02)
