"""The method table: who is in the bank, who shares a covariance block, what aids it, how answers merge."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import Literal

from polyins.errors import InputError


@dataclass(frozen=True)
class Method:
    """One row of the table."""

    name: str
    bank: Literal["one", "mean", "all"]
    """one IMU; one virtual IMU, the mean of all moved to the array origin; or all IMUs side by side"""
    shares: Literal["each", "all"] = "each"
    """{1} {2} ... {N}: a covariance block for each; or {1 2 ... N}: one block for all"""
    shared_mechanization: bool = False
    """compute the intermediates of each mechanization from the fused attitude, velocity and position"""


METHODS = {
    method.name: method
    for method in (
        Method("single", bank="one"),
        Method("imu-fusion", bank="mean"),
        Method("nav-fusion", bank="all"),
        Method("enav-fusion", bank="all", shares="all"),
        Method("enav-fusion-shared-mechanization", bank="all", shares="all", shared_mechanization=True),
    )
}


def find_method(name: str) -> Method:
    """Return the row of that name; raise InputError with the nearest known one otherwise."""
    if name in METHODS:
        return METHODS[name]
    near = difflib.get_close_matches(name, METHODS, n=1)
    hint = f"did you mean {near[0]!r}?" if near else "known: " + ", ".join(METHODS)
    raise InputError(f"method: {name!r} is unknown; {hint}")
