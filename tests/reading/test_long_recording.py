"""A recording taken in stretches gives what it gives in memory."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import driven_vehicle
import numpy as np
import pyarrow.parquet as pq
import pytest

import polyins as pi
from polyins.errors import InputError
from polyins.evaluation.summary import summarize
from polyins.formats import kf_gins, parquet_table, text_table, written_table
from polyins.formats.solution_files import IMU_ERRORS, SOLUTION, read_solution, write_solution
from polyins.model.recording import AidingStream, ImuStream, Recording, StandstillOptions
from polyins.model.rig import AidingSensor
from polyins.navigate import batch
from polyins.reading import long_recording
from polyins.reading.loading import read_config
from polyins.reading.long_recording import LongRecording, open_long
from polyins.simulation import files
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, OutageSchedule, Scenario
from polyins.tools import navigation, results
from polyins.tools.comparison import Files, compare

TIMES = ("filter_s", "us_per_epoch", "first_call_s")


@pytest.fixture(scope="module")
def simulated() -> Recording:
    outages = OutageSchedule(first_after_s=20.0, length_s=10.0, every_s=30.0)
    return simulate(Scenario(duration_s=150.0, imus=Board(count=3), outages=outages, seed=5))


def unsynchronised(recording: Recording) -> Recording:
    """Put the IMUs on clocks that tick apart, and leave rows out of two of them."""
    rng = np.random.default_rng(3)
    streams = []
    for number, stream in enumerate(recording.imus):
        time = stream.time + (rng.uniform(-4e-4, 4e-4, len(stream.time)) + 1e-3 * number if number else 0.0)
        kept = np.ones(len(time), dtype=bool)
        if number:
            kept[9000 + 400 * number : 9200 + 500 * number] = False
        streams.append(ImuStream(stream.name, time[kept], stream.dtheta[kept], stream.dvel[kept]))
    return replace(recording, imus=tuple(streams), start=replace(recording.start, static_interval=(1.0, 59.0)))


def opened(config: Path) -> LongRecording:
    recording = open_long(read_config(config), least_rows=0)
    assert recording is not None
    return recording


def same(first: Path, second: Path) -> None:
    for name in (SOLUTION, IMU_ERRORS):
        one, other = pq.read_table(first / name), pq.read_table(second / name)
        assert one.column_names == other.column_names
        for column in one.column_names:
            assert one[column].to_pylist() == other[column].to_pylist(), (name, column)


def stretched(config: Path, folder: Path, method: str, stretch_s: float) -> dict:
    """Navigate in stretches, write the solution, and return its document."""
    return navigation.run(opened(config), method, folders={folder: None}, stretch_s=stretch_s).summary


def agree(config: Path, folder: Path, method: str, stretch_s: float = 13.7) -> pi.Solution:
    """Compare a run in stretches with one in memory, which is returned: files bit for bit, figures but for rounding."""
    recording = pi.load(config)
    solution = pi.run(recording, method)
    write_solution(solution, folder / "whole")
    document = stretched(config, folder / "parts", method, stretch_s)
    same(folder / "whole", folder / "parts")
    expected = summarize(solution, recording.reference, recording.outages)
    for key in document.keys() - set(TIMES):
        assert json.dumps(rounded(document[key])) == json.dumps(rounded(expected[key])), key
    assert read_solution(folder / "parts").method == method
    return solution


def restarts(solution: pi.Solution) -> list[str]:
    """Return what became of the pauses, in turn."""
    return [found.kind for found in solution.findings if found.kind in ("restart", "pause")]


@pytest.mark.parametrize("method", ["enav-fusion", "single"])
@pytest.mark.parametrize("apart", [False, True])
def test_stretches_give_the_solution_in_memory_bit_for_bit(simulated, apart, method, tmp_path):
    config = files.write(unsynchronised(simulated) if apart else simulated, tmp_path / "recording")
    agree(config, tmp_path, method)


def test_an_imu_that_ends_long_before_the_others_is_left_behind(simulated, tmp_path):
    first, *others = simulated.imus
    kept = first.time < first.time[0] + 70.0
    short = ImuStream(first.name, first.time[kept], first.dtheta[kept], first.dvel[kept])
    config = files.write(replace(simulated, imus=(short, *others)), tmp_path / "recording")
    agree(config, tmp_path, "nav-fusion")


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz"])
def test_text_is_read_in_order(simulated, suffix, tmp_path, monkeypatch):
    config = files.write(unsynchronised(simulated), tmp_path / "recording")
    for name in ("imu1", "imu2", "imu3"):
        stream = next(one for one in pi.load(config).imus if one.name == name)
        written_table.write_imu(tmp_path / "recording" / f"{name}{suffix}", stream)
    config.write_text(re.sub(r"(imu\d)\.parquet", rf"\1{suffix}", config.read_text()))
    monkeypatch.setattr(text_table, "PIECE_BYTES", 30_000)
    agree(config, tmp_path, "enav-fusion")


@pytest.mark.parametrize("text", [False, True])
def test_files_of_kf_gins_are_read_in_order(simulated, text, tmp_path, monkeypatch):
    config = files.write(simulated, tmp_path / "recording")
    write = kf_gins.write_imu_text if text else kf_gins.write_imu_binary
    for stream in simulated.imus:
        write(tmp_path / "recording" / f"{stream.name}.imu", stream)
    config.write_text(re.sub(r"(imu\d)\.parquet", r"\1.imu", config.read_text()))
    monkeypatch.setattr(text_table, "PIECE_BYTES", 30_000)
    monkeypatch.setattr(kf_gins, "PIECE_ROWS", 10_500)
    agree(config, tmp_path, "enav-fusion", 29.0)


@pytest.fixture(scope="module")
def driven() -> Recording:
    """A drive with IMUs on both rear wheels and the body, one of which falls silent for a while."""
    recording = driven_vehicle.drive(gnss=True)
    streams = list(recording.imus)
    time = streams[1].time
    kept = (time < time[0] + 30.0) | (time > time[0] + 33.0)
    streams[1] = ImuStream(streams[1].name, time[kept], streams[1].dtheta[kept], streams[1].dvel[kept])
    return replace(recording, imus=tuple(streams))


@pytest.mark.parametrize("method", ["triple-ins", "triple-ins/centralized", "wheel-ins"])
def test_wheels_are_taken_in_stretches(driven, method, tmp_path):
    config = files.write(driven, tmp_path / "recording")
    agree(config, tmp_path, method)


def paused(recording: Recording, *pauses: tuple[float, float]) -> Recording:
    streams = []
    for stream in recording.imus:
        kept = np.all([(stream.time <= begin) | (stream.time >= end) for begin, end in pauses], axis=0)
        streams.append(ImuStream(stream.name, stream.time[kept], stream.dtheta[kept], stream.dvel[kept]))
    return replace(recording, imus=tuple(streams))


@pytest.mark.parametrize("gnss", [False, True])
def test_wheels_that_pause_begin_anew_in_stretches(gnss, tmp_path):
    """Under way: there is no standstill after the first pause."""
    recording = paused(driven_vehicle.drive(gnss=gnss), (30.0, 34.0), (60.0, 64.5))
    config = files.write(recording, tmp_path / "recording")
    assert restarts(agree(config, tmp_path, "triple-ins", 9.3)) == ["restart", "restart"]


@pytest.mark.parametrize("method", ["enav-fusion", "single"])
def test_arrays_that_pause_begin_anew_in_stretches(simulated, method, tmp_path):
    """The last part is too short for a start."""
    recording = unsynchronised(paused(simulated, (85.0, 97.0), (145.0, 148.5)))
    config = files.write(recording, tmp_path / "recording")
    assert restarts(agree(config, tmp_path, method)) == ["restart", "pause"]


def test_an_imu_that_is_dead_after_a_pause_does_not_hold_the_others_up(simulated, tmp_path):
    recording = paused(simulated, (85.0, 90.0))
    first, *others = recording.imus
    kept = first.time < 80.0
    dead = ImuStream(first.name, first.time[kept], first.dtheta[kept], first.dvel[kept])
    config = files.write(replace(recording, imus=(dead, *others)), tmp_path / "recording")
    solution = agree(config, tmp_path, "enav-fusion")
    assert restarts(solution) == ["restart"]
    assert solution.time[-1] > 149.0


def test_what_breaks_begins_anew_in_stretches(simulated, tmp_path, monkeypatch):
    advance = batch.Prepared.advance

    def poisoned(run, first, last):
        advance(run, first, last)
        after = run.inputs.time[first:last] >= 90.0
        run.outputs.variances[first:last][after & (run.start.time < 90.0)] = np.inf

    monkeypatch.setattr(batch.Prepared, "advance", poisoned)
    config = files.write(simulated, tmp_path / "recording")
    solution = agree(config, tmp_path, "enav-fusion")
    assert restarts(solution) == ["restart"]
    assert solution.is_finite.all()


def test_an_array_at_rest_is_taken_in_stretches(simulated, tmp_path):
    options = replace(simulated.options, standstill=StandstillOptions())
    config = files.write(replace(simulated, options=options), tmp_path / "recording")
    agree(config, tmp_path, "enav-fusion")


def test_a_comparison_in_stretches_has_the_figures_of_one_in_memory(simulated, tmp_path):
    config = files.write(simulated, tmp_path / "recording")
    there = Files(tmp_path / "parts")
    ours = compare(opened(config), ["single", "enav-fusion"], files=there)
    theirs = compare(pi.load(config), ["single", "enav-fusion"])
    assert ours.document["ratio_to_single"] == pytest.approx(theirs.document["ratio_to_single"], rel=1e-9)
    results.write_comparison(tmp_path / "parts", opened(config), ours)
    assert (tmp_path / "parts" / "report.html").stat().st_size > 1e6
    one = pq.read_table(tmp_path / "parts" / "single" / "imu2" / SOLUTION)
    assert np.median(np.diff(one["time_s"].to_numpy())) == pytest.approx(0.1, abs=1e-6)
    assert pq.read_metadata(tmp_path / "parts" / "single" / SOLUTION).num_rows > 10 * one.num_rows


def test_what_is_drawn_of_a_long_recording_has_its_greatest_error(simulated, tmp_path, monkeypatch):
    monkeypatch.setattr(navigation, "SHOWN_EPOCHS", 500)
    config = files.write(simulated, tmp_path / "recording")
    outcome = navigation.run(opened(config), stretch_s=20.0)
    assert outcome.errors is not None
    assert 100 < outcome.solution.time.size < 2000
    assert outcome.errors.time.size == np.count_nonzero(outcome.errors.covered)
    north = np.abs(outcome.errors.position[:, 0]).max()
    whole = navigation.run(pi.load(config))
    assert whole.errors is not None
    assert north == np.abs(whole.errors.position[:, 0]).max()


def rounded(value: object) -> object:
    """Means over parts are rounded otherwise than means over all."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.11g}") if isinstance(value, float) else value


def test_an_only_imu_of_which_much_is_no_number_is_refused_with_the_row(simulated, tmp_path):
    stream = simulated.imus[1]
    dvel = stream.dvel.copy()
    dvel[25_000:, 1] = np.nan
    config = files.write(replace(simulated.subset([1]), imus=(replace(stream, dvel=dvel),)), tmp_path / "recording")
    with pytest.raises(InputError, match=r"imu2.parquet, row 25001: accel is missing"):
        opened(config)


def test_rows_that_a_chip_repeats_are_left_out_as_in_memory(simulated, tmp_path, monkeypatch):
    stream = simulated.imus[1]
    dtheta, dvel = stream.dtheta.copy(), stream.dvel.copy()
    for first, last in ((15_000, 15_400), (16_300, 16_700), (20_000, 20_003)):
        dtheta[first:last], dvel[first:last] = dtheta[first], dvel[first]
    frozen = replace(stream, dtheta=dtheta, dvel=dvel)
    config = files.write(replace(simulated, imus=(simulated.imus[0], frozen, simulated.imus[2])), tmp_path / "r")
    monkeypatch.setattr(parquet_table, "PIECE_ROWS", 16_384)
    recording = pi.load(config)
    assert len(recording.imus[1].time) < len(stream.time) - 790
    solution = pi.run(recording)
    write_solution(solution, tmp_path / "whole")
    long = opened(config)
    assert sum("repeats the same values" in warning for warning in long.head.sentences) >= 2
    navigation.run(long, folders={tmp_path / "parts": None}, stretch_s=13.7)
    same(tmp_path / "whole", tmp_path / "parts")


def test_a_start_late_in_the_recording_is_found(simulated, tmp_path, monkeypatch):
    """At 85 s the array drives; its heading is that of its course."""
    monkeypatch.setattr(long_recording, "HEAD_S", 60.0)
    monkeypatch.setattr(long_recording, "HEAD_ROWS", 10_000)
    start = replace(simulated.start, time=85.0, heading_from="auto", heading=None)
    config = files.write(replace(simulated, start=start), tmp_path / "recording")
    agree(config, tmp_path, "enav-fusion")
    monkeypatch.setattr(long_recording, "MOST_HEAD_ROWS", 20_000)
    with pytest.raises(InputError, match=r"start.time_s: is late in a recording this long"):
        opened(config)


def test_rows_that_are_no_data_are_left_out_as_in_memory(simulated, tmp_path, monkeypatch):
    """NaN, stamps that leap and go back, and values no sensor has, at the edges of pieces, too."""
    stream = simulated.imus[2]
    time, dtheta, dvel = stream.time.copy(), stream.dtheta.copy(), stream.dvel.copy()
    dvel[16_380:16_390, 1] = np.nan
    time[20_000] = time[19_000]
    time[22_000] += 1000.0
    dtheta[25_000, 2] = 1e30
    sick = replace(stream, time=time, dtheta=dtheta, dvel=dvel)
    config = files.write(replace(simulated, imus=(*simulated.imus[:2], sick)), tmp_path / "recording")
    monkeypatch.setattr(parquet_table, "PIECE_ROWS", 16_384)
    recording = pi.load(config)
    assert len(recording.imus[2].time) == len(time) - 13
    assert [(one.kind, one.size) for one in recording.findings] == [("left out", size) for size in (10, 1, 1, 1)]
    write_solution(pi.run(recording), tmp_path / "whole")
    navigation.run(opened(config), folders={tmp_path / "parts": None}, stretch_s=13.7)
    same(tmp_path / "whole", tmp_path / "parts")


def test_only_large_recordings_are_taken_in_stretches_and_none_whose_rows_are_repaired(simulated, tmp_path):
    config = files.write(simulated, tmp_path / "recording")
    assert open_long(read_config(config)) is None
    config.write_text(config.read_text().replace("name: imu1\n", "name: imu1\n  gyro_range_deg_s: 2000\n", 1))
    assert open_long(read_config(config), least_rows=0) is None


def test_heights_are_measured_in_stretches_as_in_memory(simulated, tmp_path):
    reference = simulated.reference
    time = np.arange(0.5, 149.0, 0.37)
    height = np.interp(time, reference.time, reference.position[:, 2]) + 2.0
    stream = AidingStream("height", time, height, np.full((len(time), 1), 0.2))
    rig = replace(simulated.rig, sensors=(AidingSensor("height", offset_std=5.0),))
    config = files.write(replace(simulated, rig=rig, aiding=(stream,)), tmp_path / "recording")
    document = stretched(config, tmp_path / "long", "enav-fusion", 20.0)
    recording = pi.load(config)
    solution = pi.run(recording)
    assert document["measurements"]["height"]["count"] == solution.measurements["height"].time.size > 200
    write_solution(solution, tmp_path / "whole")
    same(tmp_path / "long", tmp_path / "whole")
