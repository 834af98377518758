"""Our own tables as targets, and all that are installed."""

from __future__ import annotations

import difflib
from importlib.metadata import entry_points

from polyins.errors import InputError
from polyins.studies.target import Target

TARGETS = (
    Target("flights", "polyins.studies.flights:reproduce", datasets=("quadrotor",), seconds=(10, 40)),
    Target(
        "wid",
        "polyins.studies.wid:reproduce",
        datasets=("wid",),
        pictures=True,
        seconds=(42, 60),
        print_tables="polyins.studies.wid:print_tables",
    ),
    Target("array", "polyins.studies.array:reproduce", seconds=(10, 240)),
    Target("allan", "polyins.studies.allan:reproduce", datasets=("mimu4444", "logs"), seconds=(20, 90)),
    Target(
        "clocks",
        "polyins.studies.clocks:reproduce",
        datasets=("quadrotor",),
        seconds=(30, 250),
        print_tables="polyins.studies.clocks:print_tables",
    ),
    Target(
        "beyond",
        "polyins.studies.beyond.table:reproduce",
        datasets=("quadrotor",),
        seconds=(110, 1500),
        print_tables="polyins.studies.beyond.table:print_tables",
    ),
    Target("consistency", "polyins.studies.consistency:reproduce"),
    Target(
        "starts",
        "polyins.studies.starts:reproduce",
        seconds=(45, 500),
        print_tables="polyins.studies.starts:print_tables",
    ),
    Target(
        "split",
        "polyins.studies.split:reproduce",
        datasets=("quadrotor", "whu-array"),
        pictures=True,
        seconds=(12, 120),
    ),
    Target(
        "calibration",
        "polyins.studies.calibration:reproduce",
        datasets=("quadrotor", "mimu4444", "whu-array"),
        seconds=(40, 240),
    ),
    Target(
        "checks",
        "polyins.studies.data_faults.table:reproduce",
        datasets=("quadrotor", "wid", "whu-array"),
        seconds=(60, 280),
        print_tables="polyins.studies.data_faults.table:print_tables",
    ),
    Target(
        "lies",
        "polyins.studies.robustness.lies:reproduce",
        seconds=(10, 30),
        print_tables="polyins.studies.robustness.lies:print_tables",
    ),
    Target(
        "gaps",
        "polyins.studies.robustness.gaps:reproduce",
        seconds=(15, 240),
        print_tables="polyins.studies.robustness.gaps:print_tables",
    ),
    Target(
        "slips",
        "polyins.studies.robustness.slips:reproduce",
        seconds=(5, 30),
        print_tables="polyins.studies.robustness.slips:print_tables",
    ),
    Target(
        "robustness",
        "polyins.studies.robustness.table:reproduce",
        seconds=(50, 240),
        print_tables="polyins.studies.robustness.table:print_tables",
    ),
)

GROUP = "polyins.targets"
"""entry points under which distributions offer tables of targets"""
SEVERAL = ("all", "figures")
"""names of many targets: every one, and those with pictures"""


def known() -> dict[str, Target]:
    """Return all targets that are installed, by name: ours first."""
    offered = [target for entry in sorted(entry_points(group=GROUP), key=_name) for target in entry.load()]
    return {target.name: target for target in (*TARGETS, *offered)}


def _name(entry: object) -> str:
    return str(getattr(entry, "name", ""))


def find(name: str) -> tuple[Target, ...]:
    """Return the target of that name, or all that a name of several stands for.

    Raises InputError with the nearest known name for an unknown one.
    """
    targets = known()
    if name in SEVERAL:
        return tuple(target for target in targets.values() if name == "all" or target.pictures)
    if name not in targets:
        names = (*targets, *SEVERAL)
        similar = difflib.get_close_matches(name, names, n=1)
        hint = f"did you mean {similar[0]!r}?" if similar else f"expected one of {', '.join(names)}"
        raise InputError(f"reproduce: target {name!r} is unknown; {hint}")
    return (targets[name],)
