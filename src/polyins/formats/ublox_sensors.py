"""The sensors of u-blox receivers: gyro and accelerometer of ESF-MEAS and ESF-RAW, wheel ticks, on the clock of GNSS.

ESF stamps count the receiver's own time. What they are in GPS time no message says. Where the receiver tells the rates
it worked with (ESF-INS), the shift is the one at which they agree with the gyro; else the order of the messages bounds
it: what was measured before a solution stands before it, but a solution comes late, so that fixes seem older than they
are. Scales: 2^-12 deg/s, 2^-10 m/s^2 (u-blox M8 receiver description, external sensor data).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from polyins.formats.joined import joined_rates
from polyins.formats.rows import ImuRows, RowSource, SensorRows, Track, rising
from polyins.model.recording import Array
from polyins.model.rig import DEG

GYRO, ACCEL = (14, 13, 5), (16, 17, 18)
"""types of x, y, z"""
GYRO_UNIT, ACCEL_UNIT = DEG / 4096.0, 1.0 / 1024.0
SPEED, SPEED_UNIT = 11, 1e-3
TICKS = {10: "single tick", 8: "rear-left", 9: "rear-right", 6: "front-left", 7: "front-right"}
"""of wheels, the best for a speed first"""
COUNTER = 1 << 23
"""of ticks; the bit above is set backwards"""
RAW_TICK_S = 1.0 / 25600.0
"""of ESF-RAW, which nothing documents: with it ten samples of ten messages a second make 100 Hz"""
MEAS, RAW = "ESF-MEAS", "ESF-RAW"
SURE = 0.95
"""correlation from which rates are taken to be the same"""
LEAST_RATES = 10
LATEST_S = 1.0
"""by which a solution comes after what it was made of"""
FASTEST_M_S, SLOWEST_M_S = 100.0, 2.0
"""speeds that tell the length of a tick lie above the slowest"""

Sensed = tuple[str, float, bytes]
"""what it is, GPS time, s, or NaN, and the payload: ESF-MEAS and ESF-RAW, ESF-INS, others for their time"""


@dataclass
class Sensors:
    """Streams of sensors on the clock of GNSS, as a `Log` has them."""

    imus: dict[str, ImuRows] = field(default_factory=dict)
    others: dict[str, SensorRows] = field(default_factory=dict)
    unusable: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    clock_offsets: dict[str, float] = field(default_factory=dict)


def read(path: Path, sensed: Sequence[Sensed], track: Track | None) -> Sensors:
    """Return the sensors' streams; `track`: positions with velocities, which tell how long a tick of a wheel is."""
    found = Sensors()
    for name in (RAW, MEAS):
        values, stamps = _values(sensed, name)
        if not stamps:
            continue
        gyro, force = _three(values, GYRO, GYRO_UNIT), _three(values, ACCEL, ACCEL_UNIT)
        offset, said = _offset(sensed, stamps, gyro)
        found.notes.append(f"{name}: {said}")
        if min(np.diff([stamp for _, stamp in stamps]), default=0.0) < -LATEST_S:
            found.notes.append(f"{name}: its clock began anew on the way; what came after that is left out")
        if len(gyro) > 1 and len(force) > 1:
            shift = np.array([offset, 0.0, 0.0, 0.0])
            found.imus[name] = joined_rates(path, name, gyro + shift, force + shift)
        elif len(gyro) or len(force):
            found.notes.append(f"{name} holds {len(gyro)} rows of gyros and {len(force)} of accelerometers")
        shifted = {kind: np.array(rows) + np.array([offset, 0.0]) for kind, rows in values.items()}
        _add_wheels(found, path, name, shifted, track)
        fresh = (set(found.imus) | set(found.others)) - set(found.clock_offsets)
        found.clock_offsets |= dict.fromkeys(sorted(fresh), offset)
    if len(found.imus) > 1:
        found.unusable[MEAS] = f"{RAW} has the same sensors at a higher rate"
    return found


def _values(sensed: Sequence[Sensed], name: str) -> tuple[dict[int, list[tuple[float, int]]], list[tuple[int, float]]]:
    """Return stamps, s, and the 24 bits of each type, and where in the file which stamp stands."""
    values: dict[int, list[tuple[float, int]]] = defaultdict(list)
    stamps: list[tuple[int, float]] = []
    clock = _Counter(1e-3 if name == MEAS else RAW_TICK_S)
    for place, (kind, _, payload) in enumerate(sensed):
        if kind != name:
            continue
        words = np.frombuffer(payload[: len(payload) // 4 * 4], "<u4")
        if name == MEAS:
            data = words[2 : 2 + (int(words[1]) >> 11 & 31)]
            pairs = [(clock.seconds(int(words[0])), int(word)) for word in data]
        else:
            pairs = [(clock.seconds(int(tag)), int(word)) for word, tag in zip(words[1::2], words[2::2], strict=False)]
        for stamp, word in pairs:
            values[word >> 24 & 63].append((stamp, word & 0xFFFFFF))
        if pairs:
            stamps.append((place, pairs[-1][0]))
    return values, stamps


class _Counter:
    """Stamps that begin again at 2^32, or at 2^24 where none is above that."""

    def __init__(self, unit: float) -> None:
        self._unit, self._last, self._turns, self._largest = unit, 0, 0, 0

    def seconds(self, count: int) -> float:
        self._largest = max(self._largest, count)
        size = 1 << (24 if self._largest < 1 << 24 else 32)
        if self._last - count > size // 2:
            self._turns += size
        elif count - self._last > size // 2 and self._turns:
            self._turns -= size
        self._last = count
        return (self._turns + count) * self._unit


def _three(values: Mapping[int, Sequence[tuple[float, int]]], kinds: tuple[int, ...], unit: float) -> Array:
    """Return stamps, s, and the three axes where all are there, shape (T, 4)."""
    x, y, z = (dict(values.get(kind, ())) for kind in kinds)
    stamps = np.array([stamp for stamp in x if stamp in y and stamp in z])
    if not len(stamps):
        return np.empty((0, 4))
    stamps = stamps[rising(stamps)]
    axes = np.array([[_signed(one[stamp]) for one in (x, y, z)] for stamp in stamps]) * unit
    return np.column_stack([stamps, axes])


def _signed(bits: int) -> int:
    return bits - (1 << 24) if bits & COUNTER else bits


def _offset(sensed: Sequence[Sensed], stamps: Sequence[tuple[int, float]], gyro: Array) -> tuple[float, str]:
    """Return what makes GPS time of the sensors' stamps, s, and how that is known."""
    timed = [(place, time) for place, (kind, time, _) in enumerate(sensed) if time == time and kind != "HNR"]
    if not stamps or not timed:
        return 0.0, "stamps are the receiver's own time: no message tells GPS time"
    places, own = np.array(stamps).T
    own = np.maximum.accumulate(own)
    at, gps = np.array(timed).T
    after = np.searchsorted(places, at)
    later, earlier = after < len(own), after > 0
    least, most = _most(gps[later] - own[after[later]]), _most(gps[earlier] - own[after[earlier] - 1])
    most = least if np.isnan(most) else most
    by_order = most if np.isnan(least) else 0.5 * (least + most)
    matched = _matched(sensed, gyro, by_order)
    if matched is not None:
        offset, correlation = matched
        return (
            offset,
            f"GPS time is {offset:.3f} s more: rates agree with ESF-INS there (correlation {correlation:.4f})",
        )
    return by_order, (
        f"GPS time is taken to be {by_order:.3f} s more, by the order of the messages alone: fixes may seem older than "
        f"they are, by up to {LATEST_S:g} s; gnss.time_offset: estimate finds it from the motion"
    )


def _most(apart: Array) -> float:
    """Return the most of what is near the usual: a receiver that has no time yet tells any; NaN of nothing."""
    if not len(apart):
        return np.nan
    return float(apart[np.abs(apart - np.median(apart)) < 2.0 * LATEST_S].max())


def _matched(sensed: Sequence[Sensed], gyro: Array, near: float) -> tuple[float, float] | None:
    """Return the shift at which the rates of ESF-INS agree with the gyro's, and the correlation, if they surely do."""
    rows = [(time, *np.frombuffer(payload[12:24], "<i4")) for kind, time, payload in sensed if kind == "ESF-INS"]
    if len(rows) < LEAST_RATES or len(gyro) < LEAST_RATES:
        return None
    told = np.array(rows, dtype=float)
    size = np.linalg.norm(told[:, 1:], axis=1)
    inside = (told[:, 0] - near - LATEST_S > gyro[0, 0]) & (told[:, 0] - near + LATEST_S < gyro[-1, 0])
    if inside.sum() < LEAST_RATES or np.ptp(size[inside]) == 0.0:
        return None
    shifts = near + np.arange(-0.2, LATEST_S, 1e-3)
    agreement = []
    for shift in shifts:
        axes = [np.interp(told[inside, 0] - shift, gyro[:, 0], axis) for axis in gyro[:, 1:].T]
        felt = np.linalg.norm(axes, axis=0)
        agreement.append(np.corrcoef(felt, size[inside])[0, 1] if np.ptp(felt) > 0.0 else 0.0)
    best = int(np.argmax(agreement))
    return (float(shifts[best]), float(agreement[best])) if agreement[best] >= SURE else None


def _add_wheels(found: Sensors, path: Path, name: str, values: Mapping[int, Array], track: Track | None) -> None:
    """Add speeds and ticks, ticks as speeds where the speed of the fixes tells how long one is."""
    speeds: dict[str, SensorRows] = {}
    if SPEED in values:
        rows = _rising(values[SPEED])
        speed = np.array([_signed(int(bits)) for bits in rows[:, 1]]) * SPEED_UNIT
        stream = f"{name} speed"
        speeds[stream] = SensorRows(RowSource(f"{path}, {stream}"), "odometer", rows[:, 0], speed)
    for kind, wheel in TICKS.items():
        if kind not in values:
            continue
        stream, rows = f"{name} {wheel}", _rising(values[kind])
        counts = _counted(rows[:, 1].astype(np.int64))
        source = RowSource(f"{path}, {stream}")
        found.others[stream] = SensorRows(source, "ticks", rows[:, 0], counts)
        if not counts.any():
            found.unusable[stream] = "all 0: its pin is open, or the wheel stood still"
            continue
        found.unusable[stream] = "how long a tick is no message tells, nor do fixes under way"
        speed, length = _speed(rows[:, 0], counts, track)
        if length:
            found.unusable[stream] = f"is used as {stream} speed, {length:.5g} m a tick by the speed of the fixes"
            source = RowSource(f"{path}, {stream} speed")
            middles = 0.5 * (rows[1:, 0] + rows[:-1, 0])
            speeds[f"{stream} speed"] = SensorRows(source, "odometer", middles, speed * length)
    found.others |= speeds
    found.unusable |= dict.fromkeys(list(speeds)[1:], "only one odometer can aid the filter")


def _rising(rows: Array) -> Array:
    return rows[rising(rows[:, 0])]


def _counted(bits: NDArray[np.int64]) -> Array:
    """Return the ticks since the first stamp, backward ones taken off; a counter that began anew goes on."""
    steps = np.diff(bits & (COUNTER - 1))
    steps = np.where(steps < 0, steps + COUNTER, steps)
    usual = np.percentile(steps, 90) if len(steps) else 0.0
    steps = np.where(steps > max(100.0 * usual, 1000.0), 0, steps)
    signs = np.where(bits[1:] & COUNTER, -1, 1)
    return np.concatenate([[0.0], np.cumsum(signs * steps)])


def _speed(time: Array, counts: Array, track: Track | None) -> tuple[Array, float]:
    """Return ticks a second, and the length of a tick, m, by fixes with a speed that tells it; else 0."""
    rate = np.diff(counts) / np.diff(time)
    if track is None or track.velocity is None:
        return rate, 0.0
    inside = (track.time > time[1]) & (track.time < time[-1])
    driven = np.linalg.norm(track.velocity[inside, :2], axis=1)
    turned = np.abs(np.interp(track.time[inside], time[1:] - 0.5 * np.diff(time), rate))
    under_way = (driven > SLOWEST_M_S) & (driven < FASTEST_M_S) & (turned > 0.0)
    if under_way.sum() < LEAST_RATES:
        return rate, 0.0
    return rate, float(np.median(driven[under_way] / turned[under_way]))
