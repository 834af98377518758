"""Each wrong input of IMUs on wheels stops, or warns, with a message that says where and what was expected."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rolling_files import (
    RADIUS,
    RATE_HZ,
    WHEELS,
    Array,
    Values,
    body_rows,
    fixes,
    wheel_rows,
    write_rows,
    write_vehicle,
)
from written_recordings import write_config

from polyins.errors import InputError
from polyins.reading.loading import load

Spoil = Callable[[Path, Values], Any]


def wheel(index: int, key: str, to: Any) -> Spoil:
    return lambda folder, values: values["imus"][index]["wheel"].update({key: to})


def imu(index: int, key: str, to: Any) -> Spoil:
    return lambda folder, values: values["imus"][index].update({key: to})


def rows_of(name: str, change: Callable[[Array], Array]) -> Spoil:
    return lambda folder, values: write_rows(folder / f"{name}.csv", change(wheel_rows(name)))


def trembling(name: str) -> Spoil:
    """Four seconds of a chip at rest, whose own noise tells it from a dead one and from the others."""

    def at_rest(rows: Array) -> Array:
        rows = rows[: int(4 * RATE_HZ)]
        rows[:, 1:] += 1e-4 * np.random.default_rng(len(name)).standard_normal(rows[:, 1:].shape)
        return rows

    return rows_of(name, at_rest)


def both(*spoils: Spoil) -> Spoil:
    return lambda folder, values: [spoil(folder, values) for spoil in spoils]


def one_wheel(folder: Path, values: Values) -> None:
    del values["imus"][1:]


def every_wheel(key: str, to: Any) -> Spoil:
    return both(*(wheel(index, key, to) for index in range(3)))


def thinned(every: int) -> Spoil:
    """Mean rates over several samples, as a slower sensor has them."""

    def slower(rows: Array) -> Array:
        blocks = rows[: len(rows) // every * every].reshape(-1, every, 7)
        return np.column_stack([blocks[:, -1, 0], blocks[:, :, 1:].mean(axis=1)])

    return lambda folder, values: write_rows(folder / "rear-left.csv", slower(wheel_rows("rear-left")))


def swapped(rows: Array) -> Array:
    """The sensor turned so that its x is the axle."""
    return rows[:, [0, 3, 1, 2, 6, 4, 5]]


def backwards(rows: Array) -> Array:
    rows[:, 1:4] *= -1.0
    return rows


def clipped(rows: Array) -> Array:
    limit = np.radians(900.0)
    rows[:, 1:4] = np.clip(rows[:, 1:4], -limit, limit)
    return rows


def tilted(rows: Array) -> Array:
    """The sensor turned by 4 deg about its x."""
    sin, cos = np.sin(np.radians(4.0)), np.cos(np.radians(4.0))
    turn = np.array([[1, 0, 0], [0, cos, sin], [0, -sin, cos]])
    rows[:, 1:4], rows[:, 4:7] = rows[:, 1:4] @ turn.T, rows[:, 4:7] @ turn.T
    return rows


def later(rows: Array) -> Array:
    rows[:, 0] += 3.0
    return rows


def bigger(name: str, radius: float) -> Spoil:
    return lambda folder, values: write_rows(folder / f"{name}.csv", wheel_rows(name, radius))


ERRORS: dict[str, tuple[Spoil, str, str]] = {
    # settings
    "radius in millimetres": (wheel(0, "radius_m", 300.0), r"imus\[0\]\.wheel\.radius_m: is 300", "expected metres"),
    "radius of zero": (wheel(0, "radius_m", 0.0), r"imus\[0\]\.wheel\.radius_m: is 0", "expected a number above zero"),
    "no radius": (
        lambda folder, values: values["imus"][0]["wheel"].pop("radius_m"),
        r"line \d+: imus\[0\]\.wheel\.radius_m",
        "is missing; expected it",
    ),
    "no spin axis": (
        lambda folder, values: values["imus"][0]["wheel"].pop("spin_axis"),
        r"imus\[0\]\.wheel\.spin_axis",
        "is missing; expected it",
    ),
    "unknown spin axis": (wheel(0, "spin_axis", "right"), r"wheel\.spin_axis: is 'right'", "expected 'x', 'y', 'z'"),
    "unknown key": (wheel(0, "radius", 0.3), r"wheel\.radius: unknown key", r"did you mean radius_m\?"),
    "unknown side": (wheel(0, "side", "front"), r"wheel\.side: is 'front'", "expected 'left' or 'right'"),
    "side against position": (
        wheel(1, "side", "right"),
        r"imus\[1\]\.wheel\.side: is right",
        "y above zero on the right",
    ),
    "all steered": (every_wheel("steering", True), r"imus\[0\]\.wheel\.steering", "expected one that is not"),
    "lever arm in millimetres": (
        wheel(0, "lever_arm_m", [0, 12.0, -5.0]),
        r"imus\[0\]\.wheel\.lever_arm_m: is 13 m long",
        "expected metres, within the radius, 0.3 m",
    ),
    "tilt": (wheel(0, "tilt_deg", [0, 30]), r"imus\[0\]\.wheel\.tilt_deg", "expected at most 20 deg off spin_axis"),
    "tilt of three": (wheel(0, "tilt_deg", [0, 1, 2]), r"wheel\.tilt_deg: is \[0, 1, 2\]", "expected two numbers"),
    "negative radius std": (
        wheel(0, "radius_std", -0.01),
        r"wheel\.radius_std: is -0\.01",
        "expected a number that is not negative",
    ),
    "axes and wheel": (imu(0, "axes", ["x", "-y", "-z"]), r"imus\[0\]\.axes", r"expected wheel\.spin_axis alone"),
    "mount and wheel": (imu(0, "mount_deg", [0, 2, 0]), r"imus\[0\]\.mount_deg", r"expected .* wheel\.tilt_deg"),
    "mount std on a wheel": (
        imu(0, "mount_std_deg", 1),
        r"imus\[0\]\.mount_std_deg",
        "expected it of an IMU on the body",
    ),
    "module over two wheels": (
        both(imu(0, "module", "A"), imu(1, "module", "A")),
        r"imus\[1\]\.module: IMU rear-left shares module 'A' with IMU rear-right, on wheels 1 m apart",
        "expected chips of one board",
    ),
    "module of wheel and body": (
        both(imu(0, "module", "A"), imu(3, "module", "A")),
        r"imus\[3\]\.module: IMU body .*on a wheel and on the body",
        "expected chips of one board",
    ),
    "unknown time offset": (
        imu(0, "time_offset", "guess"),
        r"imus\[0\]\.time_offset: is 'guess'",
        "expected 'estimate'",
    ),
    "unknown prediction": (
        lambda folder, values: values.update(filter={"rolling": {"predict": "middle"}}),
        r"filter\.rolling\.predict: is 'middle'",
        "expected 'window' or 'end'",
    ),
    "no speed interval": (
        lambda folder, values: values.update(filter={"rolling": {"speed_interval_s": 0}}),
        r"filter\.rolling\.speed_interval_s: is 0",
        "expected a number above zero",
    ),
    "window longer than interval": (
        lambda folder, values: values.update(filter={"rolling": {"speed_window_s": 0.6}}),
        r"filter\.rolling\.speed_window_s: is 0\.6",
        "expected at most speed_interval_s, 0.5",
    ),
    "speed without error": (
        lambda folder, values: values.update(filter={"rolling": {"wheel_speed_std_m_s": 0}}),
        r"filter\.rolling\.wheel_speed_std_m_s: is 0",
        "expected numbers above zero",
    ),
    "range of zero": (imu(0, "gyro_range_deg_s", 0), r"imus\[0\]\.gyro_range_deg_s", "expected a number above zero"),
    "plane of what is on one": (
        lambda folder, values: values["gnss"].update(plane_origin={"latitude_deg": 30.0, "longitude_deg": 114.0}),
        r"gnss\.plane_origin: given for positions in metres",
        "expected it with latitude and longitude only",
    ),
    # data
    "does not spin": (
        lambda folder, values: write_rows(folder / "rear-left.csv", body_rows()),
        r"imus\[1\]\.wheel: IMU rear-left turns at 0\.\d+ rad/s, other wheels at 1\d",
        "expected an IMU that turns with its wheel",
    ),
    "another axis": (
        rows_of("rear-right", swapped),
        r"imus\[0\]\.wheel\.spin_axis: is z, but IMU rear-right turns about its x",
        "expected spin_axis: x$",
    ),
    "another axis on the left": (
        rows_of("rear-left", swapped),
        r"imus\[1\]\.wheel\.spin_axis: is -z, but IMU rear-left turns about its x",
        "expected spin_axis: -x$",
    ),
    "wrong sign": (
        wheel(1, "spin_axis", "z"),
        r"imus\[1\]\.wheel\.spin_axis: with z IMU rear-left rolls 1\d\d m backwards",
        r"expected the axis that points to the right: -z\?",
    ),
    "sensor turned over": (
        rows_of("rear-right", backwards),
        r"imus\[0\]\.wheel\.spin_axis: with z IMU rear-right",
        r"the right: -z\?",
    ),
    "too slow a sensor": (
        thinned(15),
        r"imus\[1\]\.wheel: IMU rear-left turns 2\.\d rad per sample at 6\.667 Hz",
        r"expected at most 1\.5",
    ),
    "degrees as radians": (
        rows_of("rear-right", lambda rows: rows * [1, *[180 / np.pi] * 3, 1, 1, 1]),
        r"rear-right\.csv, line \d+: with unit rad/s",
        r"is the unit deg/s\?$",
    ),
    "g": (
        rows_of("rear-right", lambda rows: rows / [1, 1, 1, 1, 9.8, 9.8, 9.8]),
        r"rear-right\.csv: with unit m/s\^2",
        "say unit: g",
    ),
    "not declared as a wheel": (
        lambda folder, values: values["imus"][0].pop("wheel"),
        r"rear-right\.csv, line \d+",
        "On a wheel, it needs the section wheel",
    ),
    "no common span": (imu(0, "clock_offset_s", 132.7), r"IMU rear-right begins at 132\.71", "in common"),
    "mostly saturated": (
        imu(0, "gyro_range_deg_s", 200.0),
        r"rear-right\.csv: \d+ of 4000 rows reach the gyro's full scale, 200 deg/s",
        "expected few",
    ),
}


@pytest.mark.parametrize("case", ERRORS)
def test_message_names_place_and_expectation(case: str, tmp_path: Path) -> None:
    spoil, place, expectation = ERRORS[case]
    values = write_vehicle(tmp_path)
    spoil(tmp_path, values)
    with pytest.raises(InputError) as caught:
        load(write_config(tmp_path, values))
    message = str(caught.value)
    assert re.search(place, message), message
    assert re.search(expectation, message), message
    assert len(message.splitlines()) <= 2


@pytest.mark.parametrize("case", ERRORS)
def test_command_line_says_it_in_two_lines_and_exits_with_2(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from polyins.cli import main

    spoil, place, _ = ERRORS[case]
    values = write_vehicle(tmp_path)
    spoil(tmp_path, values)
    config = write_config(tmp_path, values)
    monkeypatch.setattr("sys.argv", ["polyins", "run", str(config), "--out", str(tmp_path / "out"), "--json"])
    with pytest.raises(SystemExit) as stopped:
        main()
    printed = capsys.readouterr()
    assert stopped.value.code == 2
    assert printed.out == ""
    assert re.search(place.rstrip("$"), printed.err)
    assert len(printed.err.strip().splitlines()) <= 2
    assert not (tmp_path / "out").exists()


SWAPPED = ((0, -0.5, "left"), (1, 0.5, "right"))

WARNINGS: dict[str, tuple[Spoil, str]] = {
    "saturation": (
        both(rows_of("rear-right", clipped), imu(0, "gyro_range_deg_s", 900.0)),
        r"rear-right\.csv: the gyro reaches its full scale, 900 deg/s, in \d+ row\(s\), the first at \d+\.\d+ s",
    ),
    "slow sensor": (thinned(5), r"imus\[1\]\.wheel: IMU rear-left turns 0\.\d+ rad per sample at 20 Hz"),
    "undeclared steering": (
        wheel(2, "steering", False),
        r"imus\[2\]\.wheel\.steering: IMU front-right yaws otherwise than IMU body; is its wheel steered\?",
    ),
    "undeclared steering without a body": (
        both(wheel(2, "steering", False), lambda folder, values: values["imus"].pop()),
        r"imus\[2\]\.wheel\.steering: IMU front-right yaws otherwise than IMU rear-",
    ),
    "undeclared tilt": (
        rows_of("rear-left", tilted),
        r"imus\[1\]\.wheel\.tilt_deg: the spin axis of IMU rear-left is 4\.0 deg off.*expected about \[-?0\.0, 4\.0\]",
    ),
    "radius against GNSS": (
        both(wheel(0, "radius_m", 0.2), wheel(1, "radius_m", 0.2)),
        r"imus\[0\]\.wheel\.radius_m: is 0\.2; GNSS speed says about 0\.(29|3)",
    ),
    "sides roll unlike": (
        bigger("rear-left", 0.33),
        r"imus\[0\]\.wheel\.radius_m: IMU rear-right rolls 1\d\d\.\d m, IMU rear-left 1\d\d\.\d m",
    ),
    "clocks differ": (
        rows_of("rear-left", later),
        r"imus\[1\]: IMU rear-left drives like IMU rear-right \+3\.0 s later",
    ),
    "lever arm of nearly the radius": (
        wheel(0, "lever_arm_m", [0.0, 0.0, 0.28]),
        r"wheel\.lever_arm_m: is \[0, 0, 0\.28\]; centripetal acceleration says about \[0, -?0\.00\d, -?0\.00\d\]",
    ),
    "body a quarter turn off": (
        imu(3, "mount_deg", [0, 0, 90]),
        r"imus\[3\]: IMU body looks turned by -90 deg about down",
    ),
    "body names its axes wrongly": (
        imu(3, "axes", ["-y", "x", "z"]),
        r"imus\[3\]: IMU body looks turned by -90 deg about down",
    ),
    "left and right swapped": (
        both(*(both(imu(k, "position_m", [0, y, 0]), wheel(k, "side", s)) for k, y, s in SWAPPED)),
        "imus: by the wheels' speeds the vehicle turns the other way than IMU body says; are left and right swapped",
    ),
    "gyro with other axes than the accelerometer": (
        lambda folder, values: write_rows(folder / "body.csv", body_rows()[:, [0, 3, 2, 1, 4, 5, 6]]),
        r"imus\[3\]\.axes: IMU body turns about its forward axis when the wheels turn the vehicle",
    ),
    "GNSS clock off by seconds": (
        lambda folder, values: values["gnss"].update(clock_offset_s=3.0),
        r"gnss: fits the wheels with -[23]\.\d\d s added to its stamps",
    ),
    "no side": (
        both(imu(0, "position_m", [0, 0, 0]), lambda folder, values: values["imus"][0]["wheel"].pop("side")),
        r"imus\[0\]\.position_m: IMU rear-right is on the middle line; is its wheel left or right of it\?",
    ),
    "no motion": (
        both(*map(trembling, WHEELS)),
        "imus: no wheel turns; expected a recording of a vehicle that drives",
    ),
}


@pytest.mark.parametrize("case", WARNINGS)
def test_doubtful_input_is_warned_of(case: str, tmp_path: Path) -> None:
    spoil, text = WARNINGS[case]
    values = write_vehicle(tmp_path)
    spoil(tmp_path, values)
    warnings = load(write_config(tmp_path, values)).sentences
    assert any(re.search(text, warning) for warning in warnings), warnings


def test_the_vehicle_that_the_cases_spoil_loads_without_a_word(tmp_path: Path) -> None:
    values = write_vehicle(tmp_path)
    recording = load(write_config(tmp_path, values))
    assert recording.warnings == ()
    del values["gnss"]
    one_wheel(tmp_path, values)
    values["imus"][0]["position_m"] = [0.0, 0.0, 0.0]
    del values["imus"][0]["wheel"]["side"]
    assert load(write_config(tmp_path, values)).warnings == ()


def test_the_recorded_way_is_the_way_rolled(tmp_path: Path) -> None:
    recording = load(write_config(tmp_path, write_vehicle(tmp_path)))
    north = fixes()
    way = np.sum(np.hypot(*np.diff(north[:, 1:3], axis=0).T))
    rolled = [-RADIUS * stream.dtheta[:, 0].sum() for stream in recording.imus[:2]]
    assert np.mean(rolled) == pytest.approx(way, rel=0.02)


def test_a_real_car_is_not_suspected(data_folder: Path) -> None:
    """Of all checks of wheels only those say something that concern damaged rows."""
    from polyins.reading import datasets

    for trial in ("02", "08"):
        texts = [text for text in datasets.wid(trial, gnss=True).warnings if ".csv" not in text]
        assert texts == []


def test_steered_wheels_of_a_real_car_are_found(data_folder: Path) -> None:
    from polyins.config.yaml_document import Document
    from polyins.reading import datasets
    from polyins.reading.loading import load_document
    from polyins.reading.wid import configuration

    folder = datasets.fetch("wid")
    values = copy.deepcopy(configuration(folder, "09"))
    values["imus"] = [imu for imu in values["imus"] if imu["name"] in ("IMU1", "IMU2", "IMU3", "IMU4", "CAR")]
    for entry in values["imus"]:
        if "wheel" in entry:
            entry["wheel"]["steering"] = False
    texts = [text for text in load_document(Document(folder / "09", values)).warnings if "steered" in text]
    assert [re.search(r"IMU (\w+) yaws", text)[1] for text in texts] == ["IMU1", "IMU3"]  # type: ignore[index]
