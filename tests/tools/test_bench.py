"""The benchmark's document; its figures are for people, since tests hold no timing."""

import pytest

from polyins.tools import bench


def test_every_case_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "ROUNDS", 2)
    monkeypatch.setattr(bench, "SECONDS", 90.0)
    monkeypatch.setattr(bench, "CASES", tuple(case for case in bench.CASES if case[2] == 1))
    document = bench.bench()
    assert [result["name"] for result in document["results"]] == ["dense/single", "single"]
    assert document["results"][0]["ratio_to_dense"] == 1.0
    for result in document["results"]:
        assert 0.0 < result["min"] <= result["median"] == result["us_per_epoch"]
        assert result["runs"] == 2
