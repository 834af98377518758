"""The start is found from what has come, the same whatever came twice or in another order."""

import random
from dataclasses import replace

import numpy as np
import pytest
from driven_vehicle import drive

import polyins as pi
from polyins.model.methods import find_method
from polyins.model.recording import Recording, StartOptions
from polyins.navigate.choice import choose
from polyins.navigate.samples import GnssFix, ImuSample, Sample
from polyins.navigate.starter import KEPT, Starter
from polyins.prepare.alignment import Start

DELAY = 0.5


def begun(
    blank: Recording, samples: list[Sample], needs_fix: bool = True, method: str = "enav-fusion"
) -> tuple[Starter, Start | None, list[Sample]]:
    starter = Starter(replace(blank, imus=(), gnss=None), DELAY, needs_fix, method)
    for k, sample in enumerate(samples):
        found = starter.take(sample)
        if found:
            return starter, found[0], [*found[1], *samples[k + 1 :]]
    return starter, None, []


def assert_same(a: Start, b: Start) -> None:
    for name in ("time", "position", "velocity", "attitude", "imu_errors"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_what_was_collected_is_handed_on_in_order(recording: Recording, samples: list[Sample]) -> None:
    _, start, all_of_them = begun(recording, samples)
    assert start is not None
    assert start.time < 9.0
    assert [e.time for e in all_of_them] == [e.time for e in samples]
    for sent, handed in zip(samples, all_of_them, strict=True):
        assert type(sent) is type(handed)
    by_name = [e for e in all_of_them if isinstance(e, ImuSample) and e.imu == "imu2"]
    np.testing.assert_array_equal([e.dvel for e in by_name], recording.imus[1].dvel)


def test_late_and_double_epochs_change_nothing(recording: Recording, samples: list[Sample]) -> None:
    _, start, _ = begun(recording, samples)
    chance = random.Random(1)
    late = sorted(samples, key=lambda e: e.time + chance.uniform(0.0, 0.8 * DELAY))
    double = [e for sample in late for e in [sample] * chance.choice([1, 2])]
    starter, again, _ = begun(recording, double)
    assert start is not None
    assert again is not None
    assert_same(start, again)
    assert starter.counts["duplicated"] > 100


def test_a_start_given_fully_needs_no_motion(recording: Recording, samples: list[Sample]) -> None:
    given = StartOptions(
        position=recording.gnss.position[0],
        velocity=np.zeros(3),
        roll_pitch=np.zeros(2),
        heading=1.0,
        heading_from="value",
        estimate_gyro_bias=False,
    )
    _, start, rest = begun(replace(recording, start=given), samples)
    assert start is not None
    assert start.time == recording.imus[0].time[0]
    assert len(rest) == len(samples)


def test_a_standstill_has_its_chance(recording: Recording, samples: list[Sample]) -> None:
    _, start, _ = begun(replace(recording, start=StartOptions(heading=1.0)), samples)
    assert start is not None
    assert start.sources["standstill"].startswith("found: 0.0")
    # not before it is over: a longer one knows the gyros better
    assert 7.5 < start.time < 9.0
    interval = (0.02, 7.5)
    _, start, _ = begun(replace(recording, start=StartOptions(heading=1.0, static_interval=interval)), samples)
    assert start is not None
    assert start.sources["gyro_bias"] == "mean of 7.5 s at standstill"


def test_it_says_what_is_missing(recording: Recording, samples: list[Sample]) -> None:
    starter, start, _ = begun(recording, [e for e in samples if isinstance(e, GnssFix)])
    assert start is None
    assert starter.why == "no data from imu1"
    starter, start, _ = begun(recording, [e for e in samples if isinstance(e, ImuSample)])
    assert start is None
    assert "GNSS" in starter.why
    starter, start, _ = begun(recording, [e for e in samples if e.time < 6.0])
    assert start is None
    assert starter.why == "collecting data until 9 s"
    starter, start, _ = begun(replace(recording, start=StartOptions()), [e for e in samples if e.time < 7.0])
    assert start is None
    assert "heading" in starter.why


def test_an_imu_that_sends_nothing_is_not_waited_for(recording: Recording, samples: list[Sample]) -> None:
    _, start, _ = begun(recording, [e for e in samples if isinstance(e, GnssFix) or e.imu != "imu3"])
    assert start is not None
    assert len(start.imu_errors) == len(recording.rig.imus)
    np.testing.assert_array_equal(start.imu_errors[2, :3], recording.rig.imus[2].initial_errors.gyro_bias)


def test_waiting_does_not_fill_the_memory(recording: Recording) -> None:
    starter = Starter(replace(recording, imus=(), gnss=None), DELAY, needs_fix=True)
    for k in range(6000):
        starter.take(ImuSample("imu1", k / 10, np.full(3, 1e-6), np.full(3, 1e-6)))
    rows = starter.imus["imu1"]
    assert len(rows.stamps) * rows.width == len(rows.numbers)
    assert 10 * KEPT < len(rows.stamps) < 10 * (KEPT + 15.0)


def epochs_of(recording: Recording) -> list[Sample]:
    found: list[Sample] = [
        ImuSample(stream.name, float(stream.time[k]), stream.dtheta[k], stream.dvel[k])
        for stream in recording.imus
        for k in range(len(stream.time))
    ]
    gnss = recording.gnss
    assert gnss is not None
    given = gnss.velocity is not None and gnss.velocity_std is not None
    for k in range(len(gnss.time)):
        velocity = (gnss.velocity[k], gnss.velocity_std[k]) if given else (None, None)
        position, std = gnss.position[k], gnss.position_std[k]
        found.append(GnssFix(float(gnss.time[k]), position, std, *velocity, geodetic=recording.geodetic))
    return sorted(found, key=lambda sample: sample.time)


@pytest.mark.parametrize("method", ["single", "enav-fusion", "imu-fusion"])
@pytest.mark.parametrize("start", [StartOptions(), StartOptions(heading=1.0)])
def test_it_is_the_start_of_the_whole_recording(
    recording: Recording, samples: list[Sample], method: str, start: StartOptions
) -> None:
    whole = replace(recording, start=start)
    _, live, _ = begun(whole, samples, method=method)
    assert live is not None
    taken = [0] if method == "single" else list(range(len(whole.rig.imus)))
    assert_same(live.subset(taken), pi.find_start(whole, method))


@pytest.mark.parametrize("method", ["body-ins", "wheel-ins", "triple-ins"])
def test_so_it_is_for_a_vehicle_without_a_given_heading(method: str) -> None:
    made = drive(gnss=True)
    whole = replace(made, start=StartOptions(), reference=None)
    _, live, _ = begun(whole, epochs_of(whole), method=method)
    batch_start = pi.find_start(whole, method)
    assert live is not None
    taken = choose(find_method(method), whole.rig).all
    assert_same(live.subset(taken), batch_start)
    assert made.reference is not None
    assert made.reference.attitude is not None
    true = np.interp(live.time, made.reference.time, np.unwrap(made.reference.attitude[:, 2]))
    assert abs((live.attitude[2] - true + np.pi) % (2.0 * np.pi) - np.pi) < np.radians(0.5)
