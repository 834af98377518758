"""RTKLIB's position files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.recognize import data_format
from polyins.formats.rtklib import read_gnss, utc_of_zero
from polyins.model.rig import DEG
from polyins.reading.loading import load

HEADER = """\
% program   : RTKPOST ver.2.4.3
% obs start : 2022/07/07 08:11:00.0 GPST (week2217 375060.0s)
%
% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)
%  {clock}                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  \
sdne(m)  sdeu(m)  sdun(m) age(s)  ratio{more}
"""
VALUES = (
    "   32.825683159   34.955962416    28.1000   {q}  17   0.0100   0.0200   0.0300"
    "   0.0010   0.0020   0.0030   1.00  999.9"
)


def write(path: Path, times: list[str], clock: str = "GPST", q: str = "1", more: tuple[str, str] = ("", "")) -> Path:
    rows = [time + VALUES.format(q=q) + more[1] for time in times]
    path.write_text(HEADER.format(clock=clock, more=more[0]) + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize(
    ("clock", "times"),
    [
        ("GPST", ["2217 375062.000", "2217 375062.200"]),
        ("GPST", ["2022/07/07 08:11:02.000", "2022/07/07 08:11:02.200"]),
        ("UTC", ["2022/07/07 08:10:44.000", "2022/07/07 08:10:44.200"]),
    ],
)
def test_all_clocks_give_seconds_of_the_gps_week(clock: str, times: list[str], tmp_path: Path) -> None:
    # Thursday 08:11:02 is 4 days, 8 hours, 11 minutes and 2 seconds after Sunday midnight; GPS - UTC = 18 s in 2022.
    track = read_gnss(write(tmp_path / "a.pos", times, clock))
    np.testing.assert_allclose(track.time, [4 * 86400 + 8 * 3600 + 11 * 60 + 2.0, 375062.2], atol=1e-6)


def test_seconds_run_on_over_the_end_of_the_week(tmp_path: Path) -> None:
    week = read_gnss(write(tmp_path / "a.pos", ["2217 604799.500", "2218 0.500"]))
    np.testing.assert_allclose(week.time, [604799.5, 604800.5])
    date = read_gnss(write(tmp_path / "b.pos", ["2022/07/09 23:59:59.5", "2022/07/10 00:00:00.5"]))
    np.testing.assert_allclose(date.time, week.time)


def test_leap_seconds_of_another_year(tmp_path: Path) -> None:
    utc = read_gnss(write(tmp_path / "a.pos", ["2010/03/01 00:00:00.0"], "UTC"))
    gps = read_gnss(write(tmp_path / "b.pos", ["2010/03/01 00:00:00.0"], "GPST"))
    assert utc.time[0] - gps.time[0] == 15.0


def test_position_and_std(tmp_path: Path) -> None:
    track = read_gnss(write(tmp_path / "a.pos", ["2217 1.0"]))
    np.testing.assert_allclose(track.position, [[32.825683159 * DEG, 34.955962416 * DEG, 28.1]])
    np.testing.assert_allclose(track.position_std, [[0.01, 0.02, 0.03]])
    assert track.velocity is None
    assert track.quality == {"fix": 1}
    assert track.warnings == ()


def test_velocity_is_turned_down(tmp_path: Path) -> None:
    more = (" vn(m/s) ve(m/s) vu(m/s) sdvn sdve sdvu sdvne sdveu sdvun", " 1.0 2.0 3.0 0.1 0.2 0.3 0 0 0")
    track = read_gnss(write(tmp_path / "a.pos", ["2217 1.0"], more=more))
    np.testing.assert_allclose(track.velocity, [[1.0, 2.0, -3.0]])
    np.testing.assert_allclose(track.velocity_std, [[0.1, 0.2, 0.3]])


def test_positions_that_are_not_fixed_are_counted(tmp_path: Path) -> None:
    path = write(tmp_path / "a.pos", ["2217 1.0", "2217 2.0"], q="2")
    path.write_text(path.read_text() + "2217 3.0" + VALUES.format(q="5") + "\n")
    track = read_gnss(path)
    assert track.quality == {"float": 2, "single": 1}
    assert track.warnings == (f"{path}: 2 float, 1 single positions",)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "latitude(deg) longitude(deg)  height(m)",
            "e-baseline(m) n-baseline(m) u-baseline(m)",
            "positions are baselines",
        ),
        ("34.955962416", "34.9559x2416", r"line 6: .*; expected a row of numbers"),
        ("   1.00  999.9", "", "line 6: 15 values; expected 17 as before|line 7"),
    ],
)
def test_other_forms_are_refused(old: str, new: str, message: str, tmp_path: Path) -> None:
    path = write(tmp_path / "a.pos", ["2217 1.0", "2217 2.0"])
    text = path.read_text()
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        read_gnss(path)


def test_header_only(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has a header and no rows; expected positions"):
        read_gnss(write(tmp_path / "a.pos", []))


def test_heights_above_the_sea_must_be_configured(tmp_path: Path) -> None:
    from written_recordings import write_config, write_recording

    values = write_recording(tmp_path)
    path = write(tmp_path / "a.pos", ["2217 101.0", "2217 102.0"])
    path.write_text(path.read_text().replace("/ellipsoidal", "/geodetic"))
    values["gnss"] = {"file": "a.pos"}
    with pytest.raises(InputError, match="above the sea; expected height: sea-level"):
        load(write_config(tmp_path, values))
    values["gnss"] |= {"height": "sea-level", "geoid_height_m": 17.0}
    recording = load(write_config(tmp_path, values))
    assert recording.gnss is not None
    np.testing.assert_allclose(recording.gnss.position[:, 2], 45.1)


def test_jst_is_nine_hours_ahead_of_utc(tmp_path: Path) -> None:
    jst = read_gnss(write(tmp_path / "a.pos", ["2022/07/07 17:10:44.000"], "JST"))
    utc = read_gnss(write(tmp_path / "b.pos", ["2022/07/07 08:10:44.000"], "UTC"))
    assert jst.time[0] == utc.time[0]


def test_degrees_minutes_and_seconds(tmp_path: Path) -> None:
    path = write(tmp_path / "a.pos", ["2217 1.0", "2217 2.0"])
    text = path.read_text().replace("latitude(deg) longitude(deg)", "latitude(d'\") longitude(d'\")")
    path.write_text(text.replace("32.825683159   34.955962416", "-0 30 36.00000   34 57 21.46470"))
    track = read_gnss(path)
    np.testing.assert_allclose(track.position[1] / DEG, [-0.51, 34.955962417, 28.1 / DEG], atol=1e-9)
    np.testing.assert_allclose(track.position_std, [[0.01, 0.02, 0.03]] * 2)


def test_ecef_is_turned_to_north_east_down(tmp_path: Path) -> None:
    # on the equator at 90 deg east: x points west, y up, z north
    more = (" vx(m/s) vy(m/s) vz(m/s) sdvx sdvy sdvz sdvxy sdvyz sdvzx", " 1.0 2.0 3.0 0.1 0.2 0.3 0 0 0")
    path = write(tmp_path / "a.pos", ["2217 1.0"], more=more)
    text = path.read_text().replace("latitude(deg) longitude(deg)  height(m)", "x-ecef(m) y-ecef(m) z-ecef(m)")
    text = text.replace(
        "sdn(m)   sde(m)   sdu(m)  sdne(m)  sdeu(m)  sdun(m)", "sdx(m) sdy(m) sdz(m) sdxy(m) sdyz(m) sdzx(m)"
    )
    text = text.replace("32.825683159   34.955962416    28.1000", "0.0 6378147.0 0.0")
    path.write_text(text.replace("0.0010   0.0020   0.0030", "0 0 0"))
    track = read_gnss(path)
    np.testing.assert_allclose(track.position, [[0.0, np.pi / 2, 10.0]], atol=1e-8)
    np.testing.assert_allclose(track.velocity, [[3.0, -1.0, -2.0]], atol=1e-12)
    np.testing.assert_allclose(track.position_std, [[0.03, 0.01, 0.02]], atol=1e-12)
    np.testing.assert_allclose(track.velocity_std, [[0.3, 0.1, 0.2]], atol=1e-12)


def test_without_a_header_the_clock_is_said_to_be_unknown(tmp_path: Path) -> None:
    path = write(tmp_path / "a.pos", ["2022/07/07 08:11:02.000", "2022/07/07 08:11:02.200"])
    path.write_text("\n".join(line for line in path.read_text().splitlines() if line[:1] != "%") + "\n")
    assert data_format(path) == "rtklib-pos"
    track = read_gnss(path)
    assert track.time[0] == 375062.0
    assert "no header" in track.warnings[0]


def test_one_broken_row_among_whole_ones_is_named_and_left_out(tmp_path: Path) -> None:
    path = write(tmp_path / "a.pos", ["2217 1.0", "2217 2.0", "2217 3.0"])
    lines = path.read_text().splitlines()
    lines[-2] = lines[-2].replace("34.", "broken ", 1)
    path.write_text("\n".join(lines) + "\n")
    track = read_gnss(path)
    assert len(track.time) == 2
    assert f"line {len(lines) - 1}: " in track.warnings[0]
    assert track.source.place(1).endswith(f"line {len(lines)}")


DATED = [f"2022/07/03 00:00:0{n}.000" for n in (1, 2, 3)]


@pytest.mark.parametrize(
    ("times", "headed"), [(["2217 1.0", "2217 2.0", "2217 3.0"], True), (DATED, True), (DATED, False)]
)
def test_a_broken_first_row_changes_no_clock(times: list[str], headed: bool, tmp_path: Path) -> None:
    path = write(tmp_path / "a.pos", times)
    kept = [line for line in path.read_text().splitlines() if headed or not line.startswith("%")]
    first = next(n for n, line in enumerate(kept) if not line.startswith("%"))
    path.write_text("\n".join([*kept[:first], kept[first][5:40], *kept[first + 1 :]]) + "\n")
    assert data_format(path) == "rtklib-pos"
    track = read_gnss(path)
    np.testing.assert_allclose(track.time, [2.0, 3.0], atol=1e-6)
    # the week began at midnight of GPS time, 18 s before that of UTC
    assert utc_of_zero(path) == 1656806400.0 - 18.0
