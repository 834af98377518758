"""Stamps of tables: counters that start again, two columns, dates."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polyins.config import TimeColumn
from polyins.errors import InputError
from polyins.formats.columns import open_table
from polyins.formats.stamps import seconds_of_date, stamps, unwrapped


def read(folder: Path, lines: list[str], **column: object) -> np.ndarray:
    path = folder / "a.csv"
    path.write_text("\n".join(lines) + "\n")
    return stamps(open_table(path), TimeColumn.model_validate(column))


@given(first=st.floats(0.0, 1000.0), steps=st.lists(st.floats(0.0, 400.0), max_size=30))
def test_a_counter_that_starts_again_goes_on(first: float, steps: list[float]) -> None:
    whole = first + np.cumsum([0.0, *steps])
    found = unwrapped(whole % 1000.0, 1000.0)
    np.testing.assert_allclose(found - found[0], whole - whole[0], atol=1e-9)


@given(st.datetimes(datetime(1971, 1, 1), datetime(2099, 1, 1)))
def test_dates_are_seconds_since_1970(moment: datetime) -> None:
    wanted = moment.replace(tzinfo=UTC).timestamp()
    for text in (
        moment.isoformat(),
        moment.isoformat(" ") + "Z",
        moment.strftime("%Y/%m/%d %H:%M:%S.%f"),
        moment.strftime("%d.%m.%Y %H:%M:%S.%f"),
        moment.strftime("%Y%m%d %H:%M:%S.%f") + "+00:00",
    ):
        assert seconds_of_date(text) == pytest.approx(wanted, abs=1e-6), text
    assert seconds_of_date(moment.isoformat() + "+02:00") == pytest.approx(wanted - 7200.0, abs=1e-6)


@pytest.mark.parametrize("text", ["", "7", "soon", "2024-13-40 00:00:00", "03/04/2024 12:00:00"])
def test_what_is_no_date(text: str) -> None:
    assert seconds_of_date(text) is None


def test_a_time_of_day_goes_on_over_midnight(tmp_path: Path) -> None:
    lines = ["t,x", "23:59:59.5,1", "23:59:59.75,2", "00:00:00.00,3"]
    np.testing.assert_allclose(read(tmp_path, lines, name="t", dates=True), [86399.5, 86399.75, 86400.0])


def test_a_day_and_a_time_in_two_columns(tmp_path: Path) -> None:
    lines = ["day,clock,x", "1970-01-02,00:00:01.5,1", "1970-01-02,00:00:02.0,2"]
    fine = {"name": "clock", "dates": True}
    np.testing.assert_allclose(read(tmp_path, lines, name="day", dates=True, fine=fine), [86401.5, 86402.0])


def test_seconds_and_what_is_beyond_them(tmp_path: Path) -> None:
    lines = ["s,n,ticks,rate", "5,250000000,30,100", "6,0,25,50"]
    np.testing.assert_allclose(read(tmp_path, lines, name="s", fine={"name": "n", "unit": "ns"}), [5.25, 6.0])
    fine = {"name": "ticks", "ticks_per_s": "rate"}
    np.testing.assert_allclose(read(tmp_path, lines, name="s", fine=fine), [5.3, 6.5])
    np.testing.assert_allclose(read(tmp_path, lines, name="ticks", tick_s=0.01), [0.3, 0.25])


def test_the_cell_that_is_no_date_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="line 3: 'later' is no date"):
        read(tmp_path, ["t,x", "12:00:00,1", "later,2"], name="t", dates=True)
