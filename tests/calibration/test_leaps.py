"""Leaps of a clock among the offsets of parts."""

import numpy as np

from polyins.calibration.leaps import Parts

RNG = np.random.default_rng(6)
BEGINS = 5.0 * np.arange(30)
STD = 1e-3


def parts(offsets: np.ndarray) -> Parts:
    return Parts(BEGINS, BEGINS + 2.5, offsets, STD**2 * np.eye(len(BEGINS)))


def test_a_step_is_found_where_it_is() -> None:
    line = 0.3 + 2e-5 * BEGINS
    for size in (0.02, -0.02):
        offsets = line + size * (BEGINS >= 50.0) + RNG.normal(0.0, STD, len(BEGINS))
        assert parts(offsets).leap() == 50.0


def test_a_line_has_none() -> None:
    for _ in range(100):
        assert parts(0.3 - 1e-4 * BEGINS + RNG.normal(0.0, STD, len(BEGINS))).leap() is None


def test_what_scatters_more_than_it_should_needs_a_larger_step() -> None:
    scattered = RNG.normal(0.0, 20.0 * STD, len(BEGINS))
    assert parts(scattered + 0.01 * (BEGINS >= 50.0)).leap() is None
    assert parts(scattered + 0.4 * (BEGINS >= 50.0)).leap() == 50.0
