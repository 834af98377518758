"""The chips of paper A's rigid arrays: Group 1 as calibrated on a turntable, the other groups drawn like it.

The statistics are those of Group 1's 16 ICM-20602 in the data set whu-array. Both triads of a chip turn with it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from polyins.recording import ImuStream
from polyins.rig import DEG
from polyins.simulation.error_scenario import IDENTITY, ChipCalibration, Matrix

Array = NDArray[np.float64]
Chips = tuple[ChipCalibration, ...]

GYRO_SCALE_PPM = (2806.0, 1028.0, 689.0), (1238.0, 1250.0, 2029.0)
"""mean and std over the chips, likewise below"""
ACCEL_SCALE_PPM = (-279.0, -967.0, 672.0), (660.0, 761.0, 1428.0)
ROTATION_DEG = (0.75, 0.01, -0.37), (0.21, 0.21, 0.21)
"""of the chip; the mean is the board's"""
GYRO_SKEW_DEG = 0.085
ACCEL_SKEW_DEG = 0.024
GYRO_OFFSET_DEG_H = (3579.0, 2037.0, 1281.0)
"""std; the mean is no property of the chips"""
ACCEL_OFFSET_MGAL = (11157.0, 6541.0, 13576.0)


def read_chips(folder: Path) -> Chips:
    """Return the calibrations of Group 1's chips from the folder of the data set whu-array."""
    gyro, accel = (np.loadtxt(folder / f"{name}_calibration_group1.txt") for name in ("gyro", "accel"))
    rows = zip(gyro, accel, strict=True)
    return tuple(_entry(g[:9].reshape(3, 3), g[9:], a[:9].reshape(3, 3), a[9:]) for g, a in rows)


def draw_chips(count: int, rng: np.random.Generator) -> Chips:
    """Draw chips from the statistics of Group 1's."""
    return tuple(_draw(rng) for _ in range(count))


def parts_of(chips: Chips) -> dict[str, Chips]:
    """Return the chips with their offsets only, with their scale factors too, and whole."""
    bare = tuple(chip.model_copy(update={"gyro_matrix": IDENTITY, "accel_matrix": IDENTITY}) for chip in chips)
    scaled = tuple(
        chip.model_copy(update={name: _diagonal(getattr(chip, name)) for name in ("gyro_matrix", "accel_matrix")})
        for chip in chips
    )
    return {"offsets": bare, "scale factors": scaled, "axes": chips}


def _diagonal(matrix: Matrix) -> Matrix:
    (xx, _, _), (_, yy, _), (_, _, zz) = matrix
    return (xx, 0.0, 0.0), (0.0, yy, 0.0), (0.0, 0.0, zz)


def _draw(rng: np.random.Generator) -> ChipCalibration:
    from scipy.spatial.transform import Rotation

    rotation = Rotation.from_rotvec(rng.normal(*ROTATION_DEG) * DEG).as_matrix()
    matrices = []
    for (mean, std), skew in ((GYRO_SCALE_PPM, GYRO_SKEW_DEG), (ACCEL_SCALE_PPM, ACCEL_SKEW_DEG)):
        square = np.eye(3)
        square[np.tril_indices(3, -1)] = rng.normal(0.0, skew * DEG, 3)
        matrices.append(np.diag(1.0 + 1e-6 * rng.normal(mean, std)) @ square @ rotation)
    gyro_offset = rng.normal(0.0, GYRO_OFFSET_DEG_H) / 3600.0
    accel_offset = rng.normal(0.0, ACCEL_OFFSET_MGAL) * 1e-5
    return _entry(matrices[0], gyro_offset, matrices[1], accel_offset)


def _entry(gyro: Array, gyro_offset: Array, accel: Array, accel_offset: Array) -> ChipCalibration:
    return ChipCalibration.model_validate(
        {
            "gyro_matrix": gyro.tolist(),
            "gyro_offset_deg_s": gyro_offset.tolist(),
            "accel_matrix": accel.tolist(),
            "accel_offset_m_s2": accel_offset.tolist(),
        }
    )


def compensate(stream: ImuStream, calibration: ChipCalibration) -> ImuStream:
    """Return the stream of a chip as its calibration corrects it: matrix raw + offset."""
    chip = calibration.chip()
    interval = np.diff(stream.time, prepend=2.0 * stream.time[0] - stream.time[1])[:, None]
    return ImuStream(
        stream.name,
        stream.time,
        # a matrix product would wake every BLAS thread for a 3 x 3 matrix
        np.einsum("ij,tj->ti", chip.gyro.matrix, stream.dtheta) + chip.gyro.offset * interval,
        np.einsum("ij,tj->ti", chip.accel.matrix, stream.dvel) + chip.accel.offset * interval,
    )
