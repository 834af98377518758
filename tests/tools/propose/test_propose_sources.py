"""Which stream is what of those that files hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from written_recordings import as_increments, still_imu, write_rows

from polyins.errors import InputError
from polyins.formats.log import Log
from polyins.formats.rows import ImuRows, RowSource, SensorRows, Track
from polyins.tools.propose.sources import FoundStream, read_sources, roles

TIME = np.arange(4.0)
IMU = ImuRows(RowSource("log"), TIME, np.zeros((4, 3)), np.zeros((4, 3)))


def track(attitude: bool = False) -> Track:
    return Track(RowSource("log"), TIME, np.zeros((4, 3)), attitude=np.zeros((4, 3)) if attitude else None)


def streams(tracks: dict[str, Track], references: set[str]) -> list[FoundStream]:
    log = Log("boot", {"imu": IMU}, tracks, {}, references=frozenset(references))
    return [FoundStream("log", rows, name, log) for name, rows in log.streams.items()]


def names(read: list[FoundStream]) -> tuple[str | None, str | None, list[str]]:
    of = roles(read)
    gnss, reference = (None if one is None else one.stream for one in (of.gnss, of.reference))
    return gnss, reference, [one.stream for one in of.unused]


@pytest.mark.parametrize(
    ("tracks", "references", "expected"),
    [
        ({"gps": track()}, set(), ("gps", None, [])),
        ({"gps": track(), "gps2": track()}, set(), ("gps", None, ["gps2"])),
        ({"truth": track(True), "gps": track()}, set(), ("gps", "truth", [])),
        ({"ins": track(True), "gps": track()}, {"ins"}, ("gps", "ins", [])),
        ({"ins": track(True)}, {"ins"}, (None, "ins", [])),
        ({"ins": track(True), "gps": track(), "gps2": track()}, {"ins"}, ("gps", "ins", ["gps2"])),
    ],
)
def test_a_receiver_aids_and_another_system_judges(
    tracks: dict[str, Track], references: set[str], expected: tuple[str | None, str | None, list[str]]
) -> None:
    assert names(streams(tracks, references)) == expected


def test_the_first_sensor_of_each_kind_counts() -> None:
    shown = {
        name: SensorRows(RowSource("log"), kind, TIME, TIME)
        for name, kind in (("a", "heading"), ("b", "heading"), ("c", "odometer"))
    }
    log = Log("boot", {"imu": IMU}, {}, shown)
    of = roles([FoundStream("log", rows, name, log) for name, rows in log.streams.items()])
    assert of.heading is not None
    assert of.odometer is not None
    assert (of.heading.stream, of.odometer.stream, of.height) == ("a", "c", None)
    assert of.span == (0.0, 3.0)


def test_one_unknown_file_does_not_stop_the_others(tmp_path: Path) -> None:
    imu = write_rows(tmp_path / "imu.txt", as_increments(still_imu()))
    unknown = tmp_path / "unknown.bin"
    unknown.write_bytes(np.random.default_rng(2).bytes(5000))
    found, left_out = read_sources([unknown, imu])
    assert [one.path for one in found] == [imu]
    assert len(left_out) == 1
    assert left_out[0].startswith("not used: ")
    with pytest.raises(InputError, match="no known binary format"):
        read_sources([unknown])
