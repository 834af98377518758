"""Tables under the header of a text log."""

from __future__ import annotations

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.text_rows import header_line, read_rows

TEXT = b"a log\n\nt,x,y,x\n1,2,3,4\n2,,5,6\n3,7,nan,8\n"


def test_columns_by_name() -> None:
    assert header_line(TEXT, "t,x") == 2
    rows = read_rows("a.csv", TEXT, 2, ",")
    assert (len(rows), rows.first_line, rows.warnings) == (3, 4, ())
    np.testing.assert_array_equal(rows.of("t", "x"), [[1, 2], [2, np.nan], [3, 7]])
    np.testing.assert_array_equal(rows.whole("x", "y").of("t"), [[1]])
    assert rows.has("t", "x")
    assert not rows.has("z")


@pytest.mark.parametrize(
    ("end", "why"), [(b"4,1", "2 columns; expected 4"), (b"4,1,-,3", "y is '-'; expected a number")]
)
def test_a_last_line_that_is_cut_off(end: bytes, why: str) -> None:
    rows = read_rows("a.csv", TEXT + end, 2, ",")
    np.testing.assert_array_equal(rows.columns["t"], [1, 2, 3])
    assert rows.warnings == (f"a.csv, line 7: is cut off ({why}); it is left out",)


@pytest.mark.parametrize(("line", "why"), [(b"2,,5", "line 5: 3 columns"), (b"2,q,5,6", "line 5: x is 'q'")])
def test_damage_in_the_middle_is_named(line: bytes, why: str) -> None:
    with pytest.raises(InputError, match=why):
        read_rows("a.csv", TEXT.replace(b"2,,5,6", line), 2, ",")


def test_lines_of_units_and_columns_that_nobody_asked_for() -> None:
    rows = read_rows("a.txt", b"t\tname\tx\n(s)\t(na)\t(m)\n1\tone\t2\n", 0, "\t", wanted="t|x", unit_lines=1)
    assert list(rows.columns) == ["t", "x"]
    np.testing.assert_array_equal(rows.of("t", "x"), [[1, 2]])


@pytest.mark.parametrize("text", [b"t,x\r\n1,2\r\n3,4\r\n", b"\xef\xbb\xbft,x\n1,2\n3,4\n", b"t,x\n1,2,\n3,4,\n"])
def test_ends_of_lines_and_marks(text: bytes) -> None:
    np.testing.assert_array_equal(read_rows("a.csv", text, 0, ",").of("t", "x"), [[1, 2], [3, 4]])


def test_a_header_alone() -> None:
    assert len(read_rows("a.csv", b"t,x\n", 0, ",")) == 0
    assert len(read_rows("a.csv", b"t,x", 0, ",")) == 0
