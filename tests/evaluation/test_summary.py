"""The documents hold every key, only JSON's values, and the figures that were put in."""

import json
from dataclasses import replace

import numpy as np
import pytest
from synthetic_solutions import drifting, drive, innovations, moved, of_fixes, reference, solution

import polyins
from polyins.evaluation.summary import comparison, summarize
from polyins.formats.documents import plain
from polyins.model.attitude import quaternions
from polyins.model.findings import notes

KEYS = {
    "polyins", "method", "imus", "rate_hz", "duration_s", "epochs", "filter_s", "us_per_epoch", "first_call_s",
    "reference", "outages", "drift", "consistency", "faults", "warnings", "verdict", "coverage", "exclusions",
}  # fmt: skip
OUTAGES = ((1010.0, 1020.0), (1040.0, 1050.0))


def off_by(metres: float, inside: tuple[float, float], **changes: object):
    """A solution that is off to the north in one interval."""
    truth = drive()
    wrong = ((truth.time >= inside[0]) & (truth.time <= inside[1]))[:, None] * [metres, 0.0, 0.0]
    return solution(truth, position=moved(truth.geodetic, wrong), **changes)


def test_a_run_document_has_all_keys_and_the_figures():
    truth = drive()
    shown = innovations(np.arange(1001.0, 1060.0), 1, rejected=(4,))
    ours = off_by(3.0, (1015.0, 1016.0), imus=4, method="enav-fusion", filter_s=0.25, measurements=of_fixes(shown),
                  findings=notes(["odd"]), start={"heading": np.float64(0.5), "position": np.zeros(3)})  # fmt: skip
    document = summarize(ours, reference(truth), OUTAGES)
    assert set(document) >= KEYS
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["polyins"] == polyins.__version__
    assert (document["method"], document["imus"], document["epochs"]) == ("enav-fusion", 4, 1201)
    assert document["rate_hz"] == pytest.approx(20.0)
    assert document["duration_s"] == pytest.approx(60.0)
    assert document["us_per_epoch"] == pytest.approx(0.25e6 / 1201)
    assert document["reference"]["horizontal_max_m"] == pytest.approx(3.0)
    assert document["outages"]["each_m"] == pytest.approx([3.0, 0.0], abs=1e-6)
    assert document["outages"]["length_s"] == 10.0
    assert document["drift"]["distance_m"] == pytest.approx(480.0, rel=1e-3)
    assert document["gnss"] == {
        "fixes": 59,
        "rejected": 1,
        "resets": 0,
        "velocities_rejected": 0,
        "rejected_times_s": [1005.0],
    }
    assert document["start"] == {"heading": 0.5, "position": [0.0, 0.0, 0.0]}
    assert document["warnings"] == ["odd"]


def test_without_a_reference_every_figure_is_null():
    document = summarize(solution(drive()), None, OUTAGES)
    assert set(document) >= KEYS
    assert set(document["reference"].values()) == {None}
    assert document["outages"] == {"count": 2, "length_s": 10.0, "horizontal_max_rms_m": None, "each_m": [None, None]}
    assert document["drift"]["rate_percent"] is None
    assert document["consistency"] == {"nees_position": None, "nis_gnss": None}


def test_a_solution_that_diverged_gives_null_and_says_so():
    truth = drive()
    position = truth.geodetic.copy()
    position[500:] = np.nan
    document = summarize(solution(truth, position=position), reference(truth), OUTAGES)
    assert document["reference"]["horizontal_rms_m"] is None
    assert document["consistency"]["nees_position"] is None
    assert json.dumps(document, allow_nan=False)
    assert any("not finite at 701 of 1201" in warning for warning in document["warnings"])


def test_a_std_that_is_no_number_is_told_of():
    truth = drive()
    made = solution(truth)
    variance = made.velocity_variance.copy()
    variance[700:, 1] = np.inf
    warnings = summarize(replace(made, velocity_variance=variance), None)["warnings"]
    assert any("not finite at 501 of 1201" in warning for warning in warnings)


@pytest.mark.parametrize(("epochs", "told"), [(1195, False), (1180, True)])
def test_a_reference_that_ends_a_little_early_is_not_told_of(epochs, told):
    """Half a second, and two seconds, of two minutes."""
    truth = drive()
    early = reference(truth, time=truth.time[:epochs], position=truth.geodetic[:epochs], velocity=None, attitude=None)
    warnings = summarize(solution(truth), early, [])["warnings"]
    assert any(f"covers {epochs} of 1201 epochs" in warning for warning in warnings) == told


def test_a_reference_that_ends_early_is_told_of():
    truth = drive()
    early = reference(truth, time=truth.time[:900], position=truth.geodetic[:900], velocity=None, attitude=None)
    warnings = summarize(solution(truth), early, OUTAGES)["warnings"]
    assert any("covers 900 of 1201 epochs" in warning for warning in warnings)
    assert any(warning.startswith("outage 1040.000 s to 1050.000 s") for warning in warnings)


def test_an_empty_solution_is_summarized_too():
    none = drive()
    empty = solution(none, time=np.zeros(0), position=np.zeros((0, 3)), attitude=np.zeros((0, 4)))
    document = summarize(empty, None)
    assert (document["epochs"], document["rate_hz"], document["us_per_epoch"]) == (0, None, None)


def test_the_single_figure_is_the_rms_over_all_imus_and_outages():
    truth = drive()
    each = [
        summarize(off_by(size, (1015.0, 1045.0), filter_s=cost), reference(truth), OUTAGES)
        for size, cost in [(3.0, 0.1), (4.0, 0.3)]
    ]
    fused = off_by(2.0, (1015.0, 1045.0), imus=2, method="enav-fusion", filter_s=0.3)
    array = summarize(fused, reference(truth), OUTAGES)
    document = comparison({"enav-fusion": array}, each)
    single = document["methods"]["single"]
    assert list(document["methods"]) == ["single", "enav-fusion"]
    assert single["outages"]["horizontal_max_rms_m"] == pytest.approx(np.sqrt(12.5))
    assert single["outages"]["each_m"] == pytest.approx([np.sqrt(12.5)] * 2)
    assert single["reference"]["horizontal_max_m"] == pytest.approx(4.0)
    assert single["filter_s"] == pytest.approx(0.2)
    assert single["each"] == each
    assert document["ratio_to_single"] == {"enav-fusion": pytest.approx(np.sqrt(12.5) / 2.0)}
    assert document["time_ratio_to_single"] == {"enav-fusion": pytest.approx(1.5)}
    assert document["sqrt_n"] == pytest.approx(np.sqrt(2.0))
    assert json.dumps(document, allow_nan=False)


def test_without_outages_the_ratio_is_that_of_the_horizontal_rms():
    truth = drive()
    single, array = (summarize(off_by(size, (1000.0, 1060.0)), reference(truth)) for size in (5.0, 2.0))
    assert comparison({"nav-fusion": array}, [single])["ratio_to_single"] == {"nav-fusion": pytest.approx(2.5)}


def test_without_single_runs_or_reference_there_is_no_ratio():
    truth = drive()
    known = summarize(solution(truth, imus=9), reference(truth))
    unknown = summarize(solution(truth), None)
    alone = comparison({"nav-fusion": known}, [])
    assert alone["ratio_to_single"] == {"nav-fusion": None}
    assert "single" not in alone["methods"]
    assert alone["sqrt_n"] == 3.0
    assert comparison({"nav-fusion": unknown}, [unknown])["ratio_to_single"] == {"nav-fusion": None}


def test_pooled_warnings_and_rejections_are_each_told_once():
    truth = drive()
    each = [summarize(drifting(truth, "single", 1, 0.1, (), seed), reference(truth)) for seed in (1, 2)]
    single = comparison({}, each)["methods"]["single"]
    assert single["gnss"]["rejected"] == 4
    assert single["gnss"]["rejected_times_s"] == each[0]["gnss"]["rejected_times_s"]


def test_plain_values():
    mixed = {"a": (np.float64("nan"), np.int64(3), np.bool_(True)), "b": {"c": np.array([1.0, np.inf])}, "d": "text"}
    assert plain(mixed) == {"a": [None, 3, True], "b": {"c": [1.0, None]}, "d": "text"}


def test_heading_error_reaches_the_document():
    truth = drive()
    turned = quaternions(truth.euler + np.radians([0.0, 0.0, 1.5]))
    document = summarize(solution(truth, attitude=turned), reference(truth))
    assert document["reference"]["heading_rmse_deg"] == pytest.approx(1.5)
