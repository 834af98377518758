"""What a mass on a spring and a damper does when the spring's foot moves.

    y'' + 2 zeta w y' + w^2 y = 2 zeta w b' + w^2 b

It is the tip of a ruler whose clamp shakes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.kernels.jit import kernel

Array = NDArray[np.float64]


def transmit(foot: Array, step: float, rate: float, damping: float) -> tuple[Array, Array]:
    """Return y and y', shape (T,), of a foot that moves as given every `step` s and evenly in between.

    `rate` is the natural frequency, rad/s, `damping` its ratio. At the first sample all is at rest. The response to
    such a foot is exact, so y' is the derivative of y.
    """
    from scipy.linalg import expm

    drag = 2.0 * damping * rate
    # y, y' - drag b, b and its constant slope
    system = np.array(
        [[0.0, 1.0, drag, 0.0], [-(rate**2), -drag, rate**2 - drag**2, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0] * 4]
    )
    response = np.empty((2, len(foot)))
    _respond(np.ascontiguousarray(foot - foot[0]), expm(system * step), step, drag, response)
    return response[0] + foot[0], response[1]


@kernel
def _respond(foot: Array, change: Array, step: float, drag: float, response: Array) -> None:
    """Write y and y'; `change` takes the state over one step."""
    y, z = 0.0, 0.0
    response[0, 0], response[1, 0] = y, z + drag * foot[0]
    for k in range(1, len(foot)):
        b, slope = foot[k - 1], (foot[k] - foot[k - 1]) / step
        last = y
        y = change[0, 0] * last + change[0, 1] * z + change[0, 2] * b + change[0, 3] * slope
        z = change[1, 0] * last + change[1, 1] * z + change[1, 2] * b + change[1, 3] * slope
        response[0, k], response[1, k] = y, z + drag * foot[k]
