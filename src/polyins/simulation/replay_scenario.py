"""What a scenario may say of a surveyed drive to be driven again."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from polyins.config import Number, PositiveSpread, Section
from polyins.io.columns import read_columns
from polyins.rig import DEG
from polyins.simulation.path import Path
from polyins.simulation.replay import replay


class Replay(Section):
    """Positions of a drive, as RTK gives them: speed, course and slope follow; camber and lean are drawn."""

    file: str
    """a table of positions of what becomes the array origin: time_s, latitude_deg, longitude_deg, height_m"""
    position_std_m: PositiveSpread = (0.02, 0.02, 0.04)
    """of the positions, north, east, down: the path is smoothed as far as that allows, m"""
    side_slip_deg_per_m_s2: Annotated[Number, Field(ge=0.0, le=2.0)] = 0.0
    """by how much the nose points inwards of the course in a turn, deg per m/s^2; cars at speed have about 0.3"""

    def path(self, seed: int) -> Path:
        """Return the path along the positions, whose camber the seed draws; raises InputError for others."""
        names = ("time_s", "latitude_deg", "longitude_deg", "height_m")
        _, (time, latitude, longitude, height) = read_columns(self.file, names)
        position = np.column_stack([latitude * DEG, longitude * DEG, height])
        std = np.tile(self.position_std_m, (len(time), 1))
        return replay(time, position, std, seed=seed, side_slip=self.side_slip_deg_per_m_s2 * DEG)
