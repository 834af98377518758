"""Simulated noise of known size, and the quick table."""

from __future__ import annotations

import numpy as np

from polyins.calibration.allan import variances
from polyins.studies.allan import covered
from polyins.studies.noise_cases import FLOOR, draw, flicker


def test_flicker_has_a_flat_allan_deviation() -> None:
    rng, of = np.random.default_rng(0), np.array([16, 64, 256])
    shown = np.mean([variances([flicker(4096, rng)], of) for _ in range(60)], axis=0)
    np.testing.assert_allclose(shown, FLOOR, rtol=0.08)


def test_cases_are_drawn_within_their_bounds() -> None:
    for seed in range(30):
        case = draw(np.random.default_rng(seed), (1.0, 6.0), 1000)
        assert 3600.0 <= case.interval * case.samples <= 6 * 3600.0
        floor_from = case.random_walk**2 / (FLOOR * case.instability**2)
        rises_from = 3.0 * FLOOR * case.instability**2 / case.rate_walk**2
        assert 10.0 <= floor_from <= 200.0
        assert 5.0 <= rises_from / floor_from <= 30.0


def test_the_table_counts() -> None:
    told = []
    found = covered((1.0, 1.0), 4, told.append)
    assert told == [0.25, 0.5, 0.75, 1.0]
    for figures in found.values():
        assert figures["of"] == 4
        assert figures["inside"] >= 3
    assert found["random_walk"]["worst_percent"] < 3.0
