"""What is known while a vehicle stands: no velocity, and no rate but the earth's."""

from __future__ import annotations

from polyins.kernels import bank, kalman, share, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.kernels.share import STRIDE


@scalar_kernel
def velocity_design(m: Array) -> None:
    """I on velocity."""
    _clear(m)
    for a in range(3):
        m[kalman.H + a * STRIDE + 3 + a] = 1.0


@scalar_kernel
def velocity_residual(w: Array, lane: int) -> vehicle.Three:
    """Velocity, m/s north, east, down."""
    v = bank.VELOCITY + lane
    return w[v], w[v + LANES], w[v + 2 * LANES]


@scalar_kernel
def rate_design(g: Array, m: Array) -> None:
    """I on gyro bias, the rate on gyro scale."""
    _clear(m)
    for a in range(3):
        m[kalman.H + a * STRIDE + 9 + a] = 1.0
        m[kalman.H + a * STRIDE + 15 + a] = g[share.RATE + a]


@scalar_kernel
def rate_residual(w: Array, lane: int, duration: float) -> vehicle.Three:
    """Mean corrected rate over the window less the earth's, rad/s in the IMU's axes."""
    c = vehicle.lane_matrix(w, bank.MATRIX + lane)
    x, y, z = vehicle.rotated_back(c, w[bank.EARTH_RATE + lane], 0.0, w[bank.EARTH_RATE + LANES + lane])
    t = bank.TURNED + lane
    return w[t] / duration - x, w[t + LANES] / duration - y, w[t + 2 * LANES] / duration - z


@scalar_kernel
def _clear(m: Array) -> None:
    for k in range(kalman.ROWS * STRIDE):
        m[kalman.H + k] = 0.0
