"""What a section says and what the model holds are the same, in both directions, for every setting."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polyins import config
from polyins.config.units import key_of, matches, read, split, write
from polyins.config.yaml_document import read_yaml, write_yaml
from polyins.model.recording import FilterOptions, RollingOptions, StandstillOptions, StartOptions
from polyins.model.rig import DEG, AidingSensor, Imu, ImuErrors, NoiseGrade, Wheel
from polyins.simulation.drive_scenario import Drive, ReplayedDrive
from polyins.simulation.error_scenario import SensorErrors
from polyins.simulation.gnss import GnssReceiver
from polyins.simulation.imu_errors import Imperfections
from polyins.simulation.path import Driving
from polyins.simulation.replay import Ride
from polyins.simulation.scenario import Fixes
from polyins.simulation.wheel_scenario import WheelModule

positive = st.floats(1e-9, 1e3)
share = st.floats(0.0, 1.0)
signed = st.floats(-1e3, 1e3)


def vectors(numbers: st.SearchStrategy[float], size: int = 3) -> st.SearchStrategy[Any]:
    return st.lists(numbers, min_size=size, max_size=size).map(np.array)


rolling = st.builds(
    lambda interval, part, **others: RollingOptions(interval, part * interval, **others),
    positive,
    st.floats(0.1, 0.9),
    predict=st.sampled_from(["window", "end"]),
    wheel_speed_std=vectors(positive),
    body_speed_std=vectors(positive),
    constraint_interval=positive,
    constraint_std=positive,
    standstill=st.booleans(),
)
standstill = st.builds(StandstillOptions, positive, positive, positive)
filters = st.builds(
    FilterOptions,
    gate_limit=st.none() | positive,
    gnss_snap=st.floats(0.0, 0.1),
    gravity=positive,
    rolling=rolling,
    standstill=st.none() | standstill,
)
starts = st.builds(
    StartOptions,
    time=st.none() | signed,
    end_time=st.none() | signed,
    velocity=st.none() | vectors(signed),
    roll_pitch=st.none() | vectors(signed, 2),
    heading=st.none() | signed,
    heading_from=st.sampled_from(["auto", "value", "gnss-course", "reference"]),
    static_interval=st.none() | st.tuples(signed, signed),
    position_std=st.none() | vectors(positive),
    velocity_std=st.none() | vectors(positive),
    attitude_std=st.none() | vectors(positive),
    estimate_gyro_bias=st.booleans(),
)
noise = st.builds(NoiseGrade, *(vectors(positive) for _ in range(6)), positive, vectors(positive), vectors(positive))
errors = st.builds(ImuErrors, *(vectors(signed) for _ in range(4)))
spreads = st.builds(ImuErrors, *(vectors(positive) for _ in range(4)))
wheels = st.builds(
    Wheel, st.floats(1e-3, 5.0), vectors(st.floats(-1.0, 1.0)), st.booleans(), share, lever_arm_std=share
)
imus = st.builds(
    Imu,
    st.just("left"),
    noise,
    position=vectors(st.floats(-10.0, 10.0)),
    initial_errors=errors,
    initial_std=spreads,
    module=st.sampled_from(["", "board"]),
    mount_std=share,
)
imperfections = st.builds(
    Imperfections,
    turn_on_share=share,
    noise=st.booleans(),
    biases=st.booleans(),
    scales=st.booleans(),
    **{item.name: positive for item in fields(Imperfections) if item.name.endswith(("_std", "_mean", "_walk", "_lsb"))},
)


def sensors(kind: str, walks: bool = False) -> st.SearchStrategy[AidingSensor]:
    position = vectors(st.floats(-10.0, 10.0))
    return st.builds(AidingSensor, st.just(kind), position, share, offset_random_walk=share if walks else st.just(0.0))


SETTINGS: list[tuple[type[config.Section], st.SearchStrategy[Any], dict[str, Any]]] = [
    (config.Rolling, rolling, {}),
    (config.Standstill, standstill, {}),
    (config.Filter, filters, {}),
    (config.StartEntry, starts, {}),
    (config.Noise, noise, {}),
    (config.InitialErrors, errors, {}),
    (config.InitialStd, spreads, {}),
    (config.WheelEntry, wheels, {"spin_axis": "x"}),
    (config.ImuEntry, imus, {}),
    (config.HeightEntry, sensors("height", walks=True), {}),
    (config.HeadingEntry, sensors("heading"), {}),
    (config.OdometerEntry, sensors("odometer"), {}),
    (SensorErrors, imperfections, {}),
]
"""a section, what it gives, and what it needs besides"""


@pytest.mark.parametrize(("section", "values", "besides"), SETTINGS, ids=lambda item: getattr(item, "__name__", ""))
def test_what_is_written_reads_back(section, values, besides, tmp_path_factory):
    file = tmp_path_factory.mktemp("written") / "section.yaml"

    @settings(deadline=None)
    @given(values)
    def reads_back(value):
        file.write_text(write_yaml({**write(section, value), **besides}))
        known = {"kind": value.kind} if isinstance(value, AidingSensor) else {}
        same(read(section.model_validate(read_yaml(file).values), type(value), **known), value)

    reads_back()


def same(read: Any, value: Any) -> None:
    assert type(read) is type(value)
    if is_dataclass(value):
        for item in fields(value):
            same(getattr(read, item.name), getattr(value, item.name))
    elif isinstance(value, np.ndarray | float):
        np.testing.assert_allclose(read, value, rtol=1e-15)
    else:
        assert read == value


@pytest.mark.parametrize(
    ("section", "kind"),
    [
        (config.Rolling(), RollingOptions()),
        (config.Standstill(), StandstillOptions()),
        (config.Filter(), FilterOptions()),
        (config.StartEntry(), StartOptions()),
        (config.InitialErrors(), ImuErrors()),
        (config.WheelEntry(radius_m=0.1, spin_axis="x"), Wheel(0.1)),
        (SensorErrors(), Imperfections()),
        (Drive(), Driving()),
        (ReplayedDrive(file="drive.pos"), Ride()),
    ],
    ids=lambda item: type(item).__name__,
)
def test_defaults_are_the_models(section, kind):
    same(read(section, type(kind)), kind)
    required = {key for key, field in type(section).model_fields.items() if field.is_required()}
    assert set(write(type(section), kind)) == required & set(matches(type(section), type(kind)))


ELSEWHERE: dict[str, set[str]] = {
    "FilterOptions": {"nonholonomic"},
    "StartOptions": {"goes_on"},
    "Imu": {"rotation"},
    "Wheel": {"steering", "radius_std", "lever_arm_std"},
    "AidingSensor": {"kind", "offset_random_walk"},
}
"""fields that no key of a section gives by itself: they follow from several or from the section, or a run sets them"""
CLOCK = set(config.clock.ClockSettings.model_fields)
OTHERWISE: dict[str, set[str]] = {
    "Noise": {"grade"},
    "WheelEntry": {"spin_axis", "side", "tilt_deg"},
    "ImuEntry": {
        "format", "columns", "rate_hz", "gyro_range_deg_s", "axes", "mount_deg", "gyro_matrix", "accel_matrix", "file",
        "stream", *CLOCK,
    },
    "Fixes": {"lies"},
    "WheelModule": {"name", "position_m", "chips", "calibrated", "slip"},
    "ReplayedDrive": {"file", "from_s", "to_s", "position_std_m"},
    "SensorErrors": {"vibration_m_s2", "common_noise_share", "common_drift_share"},
    **{
        name: {"file", "stream", "rate_hz", "columns", key, *CLOCK} for name, key in
        (("HeightEntry", "std_m"), ("HeadingEntry", "std_deg"))
    },
    "OdometerEntry": {
        "file", "stream", "rate_hz", "columns", "std_m_s", "right_std_m_s", "down_std_m_s", "constraint_interval_s",
        *CLOCK,
    },
}  # fmt: skip
"""keys that say where data are and what is made of them before they reach the filter"""


@pytest.mark.parametrize(
    ("section", "kind"),
    [
        (config.Rolling, RollingOptions),
        (config.Standstill, StandstillOptions),
        (config.Filter, FilterOptions),
        (config.StartEntry, StartOptions),
        (config.Noise, NoiseGrade),
        (config.InitialErrors, ImuErrors),
        (config.InitialStd, ImuErrors),
        (config.WheelEntry, Wheel),
        (config.ImuEntry, Imu),
        (config.HeightEntry, AidingSensor),
        (config.HeadingEntry, AidingSensor),
        (config.OdometerEntry, AidingSensor),
        (SensorErrors, Imperfections),
        (Drive, Driving),
        (ReplayedDrive, Ride),
        (Fixes, GnssReceiver),
        (WheelModule, Wheel),
    ],
)
def test_every_field_has_a_key_and_every_key_reaches_one(section, kind):
    found = matches(section, kind)
    assert {item.name for item in fields(kind)} - set(found.values()) <= ELSEWHERE.get(kind.__name__, set())
    assert set(section.model_fields) - set(found) == OTHERWISE.get(section.__name__, set())
    assert len(set(found.values())) == len(found)


@pytest.mark.parametrize(
    ("key", "name", "factor"),
    [
        ("rate_std_deg_s", "rate_std", DEG),
        ("velocity_std_m_s", "velocity_std", 1.0),
        ("gyro_bias_deg_h", "gyro_bias", DEG / 3600.0),
        ("angle_random_walk_deg_sqrt_h", "angle_random_walk", DEG / 60.0),
        ("velocity_random_walk_m_s_sqrt_h", "velocity_random_walk", 1.0 / 60.0),
        ("accel_bias_mgal", "accel_bias", 1e-5),
        ("gyro_scale_ppm", "gyro_scale", 1e-6),
        ("correlation_time_h", "correlation_time", 3600.0),
        ("g_sensitivity_deg_s_g", "g_sensitivity", DEG / 9.80665),
        ("rectification_mg_g2", "rectification", 1e-3 / 9.80665),
        ("accel_lsb_mg", "accel_lsb", 9.80665e-3),
        ("radius_std", "radius_std", 1.0),
    ],
)
def test_the_unit_stands_in_the_key(key, name, factor):
    stem, unit = split(key)
    assert stem == name
    assert unit.times / unit.by == pytest.approx(factor, rel=1e-15)


def test_numbers_are_written_as_they_were_given():
    grade = read(config.Noise.model_validate("consumer-mems"), NoiseGrade)
    assert write(config.Noise, grade) == {
        key: value if key == "correlation_time_h" else [value] * 3
        for key, value in config.NOISE_GRADES["consumer-mems"].items()
    }
    assert write(config.StartEntry, StartOptions(heading=0.1 * DEG)) == {"heading_deg": 0.1}


def test_what_is_known_otherwise_is_not_read():
    same(read(config.Filter(), FilterOptions, gravity=9.81), replace(FilterOptions(), gravity=9.81))


def test_a_key_by_its_name():
    assert key_of(config.HeadingEntry, "std") == "std_deg"
