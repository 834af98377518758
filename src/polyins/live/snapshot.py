"""The navigation state at one instant, and the figures that show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polyins.formats.solution_files import trajectory_columns
from polyins.model.solution import Trajectory
from polyins.model.status import STATUSES

if TYPE_CHECKING:
    from polyins.navigate.navigator import NavigatorState

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Snapshot:
    """A state with what is needed to tell where it is."""

    state: NavigatorState
    origin: Array
    """the first position, from which metres count"""
    geodetic: bool
    dead_reckoning: bool
    """there has been no fix for longer than there usually is none"""

    @cached_property
    def row(self) -> dict[str, Any]:
        """The figures, under the names of `solution.parquet`'s columns, and whether it is dead reckoning."""
        figures = {
            name: None if values is None else float(values[0])
            for name, values in columns([self.state], self.origin, self.geodetic).items()
        }
        return {**figures, "dead_reckoning": self.dead_reckoning, "status": self.state.status}

    @cached_property
    def status(self) -> int:
        """What the state is worth, an index into `STATUSES`."""
        return STATUSES.index(self.state.status)


def columns(states: Sequence[NavigatorState], origin: Array, geodetic: bool) -> dict[str, Array | None]:
    """Return states as the columns of `solution.parquet`; None: not known on a local plane."""
    return trajectory_columns(_stacked(states), origin, geodetic)


def _stacked(states: Sequence[NavigatorState]) -> Trajectory:
    def of(name: str) -> Array:
        return np.array([getattr(state, name) for state in states])

    return Trajectory(
        of("time"),
        of("position"),
        of("velocity"),
        of("attitude"),
        of("position_std") ** 2,
        of("velocity_std") ** 2,
        of("phi_covariance"),
    )
