"""How a solution of the data set WID is scored, on a drive whose errors are known."""

import re
from dataclasses import replace

import numpy as np
import pytest
from synthetic_solutions import GRADE, drive, solution

from polyins.errors import InputError
from polyins.model.recording import ImuStream, Recording, Reference
from polyins.model.rig import Imu, Rig
from polyins.studies import wid
from polyins.studies.reproduction import print_document
from polyins.studies.wid import ReferenceAtFixes, Trial

EAST = np.radians(90.0)
ANTENNA = np.array([2.0, -1.0, 0.0])
"""forward, right, down: heading east that is 1 m north, 2 m east"""
SPEED = 5.0


def trial(**changes: object) -> Trial:
    """East at 5 m/s for 300 m, after and before ten seconds at rest."""
    time = np.arange(0.0, 80.1, 0.2)
    distance = SPEED * np.clip(time - 10.0, 0.0, 60.0)
    track = ReferenceAtFixes(
        time=time,
        north_east=np.column_stack([np.ones_like(time), 2.0 + distance]),
        usable=np.ones(time.shape, dtype=bool),
        heading=np.full(time.shape, EAST),
        speed=np.where((time > 10.0) & (time < 70.0), SPEED, 0.0),
        distance=distance,
    )
    rig = Rig((Imu("IMU2", GRADE),))
    still = ImuStream("IMU2", time, np.zeros((time.size, 3)), np.zeros((time.size, 3)))
    reference = Reference(time, np.zeros((time.size, 3)), lever_arm=ANTENNA)
    return Trial("00", Recording(rig, (still,), reference=reference, geodetic=False), replace(track, **changes))


def solved(north: float = 0.0, east_percent: float = 0.0, turned_deg: float = 0.0):
    """The true drive of the rear axle, with errors."""
    time = np.arange(0.0, 80.01, 0.05)
    distance = SPEED * np.clip(time - 10.0, 0.0, 60.0)
    half = 0.5 * (EAST + np.radians(turned_deg))
    attitude = np.tile([np.cos(half), 0.0, 0.0, np.sin(half)], (time.size, 1))
    east = (1.0 + 0.01 * east_percent) * distance
    position = np.column_stack([np.full_like(time, north), east, np.zeros_like(time)])
    return replace(solution(drive(), attitude=attitude), time=time, geodetic=False, position=position)


def test_a_true_solution_has_no_error():
    assert wid.score(solved(), trial()) == {
        "rate_percent": pytest.approx(0.0, abs=1e-9),
        "rate_50m_percent": pytest.approx(0.0, abs=1e-9),
        "end_percent": pytest.approx(0.0, abs=1e-9),
        "heading_rmse_deg": pytest.approx(0.0, abs=1e-9),
    }


def test_a_wrong_radius_shows_in_every_rate():
    scores = wid.score(solved(east_percent=0.5), trial())
    for key in ("rate_percent", "rate_50m_percent", "end_percent"):
        assert scores[key] == pytest.approx(0.5)


def test_an_offset_weighs_more_over_short_distances():
    scores = wid.score(solved(north=1.0), trial())
    assert scores["rate_percent"] == pytest.approx(100.0 * np.mean(1.0 / np.arange(100.0, 301.0, 100.0)))
    assert scores["rate_50m_percent"] == pytest.approx(100.0 * np.mean(1.0 / np.arange(50.0, 301.0, 50.0)))


def test_a_fix_that_is_not_usable_does_not_count():
    good = trial()
    place, usable = good.track.north_east.copy(), good.track.usable.copy()
    wrong = (good.track.time > 30.0) & (good.track.time < 35.0)
    place[wrong] += 20.0
    usable[wrong] = False
    assert wid.score(solved(), trial(north_east=place))["rate_percent"] > 5.0
    assert wid.score(solved(), trial(north_east=place, usable=usable))["rate_percent"] == pytest.approx(0.0, abs=1e-9)


def test_heading_counts_while_driving_only():
    good = trial()
    parked = np.where(good.track.speed > 0.0, good.track.heading, good.track.heading + 1.0)
    assert wid.score(solved(), trial(heading=parked))["heading_rmse_deg"] == pytest.approx(0.0, abs=1e-9)
    assert wid.score(solved(turned_deg=0.7), good)["heading_rmse_deg"] == pytest.approx(0.7)


def test_a_reference_without_a_usable_fix_cannot_score():
    none = np.zeros(trial().track.usable.shape, dtype=bool)
    with pytest.raises(InputError, match="trial 00: no usable fix"):
        wid.score(solved(), trial(usable=none))


def test_means_are_over_the_trials_that_have_a_method():
    scores = [
        {"body-ins": {"rate_percent": 1.0}, "wheel-ins/IMU2": {"rate_percent": 3.0}},
        {"wheel-ins/IMU2": {"rate_percent": 5.0}},
        {"wheel-ins/IMU2": {"rate_percent": None}, "triple-ins": {"rate_percent": None}},
    ]
    assert wid.mean(scores) == {
        "body-ins": {"rate_percent": 1.0},
        "wheel-ins/IMU2": {"rate_percent": 4.0},
        "triple-ins": {"rate_percent": None},
    }


def test_smoke_tests_are_no_trials(tmp_path):
    calibration = tmp_path / "calibration.yaml"
    with pytest.raises(InputError, match=r"calibration\.yaml: is missing"):
        wid.list_trials(tmp_path)
    calibration.write_text("trials:\n  '04': {role: held out}\n  '06': {role: smoke test only}\n  '11': {role: dev}\n")
    assert wid.list_trials(tmp_path) == ["04", "11"]
    calibration.write_text("trials:\n  '06': {role: smoke test only}\n")
    with pytest.raises(InputError, match="lists no trial to score"):
        wid.list_trials(tmp_path)


def test_the_tables_have_a_row_per_method(capsys):
    scores = {"rate_percent": 0.274, "rate_50m_percent": 0.296, "end_percent": 0.364, "heading_rmse_deg": None}
    methods = {"wheel-ins/IMU2": scores, "triple-ins": scores}
    trials = {"02": methods, "09": {"triple-ins": scores | {"rate_percent": 0.5}}}
    figures = {"mean": methods, "trials": trials, "controls": {}, "controls_by_trial": {"02": {}}}
    print_document({"target": "wid", "polyins": figures, "paper": {}})
    printed = capsys.readouterr().out
    (row,) = (line for line in printed.splitlines() if "triple-ins" in line)
    assert re.findall(r"-?\d\.\d+|-(?!\w)", row) == ["0.27", "0.30", "0.36", "-", "0.27", "0.50"]
    (row,) = (line for line in printed.splitlines() if "wheel-ins/IMU2" in line)
    assert re.findall(r"-?\d\.\d+|-(?!\w)", row)[-1] == "-"
