"""Paper A's Table V in kind: where rulers bend, averaging measurements costs what averaging solutions does not."""

import pytest

from polyins.studies.progress import Steps
from polyins_papers import a5, nonrigid

pytestmark = pytest.mark.long
SEEDS = a5.BLOCK
METHODS = ("single", "imu-fusion", "nav-fusion")


@pytest.fixture(scope="module")
def rows() -> dict[str, dict[str, float]]:
    return {
        test: a5.row(a5.run(nonrigid.scenario_of(test, quick=False), SEEDS, Steps(None, SEEDS), METHODS))
        for test in a5.BOTH
    }


def test_flexible_rulers_ruin_imu_fusion_on_the_lawn_more_than_over_books(rows: dict[str, dict[str, float]]) -> None:
    lawn, books = (rows[test]["imu-fusion"] / rows[test]["nav-fusion"] for test in a5.BOTH)
    assert lawn > 1.5
    assert 1.15 < books < lawn


def test_on_the_lawn_averaging_measurements_gains_little(rows: dict[str, dict[str, float]]) -> None:
    lawn, books = (rows[test]["imu-fusion"] / rows[test]["single"] for test in a5.BOTH)
    assert lawn > 0.8
    assert books < 0.8


@pytest.mark.parametrize(("test", "least"), [("test A", 1.8), ("test B", 1.9)])
def test_nav_fusion_gains_as_on_a_rigid_array(rows: dict[str, dict[str, float]], test: str, least: float) -> None:
    assert rows[test]["single"] / rows[test]["nav-fusion"] > least
    # as good as the rigid array's 2.5 m
    assert rows[test]["nav-fusion"] < 2.6
