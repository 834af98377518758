"""Rooms import from above only, and nothing goes round in a circle, at whatever depth it is imported."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import polyins
import polyins_papers

SOURCES = Path(polyins.__file__).parents[1]
ROOMS = (
    ("version", "errors", "files", "screen"),
    ("kernels",),
    ("model",),
    ("aiding",),
    ("prepare",),
    ("navigate",),
    ("config",),
    ("formats",),
    ("calibration",),
    ("checks",),
    ("reading",),
    ("evaluation",),
    ("report",),
    ("simulation",),
    ("live",),
    ("tools",),
    ("studies",),
    ("cli",),
    ("__main__", "polyins"),
)
"""in the order in which they may import: only from above"""
FLOOR = {room: floor for floor, rooms in enumerate(ROOMS) for room in rooms}
STATES = "polyins.model.states"
"""the table that the kernels know as well, on the floor above them"""
PAPERS = len(ROOMS)


def name_of(file: Path) -> str:
    return ".".join(file.relative_to(SOURCES).with_suffix("").parts).removesuffix(".__init__")


FILES = {
    name_of(file): file
    for package in (polyins, polyins_papers)
    for file in Path(package.__file__).parent.rglob("*.py")
}  # fmt: skip


def imports_of(name: str) -> set[str]:
    """The modules of both packages that a module imports: on top, inside functions, for typing."""
    found = set()
    for node in ast.walk(ast.parse(FILES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{name}: a relative import"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            found |= {one if one in FILES else node.module for one in names}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    return {one for one in found if one in FILES} - {name}


def room_of(name: str) -> str:
    package, _, rest = name.partition(".")
    return package if package == "polyins_papers" or not rest else rest.split(".")[0]


def floor_of(name: str) -> int:
    if name == STATES:
        return 0
    return PAPERS if room_of(name) == "polyins_papers" else FLOOR[room_of(name)]


def test_every_module_is_in_a_room() -> None:
    assert {room_of(name) for name in FILES} == {*FLOOR, "polyins_papers"}


def test_rooms_import_from_above_only() -> None:
    wrong = [
        f"{name} imports {other}"
        for name in FILES
        for other in imports_of(name)
        if floor_of(other) > floor_of(name) or (floor_of(other) == floor_of(name) and on_one_floor(name, other))
    ]
    assert not wrong, "\n".join(wrong)


def on_one_floor(name: str, other: str) -> bool:
    """Whether both are on one floor in different rooms, of which neither is above the other."""
    return room_of(name) != room_of(other) and floor_of(name) > 0


def test_nothing_goes_round_in_a_circle() -> None:
    try:
        TopologicalSorter({name: imports_of(name) for name in FILES}).prepare()
    except CycleError as error:
        raise AssertionError(" -> ".join(error.args[1])) from None


def test_the_papers_use_public_names_only() -> None:
    private = []
    for name, file in FILES.items():
        if room_of(name) != "polyins_papers":
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("polyins."):
                private += [f"{name}: {alias.name}" for alias in node.names if alias.name.startswith("_")]
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id != "self":
                own = node.attr.startswith("_") and not node.attr.startswith("__")
                private += [f"{name}: {node.attr}"] if own and node.attr not in ("_replace", "_fields") else []
    assert not private
