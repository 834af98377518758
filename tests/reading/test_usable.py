"""IMUs that cannot be right are left out of a recording and named, in memory and in stretches alike."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import polyins as pi
from polyins.errors import InputError
from polyins.model.recording import ImuStream, Recording
from polyins.reading.loading import read_config
from polyins.reading.long_recording import open_long
from polyins.simulation import files
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario

Change = Callable[[ImuStream], ImuStream]


@pytest.fixture(scope="module")
def array() -> Recording:
    return simulate(Scenario(duration_s=60.0, static_s=10.0, rate_hz=50.0, imus=Board(count=4)), seed=1)


def with_second(recording: Recording, change: Change, *others: int) -> Recording:
    streams = [change(one) if i in (1, *others) else one for i, one in enumerate(recording.imus)]
    return replace(recording, imus=tuple(streams))


def all_signs(one: ImuStream) -> ImuStream:
    return ImuStream(one.name, one.time, -one.dtheta, -one.dvel)


def on_its_side(one: ImuStream) -> ImuStream:
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    return ImuStream(one.name, one.time, one.dtheta @ turn.T, one.dvel @ turn.T)


def off_by(seconds: float) -> Change:
    return lambda one: ImuStream(one.name, one.time + seconds, one.dtheta, one.dvel)


def dead(one: ImuStream) -> ImuStream:
    return ImuStream(one.name, one.time, 0.0 * one.dtheta, 0.0 * one.dvel)


def frozen(one: ImuStream) -> ImuStream:
    return ImuStream(one.name, one.time, 0.0 * one.dtheta + one.dtheta[0], 0.0 * one.dvel + one.dvel[0])


LEFT_OUT: dict[str, tuple[Change, tuple[str, ...], str]] = {
    "all signs": (all_signs, ("mount", "left out"), r"mount: its axes are \[-x, -y, -z\]"),
    "on its side": (on_its_side, ("mount", "left out"), r"mount: its axes are \[x, z, -y\]"),
    "clock far ahead": (off_by(1000.0), ("left out",), "lie apart from the others'"),
    "clock far behind": (off_by(-1000.0), ("left out",), "lie apart from the others'"),
    "zeros": (dead, ("left out",), "shows the same values throughout"),
    "frozen": (frozen, ("left out",), "shows the same values throughout"),
}


@pytest.mark.parametrize("case", LEFT_OUT)
def test_one_of_four_is_left_out_and_named(case: str, array: Recording, tmp_path: Path) -> None:
    change, kinds, text = LEFT_OUT[case]
    config = files.write(with_second(array, change), tmp_path)
    recording = pi.load(config)
    assert [imu.name for imu in recording.rig.imus] == ["imu1", "imu3", "imu4"]
    assert tuple(one.kind for one in recording.findings) == kinds
    assert {(one.stream, one.severity) for one in recording.findings} == {("imu2", "note")}
    assert re.search(text, recording.findings[0].text)
    long = open_long(read_config(config), least_rows=0)
    assert long is not None
    assert [file.entry.name for file in long.files] == ["imu1", "imu3", "imu4"]
    assert [replace(one, from_s=None, to_s=None) for one in long.head.findings] == [
        replace(one, from_s=None, to_s=None) for one in recording.findings
    ]


def test_an_imu_on_a_clock_a_little_late_does_not_move_the_standstill_out_of_the_data(
    array: Recording, tmp_path: Path
) -> None:
    still = replace(array.start, static_interval=(float(array.imus[0].time[0]), 9.0))
    late = with_second(replace(array, start=still), off_by(0.1))
    recording = pi.load(files.write(late, tmp_path))
    assert recording.start.static_interval == (float(late.imus[1].time[0]), 9.0)


def test_as_many_that_do_not_stand_as_do_are_refused(array: Recording, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"IMU imu2: .*Try axes"):
        pi.load(files.write(with_second(array, all_signs, 2), tmp_path))


def test_two_that_lie_apart_are_refused(array: Recording, tmp_path: Path) -> None:
    pair = with_second(array, off_by(1000.0)).subset([0, 1])
    with pytest.raises(InputError, match="expected at least 2 s in common"):
        pi.load(files.write(pair, tmp_path))
