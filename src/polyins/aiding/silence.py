"""Shares whose IMUs give no data: they neither measure nor are corrected, but are moved along with the vehicle.

The answer of all shares together stands in the last group, see `vehicle.merge`.
"""

from __future__ import annotations

import math

from polyins.aiding.rolling import FILLED, Joint, Rolling
from polyins.kernels import bank, earth, fuse, share, vehicle
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.kernels.share import STATES, STRIDE

REALIGNMENT = 0.5
"""s, from when a wheel's data are back until it measures again: about a turn of the wheel"""

RESEED_POSITION, RESEED_VELOCITY, RESEED_TILT, RESEED_HEADING = 0.1, 0.2, 0.1, 0.02
"""Standard deviations of a share that measures again: m, m/s, rad, rad."""


@scalar_kernel
def note_silence(k: int, now: float, rolling: Rolling) -> None:
    """Note which shares give no data in epoch k, which begins at `now`, before it is navigated."""
    if rolling.present.shape[0] > 0:
        for s in range(rolling.silent.shape[0]):
            if rolling.present[k, s] == 0:
                rolling.returned[s] = -1.0
                if rolling.silent[s] < 0.0:
                    rolling.silent[s] = now
                    rolling.memory[FILLED] = -1.0


@scalar_kernel
def move_silent(
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
    """Move silent shares along with the vehicle, and let those measure again whose data are back.

    How far a wheel turned in the meantime is known roughly. So the angle of an IMU on a wheel is aligned first: the
    mean force over a while, gravity and the vehicle's acceleration, says what it really is.
    """
    _coast(groups, rolling.silent, near, dt)
    for s in range(members.shape[0]):
        first, last = members[s, 0], members[s, 1]
        if rolling.present[k, s] == 0:
            for i in range(first, last):
                _place_on_vehicle(blocks[i // LANES], i % LANES, groups[-1], rolling.travel[k, 0], dt)
        elif rolling.silent[s] >= 0.0:
            if rolling.returned[s] < 0.0:
                rolling.returned[s] = now
            elapsed = now - rolling.returned[s]
            for i in range(first, last):
                _add_force(blocks[i // LANES], i % LANES, groups[-1], elapsed, dt)
            if elapsed >= REALIGNMENT or blocks[first // LANES, bank.WHEEL + first % LANES] == 0.0:
                for i in range(first, last):
                    _align_angle(blocks[i // LANES], i % LANES, groups[-1], elapsed)
                _reseed(s, groups, joined)
                rolling.silent[s] = -1.0
                rolling.memory[FILLED] = -1.0
        if rolling.silent[s] >= 0.0:
            fuse.fuse_states(blocks, first, last, groups[s])


@scalar_kernel
def _place_on_vehicle(w: Array, lane: int, merged: Array, travel: float, dt: float) -> None:
    """Put an IMU where the vehicle has it, and turn a wheel about its axle as far as it rolled."""
    v = vehicle.matrix_at(merged, share.VEHICLE)
    if w[bank.WHEEL + lane] == 0.0:
        vehicle.put_attitude(w, lane, v)
    else:
        forward = v[0] * merged[share.VELOCITY] + v[3] * merged[share.VELOCITY + 1] + v[6] * merged[share.VELOCITY + 2]
        rolled = travel if math.isfinite(travel) else forward * dt
        vehicle.put_attitude(w, lane, vehicle.wheel_turned(w, lane, v, -rolled / w[bank.WHEEL + lane]))
    _move_with_vehicle(w, lane, merged, v)


@scalar_kernel
def _move_with_vehicle(w: Array, lane: int, merged: Array, v: vehicle.Matrix) -> None:
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


@scalar_kernel
def _add_force(w: Array, lane: int, merged: Array, elapsed: float, dt: float) -> None:
    """Turn an IMU on a wheel with its own data, the axle kept, and add up the force that it feels, in n."""
    v = vehicle.matrix_at(merged, share.VEHICLE)
    if w[bank.WHEEL + lane] == 0.0:
        vehicle.put_attitude(w, lane, v)
    else:
        vehicle.put_attitude(w, lane, vehicle.wheel_turned(w, lane, v, 0.0))
    _move_with_vehicle(w, lane, merged, v)
    # less what it feels for being off the wheel's centre
    x, y, z = w[bank.DTHETA + lane] / dt, w[bank.DTHETA + LANES + lane] / dt, w[bank.DTHETA + 2 * LANES + lane] / dt
    outward = vehicle.cross(x, y, z, *vehicle.cross(x, y, z, *vehicle.lever_to_wheel(w, lane)))
    felt = vehicle.rotated(vehicle.lane_matrix(w, bank.AT_MATRIX + lane), outward[0], outward[1], outward[2])
    for k in range(3):
        if elapsed == 0.0:
            w[bank.TRAVELLED + k * LANES + lane] = 0.0
            w[bank.BEFORE_VELOCITY + k * LANES + lane] = merged[share.VELOCITY + k]
        else:
            w[bank.TRAVELLED + k * LANES + lane] += w[bank.DVEL_N + k * LANES + lane] + felt[k] * dt


@scalar_kernel
def _align_angle(w: Array, lane: int, merged: Array, elapsed: float) -> None:
    """Turn an IMU on a wheel about the axle until the force that it felt is gravity and the vehicle's acceleration."""
    if w[bank.WHEEL + lane] == 0.0:
        return
    v = vehicle.matrix_at(merged, share.VEHICLE)
    # forward and down, which the axle is perpendicular to
    fn, fe, fd = w[bank.TRAVELLED + lane], w[bank.TRAVELLED + LANES + lane], w[bank.TRAVELLED + 2 * LANES + lane]
    an = merged[share.VELOCITY] - w[bank.BEFORE_VELOCITY + lane]
    ae = merged[share.VELOCITY + 1] - w[bank.BEFORE_VELOCITY + LANES + lane]
    ad = merged[share.VELOCITY + 2] - w[bank.BEFORE_VELOCITY + 2 * LANES + lane] - w[bank.GRAVITY + lane] * elapsed
    felt_x, _, felt_z = vehicle.rotated_back(v, fn, fe, fd)
    true_x, _, true_z = vehicle.rotated_back(v, an, ae, ad)
    # about y, which turns z to x
    angle = math.atan2(true_x, true_z) - math.atan2(felt_x, felt_z)
    vehicle.put_attitude(w, lane, vehicle.wheel_turned(w, lane, v, angle))
    _move_with_vehicle(w, lane, merged, v)


@scalar_kernel
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


@scalar_kernel
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
