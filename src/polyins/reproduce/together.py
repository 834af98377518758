"""Many targets in one run: on all cores, with one document and one page that shows them all."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from polyins import __version__, results
from polyins.errors import InputError
from polyins.io.files import write_bytes
from polyins.parallel import in_order
from polyins.reproduce import targets
from polyins.reproduce.progress import Steps
from polyins.reproduce.targets import Document

ALONE = ("a4", "b8")
"""Those that measure time: they run when nothing else does."""
SECONDS = {"a3": (13, 240), "a5": (28, 2600), "a6": (7, 180), "afig3": (9, 120), "array": (10, 240), "b6": (23, 700),
           "b7": (38, 180), "b8": (5, 40), "flights": (10, 40), "split": (12, 120), "wid": (42, 60)}  # fmt: skip
"""About how long a target takes on one core, quick and in full, for the bar and to begin with the longest."""
OTHERS_S = 5, 30
FRAME, LEAST_HEIGHT = 30, 450
"""pixels around a figure, and for one that does not say its height"""


def reproduce(
    name: str,
    names: Sequence[str],
    quick: bool,
    out: Path,
    progress: Callable[[float], None],
    tell: Callable[[str], None],
) -> Document:
    """Run targets, leave a JSON file for each and the page `index.html` in `out`, and return one document of all.

    The results are those of one target after the other, in the order of `names`. A target whose data set is not at hand
    is told, and listed under `missing` in the settings. `name` is the document's.
    """
    expected = {each: float(SECONDS.get(each, OTHERS_S)[not quick]) for each in names}
    steps = Steps(progress, sum(expected.values()))

    def run(each: str) -> Document | str:
        report, begin = steps.next(expected[each]), time.perf_counter()
        try:
            document = targets.find_target(each, out)(quick, report)
        except InputError as error:
            tell(f"{each}: not reproduced: {error}")
            return str(error)
        finally:
            report(1.0)
        results.write_document(out / f"{each}.json", document)
        tell(f"{each}: {time.perf_counter() - begin:.0f} s")
        return document

    longest_first = sorted((each for each in names if each not in ALONE), key=lambda each: -expected[each])
    found = dict(zip(longest_first, in_order(run, longest_first), strict=True))
    found |= {each: run(each) for each in names if each in ALONE}
    documents = {each: document for each in names if not isinstance(document := found[each], str)}
    missing = {each: reason for each in names if isinstance(reason := found[each], str)}
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

    template = Environment(loader=PackageLoader("polyins.reproduce", "."), autoescape=True).get_template("page.html.j2")
    sections: list[dict[str, Any]] = [
        {
            "name": name,
            "pictures": [(file.name, height(file)) for file in sorted(out.glob(f"{name}*.html"))],
            "rows": targets.rows_of(document),
            "words": targets.words_of(document),
        }
        for name, document in documents.items()
    ]
    return template.render(sections=sections, missing=missing, quick=quick, version=__version__)
