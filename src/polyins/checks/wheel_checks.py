"""What is looked for in settings and data of IMUs on wheels before anything is computed from them.

A check raises InputError or returns warnings; the thresholds stand at the top. Streams are in the module's axes: x
along the axle to the right, so that rolling forward is a negative rate about x.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.checks.drive_checks import check_drive
from polyins.checks.steering import yaw_differences
from polyins.config import Config, ImuEntry, WheelEntry
from polyins.config.yaml_document import Document, Key
from polyins.errors import InputError
from polyins.formats.rows import intervals
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import GnssStream, ImuStream
from polyins.model.rig import DEG, MAX_RADIUS_M, Imu, Vector

Array = NDArray[np.float64]

MAX_TILT_DEG = 20.0
SAME_WHEEL_M = 0.01
TURNS_RAD_S = 0.5
"""the fastest twentieth of the time, of a wheel that rolls at all"""
STANDS = 0.1
"""A wheel slower than this part of the others' rate does not turn with the vehicle."""
UNDECLARED_TILT_DEG = 2.0
ONE_WAY = 0.5
"""of the way driven; more than that backwards is a wrong sign"""
COARSE_RAD = 0.5
"""turn per sample: what happens in between is lost on a wheel's IMU"""
TOO_COARSE_RAD = 1.5
UNEQUAL = 0.05
UNLIKE_GNSS = 0.2
GNSS_STEP_S = 2.0
GNSS_SPEED_M_S = 1.0
CLOCK_STEP_S = 0.05
CLOCK_AVERAGE_S = 0.5
LARGEST_LAG_S = 300.0
LAG_SHOWS_S = 0.3
LIKENESS = 0.02
"""by how much the correlation of two speeds has to rise before the clocks are doubted"""


@dataclass(frozen=True)
class _ConfiguredWheel:
    """An IMU on a wheel, its motion, and where it is configured."""

    index: int
    imu: Imu
    entry: WheelEntry
    time: Array
    rate: Array
    """rad/s in module axes, shape (T, 3)"""
    angle: Array
    """rad rolled forward up to each stamp"""

    @property
    def name(self) -> str:
        return self.imu.name

    @property
    def pace(self) -> float:
        """Return the turn rate that a twentieth of the time exceeds, rad/s."""
        return float(np.quantile(np.linalg.norm(self.rate, axis=1), 0.95))

    @property
    def way(self) -> Array:
        """Return the metres rolled forward up to each stamp."""
        return self.entry.radius_m * self.angle

    def keys(self, *keys: Key) -> list[Key]:
        return ["imus", self.index, "wheel", *keys]


def check_settings(config: Config, document: Document) -> list[str]:
    """Check what the configuration says of wheels against itself; return warnings, raise InputError."""
    wheels = [(index, imu, imu.wheel) for index, imu in enumerate(config.imus) if imu.wheel is not None]
    warnings = []
    for index, imu, wheel in wheels:
        _check_size(index, wheel, document)
        _check_side(index, imu, wheel, document)
        if len(wheels) > 1 and wheel.side is None and imu.position_m[1] == 0.0:
            place = document.place(["imus", index, "position_m"])
            warnings.append(f"{place}: IMU {imu.name} is on the middle line; is its wheel left or right of it?")
    if wheels and all(wheel.steering for _, _, wheel in wheels):
        raise document.error(
            ["imus", wheels[0][0], "wheel", "steering"],
            "all wheels with an IMU are steered; expected one that is not, to give speed",
        )
    _check_modules(config, document)
    return warnings


def _check_size(index: int, wheel: WheelEntry, document: Document) -> None:
    keys: list[Key] = ["imus", index, "wheel"]
    if wheel.radius_m > MAX_RADIUS_M:
        raise document.error([*keys, "radius_m"], f"is {wheel.radius_m:g}; expected metres")
    arm = float(np.linalg.norm(wheel.lever_arm_m))
    if arm > wheel.radius_m:
        raise document.error(
            [*keys, "lever_arm_m"], f"is {arm:.3g} m long; expected metres, within the radius, {wheel.radius_m:g} m"
        )
    if max(abs(tilt) for tilt in wheel.tilt_deg) > MAX_TILT_DEG:
        raise document.error(
            [*keys, "tilt_deg"], f"is {list(wheel.tilt_deg)}; expected at most {MAX_TILT_DEG:g} deg off spin_axis"
        )


def _check_side(index: int, imu: ImuEntry, wheel: WheelEntry, document: Document) -> None:
    right = imu.position_m[1]
    if wheel.side is None or right == 0.0 or (right > 0.0) == (wheel.side == "right"):
        return
    raise document.error(
        ["imus", index, "wheel", "side"],
        f"is {wheel.side}, and position_m is {list(imu.position_m)}; expected y above zero on the right, "
        "below on the left",
    )


def _check_modules(config: Config, document: Document) -> None:
    """Check that the chips of each module, which is one board, are on one wheel or on the body."""
    first: dict[str, ImuEntry] = {}
    for index, imu in enumerate(config.imus):
        other = first.setdefault(imu.module, imu) if imu.module else imu
        apart = float(np.linalg.norm(np.subtract(imu.position_m, other.position_m)))
        mixed = (imu.wheel is None) != (other.wheel is None)
        if mixed or (imu.wheel is not None and apart > SAME_WHEEL_M):
            where = "on a wheel and on the body" if mixed else f"on wheels {apart:.3g} m apart"
            raise document.error(
                ["imus", index, "module"],
                f"IMU {imu.name} shares module {imu.module!r} with IMU {other.name}, {where}; expected chips "
                "of one board",
            )


def check_motion(
    config: Config,
    document: Document,
    imus: tuple[Imu, ...],
    streams: tuple[ImuStream, ...],
    gnss: GnssStream | None,
    geodetic: bool,
) -> list[str]:
    """Check what IMUs on wheels show against the settings and each other; return warnings, raise InputError."""
    wheels = [
        _wheel(index, imu, entry.wheel, stream)
        for index, (imu, entry, stream) in enumerate(zip(imus, config.imus, streams, strict=True))
        if entry.wheel is not None
    ]
    if not wheels:
        return []
    warnings = [text for wheel in wheels for text in _check_sampling(wheel, document)]
    if max(wheel.pace for wheel in wheels) < TURNS_RAD_S:
        return [*warnings, f"{document.place(['imus'])}: no wheel turns; expected a recording of a vehicle that drives"]
    _check_all_turn(wheels, document)
    for wheel in wheels:
        warnings += _check_axis(wheel, document)
        _check_direction(wheel, document)
    rolling = [wheel for wheel in wheels if not wheel.entry.steering]
    unlike = _check_clocks(wheels, document)
    warnings += [*_check_ways(rolling, document), *unlike]
    if not unlike:
        warnings += _check_steering(rolling, imus, streams, document)
        warnings += check_drive(document, imus, streams, gnss, geodetic)
    if gnss is not None:
        warnings += [text for wheel in rolling for text in _check_radius(wheel, gnss, geodetic, document)]
    return warnings


def _wheel(index: int, imu: Imu, entry: WheelEntry, stream: ImuStream) -> _ConfiguredWheel:
    rate = stream.dtheta / intervals(stream.time)[:, None]
    return _ConfiguredWheel(index, imu, entry, stream.time, rate, -np.cumsum(stream.dtheta[:, 0]))


def _check_sampling(wheel: _ConfiguredWheel, document: Document) -> list[str]:
    step = float(np.median(np.diff(wheel.time)))
    turn = float(np.quantile(np.linalg.norm(wheel.rate, axis=1), 0.999)) * step
    if turn <= COARSE_RAD:
        return []
    text = f"{document.place(wheel.keys())}: IMU {wheel.name} turns {turn:.2g} rad per sample at {1 / step:.4g} Hz"
    if turn > TOO_COARSE_RAD:
        raise InputError(f"{text}; expected at most {TOO_COARSE_RAD:g} (is the gyro's unit right?)")
    return [f"{text}; what happens between samples is lost, expected at most {COARSE_RAD:g}"]


def _check_all_turn(wheels: list[_ConfiguredWheel], document: Document) -> None:
    paces = [wheel.pace for wheel in wheels]
    for wheel, pace in zip(wheels, paces, strict=True):
        if pace < STANDS * max(paces):
            raise InputError(
                f"{document.place(wheel.keys())}: IMU {wheel.name} turns at {pace:.2g} rad/s, other wheels at "
                f"{max(paces):.3g} rad/s; expected an IMU that turns with its wheel"
            )


def _check_axis(wheel: _ConfiguredWheel, document: Document) -> list[str]:
    """Compare the axis that the IMU turns about with the one declared."""
    fast = wheel.rate[np.linalg.norm(wheel.rate, axis=1) > TURNS_RAD_S]
    spin = np.linalg.eigh(fast.T @ fast)[1][:, -1]
    # rolling forward is a negative rate about the axis to the right
    right = wheel.imu.rotation.T @ (spin if np.sum(fast @ spin) < 0.0 else -spin)
    off_deg = float(np.degrees(np.arccos(np.clip(abs(spin[0]), 0.0, 1.0))))
    k = int(np.argmax(np.abs(right)))
    if off_deg > 45.0:
        raise InputError(
            f"{document.place(wheel.keys('spin_axis'))}: is {wheel.entry.spin_axis}, but IMU {wheel.name} turns about "
            f"its {'xyz'[k]}; expected spin_axis: {_named(right, k)}"
        )
    if off_deg < UNDECLARED_TILT_DEG:
        return []
    tilt = [right[(k + n) % 3] / right[k] / DEG for n in (1, 2)]
    return [
        f"{document.place(wheel.keys('tilt_deg'))}: the spin axis of IMU {wheel.name} is {off_deg:.1f} deg off what is "
        f"declared; expected about [{tilt[0]:.1f}, {tilt[1]:.1f}]"
    ]


def _named(right: Vector, k: int) -> str:
    return ("-" if right[k] < 0.0 else "") + "xyz"[k]


def _check_direction(wheel: _ConfiguredWheel, document: Document) -> None:
    net, whole = wheel.way[-1], float(np.sum(np.abs(np.diff(wheel.way))))
    if net > -ONE_WAY * whole:
        return
    axis = wheel.entry.spin_axis
    other = axis.removeprefix("-") if axis.startswith("-") else f"-{axis}"
    raise InputError(
        f"{document.place(wheel.keys('spin_axis'))}: with {axis} IMU {wheel.name} rolls {-net:.3g} m backwards; "
        f"expected the axis that points to the right: {other}?"
    )


def _check_ways(wheels: list[_ConfiguredWheel], document: Document) -> list[str]:
    """Compare how far the wheels roll while all are recorded."""
    if len(wheels) < 2:
        return []
    begin, end = max(wheel.time[0] for wheel in wheels), min(wheel.time[-1] for wheel in wheels)
    ways = [float(np.diff(np.interp([begin, end], wheel.time, wheel.way))[0]) for wheel in wheels]
    longest, shortest = int(np.argmax(ways)), int(np.argmin(ways))
    if ways[longest] - ways[shortest] <= UNEQUAL * ways[longest]:
        return []
    a, b = wheels[longest], wheels[shortest]
    return [
        f"{document.place(a.keys('radius_m'))}: IMU {a.name} rolls {ways[longest]:.1f} m, IMU {b.name} "
        f"{ways[shortest]:.1f} m; expected them within {100 * UNEQUAL:.0f} %: are the radii {a.entry.radius_m:g} and "
        f"{b.entry.radius_m:g} m right?"
    ]


def _check_clocks(wheels: list[_ConfiguredWheel], document: Document) -> list[str]:
    """Look whether the speeds of two wheels are more alike with one of them shifted in time."""
    first = wheels[0]
    return [
        f"{document.place(['imus', wheel.index])}: IMU {wheel.name} drives like IMU {first.name} {lag:+.1f} s later; "
        "expected one clock (clock_offset_s, or time_offset: estimate)"
        for wheel in wheels[1:]
        if (lag := _lag(first, wheel))
    ]


def _lag(a: _ConfiguredWheel, b: _ConfiguredWheel) -> float:
    """Return by how much b is later than a, s, by how both speed up and slow down; 0 if not by much."""
    begin, end = max(a.time[0], b.time[0]), min(a.time[-1], b.time[-1])
    grid = np.arange(begin, end, CLOCK_STEP_S)
    far = round(CLOCK_AVERAGE_S / CLOCK_STEP_S)
    ways = [np.interp(grid, wheel.time, wheel.way) for wheel in (a, b)]
    one, two = (way[2 * far :] - 2.0 * way[far:-far] + way[: -2 * far] for way in ways)
    size = len(one) + len(two) - 1
    product = np.fft.irfft(np.fft.rfft(two, size) * np.fft.rfft(one[::-1], size), size)
    likeness = product / max(float(np.linalg.norm(one) * np.linalg.norm(two)), 1e-12)
    lags = np.arange(1 - len(one), len(two)) * CLOCK_STEP_S
    plausible = np.abs(lags) <= LARGEST_LAG_S
    best = int(np.argmax(np.where(plausible, likeness, -1.0)))
    alike = likeness[best] > likeness[lags == 0.0][0] + LIKENESS
    return float(lags[best]) if alike and abs(lags[best]) >= LAG_SHOWS_S else 0.0


def _check_steering(
    wheels: list[_ConfiguredWheel], imus: tuple[Imu, ...], streams: tuple[ImuStream, ...], document: Document
) -> list[str]:
    """Warn of wheels that yaw otherwise than the vehicle although they are declared not to be steered."""
    chosen = [index for index, imu in enumerate(imus) if imu.wheel is None or not imu.wheel.steering]
    found = yaw_differences([imus[i] for i in chosen], [streams[i] for i in chosen])
    return [
        f"{document.place(wheel.keys('steering'))}: IMU {wheel.name} yaws otherwise than IMU {found[wheel.name]}; is "
        "its wheel steered?"
        for wheel in wheels
        if wheel.name in found
    ]


def _check_radius(wheel: _ConfiguredWheel, gnss: GnssStream, geodetic: bool, document: Document) -> list[str]:
    """Compare the way rolled with the way between fixes, where it drives."""
    inside = (gnss.time >= wheel.time[0]) & (gnss.time <= wheel.time[-1])
    time, position = gnss.time[inside], gnss.position[inside]
    if len(time) < 2:
        return []
    kept = np.flatnonzero(np.diff(np.floor((time - time[0]) / GNSS_STEP_S), prepend=-1.0) > 0.0)
    time, position = time[kept], position[kept]
    steps = np.diff(position, axis=0) * metres_per_unit(position[1:], geodetic)
    rolled = np.diff(np.interp(time, wheel.time, wheel.way))
    driving = np.abs(rolled) > GNSS_SPEED_M_S * np.diff(time)
    if not driving.any():
        return []
    ratio = float(np.sum(np.hypot(steps[driving, 0], steps[driving, 1])) / np.sum(np.abs(rolled[driving])))
    if abs(ratio - 1.0) <= UNLIKE_GNSS:
        return []
    radius = wheel.entry.radius_m
    return [f"{document.place(wheel.keys('radius_m'))}: is {radius:g}; GNSS speed says about {ratio * radius:.3g} m"]
