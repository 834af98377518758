"""What a person sees while waiting and at the end: messages and progress on standard error, tables on output."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SOON = 1.0
"""s after which a progress bar appears"""
WIDTH = 140
"""columns of text that a table may take where the output is no terminal"""


def say(text: str) -> None:
    """Print a message on standard error."""
    print(text, file=sys.stderr, flush=True)


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
