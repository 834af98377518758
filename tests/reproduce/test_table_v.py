"""Paper A's Table V in kind: where rulers bend, averaging measurements costs what averaging solutions does not."""

from polyins.reproduce import a5, nonrigid
from polyins.reproduce.progress import Steps

SEEDS = 10


def test_flexible_rulers_ruin_imu_fusion_on_the_lawn_more_than_over_books() -> None:
    rows = {
        test: a5.row(a5.run(nonrigid.scenario_of(test, quick=False), SEEDS, Steps(None, SEEDS), a5.SWEPT))
        for test in a5.BOTH
    }
    lawn, books = (rows[test]["imu-fusion"] / rows[test]["nav-fusion"] for test in a5.BOTH)
    assert lawn > 1.5
    assert 1.15 < books < lawn
    for row in rows.values():
        # as good as the rigid array's 2.2 m
        assert row["nav-fusion"] < 2.6
