"""The height of the sea above the ellipsoid, from a grid that a library brings along."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import ModuleType

import numpy as np
import pytest

from polyins.formats import geoid
from polyins.model.rig import DEG


@pytest.fixture(autouse=True)
def _looked_for_anew() -> Iterator[None]:
    geoid.library.cache_clear()
    yield
    geoid.library.cache_clear()


def test_without_the_grid_nothing_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "egm96", None)
    assert geoid.library() is None
    assert geoid.heights(np.zeros((2, 3))) is None


def test_an_early_version_without_a_grid_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "egm96", ModuleType("egm96"))
    assert geoid.library() is None


def test_angles_are_turned_into_degrees(monkeypatch: pytest.MonkeyPatch) -> None:
    grid = ModuleType("egm96")
    grid.undulation = lambda latitude, longitude: latitude + 1000.0 * longitude  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "egm96", grid)
    found = geoid.heights(np.array([[48.0 * DEG, 11.0 * DEG, 500.0], [0.0, -1.0 * DEG, 0.0]]))
    np.testing.assert_allclose(found, [11048.0, -1000.0])


def test_the_grid_is_egm96() -> None:
    pytest.importorskip("egm96", minversion=None)
    if geoid.library() is None:
        pytest.skip("egm96 before 0.2 has no grid")
    places = np.array([[38.6281550, 269.7791550], [-14.6212170, 305.0211140], [46.8743190, 102.4487290]]) * DEG
    # the points with which NGA's program for EGM96 is tested
    found = geoid.heights(np.column_stack([places, np.zeros(3)]))
    np.testing.assert_allclose(found, [-31.628, -2.969, -43.575], atol=0.1)
