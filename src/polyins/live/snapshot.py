"""The navigation state at one instant, and the figures by which it is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from polyins.model.attitude import euler_angles, euler_variance
from polyins.model.geodesy import displacement

if TYPE_CHECKING:
    from polyins.navigate.navigator import NavigatorState

Array = NDArray[np.float64]

_LOCAL = ("north_m", "east_m", "down_m")
_VELOCITY = ("north_velocity_m_s", "east_velocity_m_s", "down_velocity_m_s")
_EULER = ("roll_deg", "pitch_deg", "heading_deg")
_PHI = tuple(f"std_phi_{axis}_deg" for axis in ("north", "east", "down"))


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
    def row(self) -> dict[str, float | None]:
        """The figures, under the names of `solution.parquet`'s columns, and whether it is dead reckoning."""
        figures = {
            name: None if values is None else float(values[0])
            for name, values in columns([self.state], self.origin, self.geodetic).items()
        }
        return {**figures, "dead_reckoning": self.dead_reckoning}


def columns(states: Sequence[NavigatorState], origin: Array, geodetic: bool) -> dict[str, Array | None]:
    """Return states as the columns of `solution.parquet`; None: not known on a local plane."""

    def stacked(name: str) -> Array:
        return np.array([getattr(state, name) for state in states])

    position, phi, euler = stacked("position"), stacked("phi_covariance"), euler_angles(stacked("attitude"))
    degrees = np.degrees(euler)
    degrees[:, 2] %= 360.0
    latitude, longitude = np.degrees(position[:, :2]).T if geodetic else (None, None)
    return {
        "time_s": stacked("time"),
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "height_m": position[:, 2],
        **_named(_VELOCITY, stacked("velocity")),
        **_named(_EULER, degrees),
        **_named([f"std_{name}" for name in _LOCAL], stacked("position_std")),
        **_named([f"std_{name}" for name in _VELOCITY], stacked("velocity_std")),
        **_named([f"std_{name}" for name in _EULER], np.degrees(np.sqrt(euler_variance(euler, phi)))),
        **_named(_PHI, np.degrees(np.sqrt(phi[:, [0, 3, 5]]))),
        **_named(_LOCAL, displacement(position, origin, geodetic)),
    }


def _named(names: Sequence[str], values: Array) -> dict[str, Array]:
    return dict(zip(names, values.T, strict=True))
