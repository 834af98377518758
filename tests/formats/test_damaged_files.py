"""Whatever a file holds, reading it gives data or an InputError, never another failure."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from written_recordings import as_increments, fixes, still_imu, write_config, write_recording, write_rows

from polyins.errors import InputError
from polyins.reading.loading import load
from polyins.tools.inspect import inspect

QUICK = settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.too_slow])
LINES = st.lists(st.text(st.sampled_from("0123456789.,;-+ e\tnaxyzt#%:\"'[]{}\n"), max_size=40), max_size=8)
NUMBERS = st.lists(st.lists(st.floats(allow_nan=True), min_size=3, max_size=13), min_size=1, max_size=6)
HEADERS = st.sampled_from(
    [
        "",
        "time,lat,lon,height",
        "t,gx,gy,gz,ax,ay,az",
        "SampleTimeFine,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z",
        "%  GPST latitude(deg) longitude(deg) height(m) Q ns sdn(m) sde(m) sdu(m)",
        "sep=,",
    ]
)


def look_at(folder: pytest.TempPathFactory, content: bytes) -> None:
    path = folder.mktemp("damaged") / "file"
    path.write_bytes(content)
    with contextlib.suppress(InputError):
        inspect(path)


@QUICK
@given(content=st.binary(max_size=300))
def test_bytes(content: bytes, tmp_path_factory: pytest.TempPathFactory) -> None:
    look_at(tmp_path_factory, content)


@QUICK
@given(header=HEADERS, lines=LINES)
def test_text(header: str, lines: list[str], tmp_path_factory: pytest.TempPathFactory) -> None:
    look_at(tmp_path_factory, "\n".join([header, *lines]).encode())


@QUICK
@given(header=HEADERS, rows=NUMBERS, mark=st.sampled_from([",", " "]))
def test_numbers(header: str, rows: list[list[float]], mark: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    with np.errstate(all="ignore"):
        look_at(tmp_path_factory, "\n".join([header, *(mark.join(map(repr, row)) for row in rows)]).encode())


@QUICK
@given(data=st.data())
def test_a_recording_with_any_byte_changed(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("changed")
    config = write_config(folder, write_recording(folder))
    path = folder / data.draw(st.sampled_from(["a.txt", "b.csv", "gnss.txt", "drive.yaml"]))
    content = bytearray(path.read_bytes())
    content[data.draw(st.integers(0, min(len(content), 2000) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    with contextlib.suppress(InputError):
        load(config)


def test_the_files_that_are_changed_are_good_ones(tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("good")
    load(write_config(folder, write_recording(folder)))
    inspect(write_rows(folder / "imu.txt", as_increments(still_imu())))
    inspect(write_rows(folder / "gnss.txt", fixes()))
