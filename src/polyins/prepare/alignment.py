"""How a run starts: levelling, gyro biases, heading, velocity and position, from what is given and what is recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.errors import InputError
from polyins.kernels import earth
from polyins.model.attitude import euler_angles, in_succession, of_rotation_vectors, quaternions, rotation_matrices
from polyins.model.geodesy import displacement, metres_per_unit
from polyins.model.recording import AidingStream, GnssStream, Recording, StartOptions
from polyins.model.rig import DEG, Rig
from polyins.prepare.first_motion import Beginning, FirstMotion
from polyins.prepare.in_motion import Prior
from polyins.prepare.rolling_start import HALF, RollingMotion, rolling_motion
from polyins.prepare.timesync import Aligned
from polyins.prepare.under_way import AROUND, HARDEST, GroundMotion, find_motion

Array = NDArray[np.float64]

WINDOW = 1.0  # s
UNDER_WAY, ROLLING = "first fix in motion", "first data under way"
"""where the time of a start comes from"""
STILL_RATE = 0.4 * DEG  # rad/s, of the averaged gyro within a window
STILL_FORCE = 0.10  # m/s^2
SHORTEST_STANDSTILL = 3.0  # s
SLOW = 1.0  # m/s: what drifts that fast has to be told from rest
LARGEST_BIAS = 10.0 * DEG  # rad/s, of a gyro: more is a turn
FEWEST_OF_PIECE = 5  # fixes that show a drift beside their noise
LONGEST_STANDSTILL = 60.0  # s
FARTHEST_START = 10e3  # m from GNSS: farther away it is another place
LEAST_LEFT = 1.0  # s, of data after the start
STANDSTILL_SPEED = 0.05  # m/s: std at a standstill
ROLLING_SPEED, ROLLING_TILT = 0.1, 1.0 * DEG
"""m/s, rad: std of what wheels and forces tell of a vehicle that rolls"""
MISALIGNED = 0.02
"""rad: by that IMUs of an array may look elsewhere than their mounts say"""


@dataclass(frozen=True)
class Datum:
    """How sure the place and the heading are from which dead reckoning goes on, where nothing tells them again.

    All that follows is off by it as a whole, moved and turned about the start.
    """

    position_std: Array
    """m north, east, down, shape (3,)"""
    heading_std: float
    """rad"""


@dataclass(frozen=True)
class Start:
    """The navigation state of the array origin at the first epoch, how sure it is, and where it came from."""

    time: float
    """s"""
    position: Array
    """see polyins.model.recording"""
    velocity: Array
    """m/s north, east, down"""
    attitude: Array
    """roll, pitch, heading, rad"""
    position_std: Array
    """m"""
    velocity_std: Array
    """m/s"""
    attitude_std: Array
    """rad, of phi about north, east, down"""
    imu_errors: Array
    """shape (N, 12)"""
    imu_error_std: Array
    """shape (N, 12)"""
    sources: dict[str, str]
    """what was used for each of them, in words"""
    imu_attitudes: Array | None = None
    """roll, pitch, heading of each IMU of a rig with wheels, rad, shape (N, 3)"""
    fix_std: Array | None = None
    """of a fix as they scatter at a standstill, m, shape (3,); None: there is none"""
    decided: bool = True
    """whether further data would leave it as it is"""
    datum: Datum | None = None
    """beside the standard deviations, which are those of what follows; None: nothing"""

    @classmethod
    def known(
        cls,
        rig: Rig,
        time: float,
        position: ArrayLike,
        velocity: ArrayLike = (0.0, 0.0, 0.0),
        attitude: ArrayLike = (0.0, 0.0, 0.0),
        *,
        position_std: ArrayLike = 0.1,
        velocity_std: ArrayLike = 0.1,
        attitude_std: ArrayLike = (0.5 * DEG, 0.5 * DEG, 2.0 * DEG),
    ) -> Start:
        """Return a start of an array that is known otherwise; units as above, a std is one number or one per axis."""

        def vector(value: ArrayLike) -> Array:
            return np.broadcast_to(np.asarray(value, dtype=float), (3,)).copy()

        return cls(
            time,
            vector(position),
            vector(velocity),
            vector(attitude),
            vector(position_std),
            vector(velocity_std),
            vector(attitude_std),
            imu_errors=np.array([imu.initial_errors.as_array() for imu in rig.imus]),
            imu_error_std=np.array([imu.start_std() for imu in rig.imus]),
            sources={},
        )

    def subset(self, indices: list[int]) -> Start:
        """Return the start of just the IMUs of those indices."""
        attitudes = None if self.imu_attitudes is None else self.imu_attitudes[indices]
        return replace(
            self,
            imu_errors=self.imu_errors[indices],
            imu_error_std=self.imu_error_std[indices],
            imu_attitudes=attitudes,
        )

    def among(self, rig: Rig, indices: list[int]) -> Start:
        """Return the start, which is that of the IMUs of those indices, as one of all IMUs of a rig."""
        errors = np.array([imu.initial_errors.as_array() for imu in rig.imus])
        std = np.array([imu.start_std() for imu in rig.imus])
        attitudes = None if self.imu_attitudes is None else np.zeros((len(rig.imus), 3))
        errors[indices], std[indices] = self.imu_errors, self.imu_error_std
        if attitudes is not None and self.imu_attitudes is not None:
            attitudes[indices] = self.imu_attitudes
        return replace(self, imu_errors=errors, imu_error_std=std, imu_attitudes=attitudes)


def levelled(start: Start, rig: Rig, increments: Array, interval: float) -> Start:
    """Return a start that says how each IMU of a rig with wheels lies; one that says it already is returned as it is.

    The angle of a wheel is levelled from the increments that end at the start, (6, N) over `interval` s: what the
    accelerometer feels, less what the spin adds at its place, is gravity.
    """
    if start.imu_attitudes is not None or not rig.has_wheels:
        return start
    axle = rotation_matrix(start.attitude)[:, 1]
    attitudes = np.tile(start.attitude, (len(rig.imus), 1))
    for i, imu in enumerate(rig.imus):
        if imu.wheel is not None:
            errors = start.imu_errors[i]
            rate, force = np.split(increments[:, i] / interval - errors[:6], 2)
            roll, pitch = level(force + np.cross(rate, np.cross(rate, imu.wheel.lever_arm)))
            attitudes[i] = roll, pitch, np.arctan2(axle[1], axle[0])
    return replace(start, imu_attitudes=attitudes)


def find_start(recording: Recording, aligned: Aligned) -> Start:
    """Find the start of a recording whose IMUs are on one time base; raise InputError where nothing gives it."""
    search = _RollingSearch if recording.rig.has_wheels else _Search
    return search(recording, aligned).run()


class _Search:
    """One start being found; each step fills in what the steps after it need."""

    def __init__(self, recording: Recording, aligned: Aligned) -> None:
        self.recording = recording
        self.options: StartOptions = recording.start
        self.aligned = aligned
        self.sources: dict[str, str] = {}
        self.measured: dict[tuple[float, float], tuple[Array, float]] = {}
        self.errors = np.array([imu.initial_errors.as_array() for imu in recording.rig.imus])
        self.error_std = np.array([imu.start_std() for imu in recording.rig.imus])
        self.fixes = velocities_from_positions(recording.gnss, recording.geodetic) if recording.gnss else None
        self.motions: dict[float, GroundMotion | None] = {}
        """under way from a time on"""
        self.first: FirstMotion | None = None
        """what the fixes tell of the state, where they are asked"""

    def run(self) -> Start:
        still = self._standstill()
        known, fix_std = self.recording, None
        if known.gnss is not None and still:
            fix_std = scatter_at_rest(known.gnss, known.geodetic, *still)
            self.recording = replace(known, gnss=as_noisy_as_at_rest(known.gnss, known.geodetic, *still))
        time = self._time(still)
        velocity, velocity_std = self._velocity(time, still)
        roll_pitch, tilt_std = self._roll_pitch(time, still, velocity)
        heading, heading_std = self._heading(time, still, roll_pitch, velocity)
        attitude = np.array([roll_pitch[0], roll_pitch[1], heading])
        position, position_std = self._position(time, attitude)
        if self.sources["position"].startswith("GNSS"):
            # the array's origin is only as sure as where the antenna is seen from it
            lever = self.recording.rig.antenna
            around = np.array([heading_std, heading_std, 0.0]) * np.hypot(lever[0], lever[1])
            tilted = np.array([tilt_std, tilt_std, 0.0]) * abs(lever[2])
            over = np.array([0.0, 0.0, tilt_std]) * np.hypot(lever[0], lever[1])
            position_std = np.sqrt(position_std**2 + around**2 + tilted**2 + over**2)
        if still and self.options.estimate_gyro_bias:
            self._gyro_biases(still, attitude, position)
        elif self.first is not None and self.options.estimate_gyro_bias:
            self._gyro_biases_in_motion(self.first)
        else:
            largest = self.error_std[:, :3].max() / DEG
            self.sources["gyro_bias"] = f"configuration, std up to {largest:.3g} deg/s"
        given = self.options.attitude_std
        return Start(
            time=time,
            position=position,
            velocity=velocity,
            attitude=attitude,
            position_std=position_std if self.options.position_std is None else self.options.position_std,
            velocity_std=velocity_std if self.options.velocity_std is None else self.options.velocity_std,
            attitude_std=np.array([tilt_std, tilt_std, heading_std]) if given is None else given,
            imu_errors=self.errors,
            imu_error_std=self.error_std,
            sources=self.sources,
            fix_std=fix_std,
            decided=self.first is None or self.first.decided,
        )

    def _standstill(self) -> tuple[float, float] | None:
        if self.options.static_interval is not None:
            begin, end = self.options.static_interval
            if end - begin < WINDOW or len(self.aligned.between(begin, end).time) < 2:
                raise InputError(
                    f"start: static interval {begin} to {end} s holds no second of data; expected at least one"
                )
            self.sources["standstill"] = f"given: {begin:.3f} to {end:.3f} s"
            return begin, end
        nothing_left = self.options.roll_pitch is not None and not self.options.estimate_gyro_bias
        if nothing_left or self.options.heading_from == "reference":
            return None
        bias_std = float(self.error_std[:, 3:6].mean()) / np.sqrt(len(self.error_std))
        # a wheel that turns shows it at any speed
        fixes = None if any(imu.wheel for imu in self.recording.rig.imus) else self.fixes
        found = find_standstill(self.aligned, fixes, self.recording.geodetic, 4.0 * bias_std)
        if found and self._moves_before(found[0]):
            return None
        if found:
            self.sources["standstill"] = f"found: {found[0]:.3f} to {found[1]:.3f} s"
        return found

    def _moves_before(self, time: float) -> bool:
        """Whether fixes tell how the array is under way before it stands still."""
        first = float(self.aligned.time[0])
        if time - first < WINDOW or self.recording.gnss is None or self.options.time is not None:
            return False
        motion = self._found_motion(first, None)
        return motion is not None and motion.until <= time

    def _time(self, still: tuple[float, float] | None) -> float:
        first, last = self.aligned.time[0], self.aligned.time[-1]
        if self.options.time is not None:
            wanted, self.sources["time"] = self.options.time, "given"
        elif still:
            wanted, self.sources["time"] = min(still[1], last - LEAST_LEFT), "end of the standstill"
            if self.recording.gnss is not None and self.options.position is None:
                wanted = max(wanted, float(self.recording.gnss.time[0]))
        elif self.fixes is not None and self.options.heading_from != "reference" and not self._heading_is_told():
            self.first = self._first_motion(float(first), None)
            return self._epoch(self.first.time, UNDER_WAY)
        elif self.fixes is not None and self.options.position is None:
            # between two fixes the position would be off by what the array accelerates there
            later = self.fixes.time[self.fixes.time >= first]
            wanted, self.sources["time"] = float(later[0]) if later.size else first, "first fix"
        else:
            wanted, self.sources["time"] = first, "first epoch"
        return self._epoch(float(wanted), self.sources["time"])

    def _heading_is_told(self) -> bool:
        """Whether a heading is given or a sensor shows one, so that nothing has to move."""
        return self.options.heading is not None or (self.options.heading_from == "auto" and self._shown() is not None)

    def _shown(self) -> AidingStream | None:
        """Return the sensor of heading, if there is one."""
        return next((one for one in self.recording.aiding if one.kind == "heading" and len(one.time)), None)

    def _epoch(self, wanted: float, source: str) -> float:
        """Return the first epoch from a time on, which has to be within the data."""
        first, last = self.aligned.time[0], self.aligned.time[-1]
        self.sources["time"] = source
        if not first <= wanted <= last - LEAST_LEFT:
            raise InputError(
                f"start: time {wanted:.3f} s; expected within the IMU data, {first:.3f} to {last:.3f} s,"
                " with at least a second left"
            )
        return float(self.aligned.time[np.searchsorted(self.aligned.time, wanted)])

    def _first_motion(self, begin: float, still: tuple[float, float] | None) -> FirstMotion:
        """Return what the fixes tell of the state at a time, or later; raise InputError where they tell no heading."""
        found = self._found_motion(begin, still)
        if found is None:
            raise InputError(
                "start: no heading: GNSS does not tell one, since nothing moves far enough against the noise of its"
                " fixes, or it may go sideways; expected start.heading_deg"
            )
        return found

    def _found_motion(self, begin: float, still: tuple[float, float] | None) -> FirstMotion | None:
        assert self.recording.gnss is not None
        known = Prior()
        if still and still[0] <= begin <= still[1] + 0.5:
            known = Prior(velocity=np.zeros(3), velocity_std=STANDSTILL_SPEED)
        begin = max(begin, float(self.recording.gnss.time[0]))
        return self._beginning(still).find(begin, known, lambda time, until: self._course(time, until, still))

    def _beginning(self, still: tuple[float, float] | None) -> Beginning:
        """Return the search for it, with what a standstill shows of the gyros and of the noise of the fixes."""
        assert self.recording.gnss is not None
        if not still:
            return Beginning(self.recording, self.aligned, self.errors, self.error_std)
        errors, std = self.errors.copy(), self.error_std.copy()
        errors[:, :3] += self._mean(*still)[0]
        std[:, :3] *= 0.1
        return Beginning(self.recording, self.aligned, errors, std)

    def _course(self, time: float, until: float, still: tuple[float, float] | None) -> tuple[float, float] | None:
        """Return the heading at a time, and its std, by the course over ground up to another."""
        motion = self._motion(time, still)
        if motion is None or motion.until > until:
            return None
        turned, drift = self._turned(time, motion.time, still)
        return motion.heading - turned, float(np.hypot(motion.heading_std, drift))

    def _motion(self, after: float, still: tuple[float, float] | None) -> GroundMotion | None:
        """Return the first motion from a time on, with the gyros' biases of a standstill if there was one."""
        if after not in self.motions:
            assert self.recording.gnss is not None
            bodies = self._bodies()
            last = self.aligned.time[-1]
            shown = self.recording.gnss.time[(self.recording.gnss.time >= after) & (self.recording.gnss.time <= last)]
            std = float(self.error_std[bodies, :3].mean()) / np.sqrt(len(bodies)) if bodies else 0.0
            if len(shown) > 1:
                gnss = self.recording.gnss.at(self.recording.gnss.time <= last)
                turned = self._turning(after, shown, still)
                bias_std = 0.1 * std if still else std
                found = find_motion(gnss, self.recording.geodetic, turned, bias_std, after)
                self.motions[after] = found
            else:
                self.motions[after] = None
        return self.motions[after]

    def _bodies(self) -> list[int]:
        """Return the IMUs that turn with the vehicle: one on a wheel does not."""
        return [i for i, imu in enumerate(self.recording.rig.imus) if imu.wheel is None]

    def _turning(self, begin: float, times: Array, still: tuple[float, float] | None) -> Callable[[Array], Array]:
        """Return what tells how far the heading has turned since a time, from the gyros alone."""
        bodies = self._bodies()
        if not bodies:
            raise InputError("start: no heading: every IMU is on a wheel; expected start.heading_deg")
        bias = self._mean(*still)[0][bodies].mean(axis=0) if still else np.zeros(3)
        known = bias + self.errors[bodies, :3].mean(axis=0)
        part = self.aligned.between(begin, float(times[-1]) + 1.0)
        steps = part.increments[1:, :3][:, :, bodies].mean(axis=2) - known * np.diff(part.time)[:, None]
        force = part.increments[: max(2, round(WINDOW * self.aligned.rate_hz)), 3:].sum(axis=(0, 2))
        attitude = quaternions(np.array([[*level(force), 0.0]]))[0]
        headings, before = [0.0], 0
        marks = np.searchsorted(part.time[1:], times, "right")
        for mark in marks:
            if mark > before:
                rotations = np.concatenate([attitude[None, :], of_rotation_vectors(steps[before:mark])])
                attitude = in_succession(rotations)
                before = mark
            headings.append(float(euler_angles(attitude[None, :])[0, 2]))
        yaw = np.unwrap(headings)[1:]
        return lambda wanted: np.interp(wanted, times, yaw)

    def _velocity(self, time: float, still: tuple[float, float] | None) -> tuple[Array, Array]:
        reference = self.recording.reference
        if self.options.velocity is not None:
            self.sources["velocity"] = "given"
            return self.options.velocity, np.full(3, 0.1)
        if still and still[0] <= time <= still[1] + 0.5:
            self.sources["velocity"] = "standstill"
            return np.zeros(3), np.full(3, STANDSTILL_SPEED)
        if self.options.heading_from == "reference" and reference is not None:
            self.sources["velocity"] = "reference"
            if reference.velocity is None:
                velocity = _velocity_of_positions(time, reference.time, reference.position, self.recording.geodetic)
            else:
                velocity = _interpolate(time, reference.time, reference.velocity)
            return velocity, np.full(3, 0.3)
        if self._tells(time, still):
            assert self.first is not None
            self.sources["velocity"] = "GNSS, fixes in motion"
            return self.first.velocity, self.first.velocity_std
        if self.fixes is not None and self.fixes.velocity is not None:
            self.sources["velocity"] = "GNSS"
            return self._velocity_from_fixes(time)
        raise InputError("start: no velocity; expected GNSS, a standstill, or start.velocity_m_s")

    def _mean(self, begin: float, end: float) -> tuple[Array, Array, float]:
        """Return the mean rates and specific forces of each IMU, shape (N, 3), biases removed, and the time.

        What is missing counts only for an IMU that has nothing else there.
        """
        if (begin, end) not in self.measured:
            self.measured[begin, end] = _measured(self.aligned.between(begin, end))
        mean, duration = self.measured[begin, end]
        return mean[:, :3] - self.errors[:, :3], mean[:, 3:] - self.errors[:, 3:6], duration

    def _roll_pitch(
        self, time: float, still: tuple[float, float] | None, velocity: Array
    ) -> tuple[tuple[float, float], float]:
        reference = self.recording.reference
        if self.options.roll_pitch is not None:
            self.sources["roll_pitch"] = "given"
            return (float(self.options.roll_pitch[0]), float(self.options.roll_pitch[1])), 0.5 * DEG
        if self.options.heading_from == "reference" and reference is not None and reference.attitude is not None:
            self.sources["roll_pitch"] = "reference"
            attitude = _interpolate(time, reference.time, reference.attitude[:, :2])
            return (float(attitude[0]), float(attitude[1])), 3.0 * DEG
        if still and still[0] <= time <= still[1] + 0.5:
            self.sources["roll_pitch"] = "levelled at standstill"
            _, force, _ = self._mean(*still)
            bias_std = self.error_std[:, 3:6].mean() / 9.8
            return level(force.mean(axis=0)), float(max(0.1 * DEG, bias_std))
        self.sources["roll_pitch"] = "levelled in motion, acceleration from GNSS"
        if self._tells(time, still):
            assert self.first is not None
            roll, pitch, _ = self.first.attitude
            return (float(roll), float(pitch)), float(self.first.attitude_std[:2].max())
        _, force, _ = self._mean(time - 0.5, time + 0.5)
        heading = float(np.arctan2(velocity[1], velocity[0]))
        return level(force.mean(axis=0), self._acceleration(time), heading), 3.0 * DEG

    def _tells(self, time: float, still: tuple[float, float] | None) -> bool:
        """Whether fixes in motion tell the state at a time; they are asked where no standstill does."""
        if self.first is None and self.recording.gnss is not None and self.options.heading_from != "reference":
            known = self._known_heading(time, still)
            if known is None:
                self.first = self._first_motion(time, still)
            else:
                self.first = self._beginning(still).at(time, Prior(*known), lambda *_: None)
        return self.first is not None and abs(self.first.time - time) <= 2.0 / self.aligned.rate_hz

    def _acceleration(self, time: float) -> Array:
        if self.fixes is None or self.fixes.velocity is None:
            return np.zeros(3)
        ahead = _interpolate(time + 0.5, self.fixes.time, self.fixes.velocity)
        return np.asarray(ahead - _interpolate(time - 0.5, self.fixes.time, self.fixes.velocity))

    def _heading(
        self, time: float, still: tuple[float, float] | None, roll_pitch: tuple[float, float], velocity: Array
    ) -> tuple[float, float]:
        wanted, reference = self.options.heading_from, self.recording.reference
        known = self._known_heading(time, still)
        if known is not None:
            return known
        if wanted == "value":
            raise InputError("start: heading_from is value; expected start.heading_deg")
        if wanted == "reference" or (wanted == "auto" and self.fixes is None):
            if reference is None or reference.attitude is None:
                raise InputError("start: no heading; expected start.heading_deg, GNSS, or a reference with heading")
            self.sources["heading"] = "reference"
            unwrapped = np.unwrap(reference.attitude[:, 2:3], axis=0)
            return float(_interpolate(time, reference.time, unwrapped)[0]), 2.0 * DEG
        if self.fixes is None:
            raise InputError("start: heading_from is gnss-course, but there is no GNSS")
        if self.first is None:
            self.first = self._first_motion(time, still)
        first = self.first
        turned, drift = self._turned(time, first.time, still)
        self.sources["heading"] = f"{first.told_by} from {first.time:.3f} to {first.until:.3f} s"
        if first.time > time + WINDOW:
            self.sources["heading"] += f", less {turned / DEG:.1f} deg turned since the start"
        return float(first.attitude[2]) - turned, float(np.hypot(first.attitude_std[2], drift))

    def _known_heading(self, time: float, still: tuple[float, float] | None) -> tuple[float, float] | None:
        """Return the heading at a time, and its std, of one that is given or that a sensor shows, or None."""
        wanted, options = self.options.heading_from, self.options
        if options.heading is not None and wanted in ("auto", "value"):
            self.sources["heading"] = "given"
            std = 1.0 * DEG if options.attitude_std is None else float(options.attitude_std[2])
            return self._carried(options.heading, std, options.heading_time, time, still)
        shown = self._shown()
        if wanted != "auto" or shown is None:
            return None
        first = int(np.argmin(np.abs(shown.time - time)))
        offsets = [sensor.offset_std for sensor in self.recording.rig.sensors if sensor.kind == "heading"]
        std = float(np.hypot(shown.std[first, 0], max(offsets, default=0.0)))
        self.sources["heading"] = "sensor of heading"
        return self._carried(float(shown.value[first]), std, float(shown.time[first]), time, still)

    def _carried(
        self, heading: float, std: float, at: float | None, time: float, still: tuple[float, float] | None
    ) -> tuple[float, float]:
        """Return the heading at a time, and its std, of the one at another, by what the gyros turned in between."""
        if at is None or at == time:
            return heading, std
        if not self.aligned.time[0] <= at <= self.aligned.time[-1]:
            raise InputError(f"start: the heading is that at {at:.3f} s; expected a time within the data of the IMUs")
        turned, drift = self._turned(time, at, still)
        self.sources["heading"] += f" at {at:.3f} s, less {turned / DEG:.1f} deg turned since the start"
        return heading - turned, float(np.hypot(std, drift))

    def _turned(self, begin: float, end: float, still: tuple[float, float] | None) -> tuple[float, float]:
        """Return how far the heading has turned from one time to another, and its std, rad."""
        first, last = min(begin, end), max(begin, end)
        if last - first < 2.0 / self.aligned.rate_hz:
            return 0.0, 0.0
        turned = float(np.diff(self._turning(first, np.array([first, last]), still)(np.array([first, last])))[0])
        drift = float(self.error_std[:, :3].mean()) * (0.1 if still else 1.0) * (last - first)
        return (turned if end > begin else -turned), drift

    def _position(self, time: float, attitude: Array) -> tuple[Array, Array]:
        if self.options.position is not None:
            self.sources["position"] = "given"
            self._check_place(time, self.options.position)
            return self.options.position, np.full(3, 0.1)
        gnss, reference = self.recording.gnss, self.recording.reference
        if gnss is None and reference is not None:
            self.sources["position"] = "reference"
            point = _interpolate_position(time, reference.time, reference.position, self.recording.geodetic)
            shift = rotation_matrix(attitude) @ reference.lever_arm
            return point - shift / metres_per_unit(point, self.recording.geodetic), np.full(3, 0.1)
        if gnss is None:
            self.sources["position"] = "zero: there is no position in the recording"
            return np.zeros(3), np.full(3, 0.01)
        self.sources["position"] = "GNSS"
        antenna, std = self._position_from_fixes(time)
        shift = rotation_matrix(attitude) @ self.recording.rig.antenna
        return antenna - shift / metres_per_unit(antenna, self.recording.geodetic), std

    def _velocity_from_fixes(self, time: float) -> tuple[Array, Array]:
        """Return the interpolated velocity and its std; see `_position_from_fixes`."""
        assert self.fixes is not None
        assert self.fixes.velocity is not None
        velocity, std = _interpolate(time, self.fixes.time, self.fixes.velocity), np.full(3, 0.5)
        around = _around(time, self.fixes.time)
        usual = np.median(self.fixes.velocity[around], axis=0)
        allowed = 10.0 * std + 0.5 * HARDEST * np.ptp(self.fixes.time[around])
        if len(around) < AROUND or np.all(np.abs(velocity - usual) <= allowed):
            return velocity, std
        self.sources["velocity"] = f"GNSS, median of {AROUND} fixes"
        return usual, allowed / 3.0

    def _position_from_fixes(self, time: float) -> tuple[Array, Array]:
        """Return the interpolated position of the antenna and its std.

        If noise and acceleration do not explain how far it is from the median of the fixes around, each brought to
        `time` by their median velocity, a fix lies: then that median, and a std that allows for it.
        """
        gnss, geodetic = self.recording.gnss, self.recording.geodetic
        assert gnss is not None
        position = _interpolate_position(time, gnss.time, gnss.position, geodetic)
        std = gnss.position_std[int(np.argmin(np.abs(gnss.time - time)))]
        around = _around(time, gnss.time)
        if len(around) < AROUND:
            return position, std
        assert self.fixes is not None
        assert self.fixes.velocity is not None
        metres = metres_per_unit(position, geodetic)
        motion = np.median(self.fixes.velocity[around], axis=0) * (gnss.time[around] - time)[:, None]
        off = np.median(_from(position, gnss.position[around], geodetic) * metres - motion, axis=0)
        allowed = 10.0 * std + 0.125 * HARDEST * np.ptp(gnss.time[around]) ** 2
        if np.all(np.abs(off) <= allowed):
            return position, std
        self.sources["position"] = f"GNSS, median of {AROUND} fixes"
        return position + off / metres, allowed / 3.0

    def _check_place(self, time: float, position: Array) -> None:
        gnss = self.recording.gnss
        if gnss is None:
            return
        nearest = gnss.position[int(np.argmin(np.abs(gnss.time - time)))]
        off = _from(nearest, position[None, :], self.recording.geodetic)[0]
        distance = float(np.linalg.norm(off * metres_per_unit(nearest, self.recording.geodetic)))
        if distance > FARTHEST_START:
            raise InputError(
                f"start: position is {distance / 1e3:.1f} km from GNSS at {time:.3f} s;"
                f" expected it within {FARTHEST_START / 1e3:.0f} km"
            )

    def _gyro_biases(self, still: tuple[float, float], attitude: Array, position: Array) -> None:
        """Take what the gyros show at a standstill, less the earth's rate, as their biases."""
        rate, _, duration = self._mean(*still)
        rate = rate - rotation_matrix(attitude).T @ earth_rate(position, self.recording.geodetic)
        there = ~self.aligned.between(*still).missing[1:].all(axis=0)
        self.errors[there, :3] += rate[there]
        for i in np.flatnonzero(there):
            imu = self.recording.rig.imus[i]
            # white noise over the standstill, and a tenth of the grade for what the bias does afterwards
            self.error_std[i, :3] = np.hypot(
                imu.noise.angle_random_walk / np.sqrt(duration), 0.1 * imu.noise.gyro_bias_std
            )
        self.sources["gyro_bias"] = f"mean of {duration:.1f} s at standstill"

    def _gyro_biases_in_motion(self, first: FirstMotion) -> None:
        """Take what the fixes tell of the mean bias, and what each gyro shows beyond the mean of all."""
        bodies = self._bodies()
        rates, _, duration = self._mean(first.time, first.until)
        mean = rates[bodies].mean(axis=0)
        for i in bodies:
            imu = self.recording.rig.imus[i]
            white = imu.noise.angle_random_walk / np.sqrt(duration)
            others = (len(bodies) > 1) * np.hypot(white, MISALIGNED * np.abs(mean).max())
            std = np.sqrt(first.gyro_bias_std**2 + others**2 + (0.1 * imu.noise.gyro_bias_std) ** 2)
            self.errors[i, :3] += first.gyro_bias + rates[i] - mean
            self.error_std[i, :3] = np.minimum(std, self.error_std[i, :3])
        largest = self.error_std[bodies, :3].max() / DEG
        self.sources["gyro_bias"] = f"fixes in motion, std up to {largest:.3g} deg/s"


class _RollingSearch(_Search):
    """The start of a vehicle with wheels, at a standstill: each IMU is levelled by itself.

    The array's attitude is that of the vehicle; an IMU on a wheel looks along the axle, to the right.
    """

    imu_attitudes: Array

    def _moves_before(self, time: float) -> bool:
        # it starts at a standstill in any case
        return False

    def _standstill(self) -> tuple[float, float] | None:
        found = super()._standstill()
        if found is None or not self.options.goes_on or found[0] - self.aligned.time[0] <= WINDOW:
            return found
        del self.sources["standstill"]
        return None

    def _time(self, still: tuple[float, float] | None) -> float:
        if still or self.options.time is not None or not self.options.goes_on:
            return super()._time(still)
        wanted, gnss = float(self.aligned.time[0]) + HALF, self.recording.gnss
        if gnss is not None and self.options.position is None:
            # between two fixes the position would be off by what the vehicle turns there
            later = gnss.time[gnss.time >= wanted]
            if not later.size:
                raise InputError("start: no fix from GNSS; expected one after the pause")
            wanted = float(later[0])
        return self._epoch(wanted, ROLLING)

    def _rolling(self, time: float) -> RollingMotion:
        return rolling_motion(self.recording.rig, self.aligned, self.errors, time)

    def _velocity(self, time: float, still: tuple[float, float] | None) -> tuple[Array, Array]:
        standing = still is not None and still[0] <= time <= still[1] + 0.5
        if self.options.velocity is None and not standing:
            known = self._known_heading(time, still) if self.options.goes_on else None
            if known is not None:
                self.sources["velocity"] = "wheels"
                speed, (heading, heading_std) = self._rolling(time).speed, known
                std = np.full(3, np.hypot(ROLLING_SPEED, speed * heading_std))
                return speed * np.array([np.cos(heading), np.sin(heading), 0.0]), std
            raise InputError(
                "start: no standstill of three seconds; a vehicle with wheels starts at one:"
                " expected start.static_interval_s, or start.velocity_m_s and start.roll_pitch_deg"
            )
        return super()._velocity(time, still)

    def run(self) -> Start:
        start = super().run()
        return replace(start, imu_attitudes=self.imu_attitudes)

    def _roll_pitch(
        self, time: float, still: tuple[float, float] | None, velocity: Array
    ) -> tuple[tuple[float, float], float]:
        imus = self.recording.rig.imus
        self.imu_attitudes = np.zeros((len(imus), 3))
        given = self.options.roll_pitch
        if still:
            self.sources["roll_pitch"] = "levelled at standstill"
            for i, force in enumerate(self._mean(*still)[1]):
                self.imu_attitudes[i, :2] = level(force)
        if given is not None:
            # at a standstill of the vehicle, whose wheels may have any angle; else of each IMU itself
            self.sources["roll_pitch"] = "given"
            self.imu_attitudes[[not still or imu.wheel is None for imu in imus], :2] = given
        elif not still and self.options.goes_on:
            self.sources["roll_pitch"] = "levelled in motion, acceleration from wheels"
            motion = self._rolling(time)
            for i, imu in enumerate(imus):
                # with the vehicle to the north, a module on a wheel looks to the right
                heading = 0.0 if imu.wheel is None else np.pi / 2.0
                self.imu_attitudes[i, :2] = level(motion.forces[i], motion.acceleration, heading)
        elif not still:
            raise InputError(
                "start: no standstill of three seconds; a vehicle with wheels starts at one:"
                " expected start.static_interval_s or start.roll_pitch_deg"
            )
        bodies = [i for i, imu in enumerate(imus) if imu.wheel is None]
        roll, pitch = self.imu_attitudes[bodies[0], :2] if bodies else (0.0, 0.0)
        return (float(roll), float(pitch)), 0.5 * DEG if still or given is not None else ROLLING_TILT

    def _heading(
        self, time: float, still: tuple[float, float] | None, roll_pitch: tuple[float, float], velocity: Array
    ) -> tuple[float, float]:
        heading, std = super()._heading(time, still, roll_pitch, velocity)
        on_wheel = np.array([imu.wheel is not None for imu in self.recording.rig.imus])
        # the heading of an axle that is tilted by roll and pitch differs from the vehicle's plus 90 degrees
        axle = rotation_matrix(np.array([*roll_pitch, heading]))[:, 1]
        self.imu_attitudes[:, 2] = np.where(on_wheel, np.arctan2(axle[1], axle[0]), heading)
        return heading, std

    def _gyro_biases(self, still: tuple[float, float], attitude: Array, position: Array) -> None:
        rates, _, duration = self._mean(*still)
        for i, imu in enumerate(self.recording.rig.imus):
            turning = rotation_matrix(self.imu_attitudes[i]).T @ earth_rate(position, self.recording.geodetic)
            self.errors[i, :3] += rates[i] - turning
            self.error_std[i, :3] = np.hypot(
                imu.noise.angle_random_walk / np.sqrt(duration), 0.1 * imu.noise.gyro_bias_std
            )
        self.sources["gyro_bias"] = f"mean of {duration:.1f} s at standstill"


def _measured(part: Aligned) -> tuple[Array, float]:
    """Return the mean rates and specific forces of each IMU, shape (N, 6), and the time in which they were measured."""
    have = ~part.missing[1:]
    have[:, ~have.any(axis=0)] = True
    mean = np.einsum("tki,ti->ik", part.increments[1:], have) / (np.diff(part.time) @ have)[:, None]
    return mean, float(part.time[-1] - part.time[0])


def usual_velocity(fixes: GnssStream) -> Array:
    """Return the velocities with each component's median over five fixes, m/s, shape (M, 3)."""
    assert fixes.velocity is not None
    padded = np.pad(fixes.velocity, ((2, 2), (0, 0)), mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, 5, axis=0), axis=-1))


def find_standstill(
    aligned: Aligned, fixes: GnssStream | None, geodetic: bool = True, bias: float = np.inf
) -> tuple[float, float] | None:
    """Return the first interval of at least three seconds, at most sixty, in which the array stands still.

    Judged second by second: rates and forces averaged over tenths of a second hardly vary, and the usual speed that
    GNSS gives, where it gives one, is that of its noise. Over the whole interval the mean force is gravity but for
    `bias`, m/s^2, the rate no more than a gyro's bias, and the fixes keep to their place but for their noise: steady
    acceleration, turn or motion is none.
    """
    edges, still = still_seconds(aligned)
    if len(still) < SHORTEST_STANDSTILL / WINDOW:
        return None
    if fixes is not None and fixes.velocity is not None:
        speed = np.linalg.norm(usual_velocity(fixes), axis=1)
        noise = 4.0 * fixes.position_std.max(axis=1)
        moving = fixes.time[speed > np.maximum(0.3, noise)]
        for t in moving:
            still[(edges[:-1] - 1.0 < t) & (t < edges[1:] + 1.0)] = False
    runs = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    for begin, end in zip(runs[::2], runs[1::2], strict=True):
        until = float(min(edges[end], edges[begin] + LONGEST_STANDSTILL))
        if until - edges[begin] < SHORTEST_STANDSTILL:
            continue
        interval = float(edges[begin]), until
        by_imus = feels_gravity(aligned, *interval, bias) and hardly_turns(aligned, *interval)
        if by_imus and keeps_place(fixes, geodetic, *interval):
            return interval
    return None


def still_seconds(aligned: Aligned) -> tuple[Array, NDArray[np.bool_]]:
    """Return the edges of windows of a second, s, (K + 1,), and in which of them nothing moves, (K,).

    There rates and forces, averaged over tenths and over the IMUs, hardly vary.
    """
    edges, spread = second_spreads(aligned)
    return edges, (spread[:, :3].max(axis=1) < STILL_RATE) & (spread[:, 3:].max(axis=1) < STILL_FORCE)


def second_spreads(aligned: Aligned) -> tuple[Array, Array]:
    """Return the edges of windows of a second, (K + 1,), and the std of tenths in them, rad/s and m/s^2, (K, 6)."""
    window = max(2, round(WINDOW * aligned.rate_hz))
    tenth = max(1, round(0.1 * aligned.rate_hz))
    tenths = window // tenth
    count = len(aligned.time) // (tenth * tenths)
    used = count * tenths * tenth
    rates = aligned.increments[:used].mean(axis=2) * aligned.rate_hz
    spread = rates.reshape(count, tenths, tenth, 6).mean(axis=2).std(axis=1)
    return aligned.time[np.minimum(np.arange(count + 1) * tenths * tenth, len(aligned.time) - 1)], spread


def feels_gravity(aligned: Aligned, begin: float, end: float, bias: float) -> bool:
    """Whether the mean specific force of an interval is as large as gravity, but for `bias` and 0.15 m/s^2."""
    part = aligned.between(begin, end)
    # of each by itself: on a wheel it points elsewhere
    forces = np.linalg.norm(part.increments[1:, 3:].sum(axis=0), axis=0) / (part.time[-1] - part.time[0])
    return bool(abs(float(np.median(forces)) - 9.81) <= 0.15 + bias)


def hardly_turns(aligned: Aligned, begin: float, end: float) -> bool:
    """Whether the mean rate of an interval is one that biases explain, not that of a steady turn."""
    part = aligned.between(begin, end)
    rates = np.linalg.norm(part.increments[1:, :3].sum(axis=0), axis=0) / (part.time[-1] - part.time[0])
    return bool(np.median(rates) <= LARGEST_BIAS)


def keeps_place(fixes: GnssStream | None, geodetic: bool, begin: float, end: float) -> bool:
    """Whether fixes of an interval do not drift beyond their noise, which tells a slow drive from rest.

    Neither over all of it, nor in most of its pieces: on a circle what moves comes back.
    """
    if fixes is None:
        return True
    inside = np.flatnonzero((fixes.time >= begin) & (fixes.time <= end))
    if len(inside) < 3:
        return True
    if fixes.velocity is not None and fixes.velocity_std is not None:
        velocity, noise = fixes.velocity[inside, :2], 4.0 * float(np.median(fixes.velocity_std[inside, :2]))
        mean = np.linalg.norm(velocity.mean(axis=0))
        if mean > noise / np.sqrt(len(inside)) + 0.1 or np.median(np.linalg.norm(velocity, axis=1)) > noise + 0.1:
            return False
    time = fixes.time[inside] - fixes.time[inside].mean()
    place = displacement(fixes.position[inside], fixes.position[inside[0]], geodetic)[:, :2]
    stated = float(np.median(fixes.position_std[inside, :2]))
    drift, std, _ = _drift(time, place, stated)
    if not drift <= 4.0 * std + 0.1 <= SLOW:
        return False
    moves = []
    for piece in np.array_split(np.arange(len(time)), _pieces(time)):
        drift, std, shown = _drift(time[piece], place[piece], stated)
        moves.append(drift > 4.0 * max(std, shown) + 0.1)
    return 2 * sum(moves) <= len(moves)


def _pieces(time: Array) -> int:
    """Return into how many pieces fixes are divided, each as long as the shortest standstill and of a few at least."""
    return max(1, min(int((time[-1] - time[0]) / SHORTEST_STANDSTILL), len(time) // FEWEST_OF_PIECE))


def _drift(time: Array, place: Array, stated: float) -> tuple[float, float, float]:
    """Return the speed of a line through places, m/s, and its std by the noise that is stated, m, and that is shown."""
    since = time - time.mean()
    slope, _ = np.polyfit(since, place, 1)
    beside = place - place.mean(axis=0) - np.outer(since, slope)
    shown = float(np.sqrt(np.sum(beside**2) / max(2 * (len(time) - 2), 1)))
    per_metre = 1.0 / float(np.sqrt(np.sum(since**2)))
    return float(np.hypot(*slope)), stated * per_metre, shown * per_metre


def scatter_at_rest(gnss: GnssStream, geodetic: bool, begin: float, end: float) -> Array | None:
    """Return the std that fixes show at a standstill, m (3,), where that is more than stated; None: too few are in it.

    Of a normal variable, by the median of what is off the median: one that lies changes little.
    """
    inside = np.flatnonzero((gnss.time >= begin) & (gnss.time <= end))
    if len(inside) < AROUND:
        return None
    place = displacement(gnss.position[inside], gnss.position[inside[0]], geodetic)
    shown = 1.4826 * np.median(np.abs(place - np.median(place, axis=0)), axis=0)
    return np.asarray(np.maximum(shown, np.median(gnss.position_std[inside], axis=0)))


def as_noisy_as_at_rest(gnss: GnssStream, geodetic: bool, begin: float, end: float) -> GnssStream:
    """Return fixes with at least the std that they show at a standstill, where that is more than twice the stated."""
    shown = scatter_at_rest(gnss, geodetic, begin, end)
    if shown is None:
        return gnss
    std = gnss.position_std
    return replace(gnss, position_std=np.where(shown > 2.0 * std, np.maximum(std, shown), std))


def level(force: Array, acceleration: Array | None = None, heading: float = 0.0) -> tuple[float, float]:
    """Return roll and pitch (rad) from a mean specific force, and where in motion the acceleration in n.

    C f = a - g, with the heading given: roll and pitch turn f into the level frame's a - g.
    """
    a = np.zeros(3) if acceleration is None else acceleration
    ahead = a[0] * np.cos(heading) + a[1] * np.sin(heading)
    aside = -a[0] * np.sin(heading) + a[1] * np.cos(heading)
    vertical = np.hypot(force[1], force[2])
    roll = np.arcsin(np.clip(aside / vertical, -1, 1)) - np.arctan2(force[1], -force[2])
    z = force[1] * np.sin(roll) + force[2] * np.cos(roll)
    pitch = np.arctan2(force[0], -z) - np.arcsin(np.clip(ahead / np.hypot(force[0], z), -1, 1))
    return float((roll + np.pi) % (2 * np.pi) - np.pi), float(pitch)


def rotation_matrix(attitude: Array) -> Array:
    """Return C_nb of roll, pitch, heading (rad), shape (3, 3)."""
    return np.asarray(rotation_matrices(quaternions(attitude[None, :]))[0])


def quaternion(attitude: Array) -> Array:
    """Return q_nb, scalar first and not negative, of roll, pitch, heading (rad), shape (4,)."""
    q = quaternions(attitude[None, :])[0]
    return np.asarray(np.copysign(1.0, q[0]) * q)


def earth_rate(position: Array, geodetic: bool) -> Array:
    """Return the earth's angular rate, rad/s north, east, down, shape (3,); zero on a local plane."""
    if not geodetic:
        return np.zeros(3)
    return earth.EARTH_RATE_RAD_S * np.array([np.cos(position[0]), 0.0, -np.sin(position[0])])


def velocities_from_positions(gnss: GnssStream, geodetic: bool) -> GnssStream | None:
    """Return the stream with velocities, differenced from positions where the receiver gives none.

    A single fix has none: None.
    """
    if gnss.velocity is not None:
        return gnss
    if len(gnss.time) < 2:
        return None
    return replace(gnss, velocity=_differences(gnss.time, gnss.position, geodetic))


def _differences(time: Array, position: Array, geodetic: bool) -> Array:
    metres = _from(position[0], position, geodetic) * metres_per_unit(position[0], geodetic)
    return np.asarray(np.gradient(metres, time, axis=0))


def _velocity_of_positions(at: float, time: Array, position: Array, geodetic: bool) -> Array:
    """Return the velocity of a parabola through the positions within half a second, three of them at least.

    The difference of neighbours would multiply their noise, or the steps in which they are written, by the rate.
    """
    within = np.searchsorted(time, [at - 0.5, at + 0.5])
    first = int(np.clip(np.searchsorted(time, at) - 1, 0, max(0, len(time) - 3)))
    near = slice(min(within[0], first), max(within[1], first + 3))
    metres = _from(position[near][0], position[near], geodetic) * metres_per_unit(position[near][0], geodetic)
    degree = min(2, len(metres) - 1)
    return np.asarray(np.polyfit(time[near] - at, metres, degree)[-2] if degree else np.zeros(3))


def _around(time: float, times: Array) -> NDArray[np.intp]:
    """Return the indices of the fixes nearest to a time."""
    return np.argsort(np.abs(times - time), kind="stable")[:AROUND]


def _from(origin: Array, position: Array, geodetic: bool) -> Array:
    """Return coordinates relative to `origin`, longitudes the shorter way round."""
    relative = position - origin
    if geodetic:
        relative[:, 1] = (relative[:, 1] + np.pi) % (2.0 * np.pi) - np.pi
    return np.asarray(relative)


def _interpolate_position(at: float, time: Array, position: Array, geodetic: bool) -> Array:
    nearest = position[int(np.argmin(np.abs(time - at)))]
    return np.asarray(nearest + _interpolate(at, time, _from(nearest, position, geodetic)))


def _interpolate(at: float, time: Array, values: Array) -> Array:
    return np.array([np.interp(at, time, values[:, k]) for k in range(values.shape[1])])
