"""Several targets in one run: one document, one page, and what is missing is said."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from polyins.cli import cli
from polyins.errors import InputError
from polyins.reproduce import afig6, afig7, targets, together

Document = dict[str, Any]


def stand_in(name: str) -> Document:
    settings = {"track": "a simulated drive and drawn chips stand in"} if name == "a3" else {}
    return {"target": name, "paper": {"x_m": 1.0}, "polyins": {"x_m": 2.0}, "settings": settings}


@pytest.fixture
def without_work(monkeypatch: pytest.MonkeyPatch) -> None:
    def find(name: str, out: Path) -> Callable[[bool, Callable[[float], None]], Document]:
        def run(quick: bool, progress: Callable[[float], None]) -> Document:
            assert quick
            progress(0.5)
            if name == "flights":
                raise InputError("data set quadrotor is not at hand")
            (out / f"{name}-picture.html").write_text("<p>picture</p>")
            return stand_in(name)

        return run

    monkeypatch.setattr(targets, "find_target", find)


@pytest.mark.usefixtures("without_work")
def test_all_targets_are_one_document_and_one_page(tmp_path: Path) -> None:
    shares: list[float] = []
    told: list[str] = []
    names = ("flights", "a3", "a4")
    document = together.reproduce("all", names, True, tmp_path, shares.append, told.append)
    assert document["target"] == "all"
    assert list(document["polyins"]) == ["a3", "a4"]
    assert set(document["paper"]) == set(document["polyins"]) == set(document["settings"])
    assert "quadrotor" in document["missing"]["flights"]
    assert any("quadrotor" in text for text in told)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    assert together.parts(document)[0] == stand_in("a3")
    page = (tmp_path / "index.html").read_text()
    for expected in ("a3-picture.html", "a4.json", "stand in", "quadrotor", "x_m"):
        assert expected in page
    assert (tmp_path / "a3.json").exists()
    assert not (tmp_path / "flights.json").exists()


def test_targets_of_pictures_are_targets() -> None:
    assert set(targets.WITH_REPORTS) <= set(targets.TARGETS)
    assert set(together.SECONDS) | set(together.ALONE) <= set(targets.TARGETS)


@pytest.mark.parametrize("quick", [True, False])
def test_document_and_screen_say_whether_it_is_the_quick_form(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], quick: bool
) -> None:
    words = ["reproduce", "afig6", "--out", str(tmp_path), *(["--quick"] if quick else [])]
    cli.main(words, prog_name="polyins", standalone_mode=False)
    assert json.loads((tmp_path / "afig6.json").read_text())["settings"]["quick"] is quick
    assert ("quick form" in capsys.readouterr().err) is quick


def test_the_robot_s_way_is_to_and_fro(tmp_path: Path) -> None:
    document = afig6.reproduce(quick=True, out=tmp_path)
    for test in ("test A", "test B"):
        figures = document["polyins"][test]
        # straights of 36 m with half turns of 3 m between them
        assert 39.0 < figures["north_m"] < 42.0
        assert figures["east_m"] == pytest.approx(3.0, abs=0.1)
        assert figures["length_m"] == pytest.approx(270.0 * 1.175, rel=0.03)
    assert (tmp_path / "afig6-tracks.html").stat().st_size > 10_000


def test_a_book_shows_in_the_axes_that_the_paper_names() -> None:
    figures = afig7.reproduce(quick=True)["polyins"]
    gyro, accelerometer = (
        {axis: row["times"] for axis, row in figures[name].items()} for name in ("gyro_deg_s", "accelerometer_m_s2")
    )
    assert max(gyro, key=lambda axis: figures["gyro_deg_s"][axis]["after"]) == "x"
    assert gyro["x"] > 1.5
    assert accelerometer["y"] > accelerometer["x"]
    assert accelerometer["z"] > accelerometer["x"]
