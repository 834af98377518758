"""What a person sees while waiting and at the end: progress and tables, on standard error and output."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

SOON = 1.0
"""s after which a progress bar appears"""


def say(text: str) -> None:
    """Print a message on standard error."""
    print(text, file=sys.stderr, flush=True)


@contextmanager
def compilation_said() -> Iterator[None]:
    """Say when kernels are compiled inside the block, which happens once after installing, and how long it took."""
    from polyins.compilation import watched

    def begins() -> None:
        say(
            "polyins: compiling the kernels, about half a minute, once; later runs load them "
            "(polyins warmup compiles them all beforehand)"
        )

    with watched(begins) as seconds:
        try:
            yield
        finally:
            if seconds():
                say(f"polyins: compiled for {seconds():.1f} s")


@contextmanager
def progress(label: str) -> Iterator[Callable[[float], None]]:
    """Give a function that takes the share done; on a terminal a bar appears when the work takes over a second.

    Until the first call, and in work that never calls it, the bar only shows that something goes on.
    """
    if not sys.stderr.isatty():
        yield lambda share: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=console, transient=True)
    task = bar.add_task(label, total=None)
    timer = threading.Timer(SOON, bar.start)
    timer.daemon = True
    if console.is_terminal:
        timer.start()
    try:
        yield lambda share: bar.update(task, total=1.0, completed=share)
    finally:
        timer.cancel()
        if bar.live.is_started:
            bar.stop()


def print_table(title: str, columns: list[str], rows: list[list[str]]) -> None:
    """Print a table on standard output, the first column left and the others right aligned."""
    from rich.console import Console
    from rich.table import Table

    console = Console(soft_wrap=False)
    if not console.is_terminal:
        console.width = WIDTH
    table = Table(title=title, title_justify="left")
    for number, column in enumerate(columns):
        cells = [line for row in [columns, *rows] for line in row[number].splitlines()]
        narrowest = max(map(len, cells)) if number else None  # a figure is never cut
        table.add_column(column, justify="right" if number else "left", min_width=narrowest)
    for row in rows:
        table.add_row(*row)
    console.print(table)


def number(value: float | None, digits: int = 2) -> str:
    """Return a figure for a table, a dash where there is none."""
    return "-" if value is None else f"{value:.{digits}f}"


WIDTH = 140
"""columns of text that a table may take where the output is no terminal"""

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
    for text in dict.fromkeys(text for summary in summaries.values() for text in summary.get("warnings", ())):
        say(f"warning: {text}")


def _figure(summary: Mapping[str, Any], keys: tuple[str, ...]) -> float | None:
    from polyins.evaluation.summary import on_wheels

    if keys[0] == "drift" and not on_wheels(summary):
        return None
    value: Any = summary
    for key in keys:
        value = value[key]
    return value if value is None else float(value)
