"""Tables of loggers that name their columns in their own way: streams, units, stamps, rows of several sensors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.rows import ImuRows, Track, intervals
from polyins.model.rig import DEG
from polyins.reading import likely_units as likely
from polyins.reading.column_names import sensor_axis
from polyins.reading.guess import read_table
from polyins.reading.table_stream import TableStream

G = 9.80665
RNG = np.random.default_rng(2)
COUNT = 600
TIME = np.arange(1, COUNT + 1) / 50.0
RATES = 0.3 * np.sin(np.outer(TIME, [0.5, 0.9, 0.7])) + RNG.normal(0.0, 0.002, (COUNT, 3))
FORCE = np.column_stack([0.8 * np.sin(TIME), 0.5 * np.cos(0.7 * TIME), np.full(COUNT, -G)]) + RNG.normal(
    0.0, 0.02, (COUNT, 3)
)


def table(folder: Path, header: str, row: Callable[[int], str | list[str]]) -> list[TableStream]:
    lines = [header] if header else []
    for n in range(COUNT):
        made = row(n)
        lines += [made] if isinstance(made, str) else made
    path = folder / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    found = read_table(path)
    assert isinstance(found, list)
    return found


def joined(*values: float) -> str:
    return ",".join(f"{value:.9g}" for value in values)


def agrees(stream: TableStream, begin: float = TIME[0], tolerance: float = 1e-5, rows: int = COUNT) -> None:
    assert isinstance(stream.rows, ImuRows)
    assert len(stream.rows.time) == rows
    np.testing.assert_allclose(stream.rows.time - stream.rows.time[0] + begin, TIME, atol=1e-5)
    steps = intervals(stream.rows.time)[:, None]
    np.testing.assert_allclose(stream.rows.dtheta / steps, RATES, atol=tolerance)
    np.testing.assert_allclose(stream.rows.dvel / steps, FORCE, atol=10 * tolerance + 1e-4)


def plain(n: int) -> str:
    return joined(*RATES[n], *FORCE[n])


NAMED: dict[str, tuple[str, Callable[[int], str]]] = {
    "rostopic": (
        "%time,field.header.stamp,field.orientation.w,"
        + ",".join(f"field.angular_velocity.{a}" for a in "xyz")
        + ","
        + ",".join(f"field.linear_acceleration.{a}" for a in "xyz"),
        lambda n: f"{17 * 10**17 + round(TIME[n] * 1e9)},{17 * 10**17 + round(TIME[n] * 1e9)},1,{plain(n)}",
    ),
    "ulog2csv": (
        "timestamp," + ",".join(f"gyro_rad[{k}]" for k in range(3)) + ",gyro_integral_dt,"
        + ",".join(f"accelerometer_m_s2[{k}]" for k in range(3)),
        lambda n: f"{round(TIME[n] * 1e6)},{joined(*RATES[n])},20000,{joined(*FORCE[n])}",
    ),
    "arduino": (
        "millis,aX,aY,aZ,gX,gY,gZ",
        lambda n: f"{round(TIME[n] * 1e3)},{joined(*FORCE[n] / G)},{joined(*RATES[n] / DEG)}",
    ),
    "phone": (
        '"Time (s)","Linear Acceleration x (m/s^2)","Linear Acceleration y (m/s^2)","Linear Acceleration z (m/s^2)",'
        '"Acceleration x (m/s^2)","Acceleration y (m/s^2)","Acceleration z (m/s^2)",'
        '"Gyroscope x (rad/s)","Gyroscope y (rad/s)","Gyroscope z (rad/s)"',
        lambda n: f"{TIME[n]},0,0,0,{joined(*FORCE[n])},{joined(*RATES[n])}",
    ),
    "thousandths": (
        "t_us,gx_mdps,gy_mdps,gz_mdps,ax_mg,ay_mg,az_mg",
        lambda n: f"{TIME[n] * 1e6:.0f},{joined(*RATES[n] / DEG * 1e3)},{joined(*FORCE[n] / G * 1e3)}",
    ),
    "own name of the time": ("reading,gx,gy,gz,ax,ay,az", lambda n: f"{TIME[n]},{plain(n)}"),
    "counter of 16 bits": (
        "ms,gx,gy,gz,ax,ay,az",
        lambda n: f"{(60000 + round(TIME[n] * 1e3)) % 65536},{plain(n)}",
    ),
    "counter of 32 bits": (
        "micros,gx,gy,gz,ax,ay,az",
        lambda n: f"{(2**32 - 5 * 10**6 + round(TIME[n] * 1e6)) % 2**32},{plain(n)}",
    ),
    "end of the week": ("tow,gx,gy,gz,ax,ay,az", lambda n: f"{(604795.0 + TIME[n]) % 604800.0:.3f},{plain(n)}"),
    "dates": (
        "utc,gx,gy,gz,ax,ay,az",
        lambda n: f"2024-05-31T23:59:{50 + TIME[n]:09.6f}Z,{plain(n)}"
        if TIME[n] < 10.0
        else f"2024-06-01T00:00:{TIME[n] - 10.0:09.6f}Z,{plain(n)}",
    ),
    "without header": ("", lambda n: f"{TIME[n]},{plain(n)}"),
    "without header, a temperature and a counter": (
        "",
        lambda n: f"{n},{TIME[n] * 1e6:.0f},{25.0 + 1e-4 * n},{joined(*FORCE[n])},{joined(*RATES[n])}",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", NAMED)
def test_columns_as_loggers_call_them(name: str, tmp_path: Path) -> None:
    header, row = NAMED[name]
    (stream,) = table(tmp_path, header, row)
    agrees(stream)


def test_a_gyro_and_an_accelerometer_in_rows_of_their_own(tmp_path: Path) -> None:
    (stream,) = table(
        tmp_path,
        "timestamp,sensor,x,y,z",
        lambda n: [
            f"{TIME[n] * 1e9:.0f},GYROSCOPE,{joined(*RATES[n])}",
            f"{TIME[n] * 1e9:.0f},ACCELEROMETER,{joined(*FORCE[n])}",
            f"{TIME[n] * 1e9:.0f},MAGNETIC_FIELD,20,1,40",
        ],
    )
    assert isinstance(stream.rows, ImuRows)
    steps = intervals(stream.rows.time)[:, None]
    np.testing.assert_allclose(stream.rows.dvel / steps, FORCE, atol=1e-3)


def test_blank_cells_where_a_sensor_has_no_sample(tmp_path: Path) -> None:
    (stream,) = table(
        tmp_path,
        "t,gx,gy,gz,ax,ay,az",
        lambda n: [f"{TIME[n]},{joined(*RATES[n])},,,", f"{TIME[n] + 0.004:.4f},,,,{joined(*FORCE[n])}"],
    )
    assert isinstance(stream.rows, ImuRows)
    assert len(stream.rows.time) == COUNT
    steps = intervals(stream.rows.time)[:, None]
    assert np.sqrt(np.mean((stream.rows.dvel / steps - FORCE) ** 2)) < 0.03


def test_imus_that_a_word_tells_apart(tmp_path: Path) -> None:
    left, right = table(
        tmp_path,
        "ms,imu,gx,gy,gz,ax,ay,az",
        lambda n: [f"{TIME[n] * 1e3:.0f},left,{plain(n)}", f"{TIME[n] * 1e3 + 3:.0f},right,{plain(n)}"],
    )
    agrees(left)
    agrees(right)
    assert right.rows.time[0] == pytest.approx(TIME[0] + 0.003)


def test_positions_beside_an_imu_count_where_they_change(tmp_path: Path) -> None:
    imu, track = table(
        tmp_path,
        "t,gx,gy,gz,ax,ay,az,lat,lon,height",
        lambda n: f"{TIME[n]},{plain(n)}," + (f"{48 + 1e-6 * (n // 25)},11,{500 + n // 25}" if n >= 25 else ",,"),
    )
    agrees(imu)
    assert isinstance(track.rows, Track)
    np.testing.assert_allclose(track.rows.time, TIME[25::25])


@pytest.mark.parametrize(("unit", "scale"), [("m/s", 1.0), ("cm/s", 100.0), ("mm/s", 1000.0)])
def test_velocities_in_whole_numbers_agree_with_positions(unit: str, scale: float, tmp_path: Path) -> None:
    (stream,) = table(
        tmp_path,
        "iTOW,lat,lon,height,velN,velE,velD",
        lambda n: f"{1000 * n},{480000000 + 900 * n},110000000,{500000 + n % 3},{round(10.02 * scale)},0,0",
    )
    assert isinstance(stream.rows, Track)
    assert stream.rows.velocity is not None
    np.testing.assert_allclose(stream.rows.velocity[:, 0], 10.0, atol=0.1 if unit != "m/s" else 0.5)
    np.testing.assert_allclose(stream.rows.position[0], [48.0 * DEG, 11.0 * DEG, 500.0], atol=1e-9)


@pytest.mark.parametrize(
    ("heights", "said"),
    [("alt", "may be above the sea"), ("hMSL", "is above the sea"), ("height,alt", ""), ("alt,geoid_separation", "")],
)
def test_what_heights_are_above(heights: str, said: str, tmp_path: Path) -> None:
    values = {"alt": "450", "hMSL": "450", "height": "500", "geoid_separation": "50"}
    (stream,) = table(
        tmp_path,
        f"t,lat,lon,{heights}",
        lambda n: f"{n},{48 + 1e-6 * n},11," + ",".join(values[name] for name in heights.split(",")),
    )
    assert isinstance(stream.rows, Track)
    assert (said in " ".join(one.text for one in stream.doubts)) if said else not stream.doubts
    assert stream.rows.position[0, 2] == (450.0 if said else 500.0)


def test_a_table_without_gravity_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is gravity taken out"):
        table(tmp_path, "t,gx,gy,gz,ax,ay,az", lambda n: f"{TIME[n]},{joined(*RATES[n], *(0.01 * FORCE[n]))}")


def test_columns_that_tell_nothing_are_listed_with_what_they_hold(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"8 columns hold \(1 from .*8 from .* expected them declared by number"):
        table(tmp_path, "", lambda n: joined(*RNG.uniform(0.0, 1.0, 8)))


@pytest.mark.parametrize("per_g", [16384.0, 8192.0, 4096.0, 2048.0])
def test_raw_counts_are_never_sure(per_g: float, tmp_path: Path) -> None:
    per_deg_s = likely.COUNTS_OF_G[per_g]
    (stream,) = table(
        tmp_path,
        "t,gx,gy,gz,ax,ay,az",
        lambda n: f"{TIME[n]}," + ",".join(
            f"{round(value)}" for value in (*RATES[n] / DEG * per_deg_s, *FORCE[n] / G * per_g)
        ),
    )  # fmt: skip
    agrees(stream, tolerance=1.0 / per_deg_s * DEG)
    assert any(one.about == "units" and "scale is a guess" in one.text for one in stream.doubts)


def test_slow_turns_in_degrees_are_told_by_gravity() -> None:
    time = np.arange(6000) / 50.0
    roll = 0.05 * np.sin(0.4 * time)
    rate = np.column_stack([0.02 * np.cos(0.4 * time), 0.0 * time, 0.0 * time])
    force = np.column_stack([0.0 * time, -G * np.sin(roll), -G * np.cos(roll)])
    noise = np.random.default_rng(4).normal(0.0, 0.05, rate.shape)
    accel = likely.Likely("m/s^2")
    assert likely.gyro_unit(rate / DEG + noise, force, 0.02, accel).unit == "deg/s"
    assert likely.gyro_unit(rate + 0.3 * noise, force, 0.02, accel).unit == "rad/s"
    doubt = likely.gyro_unit(noise, force, 0.02, accel).doubt
    assert doubt is not None
    assert (doubt.about, "is a guess" in doubt.text) == ("units", True)


@pytest.mark.parametrize(
    ("name", "axis", "of"),
    [
        ("ax1", 0, "1"),
        ("imu2.accel.y", 1, "imu2"),
        ("Z Accel [x8004]", 2, ""),
        ("zacc", 2, ""),
        ("AccX", 0, ""),
        ("linear_acceleration.z", 2, ""),
        ("a_RS_S_x [m s^-2]", 0, ""),
    ],
)
def test_names_of_accelerometers(name: str, axis: int, of: str) -> None:
    found = sensor_axis(name)
    assert found is not None
    assert (found.what, found.axis, found.of) == ("accel", axis, of)


@pytest.mark.parametrize(
    "name", ["mx", "mag_x", "q.x", "field.orientation.x", "x", "lat", "angular_velocity_covariance0"]
)
def test_names_of_nothing_inertial(name: str) -> None:
    assert sensor_axis(name) is None
