"""The height of the sea (geoid) above the ellipsoid: EGM96 on a grid of 5', by egm96, which brings it along."""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module
from types import ModuleType

import numpy as np

from polyins.model.recording import Array
from polyins.model.rig import DEG

MODEL = "EGM96"


@lru_cache(maxsize=1)
def library() -> ModuleType | None:
    """Return what looks the grid up, or None where it is not installed."""
    try:
        found = import_module("egm96")
    except ImportError:
        return None
    return found if hasattr(found, "undulation") else None  # 0.1 is empty


def heights(position: Array) -> Array | None:
    """Return the geoid above the ellipsoid, m, shape (...), at latitude and longitude, rad, shape (..., 3).

    None without the grid. EGM96 itself is good to 0.5 to 1 m.
    """
    grid = library()
    if grid is None:
        return None
    return np.asarray(grid.undulation(position[..., 0] / DEG, position[..., 1] / DEG), dtype=float)
