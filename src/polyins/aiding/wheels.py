"""How wheels aid the bank: when which measurement is due, for which share, with which speed.

The answer of all shares together stands in the last group, see `vehicle.merge`. Shares that are silent, because their
IMU gives no data, neither measure nor are corrected; they are carried along with the vehicle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from polyins.aiding import reference_point, standstill, vehicle_attitude, wheel_speed
from polyins.kernels import bank, earth, fuse, joint, kalman, share, strapdown, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, kernel
from polyins.kernels.share import STATES, STRIDE

SPEED, POINT, ZERO_VELOCITY, ZERO_RATE = 0.0, 1.0, 2.0, 3.0
"""Kinds of measurement, which stand in `Rolling.given`: as arguments they would be compiled one by one."""

# places in `Rolling.settings`
SPEED_INTERVAL, SPEED_WINDOW, POINT_INTERVAL, AT_END, STANDSTILL = range(5)
POINT_VARIANCE, ZERO_VELOCITY_VARIANCE, ZERO_RATE_VARIANCE, STILL_RATE = range(5, 9)
SETTINGS = 9

# places in `Rolling.memory`
LAST_SPEED, LAST_POINT, OPENED, WATCHED, TRAVEL, LATERAL, STILL = range(7)
MEMORY = 7

# places in `Rolling.given`
KIND, G_SPEED, G_LATERAL, G_DURATION, G_DT = range(5)
G_KNOWN, G_POINT, G_VARIANCE, G_METRES = 5, 8, 11, 14
GIVEN = 17

STILL_SPEED = 0.01
"""m/s"""

LISTEN = 0.5
"""s, from when a wheel's data are back until it speaks: about a turn of the wheel"""

RESEED_POSITION, RESEED_VELOCITY, RESEED_TILT, RESEED_HEADING = 0.1, 0.2, 0.1, 0.02
"""Standard deviations of a share that speaks again: m, m/s, rad, rad."""


class Rolling(NamedTuple):
    """What a run with wheels is told, and what it remembers of them."""

    lenders: Array
    """int64 (shares,): the share that lends roll and pitch; -1: none, or on the body"""
    noise: Array
    """(shares, 3): variances of the velocity, (m/s)^2 forward, right, down"""
    settings: Array
    antenna: Array
    """m, in vehicle axes"""
    travel: Array
    """(T, 2): m that the wheels rolled in the interval that ends at each epoch, NaN where none speaks; m to the right
    of the axle's middle, the mean place of the wheels that speak"""
    present: Array
    """uint8 (T, shares): whether the IMUs of a share give data; (0, shares): they always do"""
    drift: Array
    """(shares, 3): growth of the variances of the mounting states per second"""
    memory: Array
    silent: Array
    """(shares,): since when, s; below zero: not silent"""
    back: Array
    """(shares,): since when a silent one has data again, s; below zero: not"""
    given: Array
    """what the measurement that is being applied needs"""


class Joint(NamedTuple):
    """The covariance of all shares together and its work arrays, see `kernels.joint`."""

    whole: Array
    h: Array
    hp: Array
    gain: Array
    ah: Array
    rows: Array
    """(shares, 3, .): design matrices of one epoch's measurements"""
    learned: Array
    """what they have taught so far, the error states"""
    z: Array
    work: Array


@kernel
def settle(blocks: Array, groups: Array, members: Array, rolling: Rolling, dt: float) -> None:
    """Bring everything that follows from the navigation states up to date."""
    for b in range(blocks.shape[0]):
        strapdown.update_matrix(blocks[b])
        strapdown.update_sensitivity(blocks[b])
    fuse.fuse_shares(blocks, groups, members, dt)
    vehicle.merge(blocks, groups, members, rolling.lenders, rolling.silent)


@kernel
def _residual(w: Array, lane: int, lent: vehicle.Matrix, rolling: Rolling, near: Array) -> vehicle.Three:
    given = rolling.given
    kind = given[KIND]
    if kind == SPEED:
        if rolling.settings[AT_END] != 0.0:
            return wheel_speed.residual_at_end(w, lane, lent, given[G_LATERAL], given[G_SPEED], given[G_DT])
        return wheel_speed.residual_of_window(w, lane, given[G_SPEED], given[G_DURATION])
    if kind == POINT:
        known, point = given[G_KNOWN : G_KNOWN + 3], given[G_POINT : G_POINT + 3]
        metres = given[G_METRES : G_METRES + 3]
        return reference_point.residual(w, lane, lent, point, known, metres, near[0] != 0.0)
    if kind == ZERO_VELOCITY:
        return standstill.velocity_residual(w, lane)
    return standstill.rate_residual(w, lane, given[G_DURATION])


@kernel
def _design(g: Array, w: Array, lane: int, rolling: Rolling, m: Array) -> None:
    given = rolling.given
    kind = given[KIND]
    if kind == SPEED:
        wheel_speed.design(g, w, lane, given[G_LATERAL], given[G_SPEED], m)
    elif kind == POINT:
        reference_point.design(g, w, lane, given[G_POINT : G_POINT + 3], m)
    elif kind == ZERO_VELOCITY:
        standstill.velocity_design(m)
    else:
        standstill.rate_design(g, m)


@kernel
def measure(s: int, blocks: Array, groups: Array, members: Array, near: Array, rolling: Rolling, m: Array) -> None:
    """Write design matrix, variances and residuals of a share: each member's own, and their mean."""
    kind = rolling.given[KIND]
    g = groups[s]
    first, last = members[s, 0], members[s, 1]
    w, lane = blocks[first // LANES], first % LANES
    metres = rolling.given[G_METRES : G_METRES + 3]
    earth.metric(g[share.POSITION : share.POSITION + 3], near[0] != 0.0, metres)
    _design(g, w, lane, rolling, m)
    if kind in (SPEED, POINT):
        vehicle_attitude.add_own(g, w, lane, m)
    lent = vehicle.lent_matrix(groups, rolling.lenders[s])
    for a in range(3):
        m[kalman.R + a] = rolling.noise[s, a] if kind == SPEED else rolling.given[G_VARIANCE + a]
        m[kalman.RESIDUAL + a] = 0.0
    for i in range(first, last):
        z = _residual(blocks[i // LANES], i % LANES, lent, rolling, near)
        for a in range(3):
            blocks[i // LANES, bank.RESIDUAL + a * LANES + i % LANES] = z[a]
            m[kalman.RESIDUAL + a] += z[a] / (last - first)


@kernel
def _feed_back(s: int, blocks: Array, groups: Array, members: Array, near: Array) -> None:
    g = groups[s]
    metres = g[share.METRIC : share.METRIC + 3]
    earth.metric(g[share.POSITION : share.POSITION + 3], near[0] != 0.0, metres)
    fuse.correct_members(blocks, members[s, 0], members[s, 1], metres)


@kernel
def correct_each(
    blocks: Array, groups: Array, members: Array, measurements: Array, near: Array, rolling: Rolling, dt: float
) -> None:
    """Apply what was measured and whose gain is known to every share that is not silent."""
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            m = measurements[s]
            kalman.update_covariance(groups[s], m)
            for i in range(members[s, 0], members[s, 1]):
                _member_correction(blocks[i // LANES], i % LANES, m)
            _feed_back(s, blocks, groups, members, near)
    settle(blocks, groups, members, rolling, dt)


@kernel
def _member_correction(w: Array, lane: int, m: Array) -> None:
    z0, z1, z2 = w[bank.RESIDUAL + lane], w[bank.RESIDUAL + LANES + lane], w[bank.RESIDUAL + 2 * LANES + lane]
    for k in range(STATES):
        r = kalman.K + kalman.ROWS * k
        w[bank.CORRECTION + k * LANES + lane] = m[r] * z0 + m[r + 1] * z1 + m[r + 2] * z2


@kernel
def _aid_each(
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    dt: float,
) -> None:
    """One measurement of every share, paper B's distributed filter."""
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            measure(s, blocks, groups, members, near, rolling, measurements[s])
            kalman.gain(groups[s], measurements[s])
    correct_each(blocks, groups, members, measurements, near, rolling, dt)


@kernel
def add_rows(s: int, sign: float, groups: Array, rolling: Rolling, m: Array, h: Array) -> None:
    """Add the design matrix of a share, and of the one that lends to it, to that of all states."""
    for a in range(3):
        for k in range(STATES):
            h[a, s * STATES + k] += sign * m[kalman.H + a * STRIDE + k]
    lender = rolling.lenders[s]
    if lender >= 0:
        vehicle_attitude.write_lent(groups, s, lender, m)
        for a in range(3):
            for k in range(STATES):
                h[a, lender * STATES + k] += sign * m[kalman.LENT + a * STRIDE + k]


@kernel
def _teach_all(
    measured: int, z: Array, blocks: Array, members: Array, rolling: Rolling, joined: Joint, m: Array
) -> None:
    """Update the joined covariance and add to every member's correction; the gain of all states is known.

    `z` is the residual. A member of the share `measured` differs from its mean by its own.
    """
    for s in range(members.shape[0]):
        if rolling.silent[s] >= 0.0:
            joined.gain[:, s * STATES : (s + 1) * STATES] = 0.0
    joint.update(joined.h, m[kalman.R : kalman.R + 3], joined.whole, joined.hp, joined.gain, joined.ah)
    k = joined.gain
    for s in range(members.shape[0]):
        if rolling.silent[s] >= 0.0:
            continue
        for n in range(STATES):
            j = s * STATES + n
            joined.learned[j] += k[0, j] * z[0] + k[1, j] * z[1] + k[2, j] * z[2]
        for i in range(members[s, 0], members[s, 1]):
            w, lane = blocks[i // LANES], i % LANES
            z0, z1, z2 = z[0], z[1], z[2]
            if s == measured:
                z0 += w[bank.RESIDUAL + lane] - m[kalman.RESIDUAL]
                z1 += w[bank.RESIDUAL + LANES + lane] - m[kalman.RESIDUAL + 1]
                z2 += w[bank.RESIDUAL + 2 * LANES + lane] - m[kalman.RESIDUAL + 2]
            for n in range(STATES):
                j = s * STATES + n
                w[bank.CORRECTION + n * LANES + lane] += k[0, j] * z0 + k[1, j] * z1 + k[2, j] * z2


@kernel
def _begin_teaching(blocks: Array, groups: Array, members: Array, joined: Joint) -> None:
    joint.gather(groups, members.shape[0], joined.whole)
    joined.learned[:] = 0.0
    for b in range(blocks.shape[0]):
        blocks[b, bank.CORRECTION : bank.CORRECTION + STATES * LANES] = 0.0


@kernel
def _end_teaching(
    blocks: Array, groups: Array, members: Array, near: Array, rolling: Rolling, joined: Joint, dt: float
) -> None:
    joint.scatter(groups, members.shape[0], joined.whole)
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            _feed_back(s, blocks, groups, members, near)
    settle(blocks, groups, members, rolling, dt)


@kernel
def _aid_all(
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint,
    dt: float,
) -> None:
    """One measurement of every share, or of the differences of their points, as if all were one.

    All are measured at the same states and then applied one after the other, each residual less what those before it
    have taught.
    """
    pairs = rolling.given[KIND] == POINT
    _begin_teaching(blocks, groups, members, joined)
    joined.rows[:] = 0.0
    for s in range(members.shape[0]):
        if _speaks(s, rolling):
            measure(s, blocks, groups, members, near, rolling, measurements[s])
            add_rows(s, 1.0, groups, rolling, measurements[s], joined.rows[s])
    before = -1
    for s in range(members.shape[0]):
        if not _speaks(s, rolling):
            continue
        m = measurements[s]
        if not pairs or before >= 0:
            for a in range(3):
                joined.z[a] = m[kalman.RESIDUAL + a]
                for j in range(joined.h.shape[1]):
                    joined.h[a, j] = joined.rows[s, a, j]
                if pairs:
                    joined.z[a] -= measurements[before, kalman.RESIDUAL + a]
                    for j in range(joined.h.shape[1]):
                        joined.h[a, j] -= joined.rows[before, a, j]
                for j in range(joined.h.shape[1]):
                    joined.z[a] -= joined.h[a, j] * joined.learned[j]
            joint.gain(joined.h, m[kalman.R : kalman.R + 3], joined.whole, joined.hp, joined.gain, m)
            _teach_all(-1 if pairs else s, joined.z, blocks, members, rolling, joined, m)
        before = s
    _end_teaching(blocks, groups, members, near, rolling, joined, dt)


@kernel
def _speaks(s: int, rolling: Rolling) -> bool:
    """Whether neither the share is silent nor the one that lends roll and pitch to it."""
    lender = rolling.lenders[s]
    if lender >= 0 and rolling.silent[lender] >= 0.0:
        return False
    speaks: bool = rolling.silent[s] < 0.0
    return speaks


@kernel
def _aid(
    kind: float,
    variance: float,
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint | None,
    dt: float,
) -> None:
    rolling.given[KIND] = kind
    for a in range(3):
        rolling.given[G_VARIANCE + a] = variance
        rolling.given[G_KNOWN + a] = groups[-1, share.POSITION + a]
        rolling.given[G_POINT + a] = 0.0
    if joined is None:
        _aid_each(blocks, groups, members, measurements, near, rolling, dt)
    else:
        _aid_all(blocks, groups, members, measurements, near, rolling, joined, dt)


@kernel
def _stands(blocks: Array, members: Array, rolling: Rolling, duration: float) -> bool:
    """Whether no wheel has rolled and no IMU that speaks has turned during the window."""
    limit = rolling.settings[STILL_RATE] * duration
    if not abs(rolling.memory[TRAVEL]) < STILL_SPEED * duration:
        return False
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            w, t = blocks[members[s, 0] // LANES], bank.TURNED + members[s, 0] % LANES
            if w[t] ** 2 + w[t + LANES] ** 2 + w[t + 2 * LANES] ** 2 > limit * limit:
                return False
    return True


@kernel
def _end_window(
    now: float,
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint | None,
    dt: float,
) -> None:
    """Update by what was watched: a speed, or a standstill."""
    memory, given, settings = rolling.memory, rolling.given, rolling.settings
    duration = now - memory[OPENED]
    given[G_DURATION], given[G_DT] = duration, dt
    given[G_SPEED] = memory[TRAVEL] / duration
    given[G_LATERAL] = memory[LATERAL]
    since = now - memory[LAST_SPEED]
    for s in range(members.shape[0]):
        for k in range(3):
            groups[s, share.P + (share.INERTIAL + k) * (STRIDE + 1)] += since * rolling.drift[s, k]
    memory[LAST_SPEED] = now
    still = settings[STANDSTILL] != 0.0 and _stands(blocks, members, rolling, duration)
    memory[STILL] += since if still else 0.0
    if still:
        # the rate was watched with the errors as they still are
        variance = settings[ZERO_RATE_VARIANCE]
        _aid(ZERO_RATE, variance, blocks, groups, members, measurements, near, rolling, joined, dt)
        variance = settings[ZERO_VELOCITY_VARIANCE]
        _aid(ZERO_VELOCITY, variance, blocks, groups, members, measurements, near, rolling, joined, dt)
    elif math.isfinite(given[G_SPEED]):
        _aid(SPEED, 0.0, blocks, groups, members, measurements, near, rolling, joined, dt)


@kernel
def watch(k: int, fraction: float, blocks: Array, groups: Array, members: Array, rolling: Rolling, dt: float) -> None:
    """Add what was travelled in the last `dt` seconds, this fraction of epoch k, where a speed is being taken."""
    memory = rolling.memory
    if memory[WATCHED] < 0.0:
        return
    memory[WATCHED] += fraction
    memory[TRAVEL] += fraction * rolling.travel[k, 0]
    for s in range(members.shape[0]):
        lent = vehicle.lent_matrix(groups, rolling.lenders[s])
        for i in range(members[s, 0], members[s, 1] if rolling.silent[s] < 0.0 else 0):
            wheel_speed.watch(blocks[i // LANES], i % LANES, lent, memory[LATERAL], dt)


@kernel
def open_window(now: float, lateral: float, blocks: Array, groups: Array, members: Array, rolling: Rolling) -> None:
    """Begin to take a speed."""
    memory = rolling.memory
    memory[WATCHED] = memory[TRAVEL] = 0.0
    memory[OPENED], memory[LATERAL] = now, lateral
    for s in range(members.shape[0]):
        lent = vehicle.lent_matrix(groups, rolling.lenders[s])
        for i in range(members[s, 0], members[s, 1] if rolling.silent[s] < 0.0 else 0):
            wheel_speed.open_window(blocks[i // LANES], i % LANES, lent, lateral)


@kernel
def step(
    k: int,
    now: float,
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint | None,
    dt: float,
    interval: float,
) -> None:
    """Do what is due at epoch k, at time `now`; `dt` is the part of its interval that was navigated last."""
    memory, settings = rolling.memory, rolling.settings
    half = 0.5 * interval
    if memory[WATCHED] > 0.0 and now - memory[LAST_SPEED] >= settings[SPEED_INTERVAL] - half:
        _end_window(now, blocks, groups, members, measurements, near, rolling, joined, dt)
        memory[WATCHED] = -1.0
    if memory[WATCHED] < 0.0 and now - memory[LAST_SPEED] >= settings[SPEED_INTERVAL] - settings[SPEED_WINDOW] - half:
        open_window(now, rolling.travel[k, 1], blocks, groups, members, rolling)
    if members.shape[0] > 1 and now - memory[LAST_POINT] >= settings[POINT_INTERVAL] - half:
        memory[LAST_POINT] = now
        variance = settings[POINT_VARIANCE]
        _aid(POINT, variance, blocks, groups, members, measurements, near, rolling, joined, dt)


@kernel
def fall_silent(k: int, now: float, rolling: Rolling) -> None:
    """Note which shares give no data in epoch k, which begins at `now`, before it is navigated."""
    if rolling.present.shape[0] > 0:
        for s in range(rolling.silent.shape[0]):
            if rolling.present[k, s] == 0:
                rolling.back[s] = -1.0
                if rolling.silent[s] < 0.0:
                    rolling.silent[s] = now
                    rolling.memory[WATCHED] = -1.0


@kernel
def carry(
    k: int,
    now: float,
    blocks: Array,
    groups: Array,
    members: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint | None,
    dt: float,
) -> None:
    """Carry silent shares along with the vehicle, and let those speak again whose data are back.

    How far a wheel turned in the meantime is known roughly. So an IMU on a wheel listens for a while before it speaks:
    the force that it feels, on average gravity and the vehicle's acceleration, says at which angle it really is.
    """
    _coast(groups, rolling.silent, near, dt)
    for s in range(members.shape[0]):
        first, last = members[s, 0], members[s, 1]
        if rolling.present[k, s] == 0:
            for i in range(first, last):
                _place(blocks[i // LANES], i % LANES, groups[-1], rolling.travel[k, 0], dt)
        elif rolling.silent[s] >= 0.0:
            if rolling.back[s] < 0.0:
                rolling.back[s] = now
            listened = now - rolling.back[s]
            for i in range(first, last):
                _listen(blocks[i // LANES], i % LANES, groups[-1], listened, dt)
            if listened >= LISTEN or blocks[first // LANES, bank.WHEEL + first % LANES] == 0.0:
                for i in range(first, last):
                    _find_angle(blocks[i // LANES], i % LANES, groups[-1], listened)
                _reseed(s, groups, joined)
                rolling.silent[s] = -1.0
                rolling.memory[WATCHED] = -1.0
        if rolling.silent[s] >= 0.0:
            fuse.fuse_states(blocks, first, last, groups[s])


@kernel
def _place(w: Array, lane: int, merged: Array, travel: float, dt: float) -> None:
    """Put an IMU where the vehicle has it, and turn a wheel about its axle as far as it rolled."""
    v = vehicle.matrix_at(merged, share.VEHICLE)
    if w[bank.WHEEL + lane] == 0.0:
        vehicle.put_attitude(w, lane, v)
    else:
        forward = v[0] * merged[share.VELOCITY] + v[3] * merged[share.VELOCITY + 1] + v[6] * merged[share.VELOCITY + 2]
        rolled = travel if math.isfinite(travel) else forward * dt
        vehicle.put_attitude(w, lane, vehicle.wheel_turned(w, lane, v, -rolled / w[bank.WHEEL + lane]))
    _join(w, lane, merged, v)


@kernel
def _join(w: Array, lane: int, merged: Array, v: vehicle.Matrix) -> None:
    """Give an IMU the position and the velocity that the vehicle has there."""
    c = vehicle.lane_matrix(w, bank.MATRIX + lane)
    ln, le, ld = vehicle.rotated(c, *vehicle.lever_to_wheel(w, lane))
    p = bank.IN_VEHICLE + lane
    pn, pe, pd = vehicle.rotated(v, w[p], w[p + LANES], w[p + 2 * LANES])
    w[bank.POSITION + lane] = merged[share.POSITION] + (pn - ln) * w[bank.TO_LATITUDE + lane]
    w[bank.POSITION + LANES + lane] = merged[share.POSITION + 1] + (pe - le) * w[bank.TO_LONGITUDE + lane]
    w[bank.POSITION + 2 * LANES + lane] = merged[share.POSITION + 2] - (pd - ld)
    for k in range(3):
        w[bank.VELOCITY + k * LANES + lane] = merged[share.VELOCITY + k]


@kernel
def _listen(w: Array, lane: int, merged: Array, listened: float, dt: float) -> None:
    """Turn an IMU on a wheel with its own data, the axle kept, and add up the force that it feels, in n."""
    v = vehicle.matrix_at(merged, share.VEHICLE)
    if w[bank.WHEEL + lane] == 0.0:
        vehicle.put_attitude(w, lane, v)
    else:
        vehicle.put_attitude(w, lane, vehicle.wheel_turned(w, lane, v, 0.0))
    _join(w, lane, merged, v)
    # less what it feels for being off the wheel's centre
    x, y, z = w[bank.DTHETA + lane] / dt, w[bank.DTHETA + LANES + lane] / dt, w[bank.DTHETA + 2 * LANES + lane] / dt
    outward = vehicle.cross(x, y, z, *vehicle.cross(x, y, z, *vehicle.lever_to_wheel(w, lane)))
    felt = vehicle.rotated(vehicle.lane_matrix(w, bank.AT_MATRIX + lane), outward[0], outward[1], outward[2])
    for k in range(3):
        if listened == 0.0:
            w[bank.TRAVELLED + k * LANES + lane] = 0.0
            w[bank.BEFORE_VELOCITY + k * LANES + lane] = merged[share.VELOCITY + k]
        else:
            w[bank.TRAVELLED + k * LANES + lane] += w[bank.DVEL_N + k * LANES + lane] + felt[k] * dt


@kernel
def _find_angle(w: Array, lane: int, merged: Array, listened: float) -> None:
    """Turn an IMU on a wheel about the axle until the force that it felt is gravity and the vehicle's acceleration."""
    if w[bank.WHEEL + lane] == 0.0:
        return
    v = vehicle.matrix_at(merged, share.VEHICLE)
    # forward and down, which the axle is perpendicular to
    fn, fe, fd = w[bank.TRAVELLED + lane], w[bank.TRAVELLED + LANES + lane], w[bank.TRAVELLED + 2 * LANES + lane]
    an = merged[share.VELOCITY] - w[bank.BEFORE_VELOCITY + lane]
    ae = merged[share.VELOCITY + 1] - w[bank.BEFORE_VELOCITY + LANES + lane]
    ad = merged[share.VELOCITY + 2] - w[bank.BEFORE_VELOCITY + 2 * LANES + lane] - w[bank.GRAVITY + lane] * listened
    felt_x, _, felt_z = vehicle.rotated_back(v, fn, fe, fd)
    true_x, _, true_z = vehicle.rotated_back(v, an, ae, ad)
    # about y, which turns z to x
    angle = math.atan2(true_x, true_z) - math.atan2(felt_x, felt_z)
    vehicle.put_attitude(w, lane, vehicle.wheel_turned(w, lane, v, angle))
    _join(w, lane, merged, v)


@kernel
def _coast(groups: Array, silent: Array, near: Array, dt: float) -> None:
    """With every share silent the vehicle goes on as it went."""
    for s in range(silent.shape[0]):
        if silent[s] < 0.0:
            return
    merged = groups[-1]
    metres = merged[share.METRIC : share.METRIC + 3]
    earth.metric(merged[share.POSITION : share.POSITION + 3], near[0] != 0.0, metres)
    for k in range(3):
        merged[share.POSITION + k] += merged[share.VELOCITY + k] * dt / metres[k]


@kernel
def _reseed(s: int, groups: Array, joined: Joint | None) -> None:
    """Begin anew with what the vehicle says of a share; what is known of its IMU's errors stays."""
    g = groups[s]
    share.complete(g)
    for i in range(share.NAV):
        for j in range(STATES):
            g[share.P + i * STRIDE + j] = 0.0
            g[share.P + j * STRIDE + i] = 0.0
    for k in range(3):
        g[share.P + k * (STRIDE + 1)] = RESEED_POSITION**2
        g[share.P + (3 + k) * (STRIDE + 1)] = RESEED_VELOCITY**2
        g[share.P + (6 + k) * (STRIDE + 1)] = RESEED_HEADING**2 if k == 2 else RESEED_TILT**2
    if joined is not None:
        for i in range(share.NAV):
            for j in range(joined.whole.shape[0]):
                joined.whole[s * STATES + i, j] = 0.0
                joined.whole[j, s * STATES + i] = 0.0


@kernel
def measure_position_each(
    fix: Array, blocks: Array, groups: Array, members: Array, measurements: Array, near: Array, rolling: Rolling
) -> float:
    """Measure a GNSS position with every share that is not silent; return the mean of their NIS."""
    _know(fix, rolling)
    total, speaking = 0.0, 0
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            measure(s, blocks, groups, members, near, rolling, measurements[s])
            kalman.gain(groups[s], measurements[s])
            total += kalman.normalized_innovation_squared(measurements[s])
            speaking += 1
    return total / max(speaking, 1)


@kernel
def measure_position_all(
    fix: Array,
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint,
) -> float:
    """Measure a GNSS position with the mean of what all shares predict, since its noise is one; return the NIS."""
    _know(fix, rolling)
    _begin_teaching(blocks, groups, members, joined)
    joined.h[:] = 0.0
    speaking = 0
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            speaking += 1
    m = measurements[0]
    z0, z1, z2 = 0.0, 0.0, 0.0
    for s in range(members.shape[0]):
        if rolling.silent[s] < 0.0:
            measure(s, blocks, groups, members, near, rolling, m)
            add_rows(s, 1.0 / speaking, groups, rolling, m, joined.h)
            z0 += m[kalman.RESIDUAL] / speaking
            z1 += m[kalman.RESIDUAL + 1] / speaking
            z2 += m[kalman.RESIDUAL + 2] / speaking
    m[kalman.RESIDUAL], m[kalman.RESIDUAL + 1], m[kalman.RESIDUAL + 2] = z0, z1, z2
    joint.gain(joined.h, fix[3:6], joined.whole, joined.hp, joined.gain, m)
    return kalman.normalized_innovation_squared(m)


@kernel
def measure_position(
    fix: Array,
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint | None,
) -> float:
    """Measure a GNSS position; return the NIS."""
    if joined is None:
        return measure_position_each(fix, blocks, groups, members, measurements, near, rolling)
    return measure_position_all(fix, blocks, groups, members, measurements, near, rolling, joined)


@kernel
def _know(fix: Array, rolling: Rolling) -> None:
    rolling.given[KIND] = POINT
    for a in range(3):
        rolling.given[G_KNOWN + a] = fix[a]
        rolling.given[G_VARIANCE + a] = fix[3 + a]
        rolling.given[G_POINT + a] = rolling.antenna[a]


@kernel
def correct_by_position(
    blocks: Array,
    groups: Array,
    members: Array,
    measurements: Array,
    near: Array,
    rolling: Rolling,
    joined: Joint | None,
    now: float,
    dt: float,
) -> None:
    """Apply the GNSS position that was measured."""
    if joined is None:
        correct_each(blocks, groups, members, measurements, near, rolling, dt)
    else:
        m = measurements[0]
        _teach_all(-1, m[kalman.RESIDUAL : kalman.RESIDUAL + 3], blocks, members, rolling, joined, m)
        _end_teaching(blocks, groups, members, near, rolling, joined, dt)
    # what was watched before the states were corrected does not fit them any more
    if rolling.memory[WATCHED] >= 0.0:
        open_window(now, rolling.memory[LATERAL], blocks, groups, members, rolling)
