"""The covariance of a single filter fits its errors."""

import pytest

from polyins.studies import consistency


@pytest.mark.long
def test_nees_lies_inside_its_bounds() -> None:
    figures = consistency.reproduce()["polyins"]
    assert figures["share_inside_95_percent"] >= 0.90
    assert abs(figures["mean_nees"] - consistency.STATES) < 0.05 * consistency.STATES
