"""CSV of chosen columns."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from exported import exported, known

from polyins.errors import InputError
from polyins.formats.solution_files import write_solution
from polyins.tools.export.trace import read_trace
from polyins.tools.export.writing import ExportOptions, export, write


def test_all_columns_are_those_of_the_solution(tmp_path: Path) -> None:
    _, made = known()
    write_solution(made, tmp_path)
    write(read_trace(tmp_path), tmp_path / "a.csv", "csv", ExportOptions())
    expected, read = pd.read_parquet(tmp_path / "solution.parquet"), pd.read_csv(tmp_path / "a.csv")
    assert list(read.columns) == list(expected.columns)
    for name in expected.columns.drop("status"):
        # as many digits as the column has
        np.testing.assert_array_equal(read[name].astype(expected[name].dtype), expected[name], err_msg=name)
    assert list(read["status"]) == list(expected["status"])


def test_chosen_columns_stand_in_the_order_of_the_choice(tmp_path: Path) -> None:
    path, _ = exported(tmp_path, "csv", ExportOptions(columns=("status", "time_s", "std_north_m"), rate_hz=2.0))
    lines = path.read_text().splitlines()
    assert lines[:3] == ['"status","time_s","std_north_m"', '"tracking",1000,0.1', '"tracking",1000.5,0.1']
    assert len(lines) == 1 + 21


def test_an_unknown_column_is_refused_by_name(tmp_path: Path) -> None:
    _, made = known()
    with pytest.raises(InputError, match=r"--columns height: is not in single; expected of time_s, .*height_m"):
        export(made, tmp_path / "a.csv", "csv", ExportOptions(columns=("height",)))
    assert not list(tmp_path.iterdir())


def test_what_is_no_number_is_an_empty_cell(tmp_path: Path) -> None:
    truth, _ = known()
    position = truth.geodetic
    position[3] = np.nan
    path, _ = exported(tmp_path, "csv", ExportOptions(columns=("time_s", "height_m")), position=position)
    assert path.read_text().splitlines()[4] == "1000.15,"
