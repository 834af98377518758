"""What error-free IMUs on a rolling wheel put out.

The wheel's centre p is a point of the vehicle, so the specific force there is that of `increments` at a lever arm,

    f_b(p) = C_bv (f(0) + A p + dw/dt x p),    A = (w x)(w x) - gravity's gradient ...,    w = w_iv^v,

seen from axes that spin with the rate s about x. As d/dt C_bv = -s [x x] C_bv, integration by parts needs no dw/dt:

    integral C_bv (dw/dt x p) = [C_bv (w x p)] + integral s x x C_bv (w x p).

Around the centre the module is a rigid body that turns with w_ib^b.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.simulation.increments import Increments, cross_matrix, double_cross_matrix, rates
from polyins.simulation.rolling import RollingWheel, axle_axes, to_module

Array = NDArray[np.float64]

GAUSS_NODES = 4  # exact to 1e-14 where the wheel turns by 0.25 rad per interval, to 1e-10 at 0.8 rad
BLOCK = 20_000  # intervals worked on at once: keeps the 3 x 3 matrices in the cache


def wheel_increments(wheel: RollingWheel, rate_hz: float = 200.0) -> Increments:
    """Return the error-free increments of the module in its own axes; the first interval starts at time 0.

    `dvel` is that at the wheel's centre; `at(-lever_arm)` gives what an IMU puts out whose `lever_arm` leads to it.
    """
    interval = 1.0 / rate_hz
    count = int(np.floor(wheel.path.duration * rate_hz + 1e-6))
    edges = np.arange(count + 1) / rate_hz
    dtheta, dvel, lever = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3, 3))
    for first in range(0, count, BLOCK):
        part = slice(first, min(first + BLOCK, count))
        dtheta[part], dvel[part], lever[part] = _integrate(wheel, edges[part.start : part.stop + 1], interval)
    return Increments(edges[1:], interval, dtheta, dvel, lever)


def _integrate(wheel: RollingWheel, edges: Array, interval: float) -> tuple[Array, Array, Array]:
    """Return the integrals of w, f at the centre and the lever-arm matrix between the edges."""
    rate, swing = _at_edges(wheel, edges)
    dtheta, dvel, lever = np.zeros((edges.size - 1, 3)), np.diff(swing, axis=0), cross_matrix(np.diff(rate, axis=0))
    for node, weight in zip(*np.polynomial.legendre.leggauss(GAUSS_NODES), strict=True):
        rate, force, arm = _rates(wheel, edges[:-1] + interval * (1.0 + node) / 2.0)
        dtheta += rate * (weight * interval / 2.0)
        dvel += force * (weight * interval / 2.0)
        lever += arm * (weight * interval / 2.0)
    return dtheta, dvel, lever


def _at_edges(wheel: RollingWheel, time: Array) -> tuple[Array, Array]:
    """Return what is known in full at the ends of the intervals: w_ib^b and C_bv (w_iv x p)."""
    motion, C_vb = wheel.path.motion(time), axle_axes(wheel.angle(time))
    rate = to_module(C_vb, motion.angular_rate)
    rate[:, 0] += wheel.spin(motion, time)
    return rate, to_module(C_vb, np.cross(motion.angular_rate, wheel.centre))


def _rates(wheel: RollingWheel, time: Array) -> tuple[Array, Array, Array]:
    """Return w_ib^b, f^b at the centre and the lever-arm matrix, each without what the edges give."""
    motion, C_vb = wheel.path.motion(time), axle_axes(wheel.angle(time))
    vehicle_rate, origin_force, vehicle_arm = rates(wheel.path, time)
    spin = wheel.spin(motion, time)
    rate = to_module(C_vb, vehicle_rate)
    rate[:, 0] += spin
    force = to_module(C_vb, origin_force + vehicle_arm @ wheel.centre)
    swing = to_module(C_vb, np.cross(vehicle_rate, wheel.centre))
    force[:, 1] -= spin * swing[:, 2]
    force[:, 2] += spin * swing[:, 1]
    slow = vehicle_arm - double_cross_matrix(vehicle_rate)
    return rate, force, double_cross_matrix(rate) + np.swapaxes(C_vb, 1, 2) @ slow @ C_vb
