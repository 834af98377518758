"""What tells UTC, and what heights count from."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from written_recordings import write_config, write_recording

import polyins as pi
from polyins.formats.solution_files import read_solution, write_solution
from polyins.model.recording import Recording
from polyins.reading.loading import load

HEADER = "% (lat/lon/height=WGS84/{datum},Q=1:fix)\n%  GPST latitude(deg) longitude(deg) height(m) Q ns sdn sde sdu\n"
ROW = " 30.5 114.4 20.0 1 12 0.02 0.02 0.04 0 0 0 0 0\n"
WEEK_2312 = datetime(2024, 4, 28, tzinfo=UTC).timestamp() - 18.0
"""GPS time of a midnight from Saturday to Sunday is 18 s before it is midnight in UTC"""


def loaded(folder: Path, datum: str = "ellipsoidal", **gnss: Any) -> Recording:
    """Read a recording with fixes of seconds 100 to 109 of that week."""
    values = write_recording(folder)
    rows = "".join(f"2312 {100 + second}.500{ROW}" for second in range(10))
    (folder / "gnss.pos").write_text(HEADER.format(datum=datum) + rows)
    values["start"] = {"heading_deg": 0.0}
    values["gnss"] |= {"file": "gnss.pos", "format": "auto", **gnss}
    return load(write_config(folder, values))


def test_a_file_with_its_week_tells_utc(tmp_path: Path) -> None:
    assert loaded(tmp_path).utc_of_zero == WEEK_2312


def test_an_offset_that_is_added_moves_the_zero(tmp_path: Path) -> None:
    assert loaded(tmp_path, clock_offset_s=-0.25).utc_of_zero == WEEK_2312 + 0.25


def test_seconds_without_a_week_tell_nothing(tmp_path: Path) -> None:
    assert load(write_config(tmp_path, write_recording(tmp_path))).utc_of_zero is None


@pytest.mark.parametrize(
    ("datum", "gnss", "heights"),
    [
        ("ellipsoidal", {}, "ellipsoidal"),
        ("ellipsoidal", {"height": "as-given"}, "unknown"),
        ("geodetic", {"height": "as-given"}, "sea-level"),
        ("geodetic", {"height": "sea-level", "geoid_height_m": 11.0}, "ellipsoidal"),
    ],
)
def test_heights_count_from_what_the_configuration_makes_of_them(
    datum: str, gnss: dict[str, Any], heights: str, tmp_path: Path
) -> None:
    assert loaded(tmp_path, datum, **gnss).heights == heights


def test_a_solution_and_its_file_know_both(tmp_path: Path) -> None:
    recording = loaded(tmp_path, "geodetic", height="as-given")
    solution = pi.run(recording, "single")
    write_solution(solution, tmp_path / "out")
    for one in (solution, read_solution(tmp_path / "out")):
        assert (one.heights, one.utc_of_zero) == ("sea-level", WEEK_2312)
    document = pi.evaluate(solution, None)
    assert (document["heights"], document["utc_of_zero_s"]) == ("sea-level", WEEK_2312)
