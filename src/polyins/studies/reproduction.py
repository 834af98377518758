"""Many targets in one run: on all cores, with one document and one page that shows them all."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from polyins.errors import InputError
from polyins.files import write_bytes
from polyins.formats.documents import write_document
from polyins.screen import number, print_table, say
from polyins.studies.progress import Steps
from polyins.studies.target import Document, Target
from polyins.studies.targets import find
from polyins.tools.parallel import in_order
from polyins.version import __version__

FRAME, LEAST_HEIGHT = 30, 450
"""pixels around a figure, and for one that does not say its height"""


def reproduce(
    name: str,
    targets: Sequence[Target],
    quick: bool,
    out: Path,
    progress: Callable[[float], None],
    tell: Callable[[str], None],
) -> Document:
    """Run targets, leave a JSON file for each and the page `index.html` in `out`, and return one document of all.

    The results are those of one target after the other, in the order given. A target whose data set is not at hand
    is told, and listed under `missing` in the settings. `name` is the document's.
    """
    expected = {each: float(each.seconds[not quick]) for each in targets}
    steps = Steps(progress, sum(expected.values()))

    def run(each: Target) -> Document | str:
        report, begin = steps.next(expected[each]), time.perf_counter()
        try:
            document = each.reproduce(quick, report, out)
        except InputError as error:
            tell(f"{each.name}: not reproduced: {error}")
            return str(error)
        finally:
            report(1.0)
        write_document(out / f"{each.name}.json", document)
        tell(f"{each.name}: {time.perf_counter() - begin:.0f} s")
        return document

    longest_first = sorted((each for each in targets if not each.alone), key=lambda each: -expected[each])
    found = dict(zip(longest_first, in_order(run, longest_first), strict=True))
    found |= {each: run(each) for each in targets if each.alone}
    documents = {each.name: document for each in targets if not isinstance(document := found[each], str)}
    missing = {each.name: reason for each in targets if isinstance(reason := found[each], str)}
    write_bytes(out / "index.html", page(documents, missing, out, quick).encode())
    return {
        "target": name,
        **{
            side: {each: document[side] for each, document in documents.items()}
            for side in ("paper", "polyins", "settings")
        },
        "missing": missing,
    }


def height(picture: Path) -> int:
    """Return how many pixels a page needs to show its figure, which says its own height last."""
    heights = re.findall(r'"height":(\d+)', picture.read_text(encoding="utf-8"))
    return int(heights[-1]) + FRAME if heights else LEAST_HEIGHT


def parts(document: Document) -> list[Document]:
    """Return the documents of the targets that a document of several holds."""
    sides = ("paper", "polyins", "settings")
    return [{"target": name, **{side: document[side][name] for side in sides}} for name in document["polyins"]]


def page(documents: Mapping[str, Document], missing: Mapping[str, str], out: Path, quick: bool) -> str:
    """Return the page: of each target its pictures, `out`/TARGET*.html, and its figures beside the paper's."""
    from jinja2 import Environment, PackageLoader

    template = Environment(loader=PackageLoader("polyins.studies", "."), autoescape=True).get_template("page.html.j2")
    sections: list[dict[str, Any]] = [
        {
            "name": name,
            "pictures": [(file.name, height(file)) for file in sorted(out.glob(f"{name}*.html"))],
            "rows": rows_of(document),
            "words": words_of(document),
        }
        for name, document in documents.items()
    ]
    return template.render(sections=sections, missing=missing, quick=quick, version=__version__)


def print_document(document: Document) -> None:
    """Print every figure of a document, one per row, named by its path, with the paper's beside it; then its words.

    A target with tables of its own prints these instead.
    """
    (target,) = find(document["target"])
    if target.print(document["polyins"]):
        return
    print_table(document["target"], ["figure", "paper", "polyins"], rows_of(document))
    for text in words_of(document):
        say(text)


def rows_of(document: Document) -> list[list[str]]:
    """Return each figure's path, the paper's and polyins's."""
    published = dict(leaves(document["paper"]))
    figures = dict(leaves(document["polyins"]))
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


def leaves(value: object, path: str = "") -> Iterator[tuple[str, str]]:
    """Give each number of a document, in words, under the keys or names that lead to it."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from leaves(item, f"{path} / {key}" if path else str(key))
    elif isinstance(value, list):
        if any(isinstance(item, Mapping) for item in value):
            named = {item["name"]: {key: held for key, held in item.items() if key != "name"} for item in value}
            yield from leaves(named, path)
        elif not any(isinstance(item, str) for item in value):
            yield path, ", ".join(number(item) for item in value)
    elif not isinstance(value, str):
        yield path, str(value) if isinstance(value, int) else number(value if isinstance(value, float) else None, 3)
