"""The method table: who is in the bank, who shares a covariance block, what aids it, how answers merge."""

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
    bank: Literal["one", "mean", "all", "rolling"]
    """one IMU; one virtual IMU, the mean of all moved to the array origin; all IMUs side by side; or modules on wheels
    and body, aided by wheel speed"""
    shares: Literal["each", "all", "module"] = "each"
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
    def rolling(self) -> bool:
        """Whether wheels aid it."""
        return self.bank == "rolling"


METHODS = {
    method.name: method
    for method in (
        Method("single", bank="one"),
        Method("imu-fusion", bank="mean"),
        Method("nav-fusion", bank="all"),
        Method("enav-fusion", bank="all", shares="all"),
        Method("enav-fusion-shared-mechanization", bank="all", shares="all", shared_mechanization=True),
        Method("wheel-ins", bank="rolling", shares="module", wheels=1),
        Method("body-ins", bank="rolling", shares="module", wheels=1, bodies=1, wheels_navigate=False),
        Method("dual-wheel-ins", bank="rolling", shares="module", wheels=2),
        Method("body-wheel-ins", bank="rolling", shares="module", wheels=1, bodies=1),
        Method("triple-ins", bank="rolling", shares="module", wheels=2, bodies=1),
        Method("multi-wheel-ins", bank="rolling", shares="module", wheels=ALL, bodies=ALL),
    )
}

ARRAY_METHODS = tuple(name for name, row in METHODS.items() if not row.rolling)
"""Of an array with GNSS; the others need wheels."""


def find_method(name: str) -> Method:
    """Return the row of that name; raise InputError with the nearest known one otherwise.

    Of a method with wheels, `/` may be followed by IMUs or modules to choose and by `centralized`, as in
    `body-wheel-ins/IMU4` or `triple-ins/centralized`.
    """
    base, *words = name.split("/")
    if base not in METHODS:
        near = difflib.get_close_matches(base, METHODS, n=1)
        hint = f"did you mean {near[0]!r}?" if near else "known: " + ", ".join(METHODS)
        raise InputError(f"method: {name!r} is unknown; {hint}")
    row = METHODS[base]
    if words and not row.rolling:
        raise InputError(f"method: {name!r}; expected nothing after {base!r}")
    for word in words:
        if words.count(word) > 1:
            raise InputError(f"method: {name!r} says {word!r} twice; expected it once")
    chosen = tuple(word for word in words if word != CENTRALIZED)
    return replace(row, name=name, joined=CENTRALIZED in words, chosen=chosen)
