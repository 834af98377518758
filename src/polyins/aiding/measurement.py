"""A measurement while it is applied: what its event says, and where and when that is."""

from __future__ import annotations

from polyins.kernels import kalman, vehicle
from polyins.kernels.covariance import LARGEST
from polyins.kernels.jit import Array, scalar_kernel
from polyins.kernels.layout import Layout

_layout = Layout()
_take = _layout.take

VALUE = _take(8)  # what the event says, see the files of the kinds
VARIANCE = _take(3)  # not positive: that component is not measured
KIND = _take(1)
DT = _take(1)  # seconds over which the last corrected increments were measured
GEODETIC = _take(1)  # whether positions are latitude, longitude and height
METRIC = _take(3)  # metres north, east, down per unit of each coordinate

SIZE = _layout.size

PLACE = VALUE + 3
"""where the kinds that measure a point of the vehicle keep its place, in vehicle axes, m"""


@scalar_kernel
def unit(k: int) -> vehicle.Three:
    """Return the k-th unit vector."""
    return 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0


@scalar_kernel
def put_column(update: Array, column: int, values: vehicle.Three) -> None:
    """Write a column of the design matrix."""
    for a in range(kalman.ROWS):
        update[kalman.H + a * LARGEST + column] = values[a]


@scalar_kernel
def put_turn(update: Array, k: int, values: vehicle.Three) -> None:
    """Write what a small rotation of the vehicle about the k-th axis of n does to the measurement."""
    for a in range(kalman.ROWS):
        update[kalman.TURN + 3 * a + k] = values[a]


@scalar_kernel
def put_row(update: Array, column: int, row: int, values: vehicle.Three) -> None:
    """Write three numbers of one row of the design matrix from a column on."""
    h = kalman.H + row * LARGEST + column
    update[h], update[h + 1], update[h + 2] = values


@scalar_kernel
def put_skew(update: Array, column: int, x: float, y: float, z: float) -> None:
    """Write (x, y, z) x into three columns of the design matrix."""
    put_row(update, column, 0, (0.0, -z, y))
    put_row(update, column, 1, (z, 0.0, -x))
    put_row(update, column, 2, (-y, x, 0.0))
