"""What IMUs that are alike have in common and what each has of its own, as the covariances of a bank begin with it.

Of N with a common share c of the variance v of a noise or a slow error, the mean has (c + (1 - c) / N) v, and each
deviates from it by (1 - c) v. See docs/theory.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from polyins.kernels import covariance
from polyins.model.methods import Method
from polyins.model.recording import FilterOptions
from polyins.model.rig import DEG, STANDARD_GRAVITY
from polyins.model.states import IMU_ERRORS, NAVIGATION, place

Array = NDArray[np.float64]

AXES_STD = 0.2 * DEG
"""rad: how exactly the axes of an IMU of several lie as is said"""
HOLDS = (0.0005, 0.001, 0.005 * DEG)
"""m, m/s, rad: how well IMUs on a stiff body keep together, beside what their errors explain"""

SLOW = slice(NAVIGATION, NAVIGATION + IMU_ERRORS)
PHI, AXES, ACCEL = (slice(place(name), place(name) + 3) for name in ("phi", "speed_scale", "accel_bias"))


def compares(row: Method, options: FilterOptions, blocks: tuple[tuple[int, ...], ...]) -> bool:
    """Whether IMUs that share a covariance block are compared with their mean; not where each begins with its state."""
    several = row.bank != "mean" and not row.shared_mechanization and any(len(block) > 1 for block in blocks)
    return several and options.common_share < 1.0 and options.relative_interval is not None


def noise_of(block: Array) -> Array:
    """Return what drives the errors of one IMU, as its block has it, without what drives those of other sensors."""
    noise = block[: covariance.NOISES].copy()
    noise[IMU_ERRORS : covariance.GYRO_PSD] = 0.0
    return noise


def share_out(block: Array, own: Array | None, count: int, options: FilterOptions, rotation: Array) -> None:
    """Turn the block of one IMU into that of the mean of `count`, and write how each deviates from it, if asked for.

    `rotation`: C_nb of the mean at the start.
    """
    scale = 1.0 if options.own_noise == "auto" else options.own_noise
    common, alone = options.common_share, (1.0 - options.common_share) * scale
    share, noise, square = common + alone / count, noise_of(block), square_of(block)
    block[covariance.MEMBERS], block[covariance.OWN_SCALE] = count, scale
    if own is not None:
        own[: covariance.P] = block[: covariance.P]
        own[: covariance.NOISES] = alone * noise
        _begin_deviations(square_of(own), square, alone, rotation)
    block[: covariance.NOISES] = np.where(noise > 0.0, share * noise, block[: covariance.NOISES])
    square[SLOW, SLOW] *= share
    if common < 1.0 < count:
        square[ACCEL, ACCEL] += (STANDARD_GRAVITY * AXES_STD) ** 2 / count * np.eye(3)


def square_of(block: Array) -> Array:
    """Return P of a block, square."""
    stride = int(np.sqrt(len(block) - covariance.P))
    return block[covariance.P : covariance.P + stride**2].reshape(stride, stride)


def _begin_deviations(own: Array, one: Array, alone: float, rotation: Array) -> None:
    """Write D: all begin at one state, and each has slow errors and axes of its own.

    Where axes lie otherwise than said an attitude is off by as much, so that what is compared is not; and gravity shows
    in them.
    """
    own[:] = 0.0
    own[SLOW, SLOW] = alone * one[SLOW, SLOW]
    own[ACCEL, ACCEL] += (STANDARD_GRAVITY * AXES_STD) ** 2 * np.eye(3)
    own[PHI, PHI] = own[AXES, AXES] = AXES_STD**2 * np.eye(3)
    own[PHI, AXES], own[AXES, PHI] = -(AXES_STD**2) * rotation, -(AXES_STD**2) * rotation.T
