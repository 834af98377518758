"""References to judge a written solution by (streams as configured are tested in test_load)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from written_recordings import as_increments, fixes, still_imu, write_config, write_recording, write_rows

from polyins.errors import InputError
from polyins.io.position_stream import load_reference
from polyins.solution import Innovations, Solution


def solution(geodetic: bool = True) -> Solution:
    nothing: Any = np.zeros((0, 3))
    time = np.arange(100.0, 110.0)
    zeros = np.zeros((10, 3))
    innovations = Innovations(nothing[:, 0], nothing, nothing, nothing[:, 0], nothing[:, 0] > 0, nothing[:, 0] > 0)
    point = np.array([0.1, 0.2, 0.3])
    return Solution(
        "single", geodetic, time, zeros, zeros, np.zeros((10, 4)), zeros, zeros, np.zeros((10, 6)), point, ("a",),
        time, np.zeros((10, 1, 12)), np.zeros((10, 1, 12)), innovations,
    )  # fmt: skip


def test_a_file_of_positions_describes_the_solutions_point(tmp_path: Path) -> None:
    reference = load_reference(write_rows(tmp_path / "gnss.txt", fixes()), solution())
    assert len(reference.time) == 10
    np.testing.assert_array_equal(reference.lever_arm, solution().point)


def test_the_reference_of_a_configuration(tmp_path: Path) -> None:
    values = write_recording(tmp_path)
    values["reference"] = {"file": "gnss.txt", "point_m": [1, 0, 0]}
    reference = load_reference(write_config(tmp_path, values), solution())
    np.testing.assert_array_equal(reference.lever_arm, [1.0, 0.0, 0.0])


def test_what_is_no_reference(tmp_path: Path) -> None:
    gnss = write_rows(tmp_path / "gnss.txt", fixes())
    with pytest.raises(InputError, match="holds latitude and longitude; expected metres on a local plane"):
        load_reference(gnss, solution(geodetic=False))
    with pytest.raises(InputError, match=r"imu\.txt: holds IMU data; expected positions"):
        load_reference(write_rows(tmp_path / "imu.txt", as_increments(still_imu())), solution())
    with pytest.raises(InputError, match="expected the same clock"):
        load_reference(gnss, replace(solution(), time=np.arange(900.0, 910.0)))
    with pytest.raises(InputError, match="has no reference; expected that section"):
        load_reference(write_config(tmp_path, write_recording(tmp_path)), solution())
