"""The libraries that formats are read and written with: whether they are there, and what they say."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from polyins.errors import InputError


def needed(module: str, extra: str, path: str | Path, use: str = "read") -> Any:
    """Import the library that a format needs; raise InputError that says what to install without it."""
    try:
        return import_module(module)
    except ImportError:
        library = module.partition(".")[0]
        raise InputError(f"{path}: is {use} with {library}; expected pip install 'polyins[{extra}]'") from None


@contextmanager
def damage_named(path: Path, what: str, remedy: str = "") -> Iterator[None]:
    """Turn what a library raises over a damaged file into an InputError; `remedy`: what could mend it."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:  # libraries raise whatever they stumble over
        reason = str(error).strip() or type(error).__name__
        raise InputError(
            f"{path}: cannot be read as {what} ({reason.splitlines()[0]}); is it damaged?{remedy}"
        ) from error


@contextmanager
def heard() -> Iterator[list[str]]:
    """Give a list that what a library prints inside becomes one note of: standard output is not the library's.

    From Python or from C: both streams lead to a file meanwhile.
    """
    notes: list[str] = []
    with TemporaryFile() as file, open(file.fileno(), "w", errors="replace", closefd=False) as said:
        sys.stdout.flush()
        sys.stderr.flush()
        kept = {number: os.dup(number) for number in (1, 2)}
        try:
            for number in kept:
                os.dup2(file.fileno(), number)
            with redirect_stdout(said), redirect_stderr(said):
                yield notes
        finally:
            said.flush()
            for number, was in kept.items():
                os.dup2(was, number)
                os.close(was)
        file.seek(0)
        texts = file.read().decode(errors="replace").splitlines()
    lines = list(dict.fromkeys(line.strip() for line in texts if line.strip()))
    if lines:
        more = f" (and {len(lines) - 1} more)" if len(lines) > 1 else ""
        notes.append(f"its library says: {lines[0]}{more}")
