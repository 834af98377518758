"""The bars that the simulated array has to clear."""

import numpy as np
import pytest

from polyins.studies import array


@pytest.mark.long
def test_sixteen_independent_imus_gain_more_than_three_point_two(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(array, "SCENARIOS", {"independent": array.SCENARIOS["independent"]})
    figures = array.reproduce()["polyins"]["independent"]
    ratios = np.array([figures["ratio"][name] for name in array.METHODS])
    assert len(figures["ratio_by_seed"]["enav-fusion"]) == 10
    assert np.all(ratios >= 3.2)
    assert ratios.max() <= 1.1 * ratios.min()
