"""What a command is given: configurations, or the logs that one is proposed for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from polyins.errors import InputError
from polyins.formats.recognize import data_format


def are_logs(paths: Sequence[str | Path]) -> bool:
    """Whether the files are data rather than configurations; raises InputError for some of each."""
    kinds, refused = [], []
    for path in paths:
        try:
            kinds.append(data_format(path) == "configuration")
        except InputError as error:
            refused.append(error)
    if not kinds or (refused and any(kinds)):
        raise refused[0]
    if any(kinds) and not all(kinds):
        raise InputError(f"{', '.join(map(str, paths))}: are configurations and data; expected one or the other")
    return not kinds[0]


@contextmanager
def way_named(paths: Sequence[str | Path]) -> Iterator[None]:
    """Say of what logs lack for a start how to give it, for they have no keys."""
    try:
        yield
    except InputError as error:
        if not str(error).startswith("start:") or not are_logs(paths):
            raise
        raise InputError(
            f"{error}: polyins init {' '.join(map(str, paths))} --out run.yaml writes a configuration that takes it; "
            "motion with fixes, a second antenna or another system's attitude would tell it as well"
        ) from None
