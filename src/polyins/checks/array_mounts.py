"""IMUs of an array that turn otherwise than the others: by any angle, or with swapped, mirrored or reversed axes.

The rotation between two IMUs on one body makes the turn rates and forces of one those of the other; least squares find
it (Wahba's problem, solved by singular values). The one that is off most is taken out, and the others are asked again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from polyins.checks.diagnosis import Diagnosis
from polyins.checks.evidence import Evidence, ImuEvidence
from polyins.checks.sensor_columns import renamed
from polyins.config.yaml_document import Setting
from polyins.model.axes import axes_matrix
from polyins.model.findings import Finding
from polyins.model.recording import Array
from polyins.prepare.mounts import ALIKE, AS_STATED, FLOOR, NAMES, TURNS, UNCHANGED

WINDOW_S = 0.25
"""long against how chips filter, short against turns"""
LEAST_WINDOWS = 40
LEAST_DEG = 4.0
SURE = 6.0
"""standard deviations, of a rotation that is not zero"""
EXPLAINED = 0.5
"""of the squares, that a rotation may leave"""
EXPLAINED_BY_AXES = 0.15
"""of the squares, that other axes may leave: there are 48 of them"""
LEAST_TURN = 3.0
"""times what a good IMU differs by, that an array turns at least"""


@dataclass(frozen=True)
class _Mount:
    """How an IMU is turned against the others."""

    rotation: Array
    """of its axes as stated into those of the others, (3, 3)"""
    angle_deg: float
    std_deg: float
    """about that axis"""
    gyro: int
    """index into `TURNS` of the axes that its gyro has"""
    accel: int

    @property
    def by_axes(self) -> bool:
        """Whether one of the sensors alone, or both mirrored, have other axes: no rotation is that."""
        return self.gyro != self.accel or np.linalg.det(TURNS[self.gyro]) < 0.0


def find(evidence: Evidence) -> Iterator[Diagnosis]:
    """Say which IMUs are turned against the others."""
    body = evidence.body
    if len(body) < 2 or len(body) < len(evidence.imus):
        return
    edges = _edges(body)
    if len(edges) <= LEAST_WINDOWS:
        return
    means = np.array([_means(one, edges) for one in body])
    left = list(range(len(body)))
    while len(left) > 1:
        off = {i: _against(means[i], np.median(means[[k for k in left if k != i]], axis=0)) for i in left}
        told = {i: mount for i, mount in off.items() if mount is not None}
        if not told:
            return
        # of two nobody knows which: the second is said of the first
        worst = left[-1] if len(left) == 2 else max(told, key=lambda i: told[i].angle_deg)
        if worst not in told:
            return
        yield _diagnosis(body[worst], told[worst], body[left[0]].name if len(left) == 2 else "the others")
        left.remove(worst)


def _edges(body: Sequence[ImuEvidence]) -> Array:
    begin, end = max(one.stream.time[0] for one in body), min(one.stream.time[-1] for one in body)
    return np.arange(begin, end, WINDOW_S)


def _means(one: ImuEvidence, edges: Array) -> Array:
    """Return mean rates and forces in windows, array axes, shape (W, 6)."""
    stream = one.stream
    total = np.cumsum(np.hstack([stream.dtheta, stream.dvel]), axis=0)
    at_edges = np.column_stack([np.interp(edges, stream.time, column) for column in total.T])
    return np.diff(at_edges, axis=0) / WINDOW_S


def _against(own: Array, others: Array) -> _Mount | None:
    """Return how an IMU is turned against others, by their means, (W, 6); None: it is not, or it is not sure."""
    own, others = _weighted(own), _weighted(others)
    if np.sqrt(np.mean(np.sum(others[:-1, :3] ** 2, axis=1))) < LEAST_TURN:
        return None
    accel = _axes(own[:, 3:], others[:, 3:])
    named = [_axes(own[:, :3], others[:, :3], alone=accel == AS_STATED), accel]
    vectors, wanted = np.vstack(np.hsplit(own, 2)), np.vstack(np.hsplit(others, 2))
    if named[0] != named[1] or np.linalg.det(TURNS[named[0]]) < 0.0:
        return _Mount(np.eye(3), 180.0, 0.0, named[0], named[1])
    u, _, vt = np.linalg.svd(wanted.T @ vectors)
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    left = float(np.sum((wanted - vectors @ rotation.T) ** 2))
    axis, angle = _turn(rotation)
    information = float(np.sum(wanted**2)) - axis @ (wanted.T @ wanted) @ axis
    variance = max(1.0, left / (3.0 * len(vectors))) / max(float(information), 1e-12)
    std = float(np.degrees(np.sqrt(variance)))
    if angle < max(LEAST_DEG, SURE * std) or left > EXPLAINED * float(np.sum((wanted - vectors) ** 2)):
        return None
    return _Mount(rotation, angle, std, AS_STATED, AS_STATED)


def _weighted(means: Array) -> Array:
    """Return rates and forces less their means, over what good IMUs differ by, and below them the mean force."""
    mean = means.mean(axis=0)
    centred = (means - mean) / np.repeat(FLOOR, 3)
    return np.vstack([centred, np.concatenate([np.zeros(3), mean[3:] / FLOOR[1]])])


def _axes(own: Array, others: Array, *, alone: bool = False) -> int:
    """Return which axes one sensor has, if other ones than stated explain all; without motion a sign is not seen.

    `alone`: the other sensor has those stated, so that columns are swapped or reversed: those mirror, no sensor turns.
    """
    left = np.einsum("kij,wj->kwi", TURNS, own) - others
    cost = np.maximum(np.sum(left**2, axis=(1, 2)), len(own))
    if cost.min() > EXPLAINED_BY_AXES * cost[AS_STATED]:
        return AS_STATED
    alike = cost <= ALIKE * cost.min()
    mirrored = alike & (np.linalg.det(TURNS) < 0.0)
    alike = mirrored if alone and mirrored.any() else alike
    return int(np.argmax(np.where(alike, UNCHANGED - cost / cost.max(), -np.inf)))


def _turn(rotation: Array) -> tuple[Array, float]:
    """Return axis and angle, deg, of a rotation."""
    angle = float(np.arccos(np.clip(0.5 * (np.trace(rotation) - 1.0), -1.0, 1.0)))
    values, vectors = np.linalg.eig(rotation)
    axis = np.real(vectors[:, int(np.argmin(np.abs(values - 1.0)))])
    return np.asarray(axis / np.linalg.norm(axis)), float(np.degrees(angle))


def _diagnosis(one: ImuEvidence, mount: _Mount, others: str) -> Diagnosis:
    if mount.by_axes:
        return _of_axes(one, mount, others)
    right = mount.rotation @ one.imu.rotation @ axes_matrix(one.entry.axes).T
    angles = [round(float(angle), 1) for angle in np.degrees(_euler(right))]
    return Diagnosis(
        Finding(
            "mount",
            f"IMU {one.name} is turned by {mount.angle_deg:.1f} deg (std {mount.std_deg:.1f}) against {others}, as its "
            "rates and forces tell",
            "serious",
            stream=one.name,
            size=mount.angle_deg,
            expected=0.0,
            remedy=f"say mount_deg: [{', '.join(f'{angle:g}' for angle in angles)}], or the axes that it has",
        ),
        (one.setting("mount_deg", value=angles),),
    )


def _of_axes(one: ImuEvidence, mount: _Mount, others: str) -> Diagnosis:
    settings: list[Setting] = []
    wrong = []
    for sensor, what, k in (("gyro", "gyro", mount.gyro), ("accel", "accelerometer", mount.accel)):
        if k == AS_STATED:
            continue
        wrong.append(f"the axes of its {what} are [{', '.join(NAMES[k])}]")
        in_sensor = np.round(one.imu.rotation.T @ TURNS[k] @ one.imu.rotation)
        settings += renamed(one, sensor, in_sensor)
    return Diagnosis(
        Finding(
            "mount",
            f"IMU {one.name} does not move with {others}: {' and '.join(wrong)}; expected [x, y, z]",
            "serious",
            stream=one.name,
            axis="gyro" if mount.accel == AS_STATED else "accelerometer" if mount.gyro == AS_STATED else None,
            size="[x, y, z]",
            expected=f"[{', '.join(NAMES[mount.accel if mount.gyro == AS_STATED else mount.gyro])}]",
            remedy="look at the signs and columns of its file",
        ),
        tuple(settings),
    )


def _euler(matrix: Array) -> Array:
    """Return roll, pitch, yaw, rad, of Rz(yaw) Ry(pitch) Rx(roll)."""
    roll = np.arctan2(matrix[2, 1], matrix[2, 2])
    pitch = np.arcsin(np.clip(-matrix[2, 0], -1.0, 1.0))
    return np.array([roll, pitch, np.arctan2(matrix[1, 0], matrix[0, 0])])
