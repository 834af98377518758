"""References to judge a written solution by (streams as configured are tested in test_load)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import synthetic_solutions
from written_recordings import as_increments, fixes, still_imu, write_config, write_recording, write_rows

from polyins.errors import InputError
from polyins.model.solution import Solution
from polyins.reading.reference import load_reference

POINT = np.array([0.1, 0.2, 0.3])


def solution(geodetic: bool = True, begin: float = 100.0) -> Solution:
    truth = synthetic_solutions.drive(duration=10.0, begin=begin)
    return synthetic_solutions.solution(truth, geodetic=geodetic, point=POINT)


def test_a_file_of_positions_describes_the_solutions_point(tmp_path: Path) -> None:
    reference = load_reference(write_rows(tmp_path / "gnss.txt", fixes()), solution())
    assert len(reference.time) == 10
    np.testing.assert_array_equal(reference.lever_arm, POINT)


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
        load_reference(gnss, solution(begin=900.0))
    with pytest.raises(InputError, match="has no reference; expected that section"):
        load_reference(write_config(tmp_path, write_recording(tmp_path)), solution())


def test_heights_above_another_zero_do_not_judge(tmp_path: Path) -> None:
    gnss = write_rows(tmp_path / "gnss.txt", fixes())
    with pytest.raises(InputError, match="ellipsoidal, those of the solution sea-level; expected both alike"):
        load_reference(gnss, replace(solution(), heights="sea-level"))
    assert load_reference(gnss, replace(solution(), heights="unknown")).heights == "ellipsoidal"
