"""Several targets in one run: one document, one page, and what is missing is said."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from polyins.cli import cli
from polyins.errors import InputError
from polyins.reading import catalogue
from polyins.studies import reproduction, targets
from polyins.studies.target import Target, named
from polyins_papers import afig6, afig7

Document = dict[str, Any]


def stand_in(name: str) -> Document:
    settings = {"track": "a simulated drive and drawn chips stand in"} if name == "a3" else {}
    return {"target": name, "paper": {"x_m": 1.0}, "polyins": {"x_m": 2.0}, "settings": settings}


def draw(name: str, quick: bool, progress: Callable[[float], None], out: Path) -> Document:
    assert quick
    progress(0.5)
    if name == "flights":
        raise InputError("data set quadrotor is not at hand")
    (out / f"{name}-picture.html").write_text("<p>picture</p>")
    return stand_in(name)


flights, a3, a4 = (partial(draw, name) for name in ("flights", "a3", "a4"))
ROWS = [Target(name, f"{__name__}:{name}", pictures=True) for name in ("flights", "a3", "a4")]


def test_all_targets_are_one_document_and_one_page(tmp_path: Path) -> None:
    shares: list[float] = []
    told: list[str] = []
    document = reproduction.reproduce("all", ROWS, True, tmp_path, shares.append, told.append)
    assert document["target"] == "all"
    assert list(document["polyins"]) == ["a3", "a4"]
    assert set(document["paper"]) == set(document["polyins"]) == set(document["settings"])
    assert "quadrotor" in document["missing"]["flights"]
    assert any("quadrotor" in text for text in told)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    assert reproduction.parts(document)[0]["polyins"] == stand_in("a3")["polyins"]
    page = (tmp_path / "index.html").read_text()
    for expected in ("a3-picture.html", "a4.json", "stand in", "quadrotor", "x_m"):
        assert expected in page
    assert (tmp_path / "a3.json").exists()
    assert not (tmp_path / "flights.json").exists()


def test_every_row_runs_a_function_and_names_data_sets_that_are_known() -> None:
    for target in targets.known().values():
        assert callable(named(target.run))
        assert not target.print_tables or callable(named(target.print_tables))
        assert set(target.datasets) <= set(catalogue.names())


def test_both_papers_are_found_by_entry_point() -> None:
    assert {"a3", "b6"} <= set(targets.known())
    assert {target.name for target in targets.find("figures")} < {target.name for target in targets.find("all")}


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
