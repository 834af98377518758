"""The chips of paper A's rigid arrays: Group 1 as calibrated on a turntable, the other groups drawn like it.

The statistics are those of Group 1's 16 ICM-20602 in the data set whu-array. Both triads of a chip turn with it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from polyins.config import Number, Section, Triple
from polyins.config.fields import IDENTITY, Matrix
from polyins.model.recording import ImuStream
from polyins.model.rig import DEG
from polyins.simulation.error_scenario import ChipCalibration
from polyins.studies.scenario_files import read

Array = NDArray[np.float64]
Chips = tuple[ChipCalibration, ...]


class Statistics(Section):
    """Mean and std over the chips about each axis, x, y, z."""

    gyro_scale_mean_ppm: Triple
    gyro_scale_std_ppm: Triple
    accel_scale_mean_ppm: Triple
    accel_scale_std_ppm: Triple
    rotation_mean_deg: Triple
    rotation_std_deg: Triple
    gyro_skew_std_deg: Number
    accel_skew_std_deg: Number
    gyro_offset_std_deg_h: Triple
    accel_offset_std_mgal: Triple


def read_chips(folder: Path) -> Chips:
    """Return the calibrations of Group 1's chips from the folder of the data set whu-array."""
    gyro, accel = (np.loadtxt(folder / f"{name}_calibration_group1.txt") for name in ("gyro", "accel"))
    rows = zip(gyro, accel, strict=True)
    return tuple(_entry(g[:9].reshape(3, 3), g[9:], a[:9].reshape(3, 3), a[9:]) for g, a in rows)


def draw_chips(count: int, rng: np.random.Generator) -> Chips:
    """Draw chips from the statistics of Group 1's, `chips.yaml`."""
    statistics = read(Statistics, __package__, "chips")
    return tuple(_draw(statistics, rng) for _ in range(count))


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


def _draw(chip: Statistics, rng: np.random.Generator) -> ChipCalibration:
    from scipy.spatial.transform import Rotation

    rotation = Rotation.from_rotvec(rng.normal(chip.rotation_mean_deg, chip.rotation_std_deg) * DEG).as_matrix()
    matrices = []
    for mean, std, skew in (
        (chip.gyro_scale_mean_ppm, chip.gyro_scale_std_ppm, chip.gyro_skew_std_deg),
        (chip.accel_scale_mean_ppm, chip.accel_scale_std_ppm, chip.accel_skew_std_deg),
    ):
        square = np.eye(3)
        square[np.tril_indices(3, -1)] = rng.normal(0.0, skew * DEG, 3)
        matrices.append(np.diag(1.0 + 1e-6 * rng.normal(mean, std)) @ square @ rotation)
    gyro_offset = rng.normal(0.0, chip.gyro_offset_std_deg_h) / 3600.0
    accel_offset = rng.normal(0.0, chip.accel_offset_std_mgal) * 1e-5
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
