"""Poses as robotics has them: TUM (stamp, position, quaternion) and KITTI (the first three rows of the matrix).

Positions are metres east, north, up (REP 103) from the solution's first position, attitudes those of the body's
forward, left, up axes in them. KITTI's own poses are of a camera; here the frames are those of TUM.
"""

from __future__ import annotations

from typing import IO

import numpy as np

from polyins.model.attitude import rotation_matrices
from polyins.tools.export.trace import Trace

TUM_HEADER = "# timestamp tx ty tz qx qy qz qw: s; east, north, up, m; from the body's forward, left, up\n"


def write_tum(file: IO[bytes], trace: Trace) -> None:
    """Write a line for each row: stamp of the solution, position, quaternion with the scalar last."""
    rows = np.column_stack([trace["time_s"], trace.east_north_up, np.roll(trace.attitude, -1, axis=1)])
    file.write(TUM_HEADER.encode())
    np.savetxt(file, rows, fmt=["%.9f", *["%.6f"] * 3, *["%.9f"] * 4])


def write_kitti(file: IO[bytes], trace: Trace) -> None:
    """Write a line of twelve numbers for each row, row by row of [R | t]."""
    poses = np.concatenate([rotation_matrices(trace.attitude), trace.east_north_up[:, :, None]], axis=2)
    np.savetxt(file, poses.reshape(len(trace), 12), fmt="%.9e")
