"""A height of a point of the vehicle: of a barometer, or one that is known.

What is shown is the height and a bias, which the filter may estimate. Counted downwards the prediction less what is
shown is the third component of `point`, less the estimated bias, which is too small by its error state.

Of the value: height, m; place of the point 3, from the fourth number on.
"""

from __future__ import annotations

from polyins.aiding import point
from polyins.aiding.measurement import METRIC, PLACE, VALUE
from polyins.kernels import bank, kalman, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.covariance import LARGEST
from polyins.kernels.jit import Array, scalar_kernel
from polyins.model.states import place

_HEIGHT_BIAS = place("height_bias")


@scalar_kernel
def design(block: Array, lanes: Array, lane: int, measurement: Array, update: Array) -> None:
    """Write the design matrix at the fused state of a block, and TURN: the row down of `point.design`, first."""
    point.design(block, lanes, lane, measurement, update)
    for j in range(LARGEST):
        h = kalman.H + j
        update[h] = update[h + 2 * LARGEST]
        update[h + LARGEST] = update[h + 2 * LARGEST] = 0.0
    for k in range(3):
        t = kalman.TURN + k
        update[t] = update[t + 6]
        update[t + 3] = update[t + 6] = 0.0
    update[kalman.H + _HEIGHT_BIAS] = 1.0


@scalar_kernel
def residual(lanes: Array, lane: int, lent: vehicle.Matrix, measurement: Array) -> vehicle.Three:
    """Predicted less shown height, m, counted downwards."""
    _, _, d = point.to_wheel(lanes, lane, vehicle.lane_matrix(lanes, bank.MATRIX + lane))
    p = bank.IN_VEHICLE + lane
    _, _, pd = vehicle.rotated(
        vehicle.vehicle_matrix(lanes, lane, lent),
        lanes[p] - measurement[PLACE],
        lanes[p + LANES] - measurement[PLACE + 1],
        lanes[p + 2 * LANES] - measurement[PLACE + 2],
    )
    shown = measurement[VALUE] - lanes[bank.HEIGHT_BIAS + lane]
    return (lanes[bank.POSITION + 2 * LANES + lane] - shown) * measurement[METRIC + 2] + d - pd, 0.0, 0.0
