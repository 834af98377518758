"""What is looked for in data before anything is computed from them: order, gaps, units, axes, plausible values.

A check raises InputError or returns warnings; the thresholds stand at the top.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from polyins.checks.vouched import vouched
from polyins.errors import ImplausibleError, InputError
from polyins.formats.rows import ImuRows, RowSource, Track
from polyins.model.axes import axes_matrix, right_handed_axes
from polyins.model.geodesy import displacement
from polyins.model.recording import Array, ImuStream, usual_interval
from polyins.model.rig import STANDARD_GRAVITY
from polyins.prepare.plausible import BODY, WHEEL
from polyins.prepare.timesync import LEAST_COMMON, common_begin, common_end, least_common

Axes = tuple[str, str, str]

GRAVITY_M_S2 = (5.0, 15.0)
"""The median size of the specific force lies between these on any vehicle."""
MAX_TURN_RAD = 2.0
MAX_RATE_RAD_S = BODY.rms_rate
"""rms over a recording, of anything but a wheel"""
UNUSUAL_RATE_RAD_S = 3.0
WHEEL_RATE_RAD_S = WHEEL.rms_rate
"""rms over a recording, of a wheel"""
FARTHEST_OFF_AXIS_M = 1.0
"""what a sensor of unknown mount may be off the axis of a wheel"""
RATES_HZ = (5.0, 20000.0)
GAP_INTERVALS = 1.5
"""A longer step means that rows are missing, which is a warning. Where one or two are, the rate of the row after the
step is taken for all of it; from `timesync.GAP` intervals on a gap is bridged."""
JITTER = 0.2
UPRIGHT = 0.5
"""Cosine of the largest angle between up in the array and the specific force of steady stretches."""
STEADY_S = 0.5
"""of such a stretch"""
STEADY_RAD_S = 0.3
"""that it turns at most: biases of cheap gyros are a third of that"""
LIKE_GRAVITY = 0.6
"""m/s^2, by which the mean specific force may differ in size from gravity's: biases of cheap accelerometers"""
ONE_WAY = 0.8
"""of gravity's size, that the mean over all steady stretches has unless they point everywhere"""
MAX_STD_M = 10000.0
HIGHEST_M = 100000.0
FASTER_THAN_MOVED = 10.0
"""times what positions change by are velocities in another unit"""
LEAST_SPEED_M_S = 5.0
"""that they show at least, so that those of a receiver at rest may be anything"""
MOST_OF_A_WEEK_S = 600000.0


def check_imu(
    rows: ImuRows,
    max_rate_rad_s: float = MAX_RATE_RAD_S,
    off_axis_m: float = 0.0,
    accept: Collection[str] = (),
) -> tuple[str, ...]:
    """Check one IMU's rows, in the sensor's axes, and return warnings.

    `max_rate_rad_s`: rms turn rate allowed; `off_axis_m`: how far from the axis of its turning it may sit, on a wheel;
    `accept`: kinds of judgements that the user overrules.

    Raises InputError for fewer than two rows, NaN, stamps that do not increase, and values whose size shows a wrong
    unit.
    """
    check_rows(rows)
    accepted: list[str] = []
    with vouched(accept, accepted):
        _check_rate(rows)
    with vouched(accept, accepted):
        if not rows.units_known:
            _check_accel_unit(rows, off_axis_m)
    rate = _rms_rate(rows)
    with vouched(accept, accepted):
        _check_gyro_unit(rows, rate, max_rate_rad_s)
    texts = _uneven(rows.time)
    if rate > UNUSUAL_RATE_RAD_S and max_rate_rad_s <= MAX_RATE_RAD_S:
        doubt = "" if rows.units_known else f"; is the gyro's unit {rows.gyro_unit}?"
        texts.append(f"turns at {rate:.3g} rad/s (rms), which is unusual{doubt}")
    return (*rows.warnings, *accepted, *(f"{rows.source.path}: {text}" for text in texts))


def check_rows(rows: ImuRows, first_row: int = 0) -> None:
    """Raise InputError for fewer than two rows, NaN, and stamps that do not increase; `first_row`: where they begin."""
    if len(rows.time) < 2:
        raise InputError(f"{rows.source.path}: {len(rows.time)} row(s); expected at least 2")
    check_finite(rows.source, {"time": rows.time, "gyro": rows.dtheta, "accel": rows.dvel}, first_row)
    remedy = "; give rate_hz if the file's stamps are wrong and its rows are not"
    check_order(rows.source, rows.time, remedy, first_row)


def off_upright(place: str, axes: Axes, stream: ImuStream) -> str:
    """Say that gravity in array axes does not point down, with axes that would make it so; or nothing.

    `axes` as configured.
    """
    force = steady_force(stream.time, stream.dtheta, stream.dvel)
    if force is None or -force[2] >= UPRIGHT * np.linalg.norm(force):
        return ""
    return (
        f"{place}: IMU {stream.name}: with axes [{', '.join(axes)}] the specific force in steady motion is "
        f"[{', '.join(f'{f:.1f}' for f in force)}] m/s^2 forward, right, down; expected about [0, 0, -9.8]. "
        f"Try axes: [{', '.join(upright_axes(axes, force))}]"
    )


def steady_force(time: Array, dtheta: Array, dvel: Array) -> Array | None:
    """Return the mean specific force of the stretches in which it is gravity's, m/s^2, or None where nothing tells.

    There it has gravity's size and what it acts on does not turn; a mean over turns tells nothing. `time`: s, (T,);
    `dtheta`, `dvel`: rad and m/s, (T, 3). Of stretches that point everywhere none tells.
    """
    rows = max(round(STEADY_S / usual_interval(time)), 1)
    edges = np.arange(0, len(time), rows)
    lengths = np.diff(time[edges])
    if not len(lengths):
        return None
    whole = lengths < GAP_INTERVALS * STEADY_S
    rates, forces = (np.diff(np.cumsum(one, axis=0)[edges], axis=0) / lengths[:, None] for one in (dtheta, dvel))
    sizes = _sizes(forces)
    steady = whole & (np.abs(sizes - STANDARD_GRAVITY) < LIKE_GRAVITY) & (_sizes(rates) < STEADY_RAD_S)
    if not steady.any():
        return None
    force = np.asarray(forces[steady].mean(axis=0))
    return force if np.linalg.norm(force) > ONE_WAY * STANDARD_GRAVITY else None


def upright_axes(axes: Axes, force: Array) -> Axes:
    """Return right-handed axes that make the mean specific force point up, as near to `axes` as there are.

    `force`: the mean specific force in array axes as they are now, shape (3,).
    """
    now = axes_matrix(axes)
    sensor_force = now.T @ force

    def rating(proposal: Axes) -> float:
        matrix = axes_matrix(proposal)
        # The forward axis is the one to keep, then the right one; both weigh less than any change of what is up.
        kept = (now * matrix).sum(axis=1) @ [0.02, 0.01, 0.0]
        return float(kept - (matrix @ sensor_force)[2] / np.linalg.norm(force))

    return max(right_handed_axes(), key=rating)


def check_track(track: Track, what: str, accept: Collection[str] = ()) -> tuple[str, ...]:
    """Check positions of GNSS or a reference and return warnings; `accept` as for `check_imu`.

    Raises InputError for no rows, NaN, stamps that do not increase, coordinates that no place on Earth has.
    """
    if not len(track.time):
        raise InputError(f"{track.source.path}: no rows; expected positions for {what}")
    check_finite(track.source, {"time": track.time, "position": track.position})
    angles = track.attitude
    if angles is not None and np.isnan(angles[:, :2]).all():  # of a reference with heading alone
        angles = angles[:, 2:]
    optional = {"velocity": track.velocity, "velocity std": track.velocity_std, "attitude": angles}
    check_finite(track.source, {name: block for name, block in optional.items() if block is not None})
    check_order(track.source, track.time)
    if track.geodetic:
        _check_coordinates(track)
    accepted: list[str] = []
    with vouched(accept, accepted):
        _check_heights_and_speeds(track)
    return (*track.warnings, *accepted)


def _check_heights_and_speeds(track: Track) -> None:
    """Raise InputError where heights are above the air or velocities far from what the positions change by.

    A few wrong ones among others are for the filter's gate.
    """
    height = track.position[:, 2]
    above = np.flatnonzero(np.abs(height) > HIGHEST_M)
    if 2 * len(above) > len(height):
        raise ImplausibleError(
            "units",
            f"{track.source.place(int(above[0]))}: height is {height[above[0]]:.6g} m; expected at most "
            f"{HIGHEST_M:g} m: is it in mm? (columns.position.scale)",
        )
    if track.velocity is None or len(track.time) < 3:
        return
    moved = displacement(track.position, track.position[0], True) if track.geodetic else track.position
    rates = np.linalg.norm(np.diff(moved[:, :2], axis=0), axis=1) / np.diff(track.time)
    speeds = np.linalg.norm(track.velocity[1:, :2], axis=1)
    usual, fastest = float(np.median(speeds)), float(np.quantile(rates, 0.9))
    if usual > FASTER_THAN_MOVED * fastest + LEAST_SPEED_M_S:
        raise ImplausibleError(
            "units",
            f"{track.source.path}: velocities are {usual:.4g} m/s in the middle, the positions change by "
            f"{fastest:.4g} m/s at most; expected m/s (columns.velocity.scale)",
        )


def check_std(source: RowSource, std: Array) -> None:
    """Raise InputError for standard deviations of a position that are not positive metres."""
    check_finite(source, {"position std": std})
    for row in np.flatnonzero((std <= 0.0).any(axis=1))[:1]:
        raise InputError(
            f"{source.place(int(row))}: position std is {std[row].tolist()} m; expected numbers above zero "
            "(position_std_m in the configuration takes their place)"
        )
    for row in np.flatnonzero((std > MAX_STD_M).any(axis=1))[:1]:
        raise InputError(f"{source.place(int(row))}: position std is {std[row].tolist()} m; expected metres")


def check_common_span(spans: dict[str, tuple[float, float]], *, wait: bool) -> tuple[float, float]:
    """Return the span of the recording, s; raise InputError if an IMU has less than 2 s in common with the others.

    With `wait` it begins when all measure; otherwise one that begins long after the others does not hold it up. One
    that stops long before the others does not end it.
    """
    begins, ends = np.array(list(spans.values())).T
    least = least_common(begins, ends, wait=wait)
    if least >= LEAST_COMMON:
        return float(begins.max()) if wait else common_begin(begins), common_end(ends)
    latest, earliest = list(spans)[int(np.argmax(begins))], list(spans)[int(np.argmin(ends))]
    if latest == earliest:
        raise InputError(f"IMU {latest}: {least:.3f} s of data; expected at least {LEAST_COMMON:g} s")
    raise InputError(
        f"IMU {latest} begins at {begins.max():.3f} s and IMU {earliest} ends at {ends.min():.3f} s; expected at least "
        f"{LEAST_COMMON:g} s in common (clock_offset_s shifts a clock)"
    )


def check_within(source: RowSource, what: str, time: Array, span: tuple[float, float]) -> tuple[str, ...]:
    """Return a warning if part of a stream lies outside the IMUs' span; raise InputError if all of it does."""
    inside = (time >= span[0]) & (time <= span[1])
    if not inside.any():
        raise InputError(
            f"{source.path}: {what} covers {time[0]:.3f} to {time[-1]:.3f} s, the IMUs {span[0]:.3f} to "
            f"{span[1]:.3f} s; expected the same clock (clock_offset_s shifts it; GPS time is 18 s ahead of UTC)"
        )
    if inside.all():
        return ()
    count = int(np.sum(~inside))
    return (f"{source.path}: {count} of {len(time)} {what} rows lie outside the IMUs' span and are not used",)


def check_finite(source: RowSource, blocks: dict[str, Array], first_row: int = 0) -> None:
    """Raise InputError for the first row, in blocks of shape (T,) or (T, k) by name, that is not all numbers.

    `first_row`: of the blocks in the file.
    """
    for name, block in blocks.items():
        good = np.isfinite(block)
        if good.all():
            continue
        bad = ~good
        for row in np.flatnonzero(bad if block.ndim == 1 else bad.any(axis=1))[:1]:
            place = source.place(first_row + int(row))
            raise InputError(f"{place}: {name} is missing or not a number; expected a number")


def check_order(source: RowSource, time: Array, remedy: str = "", first_row: int = 0) -> None:
    """Raise InputError for stamps, shape (T,), that do not increase; `remedy` ends the message."""
    steps = np.diff(time)
    if np.all(steps > 0.0):
        return
    row = int(np.argmax(steps <= 0.0)) + 1
    place = source.place(first_row + row)
    if steps[row - 1] == 0.0:
        count = int(np.sum(steps == 0.0))
        raise InputError(
            f"{place}: time {time[row]:.6f} s is repeated ({count} in the file); expected increasing times{remedy}"
        )
    if steps[row - 1] < -MOST_OF_A_WEEK_S:
        remedy = "; a week of GPS rolls over: count its time on through the end"
    raise InputError(
        f"{place}: time {time[row]:.6f} s follows {time[row - 1]:.6f} s; expected increasing times{remedy}"
    )


def _check_rate(rows: ImuRows) -> None:
    rate = 1.0 / usual_interval(rows.time)
    if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
        raise ImplausibleError(
            "sampling",
            f"{rows.source.path}: {rate:.4g} rows per second of the stamps; expected {RATES_HZ[0]:g} to "
            f"{RATES_HZ[1]:g} for an IMU: is the unit of time (s, ms, us, ns) right?",
        )


def _check_accel_unit(rows: ImuRows, off_axis_m: float) -> None:
    step = usual_interval(rows.time)
    size = float(np.median(_sizes(rows.dvel))) / step
    spin = float(np.median(_sizes(rows.dtheta))) / step if off_axis_m else 0.0
    if GRAVITY_M_S2[0] <= size <= GRAVITY_M_S2[1] + off_axis_m * spin**2:
        return
    unit, said = rows.accel_unit, f"the specific force comes out at {size:.4g} m/s^2"
    if unit == "m/s" and _like_gravity(size * step):
        hint = "values look like rates; say unit: m/s^2 (format: table)"
    elif unit == "m/s" and _like_gravity(size * step * STANDARD_GRAVITY):
        hint = "values look like rates in g; say unit: g (format: table)"
    elif unit == "m/s^2" and _like_gravity(size / step):
        hint = "values look like increments; say unit: m/s"
    elif unit == "m/s^2" and _like_gravity(size * STANDARD_GRAVITY):
        hint = "values look like multiples of g; say unit: g"
    elif unit == "g" and _like_gravity(size / STANDARD_GRAVITY):
        hint = "values look like m/s^2; say unit: m/s^2"
    else:
        hint = "unit, rate or columns are wrong, or gravity was taken out"
    raise ImplausibleError("units", f"{rows.source.path}: with unit {unit} {said}; expected about 9.8. {hint}")


def _sizes(vectors: Array) -> Array:
    """Return the length of each vector of shape (T, 3)."""
    x, y, z = vectors.T
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def _like_gravity(size: float) -> bool:
    return GRAVITY_M_S2[0] <= size <= GRAVITY_M_S2[1]


def _rms_rate(rows: ImuRows) -> float:
    """Return the rms turn rate, rad/s."""
    return float(np.sqrt(np.mean((_sizes(rows.dtheta[1:]) / np.diff(rows.time)) ** 2)))


def _check_gyro_unit(rows: ImuRows, rms: float, max_rate: float) -> None:
    turn = _sizes(rows.dtheta[1:])
    largest = int(np.argmax(turn))
    on_wheel = max_rate > MAX_RATE_RAD_S
    # degrees mistaken for radians make rates that no gyro has, radians mistaken for degrees make small ones
    in_degrees = rows.gyro_unit == "deg/s" and rms <= BODY.rate
    if rows.units_known or ((on_wheel or turn[largest] <= MAX_TURN_RAD) and (rms <= max_rate or in_degrees)):
        return
    other = {"rad/s": "deg/s", "rad": "rad/s or deg/s", "deg": "deg/s", "deg/s": "another"}[rows.gyro_unit]
    raise ImplausibleError(
        "units",
        f"{rows.source.place(largest + 1)}: with unit {rows.gyro_unit} the turn in one interval is "
        f"{turn[largest]:.3g} rad (rms rate {rms:.3g} rad/s); expected at most {MAX_TURN_RAD:g} rad and "
        f"{max_rate:g} rad/s: is the unit {other}?{'' if on_wheel else ' (On a wheel, it needs the section wheel.)'}",
    )


def _check_coordinates(track: Track) -> None:
    latitude, longitude = track.position[:, 0], track.position[:, 1]
    wrong = (np.abs(latitude) > np.pi / 2) | (np.abs(longitude) > 2 * np.pi)
    empty = (latitude == 0.0) & (longitude == 0.0)
    for row in np.flatnonzero(wrong)[:1]:
        hint = ": are the values degrees?" if track.angle_unit == "rad" else ": are the columns in this order?"
        raise InputError(
            f"{track.source.place(int(row))}: latitude {np.degrees(latitude[row]):.6g} deg, longitude "
            f"{np.degrees(longitude[row]):.6g} deg; expected at most 90 and 360{hint}"
        )
    for row in np.flatnonzero(empty)[:1]:
        raise InputError(f"{track.source.place(int(row))}: latitude and longitude are 0; expected rows with a fix only")


def _uneven(time: Array) -> list[str]:
    """Describe gaps and jitter of a stream."""
    steps = np.diff(time)
    usual = usual_interval(time)
    gaps = steps > GAP_INTERVALS * usual
    texts = []
    if gaps.any():
        worst = int(np.argmax(steps))
        texts.append(
            f"{int(gaps.sum())} gap(s) in the stamps, the largest {steps[worst]:.4g} s at {time[worst]:.3f} s; "
            "the motion inside is not known"
        )
    spread = float(np.quantile(np.abs(steps[~gaps] - usual), 0.95)) / usual
    if spread > JITTER:
        texts.append(f"intervals vary by {100 * spread:.0f} % (95 % of them by less); expected an even rate")
    return texts
