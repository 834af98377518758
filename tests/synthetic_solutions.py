"""A drive round a circle, known in closed form, and solutions of it with errors put in on purpose."""

from dataclasses import dataclass, replace

import numpy as np

from polyins.model.attitude import quaternions, rotation_matrices
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import GnssStream, ImuStream, Recording, Reference
from polyins.model.rig import Imu, NoiseGrade, Rig
from polyins.model.solution import Innovations, Solution

START = np.array([np.radians(30.5), np.radians(114.35), 20.0])
RADIUS_M = 80.0
RATE_RAD_S = 0.1
GRADE = NoiseGrade.from_datasheet(
    angle_random_walk_deg_sqrt_h=0.24,
    velocity_random_walk_m_s_sqrt_h=0.24,
    gyro_bias_deg_h=50.0,
    accel_bias_mgal=250.0,
    gyro_scale_ppm=1000.0,
    accel_scale_ppm=1000.0,
    correlation_time_h=1.0,
)


@dataclass(frozen=True)
class Drive:
    """Level turn to the right at constant speed and bank, from heading 0."""

    time: np.ndarray
    local: np.ndarray
    """north, east, height"""
    velocity: np.ndarray
    euler: np.ndarray

    @property
    def attitude(self) -> np.ndarray:
        return quaternions(self.euler)

    @property
    def geodetic(self) -> np.ndarray:
        """The local positions laid on the ellipsoid with the radii of the start."""
        return START + (self.local * [1.0, 1.0, -1.0]) / metres_per_unit(START[None], geodetic=True)

    def lever_arm_motion(self, lever_arm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where and how fast a point of the body moves against the origin, m and m/s in n."""
        offset = rotation_matrices(self.attitude) @ lever_arm
        return offset, np.cross([0.0, 0.0, RATE_RAD_S], offset)


def drive(duration: float = 60.0, rate: float = 20.0, begin: float = 1000.0, roll: float = 0.1) -> Drive:
    since = np.arange(round(duration * rate) + 1) / rate
    heading = RATE_RAD_S * since
    local = np.column_stack([RADIUS_M * np.sin(heading), RADIUS_M * (1.0 - np.cos(heading)), np.zeros_like(since)])
    speed = RADIUS_M * RATE_RAD_S
    velocity = np.column_stack([speed * np.cos(heading), speed * np.sin(heading), np.zeros_like(since)])
    euler = np.column_stack([np.full_like(since, roll), np.full_like(since, 0.05), heading])
    return Drive(begin + since, local, velocity, euler)


def solution(truth: Drive, geodetic: bool = True, imus: int = 1, method: str = "single", **changes: object) -> Solution:
    """The drive itself as a solution, 1 m, 0.1 m/s and 0.01 rad sure, with any field changed."""
    epochs = truth.time.size
    made = Solution(
        method=method,
        geodetic=geodetic,
        time=truth.time,
        position=truth.geodetic if geodetic else truth.local,
        velocity=truth.velocity,
        attitude=truth.attitude,
        position_variance=np.ones((epochs, 3)),
        velocity_variance=np.full((epochs, 3), 0.01),
        phi_covariance=np.tile([1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4], (epochs, 1)),
        point=np.zeros(3),
        imus=imus,
        imu_names=tuple(f"imu{k + 1}" for k in range(imus)),
        imu_error_time=truth.time[::20],
        imu_errors=np.zeros((truth.time[::20].size, imus, 12)),
        imu_error_std=np.zeros((truth.time[::20].size, imus, 12)),
    )
    return replace(made, **changes)


def reference(truth: Drive, geodetic: bool = True, **changes: object) -> Reference:
    made = Reference(truth.time, truth.geodetic if geodetic else truth.local, truth.velocity, truth.euler)
    return replace(made, **changes)


def moved(positions: np.ndarray, metres: np.ndarray) -> np.ndarray:
    """Geodetic positions moved by metres north, east, down."""
    return positions + metres / metres_per_unit(positions, geodetic=True)


def innovations(time: np.ndarray, seed: int, rejected: tuple[int, ...] = ()) -> Innovations:
    """Residuals that fit their stated standard deviation, but for the rejected ones."""
    std = np.full((time.size, 3), 0.05)
    residual = np.random.default_rng(seed).normal(scale=std)
    residual[list(rejected)] += 3.0
    accepted = np.ones(time.size, bool)
    accepted[list(rejected)] = False
    nis = np.sum((residual / std) ** 2, axis=1)
    never = np.zeros(time.size, bool)
    return Innovations(time, residual, std, nis, accepted, never, never, np.full(time.size, 3))


def of_fixes(shown: Innovations) -> dict[str, Innovations]:
    return {"GNSS position": shown}


def drifting(truth: Drive, method: str, imus: int, scale: float, outages: tuple, seed: int) -> Solution:
    """A solution whose position drifts quadratically in each outage, as inertial ones do, and is a little noisy."""
    generator = np.random.default_rng(seed)
    metres = 0.01 * generator.normal(size=(truth.time.size, 3)).cumsum(axis=0) / np.sqrt(truth.time.size)
    variance = np.full((truth.time.size, 3), 0.02**2)
    for begin, end in outages:
        since = np.where((truth.time >= begin) & (truth.time <= end), truth.time - begin, 0.0)
        metres += scale * generator.normal(size=3) * since[:, None] ** 2
        variance += (scale * since[:, None] ** 2) ** 2
    fixes = np.arange(np.ceil(truth.time[0]), truth.time[-1])
    shown = fixes[[not any(begin <= fix <= end for begin, end in outages) for fix in fixes]]
    spread = [2e-4, 2e-4, 2e-4, 2e-3, 2e-3, 2e-3, *[1e-3] * 6]
    start = generator.normal(size=(1, imus, 12)) * spread
    slow = start + generator.normal(size=(truth.time[::20].size, imus, 12)).cumsum(axis=0) * spread * 0.02
    return replace(
        solution(truth, imus=imus, method=method),
        position=moved(truth.geodetic, metres),
        attitude=quaternions(truth.euler + 0.002 * np.sin(0.03 * truth.time[:, None] + seed)),
        position_variance=variance,
        imu_errors=slow,
        imu_error_std=np.ones_like(slow) * spread,
        measurements=of_fixes(innovations(shown, seed, rejected=(5, 40))),
        filter_s=0.05 * imus,
        start={"time": truth.time[0], "heading": "from the course over ground", "position": truth.geodetic[0]},
    )


def recording(truth: Drive, imus: int, outages: tuple, **changes: object) -> Recording:
    """What such solutions might have come from; the increments are of no account."""
    rig = Rig(tuple(Imu(f"imu{k + 1}", GRADE) for k in range(imus)))
    still = np.zeros((truth.time.size, 3))
    fixes = truth.time[::20]
    made = Recording(
        rig=rig,
        imus=tuple(ImuStream(imu.name, truth.time, still, still) for imu in rig.imus),
        gnss=GnssStream(fixes, truth.geodetic[::20], np.full((fixes.size, 3), 0.05)),
        reference=reference(truth),
        outages=outages,
        name="round the circle",
        config_text="name: round the circle\nmethod: all\n",
    )
    return replace(made, **changes)
