"""How a text table is built is told by its rows, whatever stands before, between and behind them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polyins.errors import InputError
from polyins.formats.columns import open_table, read_columns
from polyins.formats.layout import cut_end, layout

ROWS = [f"{0.5 * n:.2f},{n},{-n}" for n in range(1, 31)]


def save(folder: Path, lines: list[str], end: str = "\n") -> Path:
    path = folder / "a.csv"
    path.write_text("\n".join(lines) + end)
    return path


@pytest.mark.parametrize(
    "before",
    [
        [],
        ["Session: 12", "Rate,100", "", "DATA_START"],
        ["boot ok", "1", "2", "sensors found: 3", "PPS"],
        ["# t x y of a remark", "#"],
        ["Key,Value", "Rate,100", "Range,2000", ""],
    ],
)
def test_lines_before_the_header_are_none_of_the_table(before: list[str], tmp_path: Path) -> None:
    source, (t, y) = read_columns(save(tmp_path, [*before, "t,x,y", *ROWS]), ["t", "y"])
    np.testing.assert_array_equal(t, 0.5 * np.arange(1, 31))
    np.testing.assert_array_equal(y, -np.arange(1.0, 31.0))
    assert source.place(0).endswith(f"line {len(before) + 2}")


def test_a_line_of_units_belongs_to_the_names(tmp_path: Path) -> None:
    path = save(tmp_path, ["t,x,y", "s,(m),-", *ROWS])
    assert layout(path, path.read_bytes()).names == ("t [s]", "x [m]", "y")


@pytest.mark.parametrize("mark", [";", "\t", "  "])
def test_decimal_commas_where_nothing_else_is_a_comma(mark: str, tmp_path: Path) -> None:
    lines = [mark.join(["t", "x", "y"]), *(row.replace(",", mark).replace(".", ",") for row in ROWS)]
    _, (t,) = read_columns(save(tmp_path, lines), ["t"])
    np.testing.assert_array_equal(t, 0.5 * np.arange(1, 31))


def test_commas_that_may_be_thousands_are_refused(tmp_path: Path) -> None:
    rows = [f"{n}.000,{n};{n}.5;{n}" for n in range(1, 20)]
    with pytest.raises(InputError, match=r"t is '1\.000,1'; expected a number"):
        read_columns(save(tmp_path, ["t;x;y", *rows]), ["t"])


@settings(deadline=None, max_examples=60)
@given(cut=st.integers(1, 40))
def test_a_cut_end_costs_its_line_only_and_is_named(cut: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("cut")
    rows = [f"{0.5 * n:.3f},{0.25 * n:.6f},{-0.125 * n:.6f}" for n in range(1, 31)]
    whole = "\n".join(["t,x,y", *rows]) + "\n"
    path = folder / "a.csv"
    path.write_text(whole[:-cut])
    source, (t, y) = read_columns(path, ["t", "y"])
    left = whole[:-cut].count("\n") - 1
    ended = cut == 1 or whole[:-cut].endswith("\n") or whole[-cut] == "\n"
    assert len(t) == (left + 1 if ended and not whole[:-cut].endswith("\n") else left)
    np.testing.assert_array_equal(y, -0.125 * np.arange(1, len(t) + 1))
    assert bool(source.warnings) is not ended
    if source.warnings:
        assert f"line {left + 2} is cut off" in source.warnings[0]


def test_a_first_line_without_its_begin_is_named(tmp_path: Path) -> None:
    source, (t,) = read_columns(save(tmp_path, [ROWS[0][5:], *ROWS[1:]]), [1])
    np.testing.assert_array_equal(t, 0.5 * np.arange(2, 31))
    assert "line 1 is cut off" in source.warnings[0]


def test_messages_between_rows_are_left_out_and_lines_stay_right(tmp_path: Path) -> None:
    lines = ["t,x,y", *ROWS[:10], "PPS", "GPGGA,1,2,3,4,5,6,7,8", *ROWS[10:], "t,x,y", "15.5,word,1"]
    with pytest.raises(InputError, match=r"line 35: x is 'word'"):
        read_columns(save(tmp_path, lines), ["x"])
    source, (x,) = read_columns(save(tmp_path, lines[:-1]), ["x"])
    np.testing.assert_array_equal(x, np.arange(1.0, 31.0))
    assert source.place(10).endswith("line 14")
    assert "3 line(s) between the rows" in source.warnings[0]


@pytest.mark.parametrize(("end", "mark"), [("\n", ","), ("\r\n", ","), ("\n", " ")])
def test_empty_lines_and_messages_move_no_line_number(end: str, mark: str, tmp_path: Path) -> None:
    lines = ["t,x,y", *ROWS[:5], "", *ROWS[5:10], "PPS", "", *ROWS[10:], "15.5,word,1"]
    path = tmp_path / "a.csv"
    path.write_text(end.join(line.replace(",", mark) for line in lines) + end, newline="")
    table = open_table(path)
    # one column after the other, as they are asked for
    np.testing.assert_array_equal(table.numbers(["t"])[0][:30], 0.5 * np.arange(1, 31))
    assert list(table.texts("y")[:30]) == [row.split(",")[2] for row in ROWS]
    assert [table.source.line(row) for row in (0, 5, 10, 29)] == [2, 8, 15, 34]
    with pytest.raises(InputError, match=r"line 35: x is 'word'"):
        table.numbers(["x"])


def test_few_rows_are_not_enough_to_call_one_cut() -> None:
    content = b"t,x\n1,2\n3"
    assert cut_end(content, layout("a.csv", content), 4) == len(content)


@settings(deadline=None, max_examples=40)
@given(
    blanks=st.lists(st.sampled_from([" ", "  ", "\t", " \t ", "        "]), min_size=3, max_size=3),
    end=st.sampled_from(["\n", "\r\n", " \n"]),
)
def test_any_blanks_between_columns(blanks: list[str], end: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("blanks") / "a.txt"
    lines = ["".join(f"{gap}{value}" for gap, value in zip(blanks, row.split(","), strict=True)) for row in ROWS]
    path.write_text(end.join([" t x  y", *lines]) + end, newline="")
    table = open_table(path)
    np.testing.assert_array_equal(table.numbers(["t", "y"]), [0.5 * np.arange(1, 31), -np.arange(1.0, 31.0)])
