"""What a calibration found, by the keys of the configuration."""

from __future__ import annotations

from dataclasses import dataclass, field

from polyins.model.axes import axes_matrix, right_handed_axes
from polyins.model.recording import Array, Offset

ASIDE = "~"


@dataclass(frozen=True)
class Estimate:
    """One setting of an IMU, in the configuration's unit."""

    key: str
    """as in the configuration, like `wheel.radius_m`; what the configuration does not have begins with `ASIDE`"""
    value: tuple[float, ...] | str
    """of a matrix row by row"""
    std: tuple[float, ...] | None
    """None: of an estimate in words, or of a std"""
    configured: tuple[float, ...] | str


@dataclass(frozen=True)
class Agreement:
    """How far IMUs of an array differ from their mean, rms, smoothed."""

    gyro: float
    """rad/s"""
    accel: float
    """m/s^2"""


@dataclass(frozen=True)
class Calibration:
    """What a recording tells."""

    imus: dict[str, tuple[Estimate, ...]]
    """by the IMU's name"""
    clock_offsets: tuple[Offset, ...]
    warnings: tuple[str, ...]
    forward_from: str = ""
    """of a drive with wheels: how it was found which way is forward"""
    poses: int = 0
    """of an array: how many attitudes it was held in"""
    agreement: dict[str, Agreement] = field(default_factory=dict)
    """of an array: as configured and calibrated"""


def nearest_axes(rotation: Array) -> Array:
    """Return the permutation of axes, with signs, that is nearest to a rotation, shape (3, 3)."""
    matrices = [axes_matrix(axes) for axes in right_handed_axes()]
    return max(matrices, key=lambda matrix: float((matrix * rotation).sum()))
