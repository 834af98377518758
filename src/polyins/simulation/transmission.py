"""What a mass on a spring and a damper does when the spring's foot moves.

    y'' + 2 zeta w y' + w^2 y = 2 zeta w b' + w^2 b

It is a robot's body on its tyres over the ground, and the tip of a ruler whose clamp shakes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def transmit(foot: Array, step: float, rate: float, damping: float) -> tuple[Array, Array]:
    """Return y and y', shape (T, ...), of a foot that moves as given every `step` s and evenly in between.

    `rate` is the natural frequency, rad/s, `damping` its ratio. At the first sample all is at rest. The response to
    such a foot is exact, so y' is the derivative of y.
    """
    from scipy.signal import cont2discrete, lfilter

    denominator = [1.0, 2.0 * damping * rate, rate**2]
    place, speed = [2.0 * damping * rate, rate**2], [2.0 * damping * rate, rate**2, 0.0]
    moved = foot - foot[0]
    responses = []
    for numerator in (place, speed):
        top, bottom, _ = cont2discrete((numerator, denominator), step, method="foh")
        responses.append(np.asarray(lfilter(np.ravel(top), bottom, moved, axis=0)))
    return responses[0] + foot[0], responses[1]
