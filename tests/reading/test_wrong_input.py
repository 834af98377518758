"""Each wrong input stops with a message that says where it is wrong and what was expected."""

from __future__ import annotations

import copy
import gzip
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from written_recordings import (
    GRAVITY,
    TABLE_COLUMNS,
    as_increments,
    fixes,
    still_imu,
    write_config,
    write_recording,
    write_rows,
)

from polyins.errors import InputError
from polyins.formats import geoid
from polyins.reading.loading import load

Values = dict[str, Any]
Spoil = Callable[[Path, Values], None]


@pytest.fixture(autouse=True)
def _no_grid_of_the_geoid(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(geoid, "library", lambda: None)


def setting(*keys: str | int, to: Any) -> Spoil:
    def spoil(folder: Path, values: Values) -> None:
        node: Any = values
        for key in keys[:-1]:
            node = node[key] if isinstance(key, int) else node.setdefault(key, {})
        node[keys[-1]] = to

    return spoil


def rows_of_a(change: Callable[[np.ndarray], np.ndarray]) -> Spoil:
    return lambda folder, values: (write_rows(folder / "a.txt", change(as_increments(still_imu()))), None)[1]


def rows_of_b(change: Callable[[np.ndarray], np.ndarray]) -> Spoil:
    def spoil(folder: Path, values: Values) -> None:
        write_rows(folder / "b.csv", change(still_imu()), "t,gx,gy,gz,ax,ay,az", ",")

    return spoil


def rows_of_gnss(change: Callable[[np.ndarray], np.ndarray]) -> Spoil:
    return lambda folder, values: (write_rows(folder / "gnss.txt", change(fixes())), None)[1]


def alone(index: int, spoil: Spoil) -> Spoil:
    """Spoil the file of one IMU, which there is no other beside."""

    def spoil_it(folder: Path, values: Values) -> None:
        spoil(folder, values)
        values["imus"] = [values["imus"][index]]

    return spoil_it


ON = slice(11, None)
"""rows from the twelfth on"""


def at(row: int | slice, column: int, value: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(rows: np.ndarray) -> np.ndarray:
        rows[row, column] = value
        return rows

    return change


def scaled(columns: slice, factor: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(rows: np.ndarray) -> np.ndarray:
        rows[:, columns] *= factor
        return rows

    return change


def content(name: str, data: bytes) -> Spoil:
    return lambda folder, values: (folder / name).write_bytes(data) and None


def without(name: str) -> Spoil:
    return lambda folder, values: (folder / name).unlink()


def columns(*keys: str, to: Any) -> Spoil:
    changed: Any = copy.deepcopy(TABLE_COLUMNS)
    node = changed
    for key in keys[:-1]:
        node = node[key]
    node[keys[-1]] = to
    return setting("imus", 1, "columns", to=changed)


def packed_wrongly(folder: Path, values: Values) -> None:
    (folder / "a.txt").unlink()
    (folder / "a.txt.gz").write_bytes(b"1 2 3 4 5 6 7\n")


def packed_and_cut(folder: Path, values: Values) -> None:
    packed = gzip.compress((folder / "a.txt").read_bytes())
    (folder / "a.txt").unlink()
    (folder / "a.txt.gz").write_bytes(packed[: len(packed) // 2])


def binary_cut(folder: Path, values: Values) -> None:
    (folder / "a.txt").write_bytes(as_increments(still_imu()).tobytes()[:-5])


def gnss_table(**std: Any) -> Spoil:
    def spoil(folder: Path, values: Values) -> None:
        write_rows(folder / "gnss.csv", fixes(), "t,lat,lon,h,sn,se,sd", ",")
        described = {"time": {"name": "t"}, "position": {"names": ["lat", "lon", "h"]}}
        values["gnss"] = {"file": "gnss.csv", "columns": {**described, **std}}

    return spoil


def reference_on_a_plane(folder: Path, values: Values) -> None:
    write_rows(folder / "ref.csv", fixes()[:, :4], "t,n,e,d", ",")
    described = {"time": {"name": "t"}, "position": {"names": ["n", "e", "d"], "frame": "north-east-down"}}
    values["reference"] = {"file": "ref.csv", "columns": described}


def upside_down(rows: np.ndarray) -> np.ndarray:
    rows[:, 5:] *= -1.0
    return rows


def on_its_side(rows: np.ndarray) -> np.ndarray:
    return rows[:, [0, 1, 2, 3, 4, 6, 5]]


def swapped(rows: np.ndarray) -> np.ndarray:
    """Each two rows from the eighth on in the wrong order."""
    pairs = np.arange(7, len(rows) - 1, 2)
    rows[np.ravel([pairs, pairs + 1])] = rows[np.ravel([pairs + 1, pairs])]
    return rows


def coarse(rows: np.ndarray) -> np.ndarray:
    """Stamps of a clock that ticks slower than the IMU."""
    rows[:, 0] = np.floor(rows[:, 0] * 10.0 + 1e-6) / 10.0
    return rows


def lost(rows: np.ndarray) -> np.ndarray:
    rows[[100, 200], 2] = np.nan
    rows[300, 0] = rows[299, 0]
    rows[400, 4] = 1e30
    return rows


def turn_of_three(rows: np.ndarray) -> np.ndarray:
    rows[:, 1] = np.linspace(3.1, 3.0, len(rows))
    return rows


def degrees_of_a_turn(rows: np.ndarray) -> np.ndarray:
    rows[:, 1:4] = np.degrees(1.2) + rows[:, 1:4]
    return rows


CASES: dict[str, tuple[Spoil, str, str]] = {
    # files
    "missing file": (without("a.txt"), r"line \d+: imus\[0\]\.file: .*a\.txt", "no such file"),
    "missing gnss": (without("gnss.txt"), r"gnss\.file: .*gnss\.txt", "expected it there, plain or as gnss.txt.gz"),
    "empty file": (content("a.txt", b""), r"a\.txt", "is empty; expected data"),
    "blank file": (content("b.csv", b"\n \n"), r"b\.csv", "is empty; expected data"),
    "header only": (content("b.csv", b"t,gx,gy,gz,ax,ay,az\n"), r"b\.csv", "no rows; expected data"),
    "one row": (alone(0, rows_of_a(lambda rows: rows[:1])), r"a\.txt", r"1 row\(s\); expected at least 2"),
    "not gzip": (packed_wrongly, r"a\.txt\.gz", "expected a whole gzip file"),
    "cut gzip": (packed_and_cut, r"a\.txt\.gz", "expected a whole gzip file"),
    "cut binary": (binary_cut, r"a\.txt", "expected a multiple of 56"),
    "text in numbers": (
        content("a.txt", b"1 2 3 4 5 6 7\n1 2 x 4 5 6 7\n"),
        r"a\.txt, line 2: 'x'",
        "expected a number",
    ),
    "short line": (content("a.txt", b"1 2 3 4 5 6 7\n1 2 3\n"), r"a\.txt, line 2: 3 columns", "expected 7"),
    "six columns": (content("a.txt", b"1 2 3 4 5 6\n"), r"a\.txt: 6 columns", r"expected 7 \(s, 3 rad, 3 m/s\)"),
    "text in a table": (
        content("b.csv", b"t,gx,gy,gz,ax,ay,az\n1,0,0,0,0,0,-9.8\n2,0,?,0,0,0,-9.8\n"),
        r"b\.csv, line 3: gy is '\?'",
        "expected a number",
    ),
    "short row in a table": (
        content("b.csv", b"t,gx,gy,gz,ax,ay,az\n1,0,0,0,0,0,-9.8\n2,0,0\n"),
        r"b\.csv, line 3: 3 columns",
        "expected 7",
    ),
    "missing column": (
        columns("gyro", "names", to=["gx", "gyro_y", "gz"]),
        r"b\.csv: no column 'gyro_y'",
        "did you mean 'gy'",
    ),
    "column number": (columns("time", "name", to=9), r"b\.csv: no column 9", "expected a number from 1 to 7"),
    # stamps
    "unsorted": (alone(0, rows_of_a(swapped)), r"a\.txt, line 9: time 100\.14", "expected increasing times"),
    "repeated": (alone(0, rows_of_a(coarse)), r"a\.txt, line 2: time 100\.0* s is repeated", "rate_hz"),
    "repeated in a table": (alone(1, rows_of_b(coarse)), r"b\.csv, line 3: time", "expected increasing times"),
    "NaN": (alone(0, rows_of_a(at(ON, 2, np.nan))), r"a\.txt, line 12: gyro is missing", "expected a number"),
    "NaN in a table": (alone(1, rows_of_b(at(ON, 6, np.nan))), r"b\.csv, line 13: accel is missing", "a number"),
    "NaN time": (alone(1, rows_of_b(at(ON, 0, np.nan))), r"b\.csv, line 13: time is missing", "expected a number"),
    "time unit": (columns("time", "unit", to="us"), r"b\.csv", "is the unit of time"),
    "short": (
        lambda folder, values: (
            rows_of_a(lambda r: r[:60])(folder, values),
            rows_of_b(lambda r: r[:60])(folder, values),
        )[0],
        "IMU a",
        "expected at least 2 s",
    ),
    "no overlap": (
        setting("imus", 1, "clock_offset_s", to=9.0),
        r"IMU b begins at 109\.000 s and IMU a ends at 109\.980 s",
        "in common",
    ),
    # units
    "rates as increments": (
        rows_of_a(lambda rows: still_imu()),
        r"a\.txt",
        r"values look like rates; say unit: m/s\^2",
    ),
    "g as increments": (rows_of_a(scaled(slice(4, 7), 50 / GRAVITY)), r"a\.txt", "values look like rates in g"),
    "increments as rates": (rows_of_b(as_increments), r"b\.csv", "values look like increments; say unit: m/s"),
    "g as m/s^2": (rows_of_b(scaled(slice(4, 7), 1 / GRAVITY)), r"b\.csv", "say unit: g"),
    "m/s^2 as g": (columns("accel", "unit", to="g"), r"b\.csv", r"say unit: m/s\^2"),
    "no gravity": (rows_of_b(scaled(slice(4, 7), 0.01)), r"b\.csv", "gravity was taken out"),
    "degrees as radians": (rows_of_b(degrees_of_a_turn), r"b\.csv, line \d+", "is the unit deg/s?"),
    "degrees as increments": (rows_of_a(turn_of_three), r"a\.txt, line 2", "expected at most 2 rad"),
    # axes
    "upside down": (rows_of_a(upside_down), r"imus\[0\]\.axes: IMU a", r"Try axes: \[x, -y, -z\]"),
    "on its side": (rows_of_b(on_its_side), r"imus\[1\]\.axes: IMU b", r"Try axes: \[x, -z, y\]"),
    "left-handed axes": (
        setting("imus", 0, "axes", to=["x", "y", "-z"]),
        r"imus\[0\]\.axes",
        "left-handed; expected right-handed",
    ),
    "axes twice": (setting("imus", 0, "axes", to=["x", "x", "z"]), r"imus\[0\]\.axes", "not a permutation of x, y, z"),
    "unknown axis": (
        setting("imus", 0, "axes", to=["x", "q", "z"]),
        r"imus\[0\]\.axes",
        "not a permutation of x, y, z",
    ),
    "two axes": (setting("imus", 0, "axes", to=["x", "y"]), r"imus\[0\]\.axes", "expected three of x, y, z"),
    "mount of two": (
        setting("imus", 0, "mount_deg", to=[1, 2]),
        r"imus\[0\]\.mount_deg: is \[1, 2\]",
        "expected three numbers",
    ),
    "mount of text": (setting("imus", 0, "mount_deg", to="level"), r"imus\[0\]\.mount_deg", "expected three numbers"),
    # rig
    "far IMU": (setting("imus", 1, "position_m", to=[3000, 0, 0]), r"imus\[1\].*position", "expected at most 100 m"),
    "far antenna": (
        setting("gnss", "antenna_position_m", to=[0, 1500.0, 0]),
        r"gnss\.antenna_position_m",
        "expected at most 100 m",
    ),
    "negative noise": (
        setting("imus", 0, "noise", to={"gyro_bias_deg_h": -1}),
        r"imus\[0\]\.noise\.gyro_bias_deg_h: is -1",
        "expected no negative number",
    ),
    "no correlation time": (
        setting("imus", 0, "noise", to={"correlation_time_h": 0}),
        r"imus\[0\]\.noise\.correlation_time_h",
        "expected a number above zero",
    ),
    "unknown grade": (setting("imus", 0, "noise", to="cheap"), r"imus\[0\]\.noise", "expected one of consumer-mems"),
    "one name twice": (setting("imus", 1, "name", to="a"), r"drive\.yaml: imus", "two are named 'a'"),
    "no IMU": (setting("imus", to=[]), r"line \d+: imus", "is empty; expected at least one"),
    # keys
    "unknown key": (
        setting("imus", 0, "noize", to=1),
        r"line \d+: imus\[0\]\.noize: unknown key",
        r"did you mean noise\?",
    ),
    "unknown top key": (setting("gnns", to={}), r"line \d+: gnns: unknown key", r"did you mean gnss\?"),
    "unknown key in defaults": (
        setting("imu_defaults", "rate", to=1),
        r"imu_defaults\.rate",
        r"did you mean rate_hz\?",
    ),
    "no file": (lambda folder, values: values["imus"][0].pop("file") and None, r"imus\[0\]\.file", "is missing"),
    "text for a number": (
        setting("imus", 0, "clock_offset_s", to="soon"),
        r"imus\[0\]\.clock_offset_s: is 'soon'",
        "expected a number",
    ),
    "number for a switch": (
        setting("start", "estimate_gyro_bias", to=7),
        r"start\.estimate_gyro_bias: is 7",
        "expected a valid boolean",
    ),
    "unknown unit": (
        columns("gyro", "unit", to="rpm"),
        r"columns\.gyro\.unit: is 'rpm'",
        "expected 'rad/s', 'deg/s', 'rad' or 'deg'",
    ),
    "unknown time unit": (
        columns("time", "unit", to="h"),
        r"columns\.time\.unit: is 'h'",
        "expected 's', 'ms', 'us' or 'ns'",
    ),
    "unknown format": (
        setting("imus", 0, "format", to="novatel"),
        r"imus\[0\]\.format: is 'novatel'",
        "expected 'auto', 'xsens-dot'",
    ),
    "columns with another format": (
        setting("imus", 0, "columns", to=TABLE_COLUMNS),
        r"imus\[0\]: columns",
        "with format table only",
    ),
    "unknown dataset": (
        setting("dataset", to="quadrotr"),
        r"line \d+: dataset: .*'quadrotr'",
        r"did you mean quadrotor\?",
    ),
    # positions
    "std of zero": (rows_of_gnss(at(2, 5, 0.0)), r"gnss\.txt, line 3: position std", "expected numbers above zero"),
    "negative std": (rows_of_gnss(at(1, 4, -0.1)), r"gnss\.txt, line 2: position std", "expected numbers above zero"),
    "NaN std": (rows_of_gnss(at(1, 4, np.nan)), r"gnss\.txt, line 2: position std", "expected a number"),
    "negative std in a table": (
        lambda folder, values: (
            gnss_table(std={"names": ["sn", "se", "sd"]})(folder, values),
            write_rows(folder / "gnss.csv", at(0, 6, -0.1)(fixes()), "t,lat,lon,h,sn,se,sd", ","),
        )[0],
        r"gnss\.csv, line 2: position std",
        "expected numbers above zero",
    ),
    "no std": (gnss_table(), r"gnss: .*gnss\.csv has no position std", "expected position_std_m"),
    "latitude": (rows_of_gnss(at(0, 1, 114.4)), r"gnss\.txt, line 1: latitude 114\.4 deg", "expected at most 90"),
    "no fix": (
        rows_of_gnss(lambda rows: rows * [1, 0, 0, 1, 1, 1, 1]),
        r"gnss\.txt, line 1: .* are 0",
        "expected rows with a fix",
    ),
    "degrees for radians": (
        gnss_table(position={"names": ["lat", "lon", "h"], "unit": "rad"}),
        r"gnss\.csv, line 2: latitude",
        r"are the values degrees\?",
    ),
    "unit of a frame": (
        gnss_table(position={"names": ["lat", "lon", "h"], "unit": "m"}),
        r"gnss\.columns\.position: .*unit m does not fit",
        "expected deg or rad",
    ),
    "GNSS elsewhere": (
        setting("gnss", "clock_offset_s", to=1000.0),
        r"gnss\.txt: GNSS covers 1100\.5",
        "expected the same clock",
    ),
    "sea level": (
        setting("gnss", "height", to="sea-level"),
        r"gnss\.height",
        "need geoid_height_m; expected the height",
    ),
    "two kinds of position": (reference_on_a_plane, "reference: positions are on a local plane", "expected one kind"),
    # times
    "early start": (
        setting("start", "time_s", to=50.0),
        r"start\.time_s: is 50",
        r"within the data, 100\.000 to 109\.980",
    ),
    "late start": (
        setting("start", "time_s", to=200.0),
        r"start\.time_s: is 200",
        r"within the data, 100\.000 to 109\.980",
    ),
    "end before start": (
        setting("start", "end_time_s", to=99.0),
        r"start\.end_time_s: is 99",
        "expected a time after the start",
    ),
    "static interval": (
        setting("start", "static_interval_s", to=[90, 95]),
        r"start\.static_interval_s",
        "expected .from, to. within",
    ),
    "half a position": (
        setting("start", "position", to={"north_m": 1.0}),
        r"start\.position",
        "expected latitude_deg and longitude_deg, or",
    ),
    "outage outside": (
        setting("outages", to=[[103, 104], [300, 310]]),
        r"outages: \[300, 310\]",
        "is outside the data; expected",
    ),
    "outage backwards": (
        setting("outages", to=[[105, 103]]),
        r"outages: \[105, 103\]",
        "ends before it begins; expected",
    ),
    "outages overlap": (
        setting("outages", to=[[102, 105], [104, 106]]),
        r"outages: \[104, 106\]",
        "expected outages apart",
    ),
    "outage of three": (
        setting("outages", to=[[102, 105, 107]]),
        r"outages\[0\]: is \[102, 105, 107\]",
        "expected two numbers",
    ),
    "no outage fits": (
        setting("outages", to={"length_s": 30, "every_s": 90}),
        "outages: no outage of 30 s fits",
        "expected it to end",
    ),
    "endless outages": (
        setting("outages", to={"length_s": 30, "every_s": 30}),
        "outages",
        "expected more than length_s, 30",
    ),
    "outages without GNSS": (
        lambda folder, values: (values.pop("gnss"), values.update(outages=[[102, 103]]))[1],
        "outages: given without gnss",
        "expected both or neither",
    ),
    "gate": (setting("filter", "gate_limit", to=-3), r"filter\.gate_limit: is -3", "expected a number above zero"),
}


@pytest.mark.parametrize("case", CASES)
def test_message_names_place_and_expectation(case: str, tmp_path: Path) -> None:
    spoil, place, expectation = CASES[case]
    values = write_recording(tmp_path)
    spoil(tmp_path, values)
    with pytest.raises(InputError) as caught:
        load(write_config(tmp_path, values))
    message = str(caught.value)
    assert re.search(place, message), message
    assert re.search(expectation, message), message
    assert len(message.splitlines()) <= 2


@pytest.mark.parametrize("case", CASES)
def test_command_line_says_it_in_two_lines_and_exits_with_2(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from polyins.cli import main

    spoil, place, _ = CASES[case]
    values = write_recording(tmp_path)
    spoil(tmp_path, values)
    config = write_config(tmp_path, values)
    monkeypatch.setattr("sys.argv", ["polyins", "run", str(config), "--out", str(tmp_path / "out"), "--json"])
    with pytest.raises(SystemExit) as stopped:
        main()
    printed = capsys.readouterr()
    assert stopped.value.code == 2
    assert printed.out == ""
    assert re.search(place, printed.err)
    assert len(printed.err.strip().splitlines()) <= 2
    assert not (tmp_path / "out").exists()


def test_the_recording_that_the_cases_spoil_loads_without_a_word(tmp_path: Path) -> None:
    assert load(write_config(tmp_path, write_recording(tmp_path))).warnings == ()


@pytest.mark.parametrize("spoil", [alone(1, rows_of_b(lost)), rows_of_b(lost)])
def test_single_rows_that_are_no_data_are_left_out_and_named(spoil: Spoil, tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    spoil(tmp_path, values)
    recording = load(write_config(tmp_path, values))
    assert [(one.kind, one.stream, one.size, one.severity) for one in recording.findings] == [
        ("left out", "b", 1, "note")
    ] * 4
    expected = ("are not all numbers", "are not all numbers", "are repeated, go back or leap", "beyond the range")
    assert all(text in one.text for text, one in zip(expected, recording.findings, strict=True))
    np.testing.assert_allclose(recording.imus[-1].time, np.delete(still_imu()[:, 0], [100, 200, 300, 400]), rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "place", "expectation"),
    [
        ("imus:\n  - file: a\nimus: []\n", r"drive\.yaml, line 3: .*duplicate key \"imus\"", "expected each key once"),
        ("imus:\n  - file: [a\n    b: c\n", r"drive\.yaml, line \d", "expected YAML"),
        ("imus: x\n\t- y\n", r"drive\.yaml, line 2", "expected YAML"),
        ("just words\n", r"drive\.yaml", "is not a configuration; expected YAML with keys"),
        ("", r"drive\.yaml", "is empty; expected data"),
        ("name: x\n", r"drive\.yaml: imus", "is missing"),
        ("imus: a.csv\n", r"drive\.yaml, line 1: imus: is 'a.csv'", "expected a list"),
        ("imus: [a.csv]\n", r"drive\.yaml, line 1: imus\[0\]", "expected"),
    ],
)
def test_malformed_configuration(text: str, place: str, expectation: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.yaml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load(path)
    assert re.search(place, str(caught.value)), caught.value
    assert re.search(expectation, str(caught.value)), caught.value


def test_missing_configuration(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"drive\.yaml: no such file"):
        load(tmp_path / "drive.yaml")


def test_folder_for_a_configuration(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a folder; expected a file"):
        load(tmp_path)
