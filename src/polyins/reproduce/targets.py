"""What can be reproduced, by name, and how a document is shown."""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from polyins.errors import InputError
from polyins.screen import number, print_table, say

Document = dict[str, Any]

TARGETS = (
    *("flights", "wid", "array", "consistency"),
    *("a1", "a2", "a3", "a4", "a5", "a6", "afig3", "afig6", "afig7", "afig8", "split"),
    *("b4", "b5", "b6", "b7", "b8", "bfig7", "bfig8", "bfig9", "bfig10"),
)
"""Each is a module of this package with a function `reproduce(quick, progress)`."""
WITH_REPORTS = (
    *("wid", "a3", "a5", "afig3", "afig6", "afig7", "afig8", "split"),
    *("bfig7", "bfig8", "bfig9", "bfig10"),
)
"""Those whose function also takes `out`, the folder for reports and pictures, whose names begin with the target's."""
SEVERAL = {"all": TARGETS, "figures": WITH_REPORTS}
"""Several targets under one name."""
WITH_TABLES = ("wid",)
"""Those with a function `print_tables`."""


def find_target(name: str, out: Path) -> Callable[[bool, Callable[[float], None]], Document]:
    """Return the function of a target, which leaves any reports in `out`.

    Raises InputError with the nearest known target for an unknown one.
    """
    if name not in TARGETS:
        known = (*TARGETS, *SEVERAL)
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(known)}"
        raise InputError(f"reproduce: target {name!r} is unknown; {hint}")
    function: Callable[..., Document] = importlib.import_module(f"polyins.reproduce.{name}").reproduce
    return partial(_marked, partial(function, out=out) if name in WITH_REPORTS else function)


def _marked(function: Callable[..., Document], quick: bool, progress: Callable[[float], None]) -> Document:
    """Return a function's document, whose settings say whether it is the quick form."""
    document = function(quick, progress)
    return {**document, "settings": {**document["settings"], "quick": quick}}


def print_document(document: Document) -> None:
    """Print every figure of a document, one per row, named by its path, with the paper's beside it; then its words.

    Those with tables of their own print these instead.
    """
    if document["target"] in WITH_TABLES:
        importlib.import_module(f"polyins.reproduce.{document['target']}").print_tables(document["polyins"])
        return
    print_table(document["target"], ["figure", "paper", "polyins"], rows_of(document))
    for text in words_of(document):
        say(text)


def rows_of(document: Document) -> list[list[str]]:
    """Return each figure's path, the paper's and polyins's."""
    published = dict(_leaves(document["paper"]))
    figures = dict(_leaves(document["polyins"]))
    return [[path, published.get(path, "-"), figures.get(path, "-")] for path in dict.fromkeys([*figures, *published])]


def words_of(document: Document) -> list[str]:
    """Return what a document says in words; that a data set is missing or something stands in for it first."""
    lacking = [text for text in _texts(document["settings"]) if "stand in" in text or "not at hand" in text]
    return lacking + [value for value in document["polyins"].values() if isinstance(value, str)]


def _texts(value: object) -> Iterator[str]:
    if isinstance(value, Mapping):
        for item in value.values():
            yield from _texts(item)
    elif isinstance(value, str):
        yield value


def _leaves(value: object, path: str = "") -> Iterator[tuple[str, str]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _leaves(item, f"{path} / {key}" if path else str(key))
    elif isinstance(value, list):
        yield path, ", ".join(number(item) for item in value)
    elif not isinstance(value, str):
        yield path, str(value) if isinstance(value, int) else number(value if isinstance(value, float) else None, 3)
