"""The regression behind every estimate."""

import numpy as np
import pytest

from polyins.calibration.regression import BLOCKS, blocks, fit

TRUE = np.array([2.0, -0.5])


def rows(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    draw = np.random.default_rng(seed)
    design = np.column_stack([draw.normal(size=count), 1e3 * draw.normal(size=count)])
    return design, design @ (TRUE / [1.0, 1e3])


def test_exact_data_give_exact_values_whatever_the_units() -> None:
    design, observed = rows(400, 1)
    found = fit(design, observed, blocks(400))
    assert found.values == pytest.approx(TRUE / [1.0, 1e3], rel=1e-9)
    assert np.all(found.std < 1e-9)


def test_a_tenth_of_gross_errors_hardly_moves_it() -> None:
    design, observed = rows(2000, 2)
    draw = np.random.default_rng(3)
    spoilt = observed + draw.normal(0.0, 0.01, 2000) + 100.0 * (draw.random(2000) < 0.1)
    plain = np.linalg.lstsq(design, spoilt, rcond=None)[0]
    found = fit(design, spoilt, blocks(2000)).values
    assert abs(found[0] - TRUE[0]) < 0.01
    assert abs(plain[0] - TRUE[0]) > 0.05


def test_std_is_that_of_the_error_under_correlated_noise() -> None:
    ratios = []
    for seed in range(60):
        draw = np.random.default_rng(seed)
        design = np.repeat(draw.normal(size=80), 20)[:, None]
        noise = np.repeat(draw.normal(size=80), 20)  # constant over 20 rows: white noise would be told four times less
        found = fit(design, 2.0 * design[:, 0] + noise, blocks(1600))
        ratios.append((found.values[0] - 2.0) / found.std[0])
    assert 0.7 < np.sqrt(np.mean(np.square(ratios))) < 1.6


def test_weights_count() -> None:
    design = np.ones((100, 1))
    observed = np.r_[np.zeros(50), np.ones(50)]
    weights = np.r_[np.full(50, 3.0), np.ones(50)]
    piece = np.tile(np.arange(BLOCKS), 13)[:100]
    assert fit(design, observed, piece, weights).values[0] == pytest.approx(0.25, abs=0.1)


def test_a_column_without_excitation_is_nought_and_does_no_harm() -> None:
    design, observed = rows(400, 1)
    with_idle = np.column_stack([design, np.zeros(400)])
    found = fit(with_idle, observed, blocks(400))
    assert found.values[:2] == pytest.approx(TRUE / [1.0, 1e3], rel=1e-9)
    assert found.values[2] == 0.0
