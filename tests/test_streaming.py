"""A recording taken in stretches gives what it gives in memory."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import polyins as pi
from polyins.errors import InputError
from polyins.evaluation.summary import summarize
from polyins.formats.solution_files import IMU_ERRORS, SOLUTION, read_solution, write_solution
from polyins.model.recording import AidingStream, ImuStream, Recording, StandstillOptions
from polyins.model.rig import AidingSensor
from polyins.reading.loading import read_config
from polyins.simulation import files
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, OutageSchedule, Scenario
from polyins.tools import streaming

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


def opened(config: Path) -> streaming.LongRecording:
    recording = streaming.open_long(read_config(config), least_rows=0)
    assert recording is not None
    return recording


def same(first: Path, second: Path) -> None:
    for name in (SOLUTION, IMU_ERRORS):
        one, other = pq.read_table(first / name), pq.read_table(second / name)
        assert one.column_names == other.column_names
        for column in one.column_names:
            assert one[column].to_pylist() == other[column].to_pylist(), (name, column)


@pytest.mark.parametrize("method", ["enav-fusion", "single"])
@pytest.mark.parametrize("apart", [False, True])
def test_stretches_give_the_solution_in_memory_bit_for_bit(simulated, apart, method, tmp_path):
    config = files.write(unsynchronised(simulated) if apart else simulated, tmp_path / "recording")
    recording = pi.load(config)
    solution = pi.run(recording, method)
    write_solution(solution, tmp_path / "whole")
    document = streaming.run(opened(config), tmp_path / "parts", method, stretch_s=13.7)
    same(tmp_path / "whole", tmp_path / "parts")
    expected = summarize(solution, recording.reference, recording.outages)
    for key in document.keys() - set(TIMES):
        assert json.dumps(rounded(document[key])) == json.dumps(rounded(expected[key])), key
    assert read_solution(tmp_path / "parts").method == method


def rounded(value: object) -> object:
    """Means over parts are rounded otherwise than means over all."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.11g}") if isinstance(value, float) else value


def test_a_row_that_is_no_number_is_named_and_leaves_no_file(simulated, tmp_path):
    stream = simulated.imus[1]
    dvel = stream.dvel.copy()
    dvel[25_000, 1] = np.nan
    broken = replace(simulated, imus=(simulated.imus[0], replace(stream, dvel=dvel), simulated.imus[2]))
    config = files.write(broken, tmp_path / "recording")
    long = opened_late(config)
    with pytest.raises(InputError, match=r"imu2.parquet, row 25001: accel is missing"):
        streaming.run(long, tmp_path / "out", stretch_s=20.0)
    assert not list((tmp_path / "out").iterdir())


def opened_late(config: Path) -> streaming.LongRecording:
    """Open a recording of whose beginning only a part is looked at."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(streaming, "HEAD_S", 60.0)
        return opened(config)


def test_stamps_that_go_back_are_refused_before_anything_runs(simulated, tmp_path):
    stream = simulated.imus[2]
    time = stream.time.copy()
    time[20_000] = time[19_000]
    config = files.write(
        replace(simulated, imus=(*simulated.imus[:2], replace(stream, time=time))), tmp_path / "recording"
    )
    with pytest.raises(InputError, match=r"imu3.parquet, row 20001: .*expected increasing times"):
        opened(config)


def test_only_large_parquet_recordings_are_taken_in_stretches(simulated, tmp_path):
    config = files.write(simulated, tmp_path / "recording")
    assert streaming.open_long(read_config(config)) is None
    config.write_text(config.read_text().replace("name: imu1\n", "name: imu1\n  gyro_range_deg_s: 2000\n", 1))
    assert streaming.open_long(read_config(config), least_rows=0) is None


def test_heights_are_measured_in_stretches_as_in_memory(simulated, tmp_path):
    reference = simulated.reference
    time = np.arange(0.5, 149.0, 0.37)
    height = np.interp(time, reference.time, reference.position[:, 2]) + 2.0
    stream = AidingStream("height", time, height, np.full((len(time), 1), 0.2))
    rig = replace(simulated.rig, sensors=(AidingSensor("height", offset_std=5.0),))
    config = files.write(replace(simulated, rig=rig, aiding=(stream,)), tmp_path / "recording")
    document = streaming.run(opened(config), tmp_path / "long", stretch_s=20.0)
    recording = pi.load(config)
    solution = pi.run(recording)
    assert document["measurements"]["height"]["count"] == solution.measurements["height"].time.size > 200
    write_solution(solution, tmp_path / "whole")
    same(tmp_path / "long", tmp_path / "whole")


def test_what_is_measured_on_a_schedule_is_not_taken_in_stretches(simulated, tmp_path):
    options = replace(simulated.options, standstill=StandstillOptions())
    config = files.write(replace(simulated, options=options), tmp_path / "recording")
    assert streaming.open_long(read_config(config), least_rows=0) is None
