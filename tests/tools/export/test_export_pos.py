"""RTKLIB's .pos: the documented form, and read back by the reader of the format."""

import re
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from exported import exported, known

from polyins.errors import InputError
from polyins.formats.recognize import data_format
from polyins.formats.rtklib import read_gnss, utc_of_zero
from polyins.tools.export.writing import ExportOptions, export

ROW = re.compile(
    r"\d{4}/\d\d/\d\d \d\d:\d\d:\d\d\.\d+ +-?\d+\.\d{9} +-?\d+\.\d{9} +-?\d+\.\d{4} +\d +\d+"
    r"( +-?\d+\.\d{4}){6} +\d+\.\d\d +\d+\.\d( +-?\d+\.\d{5}){9}"
)


def test_the_reader_of_the_format_gets_the_solution(tmp_path: Path) -> None:
    path, truth = exported(tmp_path, "pos")
    assert data_format(path) == "rtklib-pos"
    track = read_gnss(path)
    # 2024-05-01 is a Wednesday; GPS is 18 s ahead of UTC
    np.testing.assert_allclose(track.time, 3 * 86400 + 12 * 3600 + 18 + truth.time - 1000.0, atol=1e-6)
    assert utc_of_zero(path) + track.time[0] == datetime(2024, 5, 1, 12, tzinfo=UTC).timestamp()
    np.testing.assert_allclose(track.position[:, :2], truth.geodetic[:, :2], atol=2e-11)
    np.testing.assert_allclose(track.position[:, 2], truth.geodetic[:, 2], atol=1e-4)
    np.testing.assert_allclose(track.velocity, truth.velocity, atol=1e-5)
    np.testing.assert_allclose(track.position_std[0], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(track.velocity_std[0], [0.01, 0.02, 0.03])
    assert track.quality == {"float": 101, "single": 100}
    assert not track.above_sea


def test_rows_have_the_documented_form(tmp_path: Path) -> None:
    path, truth = exported(tmp_path, "pos")
    rows = [line for line in path.read_text().splitlines() if not line.startswith("%")]
    assert len(rows) == truth.time.size
    assert all(ROW.fullmatch(row) for row in rows)
    header = next(line for line in path.read_text().splitlines() if "latitude" in line)
    assert len(header.split()) - 1 == len(rows[0].split()) - 1  # %, and the date with its time of day


@pytest.mark.parametrize(("year", "leaps"), [(2015, 16), (2016, 17), (2018, 18)])
def test_leap_seconds_are_those_of_the_day(year: int, leaps: int, tmp_path: Path) -> None:
    at = datetime(year, 5, 1, 23, 59, 50, tzinfo=UTC).timestamp()
    path, _ = exported(tmp_path, "pos", utc_of_zero=at - 1000.0)
    row = next(line for line in path.read_text().splitlines() if not line.startswith("%"))
    assert row.startswith(f"{year}/05/02 00:00:{leaps - 10:02d}.000000 ")


def test_heights_above_the_sea_are_said_to_be(tmp_path: Path) -> None:
    path, _ = exported(tmp_path, "pos", heights="sea-level")
    assert read_gnss(path).above_sea
    path.unlink()
    path, truth = exported(tmp_path, "pos", ExportOptions(geoid_height_m=5.0), heights="sea-level")
    assert not read_gnss(path).above_sea
    np.testing.assert_allclose(read_gnss(path).position[:, 2], truth.geodetic[:, 2] + 5.0, atol=1e-4)


def test_heights_of_no_known_kind_are_refused(tmp_path: Path) -> None:
    _, made = known(heights="unknown")
    with pytest.raises(InputError, match="what heights count from is not known"):
        export(made, tmp_path / "a.pos", "pos")
    assert not list(tmp_path.iterdir())
