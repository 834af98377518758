"""What is said and refused before a file is written; the command."""

import gzip
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from exported import known

import polyins as pi
from polyins.errors import InputError
from polyins.formats.solution_files import write_solution
from polyins.model.findings import Finding
from polyins.model.status import ALIGNING, ATTITUDE_ONLY, NOT_TO_BE_USED, TRACKING
from polyins.tools.export.trace import read_trace, trace_of
from polyins.tools.export.writing import EXPORTS, ExportOptions, export, utc_of, write

GEODETIC = [form.name for form in EXPORTS if form.geodetic]
OF_DAYS = [form.name for form in EXPORTS if form.utc == "needed"]


def test_formats_of_latitude_and_longitude_refuse_a_plane_by_name(tmp_path: Path) -> None:
    assert GEODETIC == ["kml", "geojson", "gpx", "nmea", "pos"]
    _, made = known(geodetic=False)
    for to in GEODETIC:
        with pytest.raises(InputError, match=r"on a local plane.*expected --to tum, kitti, mcap, csv"):
            export(made, tmp_path / "out", to)
    assert not list(tmp_path.iterdir())


def test_formats_of_times_of_day_refuse_a_clock_that_nobody_knows(tmp_path: Path) -> None:
    assert OF_DAYS == ["kml", "gpx", "nmea", "pos"]
    _, made = known(utc_of_zero=None)
    for to in OF_DAYS:
        with pytest.raises(InputError, match=r"nothing tells UTC.*--utc-of-zero"):
            export(made, tmp_path / "out", to)
    for to in {form.name for form in EXPORTS} - set(OF_DAYS):
        export(made, tmp_path / f"out.{to}", to)


@pytest.mark.parametrize(
    ("text", "first", "unix"),
    [
        ("2024-05-01T12:00:00Z", 5.0, 1714564800.0),
        ("2024-05-01T14:00:00+02:00", 5.0, 1714564800.0),
        ("week 0", 0.0, 315964800.0),  # 1980-01-06
        ("week 2312", 302400.0, 1714262400.0 - 18.0),  # 2024-04-28
        ("week 1930", 3.0, 1483228800.0 - 17.0),  # 2017-01-01, on which it becomes 18: at its first second, in GPS time
        ("week 1930", 20.0, 1483228800.0 - 18.0),
    ],
)
def test_utc_is_given_by_date_or_week(text: str, first: float, unix: float) -> None:
    assert utc_of(text, first) == unix


@pytest.mark.parametrize("text", ["2024-05-01T12:00:00", "noon", "week", "week 12345", "1714564800"])
def test_a_time_without_its_zone_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="expected a time with its zone"):
        utc_of(text, 0.0)


def test_stamps_that_look_like_unix_time_are_said_to_be_taken_for_it(tmp_path: Path) -> None:
    truth, made = known(utc_of_zero=None, heights="sea-level")
    (note,) = export(replace(made, time=truth.time + 1.7e9), tmp_path / "a.gpx", "gpx")
    assert "taken for Unix time, which begins at 2023-11-14 22:30:00 UTC" in note


@pytest.mark.parametrize(
    ("to", "heights", "said"),
    [
        ("gpx", "ellipsoidal", "above the ellipsoid, GPX 1.1 has them above the sea; elevations are left out; --geoid"),
        ("kml", "unknown", "what heights count from is not known; the track lies on the ground"),
        ("geojson", "sea-level", "above the sea, GeoJSON has them above the ellipsoid; coordinates are without them"),
        ("mcap", "sea-level", "fixes are without altitude; --geoid-height M converts them"),
    ],
)
def test_heights_that_a_format_has_no_place_for_are_said(to: str, heights: str, said: str, tmp_path: Path) -> None:
    _, made = known(heights=heights)
    (note,) = export(made, tmp_path / "out", to)
    assert said in note


def test_rows_without_a_state_are_left_out_and_counted(tmp_path: Path) -> None:
    truth, _ = known()
    status = np.full(truth.time.size, TRACKING, dtype=np.uint8)
    status[:7], status[7:10], status[10:12] = NOT_TO_BE_USED, ALIGNING, ATTITUDE_ONLY
    position = truth.geodetic
    position[:5] = np.nan
    _, made = known(status=status, position=position, heights="sea-level")
    notes = export(made, tmp_path / "a.tum", "tum")
    assert [note.partition(": ")[2] for note in notes] == [
        "7 rows are not to be used and left out",
        "the heading of 3 rows is not known",
        "the position of 2 rows is not known",
    ]
    assert len((tmp_path / "a.tum").read_text().splitlines()) == 1 + truth.time.size - 7
    _, made = known(status=np.full_like(status, NOT_TO_BE_USED))
    with pytest.raises(InputError, match="no row is to be used"):
        export(made, tmp_path / "b.tum", "tum")


def test_what_makes_a_result_unusable_is_said_again(tmp_path: Path) -> None:
    findings = (Finding("noise", "the receiver is noisy", "doubt"), Finding("not finite", "it broke", "serious"))
    _, made = known(findings=findings)
    write_solution(made, tmp_path / "run")
    assert export(made, tmp_path / "a.tum", "tum") == ("single: it broke",)
    (note,) = write(read_trace(tmp_path / "run"), tmp_path / "b.tum", "tum", ExportOptions())
    assert note.endswith("solution.parquet: it broke")


def test_an_existing_file_stays(tmp_path: Path) -> None:
    _, made = known()
    (tmp_path / "a.tum").write_text("mine")
    with pytest.raises(InputError, match=r"a\.tum: exists; expected the name of a new one"):
        export(made, tmp_path / "a.tum", "tum")
    assert (tmp_path / "a.tum").read_text() == "mine"


def test_a_packed_file_is_packed(tmp_path: Path) -> None:
    _, made = known()
    export(made, tmp_path / "a.csv.gz", "csv")
    assert gzip.decompress((tmp_path / "a.csv.gz").read_bytes()).startswith(b'"time_s",')


def test_options_that_do_not_belong_are_refused(tmp_path: Path) -> None:
    _, made = known()
    with pytest.raises(InputError, match="--columns: given with --to kml; expected it with csv"):
        export(made, tmp_path / "a", "kml", ExportOptions(columns=("time_s",)))
    with pytest.raises(InputError, match="--to shp: is no format; expected one of tum, kitti, kml"):
        export(made, tmp_path / "a", "shp")


@pytest.mark.parametrize("to", [form.name for form in EXPORTS if form.name != "mcap"])
def test_a_solution_from_its_file_is_that_in_memory(to: str, tmp_path: Path) -> None:
    _, made = known(heights="sea-level")
    write_solution(made, tmp_path)
    write(read_trace(tmp_path), tmp_path / "file", to, ExportOptions(rate_hz=1.0))
    write(trace_of(made), tmp_path / "memory", to, ExportOptions(rate_hz=1.0))
    numbers = [[_number(word) for word in _words((tmp_path / name).read_text())] for name in ("file", "memory")]
    assert len(numbers[0]) == len(numbers[1])
    for one, other in zip(*numbers, strict=True):
        # what is in single precision in the file
        assert one == other or abs(one - other) < 1e-4


def _words(text: str) -> list[str]:
    return [word for word in re.split(r"[\s,<>:*\[\]\"]+", text) if word]


def _number(word: str) -> float | str:
    try:
        return float(word)
    except ValueError:
        return word


def test_a_method_of_a_comparison_is_named(tmp_path: Path) -> None:
    for name in ("enav-fusion", "single/imu1", "triple-ins/centralized"):
        _, made = known(method=name)
        write_solution(made, tmp_path / name)
    with pytest.raises(InputError, match="holds enav-fusion, single/imu1, triple-ins/centralized; expected --method"):
        read_trace(tmp_path)
    assert read_trace(tmp_path, "single/imu1").method == "single/imu1"
    with pytest.raises(InputError, match=r"--method nav-fusion: is not in .*; expected one of enav-fusion, "):
        read_trace(tmp_path, "nav-fusion")
    with pytest.raises(InputError, match=r"--method enav-fusion: .* holds one solution"):
        read_trace(tmp_path / "enav-fusion/solution.parquet", "enav-fusion")
    assert read_trace(tmp_path / "enav-fusion").method == "enav-fusion"
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"holds no solution\.parquet"):
        read_trace(tmp_path / "empty")


def test_the_command(tmp_path: Path) -> None:
    _, made = known()
    write_solution(made, tmp_path / "run")

    def polyins(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "polyins", "export", *words]
        return subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)

    done = polyins("run", "--to", "csv", "out.csv", "--columns", "time_s, status", "--rate", "1")
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
    assert (tmp_path / "out.csv").read_text().splitlines()[0] == '"time_s","status"'
    done = polyins("run", "--to", "gpx", "out.gpx", "--geoid-height", "40")
    assert done.stderr == "written: out.gpx\n"
    done = polyins("run", "--to", "gpx", "out.gpx")
    assert done.returncode == 2
    assert "out.gpx: exists" in done.stderr


def test_from_python(tmp_path: Path) -> None:
    _, made = known()
    assert pi.export(made, tmp_path / "a.kml", "kml", pi.ExportOptions(geoid_height_m=40.0, rate_hz=1.0)) == ()
