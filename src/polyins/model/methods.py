"""The method table: who is in the bank, who shares a covariance block, which blocks are joined.

What aids a run is not in it: that follows from the rig and the streams.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, replace
from typing import Literal

from polyins.errors import InputError

ALL = 1_000_000
"""as many as there are"""

CENTRALIZED = "centralized"


@dataclass(frozen=True)
class Method:
    """One row of the table."""

    name: str
    bank: Literal["one", "mean", "all", "modules"]
    """one IMU; one virtual IMU, the mean of all moved to the array origin; all IMUs side by side; or modules on wheels
    and body. The first three take the IMUs that are fixed to the body"""
    blocks: Literal["each", "all", "module"] = "each"
    """{1} {2} ... {N}: a covariance block for each; {1 2 ... N}: one block for all; or one block for each module"""
    shared_mechanization: bool = False
    """compute the intermediates of each mechanization from the fused attitude, velocity and position"""
    wheels: int = 0
    """modules on wheels that give speed"""
    bodies: int = 0
    """modules on the body"""
    wheels_navigate: bool = True
    """whether the modules on wheels are in the bank, besides giving speed"""
    joined: bool = False
    """[{1} {2} ...]: the blocks keep their cross-covariances"""
    chosen: tuple[str, ...] = ()
    """names of the IMUs or modules to prefer, where there are more than the method takes"""

    @property
    def for_wheels(self) -> bool:
        """Whether it is made for rigs with an IMU on a wheel."""
        return self.bank == "modules"


METHODS = {
    method.name: method
    for method in (
        Method("single", bank="one"),
        Method("imu-fusion", bank="mean"),
        Method("nav-fusion", bank="all"),
        Method("enav-fusion", bank="all", blocks="all"),
        Method("enav-fusion-shared-mechanization", bank="all", blocks="all", shared_mechanization=True),
        Method("wheel-ins", bank="modules", blocks="module", wheels=1),
        Method("body-ins", bank="modules", blocks="module", wheels=1, bodies=1, wheels_navigate=False),
        Method("dual-wheel-ins", bank="modules", blocks="module", wheels=2),
        Method("body-wheel-ins", bank="modules", blocks="module", wheels=1, bodies=1),
        Method("triple-ins", bank="modules", blocks="module", wheels=2, bodies=1),
        Method("multi-wheel-ins", bank="modules", blocks="module", wheels=ALL, bodies=ALL),
    )
}

ARRAY_METHODS = tuple(name for name, row in METHODS.items() if not row.for_wheels)
"""Of the IMUs on a body; the others need wheels."""


def find_method(name: str) -> Method:
    """Return the row of that name; raise InputError with the nearest known one otherwise.

    After `/` may follow `centralized`, and for a method with wheels IMUs or modules to choose, as in
    `body-wheel-ins/IMU4`, `triple-ins/centralized` or `nav-fusion/centralized`.
    """
    base, *words = name.split("/")
    if base not in METHODS:
        close = difflib.get_close_matches(base, METHODS, n=1)
        hint = f"did you mean {close[0]!r}?" if close else "known: " + ", ".join(METHODS)
        raise InputError(f"method: {name!r} is unknown; {hint}")
    row = METHODS[base]
    if CENTRALIZED in words and not row.for_wheels and (row.bank != "all" or row.blocks != "each"):
        raise InputError(f"method: {name!r}; {base} has one covariance block: expected several to be joined")
    chosen = tuple(word for word in words if word != CENTRALIZED)
    if chosen and not row.for_wheels:
        raise InputError(f"method: {name!r}; expected nothing after {base!r} but {CENTRALIZED}")
    for word in words:
        if words.count(word) > 1:
            raise InputError(f"method: {name!r} says {word!r} twice; expected it once")
    return replace(row, name=name, joined=CENTRALIZED in words, chosen=chosen)
