"""The files that a command leaves in its folder beside its solutions; each is whole or absent."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from polyins.evaluation.documents import CompareDocument
from polyins.files import write_bytes
from polyins.formats.documents import write_document
from polyins.model.recording import Recording
from polyins.reading.long_recording import LongRecording
from polyins.tools.comparison import Comparison
from polyins.tools.navigation import Outcome, head


def write_run(folder: Path, recording: Recording | LongRecording, outcome: Outcome, report: bool = True) -> None:
    """Write summary, configuration and report of one run."""
    _write_summary(folder, head(recording), outcome.summary)
    if report:
        _write_report(folder, recording, {outcome.solution.method: outcome})


def write_comparison(
    folder: Path, recording: Recording | LongRecording, result: Comparison, report: bool = True
) -> None:
    """Write the summary of each method into its folder, and what compares them.

    Below `single` (with wheels `wheel-ins`), which has the figures over all, each IMU has a folder of its name.
    """
    summaries = result.document["methods"]
    for name in result.outcomes:
        write_document(folder / name / "summary.json", summaries[name])
        for imu, summary in zip(result.each, summaries[name].get("each", ()), strict=False):
            write_document(folder / name / imu / "summary.json", summary)
    _write_summary(folder, head(recording), result.document)
    if report:
        runs = {name: Outcome(one.solution, one.errors, summaries[name]) for name, one in result.outcomes.items()}
        _write_report(folder, recording, runs, result.document)


def _write_summary(folder: Path, recording: Recording, summary: Mapping[str, Any]) -> None:
    """Write summary and configuration, and take away the report of an earlier run."""
    write_document(folder / "summary.json", summary)
    write_bytes(folder / "config.yaml", recording.config_text.encode())
    (folder / "report.html").unlink(missing_ok=True)


def _write_report(
    folder: Path,
    recording: Recording | LongRecording,
    runs: Mapping[str, Outcome],
    comparison: CompareDocument | None = None,
) -> None:
    from polyins.report.page import write_report
    from polyins.report.scene import Scene, gaps_of

    known = head(recording)
    gaps = gaps_of(known) if isinstance(recording, Recording) else recording.gaps
    scene = Scene.of(
        {name: (one.solution, one.summary) for name, one in runs.items()},
        known,
        comparison,
        {name: one.errors for name, one in runs.items()},
        dict(zip((imu.name for imu in known.rig.imus), gaps, strict=True)),
    )
    write_report(folder / "report.html", scene, comparison)
