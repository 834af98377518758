"""The page is one file that says what was run, in the words that it was given."""

import re
from dataclasses import replace
from html import unescape

import pytest

from polyins.errors import InputError
from polyins.model.findings import Finding, Verdict
from polyins.report import Scene, write_report


@pytest.fixture(scope="module")
def text(report) -> str:
    return report.read_text(encoding="utf-8")


def words(text: str, section: str) -> str:
    """What a reader sees of one section."""
    part = re.search(rf'<section[^>]*id="{section}".*?</section>', text, re.DOTALL)
    assert part
    return re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]*>", " ", part[0])))


def test_the_table_has_each_methods_figures_and_ratios(text, compared):
    table = words(text, "figures")
    for name, summary in compared["methods"].items():
        assert f"{name} {summary['outages']['horizontal_max_rms_m']:.2f}" in table
    assert f"{compared['ratio_to_single']['enav-fusion']:.2f}" in table
    assert "roll rmse (deg)" in table


def test_it_says_what_was_run(text):
    run = words(text, "run")
    assert "6 (imu1, imu2, …, imu6)" in run
    assert "300.0 s, 6,001 epochs at 20.0 Hz" in run
    assert "3 of 30 s" in run
    assert "position, velocity, attitude; 6,001 epochs" in run
    assert "start: heading from the course over ground" in run
    assert "one IMU was late" in words(text, "verdict")
    assert "method: all" in words(text, "config")


def test_it_is_light_and_loads_nothing(text):
    assert len(text.encode()) < 8e6
    assert text.count("plotly.js v") == 1
    assert not re.search(r"<(script|link|img|iframe)[^>]*\s(src|href)=[\"'](?!data:)", text.split("</script>", 1)[1])
    assert not re.search(r"<script[^>]+src=", text)


def test_names_cannot_smuggle_in_markup(text):
    assert "<script>throw 1" not in text
    assert "&lt;script&gt;throw 1" in text


def of(*texts: str) -> dict:
    return Verdict(tuple(Finding("odd", text, "doubt") for text in texts)).document()


def test_findings_of_some_runs_name_them(made_runs, made_recording, tmp_path):
    runs = {
        name: (made, {**summary, "verdict": of("slow") if name == "single" else of()})
        for name, (made, summary) in made_runs.items()
    }
    write_report(tmp_path / "report.html", Scene.of(runs, made_recording))
    warnings = words((tmp_path / "report.html").read_text(encoding="utf-8"), "verdict")
    assert "doubt single: slow" in warnings


def test_columns_in_which_nothing_is_known_are_left_out(made_runs, made_recording, tmp_path):
    made, _ = made_runs["single"]
    unknown = {
        **made_runs["single"][1],
        "reference": dict.fromkeys(made_runs["single"][1]["reference"]),
        "outages": {"count": 0, "length_s": None, "horizontal_max_rms_m": None, "each_m": []},
    }
    bare = replace(made_recording, reference=None, outages=(), config_text="", warnings=())
    write_report(tmp_path / "report.html", Scene.of({"single": (made, unknown)}, bare))
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "rmse" not in words(text, "figures")
    assert "NIS GNSS" in words(text, "figures")
    for absent in ("outages", "velocity", "config"):
        assert f'id="{absent}"' not in text


def test_a_failure_leaves_no_half_page(made_runs, made_recording, tmp_path):
    wrong = replace(made_recording, reference=replace(made_recording.reference, time=made_recording.reference.time[:1]))
    with pytest.raises(InputError, match="reference: 1 epochs"):
        write_report(tmp_path / "report.html", Scene.of(made_runs, wrong))
    assert list(tmp_path.iterdir()) == []
