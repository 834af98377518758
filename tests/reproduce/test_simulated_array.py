"""The bars that the simulated array has to clear."""

import numpy as np
import pytest

from polyins.reproduce import array


def test_a_rigid_array_of_sixteen_gains_more_than_three_point_two(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(array, "SCENARIOS", {"chips": array.SCENARIOS["chips"]})
    figures = array.reproduce()["polyins"]["chips"]
    ratios = np.array([figures["ratio"][name] for name in array.METHODS])
    assert len(figures["ratio_by_seed"]["enav-fusion"]) == 10
    assert np.all(ratios >= 3.2)
    assert ratios.max() <= 1.1 * ratios.min()
