"""The files that a command leaves in its folder; each is whole or absent."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from polyins.files import write_bytes
from polyins.formats.documents import write_document
from polyins.formats.solution_files import write_solution
from polyins.model.recording import Recording
from polyins.model.solution import Solution
from polyins.tools.comparison import Comparison

Document = Mapping[str, Any]


def write_run(folder: Path, recording: Recording, solution: Solution, summary: Document, report: bool = True) -> None:
    """Write solution, summary, configuration and report of one run."""
    write_solution(solution, folder)
    write_summary(folder, recording, summary)
    if report:
        from polyins.report.page import write_report

        write_report(folder / "report.html", {solution.method: (solution, dict(summary))}, recording)


def write_summary(folder: Path, recording: Recording, summary: Document) -> None:
    """Write summary and configuration of a run, and take away the report of an earlier one."""
    write_document(folder / "summary.json", summary)
    _write_config(folder, recording)
    (folder / "report.html").unlink(missing_ok=True)


def write_comparison(folder: Path, recording: Recording, result: Comparison, report: bool = True) -> None:
    """Write a folder per method and what compares them.

    Below `single` (with wheels `wheel-ins`), which holds the first IMU's solution and the figures over all, each IMU
    has a folder of its name.
    """
    summaries = result.document["methods"]
    alone = "wheel-ins" if recording.rig.has_wheels else "single"
    for name, solution in result.solutions.items():
        if name != alone:
            write_solution(solution, folder / name)
            write_document(folder / name / "summary.json", summaries[name])
    if alone in result.solutions:
        write_solution(result.solutions[alone], folder / alone)
        write_document(folder / alone / "summary.json", summaries[alone])
        for (name, solution), summary in zip(result.each.items(), summaries[alone]["each"], strict=True):
            write_solution(solution, folder / alone / name)
            write_document(folder / alone / name / "summary.json", summary)
    write_summary(folder, recording, result.document)
    if report:
        from polyins.report.page import write_report

        runs = {name: (solution, summaries[name]) for name, solution in result.solutions.items()}
        write_report(folder / "report.html", runs, recording, result.document)


def _write_config(folder: Path, recording: Recording) -> None:
    write_bytes(folder / "config.yaml", recording.config_text.encode())
