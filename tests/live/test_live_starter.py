"""The start is found from what has come, the same whatever came twice or in another order."""

import random
from dataclasses import replace

import numpy as np

from polyins.live.events import Epoch, GnssEpoch, ImuEpoch
from polyins.live.starter import KEPT, Starter
from polyins.model.recording import Recording, StartOptions
from polyins.prepare.alignment import Start

DELAY = 0.5


def begun(blank: Recording, epochs: list[Epoch], needs_fix: bool = True) -> tuple[Starter, Start | None, list[Epoch]]:
    starter = Starter(replace(blank, imus=(), gnss=None), DELAY, needs_fix)
    for k, epoch in enumerate(epochs):
        found = starter.take(epoch)
        if found:
            return starter, found[0], [*found[1], *epochs[k + 1 :]]
    return starter, None, []


def assert_same(a: Start, b: Start) -> None:
    for name in ("time", "position", "velocity", "attitude", "imu_errors"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_what_was_collected_is_handed_on_in_order(recording: Recording, epochs: list[Epoch]) -> None:
    _, start, all_of_them = begun(recording, epochs)
    assert start is not None
    assert start.time < 9.0
    assert [e.time for e in all_of_them] == [e.time for e in epochs]
    for sent, handed in zip(epochs, all_of_them, strict=True):
        assert type(sent) is type(handed)
    by_name = [e for e in all_of_them if isinstance(e, ImuEpoch) and e.imu == "imu2"]
    np.testing.assert_array_equal([e.dvel for e in by_name], recording.imus[1].dvel)


def test_late_and_double_epochs_change_nothing(recording: Recording, epochs: list[Epoch]) -> None:
    _, start, _ = begun(recording, epochs)
    chance = random.Random(1)
    late = sorted(epochs, key=lambda e: e.time + chance.uniform(0.0, 0.8 * DELAY))
    double = [e for epoch in late for e in [epoch] * chance.choice([1, 2])]
    starter, again, _ = begun(recording, double)
    assert start is not None
    assert again is not None
    assert_same(start, again)
    assert starter.counts["duplicated"] > 100


def test_a_start_given_fully_needs_no_motion(recording: Recording, epochs: list[Epoch]) -> None:
    given = StartOptions(
        position=recording.gnss.position[0],
        velocity=np.zeros(3),
        roll_pitch=np.zeros(2),
        heading=1.0,
        heading_from="value",
        estimate_gyro_bias=False,
    )
    _, start, rest = begun(replace(recording, start=given), epochs)
    assert start is not None
    assert start.time == recording.imus[0].time[0]
    assert len(rest) == len(epochs)


def test_a_standstill_has_its_chance(recording: Recording, epochs: list[Epoch]) -> None:
    _, start, _ = begun(replace(recording, start=StartOptions(heading=1.0)), epochs)
    assert start is not None
    assert start.sources["standstill"].startswith("found: 0.0")
    assert 3.0 < start.time < 6.0
    interval = (0.02, 7.5)
    _, start, _ = begun(replace(recording, start=StartOptions(heading=1.0, static_interval=interval)), epochs)
    assert start is not None
    assert start.sources["gyro_bias"] == "mean of 7.5 s at standstill"


def test_it_says_what_is_missing(recording: Recording, epochs: list[Epoch]) -> None:
    starter, start, _ = begun(recording, [e for e in epochs if isinstance(e, GnssEpoch) or e.imu != "imu3"])
    assert start is None
    assert starter.why == "no data from imu3"
    starter, start, _ = begun(recording, [e for e in epochs if isinstance(e, ImuEpoch)])
    assert start is None
    assert "GNSS" in starter.why
    starter, start, _ = begun(recording, [e for e in epochs if e.time < 6.0])
    assert start is None
    assert starter.why == "collecting data until 9 s"
    starter, start, _ = begun(replace(recording, start=StartOptions()), [e for e in epochs if e.time < 7.0])
    assert start is None
    assert "heading" in starter.why


def test_waiting_does_not_fill_the_memory(recording: Recording) -> None:
    starter = Starter(replace(recording, imus=(), gnss=None), DELAY, needs_fix=True)
    for k in range(6000):
        starter.take(ImuEpoch("imu1", k / 10, np.zeros(3), np.zeros(3)))
    rows = starter.imus["imu1"]
    assert len(rows.stamps) * rows.width == len(rows.numbers)
    assert len(rows.stamps) < 10 * (KEPT + 15.0)
