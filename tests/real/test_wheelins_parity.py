"""A wheel IMU through Wheel-INS: a replica of what that program does, and polyins from the same configuration."""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation

from polyins.model.solution import Solution
from polyins.navigate import batch
from polyins.reading.loading import load

Array = NDArray[np.float64]

DEG = np.pi / 180.0
GRAVITY = np.array([0.0, 0.0, 9.782940329221166])
UNITS = np.repeat([1.0, 1.0, 1.0 / DEG, 3600.0 / DEG, 1e5, 1e6, 1e6], 3)
"""the columns of the program's files: m, m/s, deg, deg/h, mGal, ppm, ppm"""
R, V, PHI, BG, BA, SG, SA = (slice(3 * i, 3 * i + 3) for i in range(7))
EYE = np.eye(21)
ODO_WINDOW_S = 0.1
LAST_DIGIT = 1e-8
"""ten times the last digit of the program's files"""


@dataclass(frozen=True)
class Settings:
    """The configuration in SI."""

    start_std: Array
    """of the 21 states"""
    random_walk: Array
    """m/s/sqrt(s) and rad/sqrt(s), shape (2,)"""
    correlation_time: float
    speed_std: Array
    interval: float
    radius: float
    window: int
    """samples"""


@dataclass(frozen=True)
class Replica:
    """One row per epoch after the first record."""

    time: Array
    position: Array
    velocity: Array
    euler_deg: Array
    std: Array
    errors: Array
    updates: int


def read_settings(path: Path) -> Settings:
    config = YAML(typ="safe").load(path)
    noise = config["imunoise"]
    slow = np.array([noise[key] for key in ("gbstd", "abstd", "gsstd", "asstd")])
    navigation = np.concatenate([config[key] for key in ("initposstd", "initvelstd", "initattstd")])
    return Settings(
        start_std=np.concatenate([navigation, np.repeat(slow, 3)]) / UNITS,
        random_walk=np.array([noise["vrw"], noise["arw"] * DEG]) / 60.0,
        correlation_time=noise["corrtime"] * 3600.0,
        speed_std=np.array(config["ODO_std"]),
        interval=config["ODO_dt"],
        radius=config["Wheel_Radius"],
        window=round(ODO_WINDOW_S * config["imudatarate"]),
    )


def read_records(path: Path) -> Array:
    """Seconds, rates, specific forces; shape (T, 7)."""
    return np.frombuffer(gzip.decompress(path.read_bytes()), dtype="<f8").reshape(-1, 7)


def turn(q: tuple[float, ...], rotation: list[float]) -> tuple[float, ...]:
    """q times the quaternion of a rotation vector, in plain floats: it is the one step that cannot be vectorized."""
    x, y, z = rotation
    angle = (x * x + y * y + z * z) ** 0.5
    sine = np.sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    a, b, c, d = float(np.cos(0.5 * angle)), sine * x, sine * y, sine * z
    w, i, j, k = q
    product = (
        w * a - i * b - j * c - k * d, w * b + i * a + j * d - k * c,
        w * c - i * d + j * a + k * b, w * d + i * c - j * b + k * a,
    )  # fmt: skip
    length = sum(part * part for part in product) ** 0.5
    return tuple(float(part / length) for part in product)


def matrices(quaternions: Array) -> Array:
    return np.asarray(Rotation.from_quat(quaternions, scalar_first=True).as_matrix())


def skews(vectors: Array) -> Array:
    """The matrices (a x), shape (T, 3, 3)."""
    x, y, z = vectors.T
    o = np.zeros_like(x)
    return np.stack([np.stack(row, -1) for row in ((o, -z, y), (z, o, -x), (-y, x, o))], -2)


def transitions(C: Array, rate: Array, force: Array, dt: Array, correlation_time: float) -> Array:
    """Phi = I + F dt of every epoch of a segment, shape (T, 21, 21)."""
    F = np.zeros((len(dt), 21, 21))
    F[:, R, V] = np.eye(3)
    F[:, V, PHI] = skews(np.einsum("kij,kj->ki", C, force))
    F[:, V, BA], F[:, V, SA] = C, C * force[:, None]
    F[:, PHI, BG], F[:, PHI, SG] = -C, -C * rate[:, None]
    F[:, range(9, 21), range(9, 21)] = -1.0 / correlation_time
    return EYE + F * dt[:, None, None]


def half_noise(settings: Settings, dt: float) -> Array:
    """G Qc G' dt / 2. The random walks are equal on all axes, so that C drops out."""
    slow = 2.0 * settings.start_std[9:] ** 2 / settings.correlation_time
    density = np.concatenate([np.zeros(3), np.repeat(settings.random_walk**2, 3), slow])
    return 0.5 * dt * np.diag(density)


class WheelInsReplica:
    """Works through the record from one velocity update to the next: between them the IMU errors are constant."""

    def __init__(self, records: Array, settings: Settings) -> None:
        self.records, self.settings = records, settings
        self.dt = np.diff(records[:, 0])
        self.position, self.velocity, self.q = np.zeros(3), np.zeros(3), (1.0, 0.0, 0.0, 0.0)
        self.errors = np.zeros(12)
        self.P = np.diag(settings.start_std**2)
        first = self.dt[0] * records[0, 1:]
        self.previous = first[:3], first[3:]
        self.out: list[list[Array]] = []

    def run(self) -> Replica:
        now, last, updates = 1, self.records[0, 0], 0
        for k in range(1, len(self.records)):
            if self.records[k, 0] - last >= self.settings.interval and k + 1 >= self.settings.window:
                self.propagate(now, k + 1)
                self.update(k)
                now, last, updates = k + 1, self.records[k, 0], updates + 1
        self.propagate(now, len(self.records))
        position, velocity, euler, std, errors = (np.concatenate(column) for column in zip(*self.out, strict=True))
        return Replica(self.records[1:, 0], position, velocity, euler, std, errors, updates)

    def propagate(self, begin: int, end: int) -> None:
        """Advance over the records begin to end - 1, without updates."""
        dt = self.dt[begin - 1 : end - 1]
        bg, ba, sg, sa = self.errors.reshape(4, 3)
        rate = (self.records[begin:end, 1:4] - bg) / (1.0 + sg)
        force = (self.records[begin:end, 4:7] - ba) / (1.0 + sa)
        dtheta, dvel = rate * dt[:, None], force * dt[:, None]
        dtheta_before = np.vstack([self.previous[0], dtheta[:-1]])
        dvel_before = np.vstack([self.previous[1], dvel[:-1]])
        coning = np.cross(dtheta_before, dtheta) / 12.0
        sculling = (np.cross(dtheta_before, dvel) + np.cross(dvel_before, dtheta)) / 12.0

        quaternions = [self.q]
        for rotation in (dtheta + coning).tolist():
            quaternions.append(turn(quaternions[-1], rotation))
        C = matrices(np.array(quaternions))
        gained = np.einsum("kij,kj->ki", C[:-1], dvel + 0.5 * np.cross(dtheta, dvel) + sculling)
        velocity = np.vstack([self.velocity, gained + GRAVITY * dt[:, None]]).cumsum(axis=0)
        position = np.vstack([self.position, 0.5 * (velocity[1:] + velocity[:-1]) * dt[:, None]]).cumsum(axis=0)

        variances = self.propagate_covariance(transitions(C[:-1], rate, force, dt, self.settings.correlation_time), dt)
        self.position, self.velocity, self.q = position[-1], velocity[-1], quaternions[-1]
        self.previous = dtheta[-1], dvel[-1]
        euler = np.column_stack([
            np.arctan2(C[1:, 2, 1], C[1:, 2, 2]),
            np.arctan2(-C[1:, 2, 0], np.hypot(C[1:, 2, 1], C[1:, 2, 2])),
            np.arctan2(C[1:, 1, 0], C[1:, 0, 0]),
        ])  # fmt: skip
        errors = np.repeat(self.errors[None], len(dt), axis=0)
        self.out.append([position[1:], velocity[1:], euler / DEG, np.sqrt(variances), errors])

    def propagate_covariance(self, Phi: Array, dt: Array) -> Array:
        """Phi P Phi' + (Phi Q Phi' + Q) / 2, epoch by epoch; return the variances (T, 21)."""
        variances = np.empty((len(dt), 21))
        half, length = half_noise(self.settings, dt[0]), dt[0]
        for k, step in enumerate(Phi):
            if dt[k] != length:
                half, length = half_noise(self.settings, dt[k]), dt[k]
            self.P = step @ (self.P + half) @ step.T + half
            variances[k] = self.P.diagonal()
        return variances

    def update(self, k: int) -> None:
        """3-D velocity in the vehicle's axes; the wheel's centre is the IMU (no lever arm in this configuration)."""
        speed = -self.settings.radius * self.records[k + 1 - self.settings.window : k + 1, 1].mean()
        axle = matrices(np.array([self.q]))[0, :, 0]
        heading = np.arctan2(axle[1], axle[0]) - 0.5 * np.pi
        c, s = np.cos(heading), np.sin(heading)
        level = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        H = np.zeros((3, 21))
        H[:, V] = level
        H[:, 8] = -level @ np.array([self.velocity[1], -self.velocity[0], 0.0])
        Rm = np.diag(self.settings.speed_std**2)
        gain = self.P @ H.T @ np.linalg.inv(H @ self.P @ H.T + Rm)
        rest = EYE - gain @ H
        self.P = rest @ self.P @ rest.T + gain @ Rm @ gain.T
        self.feed_back(gain @ (level @ self.velocity - np.array([speed, 0.0, 0.0])))

    def feed_back(self, dx: Array) -> None:
        """Take the errors out of the state, and of the last row written."""
        self.position, self.velocity = self.position - dx[R], self.velocity - dx[V]
        rotation = Rotation.from_rotvec(dx[PHI]) * Rotation.from_quat(self.q, scalar_first=True)
        self.q = tuple(rotation.as_quat(scalar_first=True).tolist())
        self.errors = self.errors + dx[9:]
        row = [self.position, self.velocity, rotation.as_euler("ZYX", degrees=True)[::-1],
               np.sqrt(self.P.diagonal()), self.errors]  # fmt: skip
        for column, value in zip(self.out[-1], row, strict=True):
            column[-1] = value


@pytest.fixture(scope="module")
def folder(data_folder: Path) -> Path:
    folder = data_folder / "wheelins-parity"
    if not folder.is_dir():
        pytest.skip(f"no data set: {folder}")
    return folder


@pytest.fixture(scope="module")
def replica(folder: Path) -> Replica:
    records = read_records(folder / "wheel_imu.bin.gz")
    return WheelInsReplica(records, read_settings(folder / "wheel-ins.yaml")).run()


def rows_at(time: Array, stamps: Array) -> NDArray[np.intp]:
    k = np.searchsorted(time, stamps - 1e-4)
    np.testing.assert_allclose(time[k], stamps, atol=1e-4)
    return k


def wrapped(degrees: Array) -> Array:
    return np.asarray((degrees + 180.0) % 360.0 - 180.0)


# --- part A: the replica is the program -------------------------------------------------------------------------------


def test_the_replica_updates_as_often(replica: Replica) -> None:
    assert replica.updates == 599


def test_the_replica_goes_where_the_program_goes(replica: Replica, folder: Path) -> None:
    expected = np.loadtxt(folder / "expected_traj.txt.gz")
    k = rows_at(replica.time, expected[:, 0])
    assert len(k) == 6000
    assert np.abs(replica.position[k] - expected[:, 1:4]).max() < LAST_DIGIT
    assert np.abs(replica.velocity[k] - expected[:, 4:7]).max() < LAST_DIGIT
    assert np.abs(wrapped(replica.euler_deg[k] - expected[:, 7:10])).max() < LAST_DIGIT


def test_the_replica_is_as_sure(replica: Replica, folder: Path) -> None:
    expected = np.loadtxt(folder / "expected_std.txt.gz")
    k = rows_at(replica.time, expected[:, 0])
    assert len(k) == 300
    np.testing.assert_allclose(replica.std[k] * UNITS, expected[:, 1:], rtol=1e-9, atol=LAST_DIGIT)


def test_the_replica_finds_the_same_imu_errors(replica: Replica, folder: Path) -> None:
    expected = np.loadtxt(folder / "expected_imu_err.txt.gz")
    k = rows_at(replica.time, expected[:, 0])
    assert len(k) == 300
    np.testing.assert_allclose(replica.errors[k] * UNITS[9:], expected[:, 1:], rtol=1e-8, atol=LAST_DIGIT)


# --- part B: polyins takes the program's configuration and gives its answer -------------------------------------------


@pytest.fixture(scope="module")
def solution(folder: Path) -> Solution:
    return batch.run(load(folder / "wheel-ins.yaml"), "wheel-ins")


def heading_deg(solution: Solution) -> Array:
    return np.asarray(Rotation.from_quat(solution.attitude, scalar_first=True).as_euler("ZYX", degrees=True)[:, 0])


def test_polyins_starts_where_the_configuration_says(solution: Solution) -> None:
    assert not solution.geodetic
    assert solution.time[0] == pytest.approx(1000.005, abs=0.006)
    assert np.abs(solution.position[0]).max() < 1e-3
    assert wrapped(heading_deg(solution)[:1] + 90.0) == pytest.approx(0.0, abs=1e-2)


def test_polyins_goes_where_the_program_goes(solution: Solution, folder: Path) -> None:
    """The reference point is the wheel's centre, and the vehicle's heading the IMU's yaw less 90 degrees.

    What is left, 0.07 mm, is the axle's tilt, which that program leaves out of the heading error.
    """
    expected = np.loadtxt(folder / "expected_traj.txt.gz")
    k = rows_at(solution.time, expected[:, 0])
    assert len(k) == 6000
    assert np.abs(solution.position[k] - expected[:, 1:4] * [1.0, 1.0, -1.0]).max() < 2e-3
    assert np.abs(wrapped(heading_deg(solution)[k] - expected[:, 9] + 90.0)).max() < 1e-4


def test_polyins_finds_the_same_imu_errors(solution: Solution, folder: Path) -> None:
    """In units of what is left of them unknown.

    The accelerometers in the wheel are another matter: that program leaves out the second order of the rotation within
    an interval, 0.1 % of the force here, and takes it for their errors.
    """
    expected, std = (np.loadtxt(folder / f"expected_{name}.txt.gz") for name in ("imu_err", "std"))
    errors = np.array([np.interp(expected[:, 0], solution.imu_error_time, e) for e in solution.imu_errors[:, 0].T]).T
    late = expected[:, 0] > 1020.0
    off = np.abs((errors * UNITS[9:] - expected[:, 1:]) / std[:, 10:])[late].max(axis=0)
    in_wheel = [4, 5, 10, 11]
    assert np.delete(off, in_wheel).max() < 1e-2
    assert off[in_wheel].max() < 1.0


def test_polyins_is_near_the_truth(solution: Solution, folder: Path) -> None:
    """Against the truth, not against the other program: both could be wrong."""
    truth = np.loadtxt(folder / "truth.csv.gz", delimiter=",", skiprows=1)
    at = np.array([np.interp(truth[:, 0], solution.time, column) for column in solution.position[:, :2].T]).T
    travelled = np.concatenate([[0.0], np.hypot(*np.diff(truth[:, 1:3], axis=0).T).cumsum()])
    off = np.hypot(*(at - truth[:, 1:3]).T)
    assert travelled[-1] > 1000.0
    assert off.max() < 1e-3 * travelled[-1]
    heading = np.interp(truth[:, 0], solution.time, np.unwrap(heading_deg(solution), period=360.0))
    assert np.abs(wrapped(heading - truth[:, 3])).max() < 0.3
