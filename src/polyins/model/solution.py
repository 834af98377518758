"""What comes out of a run: merged states with their standard deviations, IMU errors, innovations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polyins.model.comparisons import NO_COMPARISONS, Comparisons, Exclusion, exclusions
from polyins.model.findings import SILENT, Finding
from polyins.model.recording import Heights
from polyins.model.rig import Vector

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Innovations:
    """One row per measurement of a kind that the filter was shown (fixes inside outages are not)."""

    time: Array
    """s, shape (M,)"""
    residual: Array
    """predicted minus measured, in `unit` along `axes`, shape (M, A)"""
    std: Array
    """predicted standard deviation of the residual, shape (M, A)"""
    nis: Array
    """normalized innovation squared, shape (M,)"""
    accepted: NDArray[np.bool_]
    """False where the gate did not take the measurement as it is: it weighed less, or nothing; shape (M,)"""
    reset: NDArray[np.bool_]
    """True where the position was set to it because it kept to an offset for long, shape (M,)"""
    velocity_rejected: NDArray[np.bool_]
    """True where a position was accepted and the velocity of the same fix was not, shape (M,)"""
    rows: NDArray[np.intp]
    """degrees of freedom of the NIS, shape (M,)"""
    change: Array | None = None
    """of a position: how the receiver moved since the fix before, otherwise than the IMUs did, m, shape (M, 3)"""
    noise_ratio: Array | None = None
    """of a position: the variance that was found from fix to fix and used, over the stated one, or 1; shape (M,)"""
    gained: Array | None = None
    """of a position: what the velocity gained since the fix before by the IMUs alone, m/s, shape (M, 3)"""
    slip: Array | None = None
    """of a wheel speed: which of `wheels` were not believed, see `navigate.slip`; by how much the speed of the worst of
    them was off, and the speed that was expected, m/s; shape (M, 3)"""
    wheels: tuple[str, ...] = ()
    """IMUs on the wheels that give the speed"""
    axes: tuple[str, ...] = ("north", "east", "down")
    unit: str = "m"

    def used(self) -> Innovations:
        """Return those that the filter could compare: while every IMU is silent it predicts nothing."""
        rows = self.std.max(axis=1) > 0.0
        if rows.all():
            return self
        kept: dict[str, Any] = {name: getattr(self, name)[rows] for name in self._by_row()}
        return replace(self, **kept)

    @classmethod
    def joined(cls, parts: Sequence[Innovations]) -> Innovations:
        """Return those of parts of a recording that follow one another."""
        names = parts[0]._by_row()
        whole: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
        return replace(parts[0], **whole)

    def _by_row(self) -> list[str]:
        """Return what has a row per measurement."""
        of_some = [name for name in ("change", "noise_ratio", "gained", "slip") if getattr(self, name) is not None]
        return ["time", "residual", "std", "nis", "accepted", "reset", "velocity_rejected", "rows", *of_some]


_NEVER = np.zeros(0, dtype=bool)
NO_INNOVATIONS = Innovations(
    time=np.zeros(0),
    residual=np.zeros((0, 3)),
    std=np.zeros((0, 3)),
    nis=np.zeros(0),
    accepted=_NEVER,
    reset=_NEVER,
    velocity_rejected=_NEVER,
    rows=np.zeros(0, dtype=np.intp),
)
"""of a run without fixes"""


@dataclass(frozen=True)
class OffsetEstimate:
    """What was estimated of the offset or scale of a sensor, one row per log entry."""

    value: Array
    """shape (K,), the unit of its state, see `model.states`"""
    std: Array
    """shape (K,)"""


class Trajectory(NamedTuple):
    """The states of T epochs and how sure they are."""

    time: Array
    """s, shape (T,)"""
    position: Array
    """(latitude rad, longitude rad, height m), or (north m, east m, height m) on a local plane, shape (T, 3)"""
    velocity: Array
    """m/s north, east, down, shape (T, 3)"""
    attitude: Array
    """q_nb, scalar first, shape (T, 4)"""
    position_variance: Array
    """m^2 north, east, down, shape (T, 3)"""
    velocity_variance: Array
    """m^2/s^2, shape (T, 3)"""
    phi_covariance: Array
    """rad^2: NN, NE, ND, EE, ED, DD of the attitude error phi, shape (T, 6)"""


BY_EPOCH = Trajectory._fields
BY_LOG = ("imu_error_time", "imu_errors", "imu_error_std")


@dataclass(frozen=True)
class Solution:
    """The trajectory of one method over one recording, one row per IMU epoch."""

    method: str
    geodetic: bool
    time: Array
    """s, shape (T,)"""
    position: Array
    """(latitude rad, longitude rad, height m), or (north m, east m, height m) on a local plane, shape (T, 3)"""
    velocity: Array
    """m/s north, east, down, shape (T, 3)"""
    attitude: Array
    """q_nb, scalar first, shape (T, 4)"""
    position_variance: Array
    """m^2 north, east, down, shape (T, 3)"""
    velocity_variance: Array
    """m^2/s^2, shape (T, 3)"""
    phi_covariance: Array
    """rad^2: NN, NE, ND, EE, ED, DD of the attitude error phi, shape (T, 6)"""
    point: Vector
    """the point that the solution describes, m, in the array frame"""
    imus: int
    """how many IMUs it is made from"""
    imu_names: tuple[str, ...]
    """of the navigators; a virtual IMU is one"""
    imu_error_time: Array
    """s, shape (K,)"""
    imu_errors: Array
    """gyro bias rad/s, accelerometer bias m/s^2, gyro scale, accelerometer scale; shape (K, N, 12)"""
    imu_error_std: Array
    """shape (K, N, 12)"""
    measurements: dict[str, Innovations] = field(default_factory=dict)
    """what became of the measurements, by the name of their kind, see `aiding.kinds`"""
    comparisons: Comparisons = NO_COMPARISONS
    """how the IMUs of a block kept together"""
    offsets: dict[str, OffsetEstimate] = field(default_factory=dict)
    """of height, heading and odometer, where the filter estimates them; times are `imu_error_time`"""
    mounting: Array | None = None
    """with wheels: estimated relative error of the wheel speed, and of a wheel's lever arm y and z (m) or of a body's
    mount pitch and yaw (rad), shape (K, N, 3)"""
    mounting_std: Array | None = None
    """shape (K, N, 3); zero where it is not estimated"""
    start: dict[str, object] = field(default_factory=dict)
    """how the start was found: time, position, velocity, roll and pitch, heading, gyro bias"""
    filter_s: float = 0.0
    """CPU time inside the compiled loop"""
    first_call_s: float = 0.0
    """time spent on compiling or loading the kernels"""
    status: NDArray[np.uint8] | None = None
    """what each state is worth, an index into `model.status.STATUSES`, shape (T,); None: it is not known"""
    recording_span: tuple[float, float] | None = None
    """s, s: what the IMUs of the recording cover"""
    findings: tuple[Finding, ...] = ()
    """what there is to say of data and run"""
    heights: Heights = "ellipsoidal"
    """what the heights of geodetic positions count from"""
    utc_of_zero: float | None = None
    """Unix time at which `time` is zero, s; None: it is not known"""

    @property
    def warnings(self) -> tuple[str, ...]:
        """The findings as sentences, but for IMUs that fell silent."""
        return tuple(one.sentence for one in self.findings if one.kind != SILENT)

    @property
    def faults(self) -> tuple[str, ...]:
        """IMUs that fell silent, as sentences."""
        return tuple(one.sentence for one in self.findings if one.kind == SILENT)

    @property
    def exclusions(self) -> tuple[Exclusion, ...]:
        """Which IMUs did not count when, since they deviated from the others."""
        return exclusions(self.comparisons, self.imu_names)

    @property
    def trajectory(self) -> Trajectory:
        """What has a row per epoch."""
        return Trajectory(*(getattr(self, name) for name in BY_EPOCH))

    def at(self, epochs: NDArray[np.intp], logs: NDArray[np.intp]) -> Solution:
        """Return the solution at some of its epochs, with some rows of the log; measurements stay."""

        def of(values: Array | None) -> Array | None:
            return None if values is None else values[logs]

        offsets = {name: OffsetEstimate(one.value[logs], one.std[logs]) for name, one in self.offsets.items()}
        return replace(
            self,
            **{name: getattr(self, name)[epochs] for name in BY_EPOCH},
            **{name: getattr(self, name)[logs] for name in BY_LOG},
            offsets=offsets,
            status=None if self.status is None else self.status[epochs],
            mounting=of(self.mounting),
            mounting_std=of(self.mounting_std),
        )

    @classmethod
    def joined(cls, parts: Sequence[Solution]) -> Solution:
        """Return the solution whose parts follow one another; what is said of it as a whole, the last part says."""
        if len(parts) == 1:
            return parts[0]
        last = parts[-1]

        def whole(name: str) -> Any:
            values = [getattr(part, name) for part in parts]
            return None if values[0] is None else np.concatenate(values)

        kinds = dict.fromkeys(kind for part in parts for kind in part.measurements)
        measured = {kind: [part.measurements[kind] for part in parts if kind in part.measurements] for kind in kinds}
        offsets = {name: [part.offsets[name] for part in parts] for name in last.offsets}
        return replace(
            last,
            **{name: whole(name) for name in (*BY_EPOCH, *BY_LOG, "mounting", "mounting_std", "status")},
            measurements={kind: Innovations.joined(some) for kind, some in measured.items()},
            comparisons=Comparisons.joined([part.comparisons for part in parts]),
            offsets={
                name: OffsetEstimate(*(np.concatenate([getattr(one, of) for one in some]) for of in ("value", "std")))
                for name, some in offsets.items()
            },
            filter_s=sum(part.filter_s for part in parts),
            first_call_s=parts[0].first_call_s,
        )

    @property
    def is_finite(self) -> NDArray[np.bool_]:
        """At which epochs all of the state and of its variances is a number, shape (T,)."""
        return np.asarray(np.all([np.isfinite(getattr(self, name)).all(axis=1) for name in BY_EPOCH[1:]], axis=0))

    @property
    def innovations(self) -> Innovations:
        """What became of the GNSS positions."""
        return self.measurements.get("GNSS position", NO_INNOVATIONS)
