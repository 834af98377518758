"""Heights, headings and speeds from end to end: consistent, of use, late as good as on time, lies refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path as Path_

import numpy as np
import pytest
from array_recordings import Array, Swing, received, sensed, shaken_path, start_at
from playing import events, feed
from scipy.stats import chi2

from polyins.model.recording import AidingStream, FilterOptions, NonholonomicOptions, Recording, Reference
from polyins.model.rig import DEG, AidingSensor, Imu, ImuErrors, NoiseGrade, Rig
from polyins.navigate import batch
from polyins.navigate.navigator import Navigator
from polyins.reading.loading import load
from polyins.simulation.files import write
from polyins.simulation.path import Path

PLACE = np.array([-0.7, 0.1, 0.4])
STD = {"height": np.array([0.3]), "heading": np.array([0.5 * DEG]), "odometer": np.array([0.05, 0.03, 0.04])}
OFFSET = {"height": 2.5, "heading": 4.0 * DEG, "odometer": 0.02}
GRADE = NoiseGrade.from_datasheet(
    angle_random_walk_deg_sqrt_h=0.2,
    velocity_random_walk_m_s_sqrt_h=0.25,
    gyro_bias_deg_h=50.0,
    accel_bias_mgal=250.0,
    gyro_scale_ppm=1000.0,
    accel_scale_ppm=800.0,
    correlation_time_h=1.0,
)


def calm_path(duration: float, **changes: Swing) -> Path:
    curves = {
        "speed": Swing(8.0, 0.0, 3.0, 0.3),
        "roll": Swing(0.0, 0.0, 0.05, 0.9),
        "pitch": Swing(0.0, 0.0, 0.04, 0.7),
        "heading": Swing(1.0, 0.05, 0.5, 0.2),
    }
    return shaken_path(duration, **(curves | changes))


def shown(truth: Path, kind: str, times: Array, offset: float, seed: int) -> AidingStream:
    """What the sensor shows of the truth, with noise as stated."""
    at = truth.truth(times, PLACE)
    noise = np.random.default_rng([seed, 7]).standard_normal(len(times)) * STD[kind][0]
    if kind == "height":
        value = at.position[:, 2] + offset + noise
    elif kind == "heading":
        value = at.attitude[:, 2] + offset + noise
    else:
        # at this place the path's lever arm turns some of the rotation into sideways motion
        ahead = truth.truth(times)
        value = np.linalg.norm(ahead.velocity, axis=1) / (1.0 + offset) + noise
    return AidingStream(kind, times, value, np.tile(STD[kind], (len(times), 1)))


def aided(
    kind: str, *, offset: float = 0.0, offset_std: float = 0.0, duration: float = 60.0, imus: int = 1, seed: int = 0,
    truth: Path | None = None, outages: tuple[tuple[float, float], ...] = (), every: float = 0.5,
) -> Recording:  # fmt: skip
    """An array along a calm path with fixes and one more sensor."""
    truth = truth or calm_path(duration)
    rng = np.random.default_rng([seed, 5])
    places = np.zeros((1, 3)) if imus == 1 else rng.uniform(-0.1, 0.1, (imus, 3))
    place = np.zeros(3) if kind == "odometer" else PLACE
    known = ImuErrors(*(0.0 * GRADE.gyro_bias_std for _ in range(4)))
    rig = Rig(
        tuple(Imu(f"imu{i + 1}", GRADE, position=where, initial_errors=known) for i, where in enumerate(places)),
        np.array([0.2, 0.1, -0.3]),
        (AidingSensor(kind, place, offset_std),),
    )
    gnss = received(truth, rig.antenna, np.arange(1.03, duration, 1.0), seed)
    times = np.arange(0.77, duration, every)
    stamps = np.arange(1.0, np.floor(duration * 10.0)) / 10.0
    at = truth.truth(stamps)
    return Recording(
        rig,
        sensed(truth, rig, seed, 100.0),
        gnss=replace(gnss, velocity=None, velocity_std=None),
        reference=Reference(stamps, at.position, at.velocity, at.attitude),
        start=start_at(truth, 0.01),
        outages=outages,
        aiding=(shown(truth, kind, times, offset, seed),),
    )


def error_at_reference(solution: batch.Solution, recording: Recording) -> tuple[Array, Array]:
    """Height, m, and heading, rad, less those of the reference."""
    reference = recording.reference
    assert reference is not None
    assert reference.attitude is not None
    k = np.searchsorted(solution.time, reference.time - 1e-6)
    inside = k < len(solution.time)
    k = k[inside]
    height = solution.position[k, 2] - reference.position[inside, 2]
    w, x, y, z = solution.attitude[k].T
    heading = np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    off = heading - reference.attitude[inside, 2]
    return height, np.asarray((off + np.pi) % (2.0 * np.pi) - np.pi)


@pytest.mark.parametrize("method", ["single", "nav-fusion", "enav-fusion"])
@pytest.mark.parametrize("kind", STD)
def test_its_nis_is_chi_square_distributed(kind: str, method: str) -> None:
    total, degrees = 0.0, 0
    for seed in range(4):
        found = batch.run(aided(kind, seed=seed), method).measurements[kind]
        assert found.accepted.all()
        late = found.time > 10.0
        total, degrees = total + found.nis[late].sum(), degrees + int(found.rows[late].sum())
    # what a filter knows of the sensors is what they were drawn from, but errors at the start are half as large
    low, high = chi2.ppf([1e-4, 1.0 - 1e-4], degrees) / degrees
    if kind == "odometer":  # the constraint is exact here, so that two of three rows are quiet
        assert total / degrees < high
        assert total / degrees > low / 3.0
    else:
        assert low < total / degrees < high


@pytest.mark.parametrize("kind", STD)
def test_its_offset_is_found(kind: str) -> None:
    recording = aided(kind, offset=OFFSET[kind], offset_std=2.0 * OFFSET[kind])
    solution = batch.run(recording, "single")
    (found,) = solution.offsets.values()
    assert found.std[-1] < 0.2 * found.std[0]
    assert abs(found.value[-1] - OFFSET[kind]) < 3.0 * found.std[-1]
    assert solution.measurements[kind].accepted.all()


def test_heights_hold_the_height_through_an_outage() -> None:
    recording = aided("height", duration=80.0, outages=((8.0, 68.0),), offset=1.0, offset_std=3.0)
    with_heights, _ = error_at_reference(batch.run(recording, "single"), recording)
    without, _ = error_at_reference(batch.run(replace(recording, aiding=()), "single"), recording)
    assert np.abs(with_heights).max() < 0.5 * np.abs(without).max()
    assert np.abs(with_heights).max() < 0.5


def test_headings_hold_the_heading_of_a_hovering_array() -> None:
    truth = calm_path(120.0, speed=Swing(0.02), heading=Swing(2.9), roll=Swing(0.0, 0.0, 0.02, 1.1))
    recording = aided("heading", duration=120.0, truth=truth, imus=3)
    start = replace(recording.start, attitude_std=np.array([0.5, 0.5, 30.0]) * DEG, heading=2.9 + 20.0 * DEG)
    recording = replace(recording, start=start).as_published()
    solution = batch.run(recording, "enav-fusion")
    _, held = error_at_reference(solution, recording)
    _, free = error_at_reference(batch.run(replace(recording, aiding=()), "enav-fusion"), recording)
    assert np.abs(free[-200:]).min() > 5.0 * DEG
    assert np.abs(held[-200:]).max() < 0.5 * DEG


def test_that_a_vehicle_does_not_slip_slows_its_drift() -> None:
    truth = calm_path(120.0)
    plain = replace(aided("odometer", duration=120.0, truth=truth, outages=((50.0, 110.0),)), aiding=())
    assumed = replace(plain, options=FilterOptions(nonholonomic=NonholonomicOptions(0.5, np.array([0.05, 0.05]))))

    def off(recording: Recording) -> float:
        solution = batch.run(recording, "single")
        at = truth.truth(solution.time[-1100:])
        return float(np.abs(solution.velocity[-1100:] - at.velocity).max())

    assert off(assumed) < 0.5 * off(plain)
    solution = batch.run(assumed, "single")
    assert set(solution.measurements["odometer"].rows) == {2}


@pytest.mark.parametrize("kind", STD)
def test_a_lie_is_rejected_and_counted(kind: str) -> None:
    recording = aided(kind)
    honest = batch.run(recording, "single")
    stream = recording.aiding[0]
    value = stream.value.copy()
    value[60] += 200.0 * STD[kind][0]
    lying = batch.run(replace(recording, aiding=(replace(stream, value=value),)), "single")
    found = lying.measurements[kind]
    np.testing.assert_array_equal(np.flatnonzero(~found.accepted), [60])
    assert np.abs(lying.velocity - honest.velocity).max() < 0.1


@pytest.mark.parametrize("method", ["single", "enav-fusion", "nav-fusion/centralized"])
@pytest.mark.parametrize("kind", STD)
def test_late_it_is_worth_what_it_is_on_time(kind: str, method: str) -> None:
    recording = aided(kind, duration=12.0, imus=3, offset=0.1 * OFFSET[kind], offset_std=OFFSET[kind])
    prepared = batch.prepare(recording, method)
    recording = prepared.recording
    navigator = Navigator(recording.rig, prepared.start, method=method, options=recording.options)
    stream = recording.aiding[0]
    due = sorted(range(len(stream.time)), key=lambda k: stream.time[k] + 0.3)
    for event in events(recording):
        while due and stream.time[due[0]] + 0.3 <= event.arrives:
            k = due.pop(0)
            navigator.aid(kind, stream.time[k], stream.value[k], stream.std[k])
        feed(navigator, recording, event)
    while due:
        k = due.pop(0)
        navigator.aid(kind, stream.time[k], stream.value[k], stream.std[k])
    navigator.flush()
    state, solution = navigator.state, batch.navigate(prepared)
    assert state is not None
    assert not navigator.counts
    np.testing.assert_array_equal(state.position, solution.position[-1])
    np.testing.assert_array_equal(state.velocity, solution.velocity[-1])
    np.testing.assert_array_equal(state.attitude, solution.attitude[-1])


@pytest.mark.parametrize("kind", STD)
def test_chunks_give_the_same_bits(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    recording = aided(kind, duration=20.0, imus=2, offset_std=OFFSET[kind])
    whole = batch.run(recording, "enav-fusion")
    monkeypatch.setattr(batch, "CHUNK", 7)
    again = batch.run(recording, "enav-fusion")
    np.testing.assert_array_equal(again.position, whole.position)
    np.testing.assert_array_equal(again.imu_error_std, whole.imu_error_std)


@pytest.mark.parametrize("kind", STD)
def test_from_files_it_is_the_same(kind: str, tmp_path: Path_) -> None:
    recording = aided(kind, duration=12.0, offset=OFFSET[kind], offset_std=OFFSET[kind])
    read = load(write(recording, tmp_path))
    np.testing.assert_allclose(read.aiding[0].value, recording.aiding[0].value, rtol=1e-12)
    np.testing.assert_allclose(read.aiding[0].std, recording.aiding[0].std, rtol=1e-12)
    assert read.rig.sensors[0].offset_std == pytest.approx(OFFSET[kind], rel=1e-12)
    ours, theirs = batch.run(recording, "single"), batch.run(read, "single")
    np.testing.assert_allclose(theirs.velocity, ours.velocity, atol=1e-9)


def test_the_constraint_alone_needs_no_file(tmp_path: Path_) -> None:
    recording = replace(aided("odometer", duration=12.0), aiding=())
    assumed = FilterOptions(nonholonomic=NonholonomicOptions(0.5, np.array([0.05, 0.06])))
    read = load(write(replace(recording, options=assumed), tmp_path))
    assert read.options.nonholonomic is not None
    assert read.options.nonholonomic.interval == 0.5
    np.testing.assert_array_equal(read.options.nonholonomic.std, [0.05, 0.06])
    assert batch.run(read, "single").measurements["odometer"].time.size > 20
