"""The configuration file: what it may say, what is filled in, how it is written back."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from described_keys import descriptions
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel

from polyins import config
from polyins.config import NOISE_GRADES, Config, ImuEntry, Noise, OutageSchedule, parse
from polyins.config.yaml_document import Document, read_yaml, write_yaml
from polyins.errors import InputError
from polyins.model.recording import FilterOptions


def parsed(values: dict[str, Any]) -> Config:
    return parse(Document(Path("drive.yaml"), values))


def sections() -> Iterator[type[BaseModel]]:
    for member in vars(config).values():
        if isinstance(member, type) and issubclass(member, config.Section):
            yield member


@pytest.mark.parametrize("section", list(sections()), ids=lambda section: section.__name__)
def test_every_key_is_described(section: type[BaseModel]) -> None:
    described = descriptions(section)
    for name in section.model_fields:
        assert described.get(name), f"{section.__name__}.{name}"


def test_only_the_file_of_an_imu_must_be_given() -> None:
    filled = parsed({"imus": [{"file": "a.csv"}, {"file": "b.csv"}]})
    assert [imu.name for imu in filled.imus] == ["imu1", "imu2"]
    assert filled.filter.gate_limit == FilterOptions().gate_limit
    assert filled.gnss is None
    assert filled.outages == ()


def test_numbers_with_exponent_are_numbers(tmp_path: Path) -> None:
    path = tmp_path / "drive.yaml"
    path.write_text("imus: [{file: a.csv}]\nfilter: {gnss_snap_s: 1e-3}\n")
    assert parse(read_yaml(path)).filter.gnss_snap_s == 1e-3


def test_a_gate_of_null_is_no_gate(tmp_path: Path) -> None:
    path = tmp_path / "drive.yaml"
    path.write_text("imus: [{file: a.csv}]\nfilter: {gate_limit: null}\n")
    assert parse(read_yaml(path)).filter.gate_limit is None


def test_defaults_hold_for_imus_that_do_not_say_otherwise() -> None:
    filled = parsed(
        {
            "imu_defaults": {
                "axes": ["x", "-y", "-z"],
                "rate_hz": 100,
                "noise": {"gyro_bias_deg_h": 7, "gyro_scale_ppm": 1},
            },
            "imus": [{"file": "a.csv"}, {"file": "b.csv", "rate_hz": 50, "noise": {"gyro_bias_deg_h": [1, 2, 3]}}],
        }
    )
    first, second = filled.imus
    assert (first.axes, first.rate_hz, first.noise.gyro_bias_deg_h) == (("x", "-y", "-z"), 100.0, (7.0, 7.0, 7.0))
    assert (second.axes, second.rate_hz, second.noise.gyro_bias_deg_h) == (("x", "-y", "-z"), 50.0, (1.0, 2.0, 3.0))
    assert second.noise.gyro_scale_ppm == (1.0, 1.0, 1.0)


@pytest.mark.parametrize("grade", NOISE_GRADES)
def test_a_grade_stands_for_its_figures(grade: str) -> None:
    noise = Noise.model_validate(grade)
    for name, value in NOISE_GRADES[grade].items():
        assert getattr(noise, name) == (value if name == "correlation_time_h" else (value,) * 3)


def test_grades_get_better_in_order() -> None:
    for worse, better in zip(list(NOISE_GRADES)[:-1], list(NOISE_GRADES)[1:], strict=True):
        for name in set(NOISE_GRADES[worse]) - {"correlation_time_h"}:
            assert NOISE_GRADES[better][name] < NOISE_GRADES[worse][name]


def test_a_figure_overrides_the_grade() -> None:
    noise = Noise.model_validate({"grade": "tactical", "accel_bias_mgal": 20})
    assert noise.accel_bias_mgal == (20.0, 20.0, 20.0)
    assert noise.gyro_bias_deg_h == (1.0, 1.0, 1.0)


@given(
    st.floats(-500.0, 500.0),
    st.one_of(st.none(), st.floats(0.0, 500.0)),
    st.floats(1.0, 200.0),
    st.floats(0.01, 0.99),
    st.floats(0.0, 3000.0),
)
def test_a_schedule_has_all_the_whole_outages_and_no_other(
    start: float, after: float | None, every: float, share: float, duration: float
) -> None:
    schedule = OutageSchedule(length_s=share * every, every_s=every, first_after_s=after)
    first, end = start + (every - share * every if after is None else after), start + duration
    intervals = schedule.intervals(start, end)
    candidates = [first + k * every for k in range(4000)]
    expected = [begin for begin in candidates if begin + share * every < end - 2e-6]
    tolerant = [begin for begin in candidates if begin + share * every < end]
    assert set(expected) <= {begin for begin, _ in intervals} <= set(tolerant)
    assert all(stop - begin == pytest.approx(share * every) for begin, stop in intervals)


def test_the_schedule_of_a_published_drive() -> None:
    schedule = OutageSchedule(length_s=30.0, every_s=90.0, first_after_s=0.0)
    intervals = schedule.intervals(271130.0, 273690.0)
    assert len(intervals) == 29
    assert (intervals[0], intervals[-1]) == ((271130.0, 271160.0), (273650.0, 273680.0))


def test_outages_are_a_schedule_or_a_list() -> None:
    imus = [{"file": "a.csv"}]
    schedule = parsed({"imus": imus, "outages": {"length_s": 30, "every_s": 90}}).outages
    assert schedule == OutageSchedule(length_s=30.0, every_s=90.0)
    assert parsed({"imus": imus, "outages": [[1, 2], [3, 4.5]]}).outages == ((1.0, 2.0), (3.0, 4.5))


def test_a_matrix_that_corrects_no_chip_is_refused() -> None:
    degrees = [[57.3, 0, 0], [0, 57.3, 0], [0, 0, 57.3]]
    with pytest.raises(InputError, match=r"gyro_matrix.*differs by 56 from the unit matrix"):
        parsed({"imus": [{"file": "a.csv", "gyro_matrix": degrees}]})


def test_what_is_in_force_can_be_written_and_read_again(tmp_path: Path) -> None:
    filled = parsed(
        {
            "imus": [
                {
                    "file": "a.csv",
                    "axes": ["-z", "y", "x"],
                    "mount_deg": [1, 2, 3],
                    "gyro_matrix": [[1.002, 0, 0.001], [0, 0.998, 0], [0.003, 0, 1]],
                    "initial_std": {"gyro_scale_ppm": 9},
                }
            ],
            "gnss": {"file": "g.txt", "rate_hz": 1},
            "outages": {"length_s": 30, "every_s": 90},
            "start": {"position": {"north_m": 1, "east_m": 2}, "velocity_m_s": [1, 2, 3]},
            "filter": {"gate_limit": None},
        }
    )
    path = tmp_path / "again.yaml"
    path.write_text(write_yaml(filled.model_dump(mode="json", exclude={"imu_defaults"})))
    assert parse(read_yaml(path)) == filled


@given(st.sampled_from(sorted(ImuEntry.model_fields)), st.data())
def test_a_key_with_one_letter_wrong_is_told_the_right_one(key: str, data: st.DataObject) -> None:
    position = data.draw(st.integers(0, len(key) - 1))
    wrong = key[:position] + "q" + key[position + 1 :]
    with pytest.raises(InputError, match=f"imus.0..{wrong}: unknown key; did you mean {key}"):
        parsed({"imus": [{"file": "a.csv", wrong: 1}]})


@pytest.mark.parametrize("value", [True, "3", None, [1]])
def test_only_a_number_is_a_number(value: object) -> None:
    with pytest.raises(InputError, match=r"imus\[0\]\.clock_offset_s: is .*; expected a number"):
        parsed({"imus": [{"file": "a.csv", "clock_offset_s": value}]})


def test_the_line_of_a_nested_key_is_named(tmp_path: Path) -> None:
    path = tmp_path / "drive.yaml"
    path.write_text(
        "imus:\n  - file: a.csv\n  - file: b.csv\n    noise:\n      gyro_scale_ppm: 3\n      gyro_bias: 4\n"
    )
    with pytest.raises(InputError, match=r"drive\.yaml, line 6: imus\[1\]\.noise\.gyro_bias: unknown key"):
        parse(read_yaml(path))
