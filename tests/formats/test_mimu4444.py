"""Packets of the MIMU4444."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from polyins.errors import InputError
from polyins.formats.mimu4444 import CHIPS, OTHER_SIDE, PACKET, read
from polyins.formats.recognize import data_format, read_log
from polyins.model.axes import Axes, axes_matrix
from polyins.tools.propose.proposal import propose

STEP = 1_024_000
"""ticks of a packet at 62.5 Hz"""


def packets(count: int, *, number: int = 0, counter: int = 0) -> list[bytes]:
    made = []
    for k in range(count):
        packet = np.zeros(1, PACKET)
        packet["begin"], packet["kind"] = 0xAA, 0x64
        packet["number"], packet["counter"] = (number + k) % 2**16, (counter + k * STEP) % 2**32
        packet["values"] = np.arange(CHIPS * 6).reshape(CHIPS, 6) + k
        content = packet.tobytes()[:-2]
        made.append(content + (sum(content) & 0xFFFF).to_bytes(2, "big"))
    return made


def test_counter_and_number_run_on_over_their_wraps(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(b"ok!?" + b"".join(packets(50, number=2**16 - 20, counter=2**32 - 30 * STEP)))
    assert data_format(path) == "mimu4444"
    log = read_log(path)
    np.testing.assert_allclose(np.diff(log.imus["imu8"].time), 0.016, atol=1e-12)
    assert log.notes == ("4 bytes are no whole packets and are left out",)
    assert log.imus["imu2"].dvel[1] == pytest.approx(np.array([7, 8, 9]) * 9.80665 / 2048 * 0.016)
    assert log.imus["imu2"].dtheta[1] == pytest.approx(np.radians(np.array([10, 11, 12]) / 16.4) * 0.016)


def test_a_gap_longer_than_the_counter_is_as_long_as_its_packets(tmp_path: Path) -> None:
    all_of_them = packets(10_000)
    path = tmp_path / "a.bin"
    path.write_bytes(b"".join(all_of_them[:10] + all_of_them[-10:]))
    log = read(path)
    assert log.imus["imu1"].time[-1] == pytest.approx(9999 * 0.016)
    assert "9980 packet(s) are missing by their numbers" in log.notes


def test_what_is_damaged_or_cut_off_is_left_out(tmp_path: Path) -> None:
    made = packets(20)
    made[7] = made[7][:50] + b"\x55" + made[7][51:]
    path = tmp_path / "a.bin"
    path.write_bytes(b"".join(made)[:-30])
    log = read(path)
    assert len(log.imus["imu1"].time) == 18
    assert log.notes[:2] == (
        f"{106 + 76} bytes are no whole packets and are left out",
        "1 packet(s) are missing by their numbers",
    )
    path.write_bytes(made[0])
    with pytest.raises(InputError, match="1 whole packet"):
        read(path)


def test_a_file_that_begins_within_a_packet(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(b"".join(packets(10))[50:])
    assert data_format(path) == "mimu4444"
    assert len(read(path).imus["imu1"].time) == 9


def test_without_positions_all_chips_are_turned_alike(tmp_path: Path) -> None:
    """The board lies on its side, so that gravity alone would give each side its own forward."""
    path = tmp_path / "a.bin"
    board = np.array([0, -2048, 0, 0, 0, 0])
    mirror = np.array([2048, 0, 0, 0, 0, 0])  # -y, -x, -z of it
    made = []
    for k, one in enumerate(packets(200)):
        packet = np.frombuffer(one, PACKET).copy()
        packet["values"] = [[board, mirror][chip % 2] for chip in range(CHIPS)]
        packet["values"][:, :, 3:] = k % 2
        content = packet.tobytes()[:-2]
        made.append(content + (sum(content) & 0xFFFF).to_bytes(2, "big"))
    path.write_bytes(b"".join(made))
    text = propose([path]).text
    assert text.count("axes: [x, y, z]") == 0
    odd, even = (axes_matrix(axes) for axes in named_axes(text)[:2])
    np.testing.assert_array_equal(even, odd @ axes_matrix(OTHER_SIDE))
    assert (odd @ board[:3])[2] == -2048


def named_axes(text: str) -> list[Axes]:
    return [(found[1], found[2], found[3]) for found in re.finditer(r"axes: \[(\S+), (\S+), (\S+)\]", text)]


def test_where_the_chips_are(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(b"".join(packets(5)))
    assert read(path).points == {}
    beside = tmp_path / "IMU_positions.csv"
    beside.write_text("axes, 1\n" + "".join(f"{axis}, {', '.join(['0.5'] * 8)}\n" for axis in "xyz"))
    assert read(path).points["imu3"] == (0.5, 0.5, 0.5)
    beside.write_text("axes, 1\n")
    with pytest.raises(InputError, match="expected where each chip is"):
        read(path)
