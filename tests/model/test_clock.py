"""Clocks of streams."""

import numpy as np
import pytest

from polyins.model.clock import Clock

LEAPING = Clock(-3.7, 257e-6, 20.0, ((50.0, -0.25), (80.0, 1.0)))
STAMPS = np.array([0.0, 12.5, 49.999, 50.0, 79.0, 80.5, 1e6])


def test_offset_drift_and_leaps_are_added() -> None:
    expected = STAMPS - 3.7 + 257e-6 * (STAMPS - 20.0) + [0.0, 0.0, 0.0, -0.25, -0.25, 0.75, 0.75]
    np.testing.assert_allclose(LEAPING.common(STAMPS), expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("clock", [Clock(), Clock(0.1), Clock(0.1, 3e-5, 7.0), LEAPING])
def test_one_stamp_has_the_bits_that_it_has_among_many(clock: Clock) -> None:
    assert [clock.common(float(stamp)) for stamp in STAMPS] == clock.common(STAMPS).tolist()


def test_an_offset_alone_adds_it() -> None:
    assert (Clock(0.1).common(STAMPS) == STAMPS + 0.1).all()


def test_the_inverse_leads_back() -> None:
    ahead = Clock(-3.7, 257e-6, 20.0, ((50.0, 0.25), (80.0, 1.0)))
    np.testing.assert_allclose(ahead.inverse.common(ahead.common(STAMPS)), STAMPS, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("onward", [Clock(2.0), Clock(2.0, -4e-5, 300.0), Clock(0.5, 1e-4, -10.0, ((40.0, 0.125),))])
def test_one_clock_after_another(onward: Clock) -> None:
    both = LEAPING.then(onward)
    np.testing.assert_allclose(both.common(STAMPS), onward.common(LEAPING.common(STAMPS)), rtol=0.0, atol=1e-7)
