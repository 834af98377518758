"""Positions and their differences in metres north, east and down."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def metres_per_unit(position: Array, geodetic: bool) -> Array:
    """Return what turns small differences of positions into metres north, east, down, shape (..., 3).

    For (latitude, longitude, height) that is (R_M + h, (R_N + h) cos latitude, -1) with the radii of WGS 84; on a
    local plane (1, 1, -1). `position` has shape (..., 3).
    """
    scale = np.broadcast_to([1.0, 1.0, -1.0], position.shape).copy()
    if geodetic:
        from pymap3d import rcurve

        latitude, height = position[..., 0], position[..., 2]
        scale[..., 0] = rcurve.meridian(latitude, deg=False) + height
        scale[..., 1] = (rcurve.transverse(latitude, deg=False) + height) * np.cos(latitude)
    return scale


def displacement(position: Array, origin: Array, geodetic: bool) -> Array:
    """Return metres north, east, down from `origin`, shape (3,), to each `position`, shape (T, 3).

    For geodetic positions the axes are those of the plane that touches the ellipsoid's normal at `origin`.
    """
    if not geodetic:
        return (position - origin) * [1.0, 1.0, -1.0]
    from pymap3d import geodetic2ned

    return np.column_stack(geodetic2ned(*position.T, *origin, deg=False))
