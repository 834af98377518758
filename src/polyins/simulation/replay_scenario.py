"""What a scenario may say of a surveyed drive to be driven again."""

from __future__ import annotations

import numpy as np

from polyins.config import PositiveSpread, Section
from polyins.io.columns import read_columns
from polyins.rig import DEG
from polyins.simulation.path import Path
from polyins.simulation.replay import replay


class Replay(Section):
    """Positions of a drive, as RTK gives them: speed, course and slope follow; camber and lean are drawn."""

    file: str
    """a table of positions: time_s, latitude_deg, longitude_deg, height_m"""
    position_std_m: PositiveSpread = (0.02, 0.02, 0.04)
    """of the positions, north, east, down: the path is smoothed as far as that allows, m"""

    def path(self, seed: int) -> Path:
        """Return the path along the positions, whose camber the seed draws; raises InputError for others."""
        names = ("time_s", "latitude_deg", "longitude_deg", "height_m")
        _, (time, latitude, longitude, height) = read_columns(self.file, names)
        position = np.column_stack([latitude * DEG, longitude * DEG, height])
        return replay(time, position, np.tile(self.position_std_m, (len(time), 1)), seed=seed)
