"""That a vehicle stands: no rate but the earth's, over a window in which the corrected increments were added up.

How an attitude error turns the earth's rate is left out.

Of the value: whether it is known that it stands; how long the window was, s.
"""

from __future__ import annotations

from polyins.aiding.measurement import VALUE, put_column, unit
from polyins.kernels import bank, covariance, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.model.states import place

_GYRO_BIAS, _GYRO_SCALE = place("gyro_bias"), place("gyro_scale")


@scalar_kernel
def design(block: Array, update: Array) -> None:
    """I on gyro bias, the rate on gyro scale."""
    for k in range(3):
        x, y, z = unit(k)
        rate = block[covariance.RATE + k]
        put_column(update, _GYRO_BIAS + k, (x, y, z))
        put_column(update, _GYRO_SCALE + k, (x * rate, y * rate, z * rate))


@scalar_kernel
def residual(lanes: Array, lane: int, measurement: Array) -> vehicle.Three:
    """Mean corrected rate over the window less the earth's, rad/s in the IMU's axes."""
    c = vehicle.lane_matrix(lanes, bank.MATRIX + lane)
    x, y, z = vehicle.rotated_back(c, lanes[bank.EARTH_RATE + lane], 0.0, lanes[bank.EARTH_RATE + LANES + lane])
    t, duration = bank.TURNED + lane, measurement[VALUE + 1]
    return lanes[t] / duration - x, lanes[t + LANES] / duration - y, lanes[t + 2 * LANES] / duration - z
