"""The figures of one or more methods as a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from polyins.evaluation.documents import sentence
from polyins.screen import number, print_table, say

FIGURES = (
    ("outages\nmax, m", ("outages", "horizontal_max_rms_m"), 2),
    ("drift\n%", ("drift", "rate_percent"), 2),
    ("end point\n%", ("drift", "end_percent"), 2),
    ("horizontal\nrms, m", ("reference", "horizontal_rms_m"), 2),
    ("vertical\nrms, m", ("reference", "vertical_rms_m"), 2),
    ("roll\ndeg", ("reference", "roll_rmse_deg"), 3),
    ("pitch\ndeg", ("reference", "pitch_rmse_deg"), 3),
    ("heading\ndeg", ("reference", "heading_rmse_deg"), 3),
    ("CPU us\nper epoch", ("us_per_epoch",), 2),
)


def print_summaries(title: str, summaries: Mapping[str, Mapping[str, Any]], ratios: Mapping[str, float | None]) -> None:
    """Print the figures of one or more methods as a table, then their warnings; what none of them has is left out."""
    columns, cells = ["method"], [[name] for name in summaries]
    for label, keys, digits in FIGURES:
        values = [_figure(summary, keys) for summary in summaries.values()]
        if any(value is not None for value in values):
            columns.append(label)
            for row, value in zip(cells, values, strict=True):
                row.append(number(value, digits))
    if ratios:
        alone = next((name for name in summaries if name not in ratios), "single")
        columns.append(f"ratio to\n{alone}")
        for row in cells:
            row.append("1" if row[0] == alone else number(ratios.get(row[0]), 2))
    print_table(title, columns, cells)
    for name, summary in summaries.items():
        gnss = summary["gnss"]
        if gnss["rejected"]:
            say(f"{name}: {gnss['rejected']} of {gnss['fixes']} GNSS fixes rejected")
    verdicts = {name: summary["verdict"] for name, summary in summaries.items() if "verdict" in summary}
    said: dict[str, list[str]] = {}
    for name, one in verdicts.items():
        for finding in one["findings"]:
            said.setdefault(f"{finding['severity']}: {sentence(finding)}", []).append(name)
    for text, names in said.items():
        say(text if len(names) == len(verdicts) else f"{', '.join(names)}: {text}")
    levels: dict[str, list[str]] = {}
    for name, one in verdicts.items():
        levels.setdefault(one["level"], []).append(name)
    for level, names in levels.items():
        say(f"verdict: {level}" + ("" if len(levels) == 1 else f" ({', '.join(names)})"))


def _figure(summary: Mapping[str, Any], keys: tuple[str, ...]) -> float | None:
    from polyins.evaluation.summary import on_wheels

    if keys[0] == "drift" and not on_wheels(summary):
        return None
    value: Any = summary
    for key in keys:
        value = value[key]
    return value if value is None else float(value)
