"""Columns of texts and of Parquet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from polyins.errors import InputError
from polyins.formats.columns import column_names, read_columns


@pytest.mark.parametrize(
    "text",
    [
        "t,x\n1,2\n3,4\n",
        " t , x ,\n1,2,\n3,4,\n",
        "t;x\n1;2\n3;4\n",
        "t\tx\n1\t2\n3\t4\n",
        "  t    x\n  1    2\n  3    4\n",
        "sep=,\nt,x\n1,2\n3,4\n",
        "# a remark\n# t x\n1 2\n3 4\n",
        '"t","x"\r\n1,2\r\n3,4\r\n',
        "t,x\n1,2,\n3,4,\n",
        "\ufefft,x\n1,2\n3,4\n",
    ],
)
def test_headers_and_separators(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(text, encoding="utf-8", newline="")
    _, (t, x) = read_columns(tmp_path / "a.csv", ["t", "x"])
    np.testing.assert_array_equal(t, [1.0, 3.0])
    np.testing.assert_array_equal(x, [2.0, 4.0])


def test_empty_cells_are_nan(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,x\n1,2\n3,\n5,nan\n")
    _, (x,) = read_columns(tmp_path / "a.csv", ["x"])
    np.testing.assert_array_equal(x, [2.0, np.nan, np.nan])


def test_the_bad_line_is_named_behind_a_preamble(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("sep=,\n\nt,x\n1,2\n3,four\n")
    with pytest.raises(InputError, match="line 5: x is 'four'; expected a number"):
        read_columns(tmp_path / "a.csv", ["t", "x"])
    (tmp_path / "b.csv").write_text("sep=,\n\nt,x\n1,2\n3\n")
    with pytest.raises(InputError, match="line 5: 1 columns; expected 2"):
        read_columns(tmp_path / "b.csv", ["t", "x"])


def test_parquet_that_is_cut(tmp_path: Path) -> None:
    parquet.write_table(pa.table({"t": [1.0, 2.0]}), tmp_path / "a.parquet")
    content = (tmp_path / "a.parquet").read_bytes()
    (tmp_path / "b.parquet").write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError, match=r"b\.parquet: is not a whole Parquet file"):
        column_names(tmp_path / "b.parquet")


def test_parquet_of_text(tmp_path: Path) -> None:
    parquet.write_table(pa.table({"t": ["now", "then"]}), tmp_path / "a.parquet")
    with pytest.raises(InputError, match=r"a\.parquet: cannot be read as numbers"):
        read_columns(tmp_path / "a.parquet", ["t"])
