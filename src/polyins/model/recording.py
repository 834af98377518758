"""Time-stamped streams and what belongs to them: the input of every method.

A position is (latitude rad, longitude rad, ellipsoidal height m) where the recording is geodetic, and
(north m, east m, height m) on a local tangent plane where it is not.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from polyins.model.clock import Clock
from polyins.model.findings import Finding
from polyins.model.rig import DEG, Rig, Vector, zero_vector

Array = NDArray[np.float64]
Rows = slice | NDArray[np.bool_] | NDArray[np.intp]
"""which rows of a stream"""
Heights = Literal["ellipsoidal", "sea-level", "unknown"]


USUAL_OF = 10_000
"""Intervals that tell the usual one, however long the recording is."""


def usual_interval(time: Array) -> float:
    """Return the median of the first intervals between stamps, shape (T,), s."""
    return float(np.median(np.diff(time[: USUAL_OF + 1])))


@dataclass(frozen=True)
class ImuStream:
    """Increments of one IMU in array axes, each over the interval that ends at its time stamp."""

    name: str
    time: Array
    """s, shape (T,), strictly increasing"""
    dtheta: Array
    """rad, shape (T, 3)"""
    dvel: Array
    """m/s, shape (T, 3)"""

    @property
    def rate_hz(self) -> float:
        """Nominal rate: one over the median interval."""
        return float(1.0 / np.median(np.diff(self.time)))

    def at(self, rows: Rows) -> ImuStream:
        """Return some of the rows."""
        return ImuStream(self.name, self.time[rows], self.dtheta[rows], self.dvel[rows])


@dataclass(frozen=True)
class GnssStream:
    """Positions, and where the receiver gives them velocities, of the antenna."""

    time: Array
    """s, shape (M,)"""
    position: Array
    """shape (M, 3), see the module's docstring"""
    position_std: Array
    """m north, east, down, shape (M, 3)"""
    velocity: Array | None = None
    """m/s north, east, down, shape (M, 3)"""
    velocity_std: Array | None = None
    """m/s, shape (M, 3)"""

    def at(self, rows: Rows) -> GnssStream:
        """Return some of the fixes."""

        def of(values: Array | None) -> Array | None:
            return None if values is None else values[rows]

        stds = self.position_std[rows], of(self.velocity), of(self.velocity_std)
        return GnssStream(self.time[rows], self.position[rows], *stds)


@dataclass(frozen=True)
class AidingStream:
    """What a sensor beside IMUs and GNSS says of the vehicle; where it sits stands in the rig."""

    kind: str
    """height, heading or odometer"""
    time: Array
    """s, shape (M,)"""
    value: Array
    """height as in the module's docstring, m; heading, rad; forward speed, m/s; shape (M,)"""
    std: Array
    """of the value, shape (M, 1); of an odometer that of forward, right and down, m/s, shape (M, 3); zero: not measured
    """


@dataclass(frozen=True)
class Reference:
    """What the solution is judged by; what the reference system does not give is None."""

    time: Array
    """s, shape (R,)"""
    position: Array
    """shape (R, 3), see the module's docstring"""
    velocity: Array | None = None
    """m/s north, east, down, shape (R, 3)"""
    attitude: Array | None = None
    """roll, pitch, heading, rad, shape (R, 3)"""
    lever_arm: Vector = field(default_factory=zero_vector)
    """The reference's point in the array frame, m."""
    heights: Heights = "ellipsoidal"
    """what those of geodetic positions count from"""

    def between(self, first: int, last: int) -> Reference:
        """Return rows first ... last - 1."""

        def of(values: Array | None) -> Array | None:
            return None if values is None else values[first:last]

        return replace(
            self,
            time=self.time[first:last],
            position=self.position[first:last],
            velocity=of(self.velocity),
            attitude=of(self.attitude),
        )


@dataclass(frozen=True)
class StartOptions:
    """How the navigation state is found at the start; what is None is found from the data."""

    time: float | None = None
    """s; None: the first instant at which all that is needed is there"""
    end_time: float | None = None
    """s; None: the end of the data"""
    position: Vector | None = None
    """of the array origin, see the module's docstring"""
    velocity: Vector | None = None
    """m/s north, east, down"""
    roll_pitch: Array | None = None
    """rad, shape (2,)"""
    heading: float | None = None
    """rad"""
    heading_time: float | None = None
    """s: when it was that; None: at the start"""
    heading_from: str = "auto"
    """value, gnss-course, reference, or auto: the first of these that the data allow"""
    static_interval: tuple[float, float] | None = None
    """s, s: the array stands still; None: looked for"""
    position_std: Vector | None = None
    """m north, east, down"""
    velocity_std: Vector | None = None
    """m/s"""
    attitude_std: Vector | None = None
    """rad: roll, pitch, heading"""
    estimate_gyro_bias: bool = True
    """use a static interval for the gyro biases of IMUs"""
    goes_on: bool = False
    """what is known of the IMUs was found before a pause: a vehicle with wheels need not stand still"""


@dataclass(frozen=True)
class RollingOptions:
    """How wheels aid the filter; the values are paper B's (Table IX)."""

    speed_interval: float = 0.5
    """s, from one update by wheel speed and nonholonomic constraint to the next"""
    speed_window: float = 0.1
    """s: the speed is the mean over this time before the update"""
    predict: str = "window"
    """what the measured mean speed is compared with: the mean velocity over the same window, or with "end" the velocity
    at its end, which is half a window late"""
    wheel_speed_std: Vector = field(default_factory=lambda: np.array([0.03, 0.02, 0.02]))
    """m/s forward, right, down, for IMUs on wheels"""
    body_speed_std: Vector = field(default_factory=lambda: np.array([0.05, 0.04, 0.04]))
    """m/s forward, right, down, for IMUs on the body"""
    constraint_interval: float = 1.0
    """s, from one update by the reference point to the next"""
    constraint_std: float = 0.2
    """m, of each component of the reference point"""
    standstill: bool = True
    """look for standstills and update by zero velocity and zero rate there"""


@dataclass(frozen=True)
class NonholonomicOptions:
    """That the vehicle moves neither sideways nor up, at the place of the odometer, as a measurement of its own."""

    interval: float = 0.5
    """s, from one to the next; the shorter, the more it weighs"""
    std: Array = field(default_factory=lambda: np.array([0.1, 0.1]))
    """m/s right, down; the larger, the more slip is allowed for"""


@dataclass(frozen=True)
class StandstillOptions:
    """Updates by zero velocity and zero rate where an array without wheels is found at rest."""

    interval: float = 1.0
    """s: whether it rests is judged over this time, again and again; the longer, the rarer a false standstill"""
    velocity_std: float = 0.01
    """m/s; the larger, the less a standstill weighs"""
    rate_std: float = 0.05 * DEG
    """rad/s, of the mean rate; above what an idling engine shakes"""


@dataclass(frozen=True)
class FilterOptions:
    """What the filter is told beyond the rig."""

    gate_limit: float | None = 100.0
    """A measurement weighs less whose normalized innovation squared, with the prediction's std taken
    `update.CAUTION`-fold, exceeds this; None: no gate. Errors beyond the model, such as misaligned chips', make good
    fixes exceed ten of the filter's own sigma after an outage or in a bend, but not ten of four times these."""
    gnss_snap: float = 1e-4
    """s: a fix nearer than this to an IMU epoch is applied at that epoch; otherwise the interval is split."""
    gravity: float = 9.80665
    """m/s^2, on a local tangent plane only."""
    common_share: float = 0.0
    """of the variances of noise and slow errors, what IMUs that share a covariance block have in common, 0 to 1; of 1
    the block is told what one IMU is told, which is paper A, and nothing tells the IMUs apart."""
    relative_interval: float | None = 1.0
    """s between two comparisons of such IMUs with their mean; None: they are not compared."""
    own_noise: float | Literal["auto"] = "auto"
    """times the variances that IMUs are said to have of their own; auto: as they show when they are compared, at least
    once"""
    exclusion: bool = True
    """whether an IMU that deviates from the others counts no more"""
    rolling: RollingOptions = RollingOptions()
    nonholonomic: NonholonomicOptions | None = None
    """None: it is not assumed"""
    standstill: StandstillOptions | None = None
    """of a rig without wheels, whose `rolling.standstill` says it otherwise; None: standstills are not looked for"""


@dataclass(frozen=True)
class Offset:
    """What was found to add to the stamps of one stream to put them on the clock of the others."""

    name: str
    """of the IMU, GNSS, or the kind of another stream"""
    offset_s: float
    """at the stamp `reference_s`"""
    std_s: float
    correlation: float | None
    """of the motions that were compared, at that offset; None: a trajectory was fitted instead"""
    drift: float = 0.0
    """relative; above zero where the clock is slow"""
    drift_std: float = 0.0
    reference_s: float = 0.0
    """stamp at which the drift adds nothing"""
    leaps: tuple[tuple[float, float, float], ...] = ()
    """of the clock: stamp from which on, what is added to later stamps, s, and its std, s"""

    @property
    def clock(self) -> Clock:
        """What brings the stamps to the clock of the others."""
        leaps = tuple((at, size) for at, size, _ in self.leaps)
        return Clock(self.offset_s, self.drift, self.reference_s, leaps)


@dataclass(frozen=True)
class Recording:
    """Everything that a method needs: the rig, the streams on one clock, how to start, what to leave out."""

    rig: Rig
    imus: tuple[ImuStream, ...]
    """in the order of `rig.imus`"""
    gnss: GnssStream | None = None
    reference: Reference | None = None
    geodetic: bool = True
    outages: tuple[tuple[float, float], ...] = ()
    """s, s: intervals in which GNSS is withheld from the filter"""
    start: StartOptions = StartOptions()
    options: FilterOptions = FilterOptions()
    name: str = "recording"
    config_text: str = ""
    """the configuration in force, as YAML"""
    warnings: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
    """what of the IMUs' data is left out"""
    clock_offsets: tuple[Offset, ...] = ()
    """what was found where the configuration says `time_offset: estimate`"""
    aiding: tuple[AidingStream, ...] = ()
    """what sensors beside IMUs and GNSS say"""
    heights: Heights = "ellipsoidal"
    """what the heights of geodetic positions count from"""
    utc_of_zero: float | None = None
    """Unix time at which the common clock shows zero, s; None: no file tells it"""
    accepted: tuple[str, ...] = ()
    """kinds of findings that the user vouches for: they are notes"""

    @property
    def sentences(self) -> tuple[str, ...]:
        """Warnings and findings."""
        return (*self.warnings, *(finding.sentence for finding in self.findings))

    def as_published(self) -> Recording:
        """Return the recording for filters as in paper A: a block is told what one IMU is told; all always count."""
        return replace(self, options=replace(self.options, common_share=1.0))

    def without_gate(self) -> Recording:
        """Return the recording with every measurement taken as it is, as the papers do."""
        return replace(self, options=replace(self.options, gate_limit=None))

    def subset(self, indices: Iterable[int]) -> Recording:
        """Return the recording with just the IMUs of those indices."""
        kept = tuple(indices)
        return replace(self, rig=self.rig.subset(kept), imus=tuple(self.imus[i] for i in kept))
