"""White noise, flicker and random walk, told from simulated rates."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.fft import dct

from polyins.calibration.noise_model import Spectrum, allan_variance_of, fit
from polyins.simulation.imu_errors import gauss_markov
from polyins.studies.noise_cases import NoiseCase, flicker

CASE = NoiseCase(random_walk=7e-5, instability=2.4e-5, rate_walk=9e-7, interval=0.1, samples=60_000)


@pytest.mark.parametrize("kind", ["flicker", "walk"])
def test_variances_of_the_cosine_transform(kind: str) -> None:
    """Those of many recordings are as the basis says, from the lowest order on, and hardly depend on each other."""
    rng, column = np.random.default_rng(0), ["white", "flicker", "walk"].index(kind)
    shown = []
    for _ in range(1500):
        made = (
            flicker(256, rng) if kind == "flicker" else np.cumsum(rng.standard_normal(512)).reshape(-1, 2).mean(axis=1)
        )
        shown.append(dct(made, norm="ortho")[1:9])
    basis = Spectrum.of([np.sin(np.arange(256.0))], 1.0).basis[:8, column]
    scale = 1.0 if kind == "flicker" else 2.0  # two steps of one in an interval
    np.testing.assert_allclose(np.mean(np.square(shown), axis=0) / scale, basis, rtol=0.15)
    off_diagonal = np.corrcoef(np.transpose(shown)) - np.eye(8)
    assert np.abs(off_diagonal).max() < (0.16 if kind == "flicker" else 0.1)


def test_the_three_are_found() -> None:
    case, rng = CASE, np.random.default_rng(3)
    found = fit([case.rates(rng)], case.interval)
    assert found.random_walk.value == pytest.approx(case.random_walk, rel=0.01)
    assert found.instability.value == pytest.approx(case.instability, rel=0.3)
    for one, truth in zip((found.random_walk, found.instability, found.rate_walk), case.truth, strict=True):
        assert one.low <= truth <= one.high
    assert 0.5 < found.excess < 1.5
    assert found.up_to_hz == pytest.approx(5.0, rel=0.02)


def test_what_is_not_there_is_at_most_little() -> None:
    white = np.random.default_rng(1).standard_normal(20_000)
    found = fit([white], 0.01)
    assert found.random_walk.value == pytest.approx(0.1, rel=0.02)
    assert found.instability.value is None
    assert found.rate_walk.value is None
    assert found.instability.low == found.rate_walk.low == 0.0
    # nowhere does what it can be at most exceed the white noise within the recording
    assert found.instability.high**2 < found.best[0] / 10.0
    assert 0.0 < found.rate_walk.high**2 * 100.0 / 3.0 < found.best[0] / 10.0


def test_intervals_hold_the_truth() -> None:
    inside = np.zeros(3)
    for seed in range(40):
        case = NoiseCase(7e-5, 2.4e-5, 9e-7, interval=1.0, samples=8000)
        found = fit([case.rates(np.random.default_rng([seed, 8]))], case.interval)
        each = found.random_walk, found.instability, found.rate_walk
        inside += [one.low <= truth <= one.high for one, truth in zip(each, case.truth, strict=True)]
    assert inside.min() >= 36


def test_a_scale_changes_nothing_but_the_scale() -> None:
    rates = CASE.rates(np.random.default_rng(5))[:20_000]
    one, other = fit([rates], 0.1), fit([1e-6 * rates], 0.1)
    for name in ("random_walk", "instability", "rate_walk"):
        small, large = getattr(other, name), getattr(one, name)
        assert (small.value is None) == (large.value is None)
        assert small.low == pytest.approx(1e-6 * large.low, rel=1e-3)
        assert small.high == pytest.approx(1e-6 * large.high, rel=1e-3)


def test_stretches_have_means_of_their_own() -> None:
    rates = np.split(CASE.rates(np.random.default_rng(6)), 6)
    moved = [part + shift for part, shift in zip(rates, (1.0, -2.0, 0.5, 0.0, 7.0, -3.0), strict=True)]
    np.testing.assert_allclose(fit(moved, 0.1).best, fit(rates, 0.1).best, rtol=1e-5, atol=1e-18)


def test_what_a_filter_leaves_is_judged_below_it() -> None:
    """A running mean over eight samples: the random walk is what it was."""
    white = np.random.default_rng(2).standard_normal(100_008)
    filtered = np.convolve(white, np.ones(8) / 8.0, "valid")
    found = fit([filtered], 0.01)
    assert found.up_to_hz < 6.3
    assert found.random_walk.value == pytest.approx(0.1, rel=0.05)


def test_a_line_is_named_and_left_out() -> None:
    time = np.arange(50_000) * 0.01
    white = np.random.default_rng(4).standard_normal(50_000)
    found = fit([white + 0.5 * np.sin(2.0 * np.pi * 12.3 * time)], 0.01)
    assert found.lines_hz[0] == pytest.approx(12.3, rel=0.02)
    assert found.random_walk.value == pytest.approx(0.1, rel=0.01)
    assert found.excess < 1.5
    assert fit([white], 0.01).lines_hz == ()


def test_a_bias_that_wanders_about_its_mean_is_not_described() -> None:
    """A Gauss-Markov process of half a minute beside white noise, in which the likelihood has several maxima."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        wandering = gauss_markov(72_000, 0.1 / 30.0, rng)[:, 0]
        found = fit([7e-5 / np.sqrt(0.1) * rng.standard_normal(72_000) + 3e-4 * wandering], 0.1)
        assert found.off is not None
        hz, times = found.off
        assert 1e-3 < hz < 0.1
        assert times < 0.5


def test_noise_of_the_model_is_described_down_to_the_lowest_frequencies() -> None:
    for seed in range(10):
        case = NoiseCase(7e-5, 2.4e-5, 9e-7, interval=1.0, samples=8000)
        found = fit([case.rates(np.random.default_rng([seed, 9]))], case.interval)
        assert found.off is None


def test_the_model_is_the_sum_of_its_parts() -> None:
    tau = np.array([1.0, 10.0, 100.0])
    expected = 4.0 / tau + 2.0 * np.log(2.0) / np.pi * 0.25 + 1e-4 * tau / 3.0
    np.testing.assert_allclose(allan_variance_of(np.array([4.0, 0.25, 1e-4]), tau), expected)
