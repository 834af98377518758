"""That a vehicle stands: no velocity."""

from __future__ import annotations

from polyins.aiding.measurement import put_column, unit
from polyins.kernels import bank, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.model.states import place

_VELOCITY = place("velocity")


@scalar_kernel
def design(update: Array) -> None:
    """I on velocity."""
    for k in range(3):
        put_column(update, _VELOCITY + k, unit(k))


@scalar_kernel
def residual(lanes: Array, lane: int) -> vehicle.Three:
    """Velocity, m/s north, east, down."""
    v = bank.VELOCITY + lane
    return lanes[v], lanes[v + LANES], lanes[v + 2 * LANES]
