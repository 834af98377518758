"""The attitude of a vehicle as it follows from the IMUs on its wheels and body, and the middle of its rear axle.

v is forward-right-down. An IMU on a wheel has its x axis along the axle, to the right; what else it knows of the
vehicle's attitude is nothing, so roll and pitch are lent by an IMU on the body, or zero.
"""

from __future__ import annotations

import math

from polyins.kernels import bank, covariance, fuse
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel

Three = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]


@scalar_kernel
def turned_about_down(c: Matrix, x: float, y: float, n: float, e: float) -> Matrix:
    """Turn C_nv about the vertical until its vector with the horizontal parts (x, y) points along (n, e)."""
    scale = 1.0 / math.sqrt((n * n + e * e) * (x * x + y * y))
    cos = (n * x + e * y) * scale
    sin = (e * x - n * y) * scale
    return (
        cos * c[0] - sin * c[3],
        cos * c[1] - sin * c[4],
        cos * c[2] - sin * c[5],
        sin * c[0] + cos * c[3],
        sin * c[1] + cos * c[4],
        sin * c[2] + cos * c[5],
        c[6],
        c[7],
        c[8],
    )


@scalar_kernel
def turned_to_axle(lent: Matrix, n: float, e: float) -> Matrix:
    """Turn C_nv about the vertical until its axle points horizontally along (n, e).

    Exact for a tilted axle, whose heading is not that of the vehicle plus 90 degrees.
    """
    return turned_about_down(lent, lent[1], lent[4], n, e)


@scalar_kernel
def on_body(c: Matrix, pitch: float, yaw: float) -> Matrix:
    """C_nv = C_nb exp(m x)', m = (0, pitch, yaw) the small rotation that takes the IMU's axes to the vehicle's."""
    square = pitch * pitch + yaw * yaw
    if square == 0.0:
        return c
    angle = math.sqrt(square)
    s, k = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    cosine = 1.0 - k * square
    return (
        cosine * c[0] - s * yaw * c[1] + s * pitch * c[2],
        s * yaw * c[0] + (1.0 - k * yaw * yaw) * c[1] + k * pitch * yaw * c[2],
        -s * pitch * c[0] + k * pitch * yaw * c[1] + (1.0 - k * pitch * pitch) * c[2],
        cosine * c[3] - s * yaw * c[4] + s * pitch * c[5],
        s * yaw * c[3] + (1.0 - k * yaw * yaw) * c[4] + k * pitch * yaw * c[5],
        -s * pitch * c[3] + k * pitch * yaw * c[4] + (1.0 - k * pitch * pitch) * c[5],
        cosine * c[6] - s * yaw * c[7] + s * pitch * c[8],
        s * yaw * c[6] + (1.0 - k * yaw * yaw) * c[7] + k * pitch * yaw * c[8],
        -s * pitch * c[6] + k * pitch * yaw * c[7] + (1.0 - k * pitch * pitch) * c[8],
    )


@scalar_kernel
def matrix_at(block: Array, c: int) -> Matrix:
    """Return the matrix at an offset of a block."""
    return (
        block[c],
        block[c + 1],
        block[c + 2],
        block[c + 3],
        block[c + 4],
        block[c + 5],
        block[c + 6],
        block[c + 7],
        block[c + 8],
    )


@scalar_kernel
def put_matrix(block: Array, c: int, v: Matrix) -> None:
    """Write a matrix at an offset of a block."""
    (
        block[c],
        block[c + 1],
        block[c + 2],
        block[c + 3],
        block[c + 4],
        block[c + 5],
        block[c + 6],
        block[c + 7],
        block[c + 8],
    ) = v


@scalar_kernel
def lane_matrix(lanes: Array, c: int) -> Matrix:
    """Return the matrix of one IMU at an offset of its row, its lane included."""
    return (
        lanes[c],
        lanes[c + LANES],
        lanes[c + 2 * LANES],
        lanes[c + 3 * LANES],
        lanes[c + 4 * LANES],
        lanes[c + 5 * LANES],
        lanes[c + 6 * LANES],
        lanes[c + 7 * LANES],
        lanes[c + 8 * LANES],
    )


@scalar_kernel
def rotated(c: Matrix, x: float, y: float, z: float) -> Three:
    """C times a vector."""
    return c[0] * x + c[1] * y + c[2] * z, c[3] * x + c[4] * y + c[5] * z, c[6] * x + c[7] * y + c[8] * z


@scalar_kernel
def rotated_back(c: Matrix, n: float, e: float, d: float) -> Three:
    """C' times a vector."""
    return c[0] * n + c[3] * e + c[6] * d, c[1] * n + c[4] * e + c[7] * d, c[2] * n + c[5] * e + c[8] * d


@scalar_kernel
def cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> Three:
    """Return a x b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@scalar_kernel
def vehicle_matrix(lanes: Array, lane: int, lent: Matrix) -> Matrix:
    """C_nv as it follows from the attitude of one IMU."""
    c = lane_matrix(lanes, bank.MATRIX + lane)
    if lanes[bank.RADIUS + lane] != 0.0:
        return turned_to_axle(lent, c[0], c[3])
    return on_body(c, lanes[bank.MOUNT + lane], lanes[bank.MOUNT + LANES + lane])


@scalar_kernel
def lent_matrix(blocks: Array, lender: int) -> Matrix:
    """C_nv of the block that lends roll and pitch; level without one."""
    if lender < 0:
        return 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    return matrix_at(blocks[lender], covariance.VEHICLE)


@scalar_kernel
def update_attitudes(rows: Array, blocks: Array, spans: Array, lenders: Array) -> None:
    """Write C_nv of each block from its fused attitude; the blocks that lend come first in time, not in place."""
    for lending in (True, False):
        for s in range(spans.shape[0]):
            lanes, lane = rows[spans[s, 0] // LANES], spans[s, 0] % LANES
            if (lanes[bank.RADIUS + lane] == 0.0) == lending:
                block = blocks[s]
                c = matrix_at(block, covariance.MATRIX)
                if lending:
                    v = on_body(c, lanes[bank.MOUNT + lane], lanes[bank.MOUNT + LANES + lane])
                else:
                    v = turned_to_axle(lent_matrix(blocks, lenders[s]), c[0], c[3])
                put_matrix(block, covariance.VEHICLE, v)


@scalar_kernel
def lever_to_wheel(lanes: Array, lane: int) -> Three:
    """From the IMU to the centre of its wheel, as estimated, m, in its axes; zero on the body."""
    if lanes[bank.RADIUS + lane] == 0.0:
        return 0.0, 0.0, 0.0
    return (
        lanes[bank.TO_WHEEL + lane],
        lanes[bank.TO_WHEEL + LANES + lane] + lanes[bank.MOUNT + lane],
        lanes[bank.TO_WHEEL + 2 * LANES + lane] + lanes[bank.MOUNT + LANES + lane],
    )


@scalar_kernel
def lever_to_speed(lanes: Array, lane: int, x: float, y: float, z: float, lateral: float) -> Three:
    """From the place (x, y, z) in the vehicle to the point whose speed the wheels give, in the axes of the IMU.

    That point is `lateral` m to the right in the rear axle. The axle of a wheel is the x axis of its IMU, so the spin
    does not move a point on it.
    """
    if lanes[bank.RADIUS + lane] == 0.0:
        return -x, lateral - y, -z
    lx, ly, lz = lever_to_wheel(lanes, lane)
    return lx + lateral - y, ly, lz


@scalar_kernel
def merge(rows: Array, blocks: Array, spans: Array, lenders: Array) -> None:
    """Write position and velocity of the vehicle's origin, and its attitude, into the last block.

    Position and velocity are means over the blocks that count. Where some of them spin, the heading is their mean
    direction and roll and pitch are lent; where none does, the attitude is their mean. Paper A (15)-(17); paper B
    (7)-(8), with all IMUs in one frame. A bank of one block that fuses at the origin is merged already.
    """
    if blocks.shape[0] == spans.shape[0]:
        return
    update_attitudes(rows, blocks, spans, lenders)
    counting = 0
    for s in range(spans.shape[0]):
        if blocks[s, covariance.COUNTS] != 0.0:
            counting += 1
    if counting == 0:
        return
    merged = blocks[-1]
    for k in range(6):
        merged[covariance.POSITION + k] = 0.0
    q0, q1, q2, q3 = 0.0, 0.0, 0.0, 0.0
    forward_n, forward_e = 0.0, 0.0
    base, lender, spinning = -1, -1, False
    for s in range(spans.shape[0]):
        block = blocks[s]
        if block[covariance.COUNTS] == 0.0:
            continue
        lanes, lane = rows[spans[s, 0] // LANES], spans[s, 0] % LANES
        spins = lanes[bank.RADIUS + lane] != 0.0
        if base < 0:
            base = s
        if lender < 0 and (not spins or lenders[s] >= 0):
            lender = lenders[s] if spins else s
        spinning = spinning or spins
        v = matrix_at(block, covariance.VEHICLE)
        c = matrix_at(block, covariance.MATRIX)
        pn, pe, pd = rotated(v, block[covariance.PLACE], block[covariance.PLACE + 1], block[covariance.PLACE + 2])
        rn, re, rd = rotated(c, block[covariance.RATE], block[covariance.RATE + 1], block[covariance.RATE + 2])
        rn -= lanes[bank.EARTH_RATE + lane]
        rd -= lanes[bank.EARTH_RATE + LANES + lane]
        ln, le, ld = -pn, -pe, -pd
        un, ue, ud = block[covariance.VELOCITY], block[covariance.VELOCITY + 1], block[covariance.VELOCITY + 2]
        if spins:
            x, y, z = lever_to_wheel(lanes, lane)
            wn, we, wd = rotated(c, x, y, z)
            ln, le, ld = ln + wn, le + we, ld + wd
            an, ae, ad = cross(rn, re, rd, wn, we, wd)
            un, ue, ud = un + an, ue + ae, ud + ad
            spin = rn * c[0] + re * c[3] + rd * c[6]
            rn, re, rd = rn - spin * c[0], re - spin * c[3], rd - spin * c[6]
        bn, be, bd = cross(rn, re, rd, pn, pe, pd)
        merged[covariance.POSITION] += ln * lanes[bank.TO_LATITUDE + lane]
        merged[covariance.POSITION + 1] += le * lanes[bank.TO_LONGITUDE + lane]
        merged[covariance.POSITION + 2] -= ld
        merged[covariance.VELOCITY] += un - bn
        merged[covariance.VELOCITY + 1] += ue - be
        merged[covariance.VELOCITY + 2] += ud - bd
        block[covariance.FORWARD] = v[0] * (un - bn) + v[3] * (ue - be) + v[6] * (ud - bd)
        for k in range(3):
            merged[covariance.POSITION + k] += block[covariance.POSITION + k] - blocks[base, covariance.POSITION + k]
        q0 += block[covariance.QUATERNION]
        q1 += block[covariance.QUATERNION + 1]
        q2 += block[covariance.QUATERNION + 2]
        q3 += block[covariance.QUATERNION + 3]
        norm = 1.0 / math.sqrt(v[0] * v[0] + v[3] * v[3])
        forward_n += v[0] * norm
        forward_e += v[3] * norm
    for k in range(3):
        merged[covariance.POSITION + k] = (
            blocks[base, covariance.POSITION + k] + merged[covariance.POSITION + k] / counting
        )
        merged[covariance.VELOCITY + k] /= counting
    if spinning:
        lent = lent_matrix(blocks, lender)
        _put_merged(merged, turned_about_down(lent, lent[0], lent[3], forward_n, forward_e))
        return
    merged[covariance.QUATERNION], merged[covariance.QUATERNION + 1] = q0, q1
    merged[covariance.QUATERNION + 2], merged[covariance.QUATERNION + 3] = q2, q3
    fuse.normalize(merged)
    fuse.quaternion_to_matrix(merged, covariance.QUATERNION, covariance.MATRIX)
    lanes, lane = rows[spans[base, 0] // LANES], spans[base, 0] % LANES
    pitch, yaw = lanes[bank.MOUNT + lane], lanes[bank.MOUNT + LANES + lane]
    if pitch != 0.0 or yaw != 0.0:
        _put_merged(merged, on_body(matrix_at(merged, covariance.MATRIX), pitch, yaw))
    for k in range(9):
        merged[covariance.VEHICLE + k] = merged[covariance.MATRIX + k]


@scalar_kernel
def _put_merged(merged: Array, v: Matrix) -> None:
    put_matrix(merged, covariance.MATRIX, v)
    put_matrix(merged, covariance.VEHICLE, v)
    # of the two quaternions the one whose scalar part, or near the half turn the vertical one, is positive
    reference = (1.0, 0.0, 0.0, 0.0) if v[0] + v[4] + v[8] > 0.0 else (0.0, 0.0, 0.0, 1.0)
    q = quaternion(v, reference)
    for k in range(4):
        merged[covariance.QUATERNION + k] = q[k]


@scalar_kernel
def wheel_turned(lanes: Array, lane: int, v: Matrix, angle: float) -> Matrix:
    """Return C_nb of an IMU on a wheel whose axle is that of the vehicle, turned about it from where it was."""
    xn, xe, xd = v[1], v[4], v[7]
    yn, ye, yd = (
        lanes[bank.MATRIX + LANES + lane],
        lanes[bank.MATRIX + 4 * LANES + lane],
        lanes[bank.MATRIX + 7 * LANES + lane],
    )
    along = yn * xn + ye * xe + yd * xd
    yn, ye, yd = yn - along * xn, ye - along * xe, yd - along * xd
    norm = 1.0 / math.sqrt(yn * yn + ye * ye + yd * yd)
    yn, ye, yd = yn * norm, ye * norm, yd * norm
    zn, ze, zd = cross(xn, xe, xd, yn, ye, yd)
    c, s = math.cos(angle), math.sin(angle)
    return (
        xn,
        c * yn + s * zn,
        c * zn - s * yn,
        xe,
        c * ye + s * ze,
        c * ze - s * ye,
        xd,
        c * yd + s * zd,
        c * zd - s * yd,
    )


@scalar_kernel
def quaternion(c: Matrix, near: Quaternion) -> Quaternion:
    """Return the quaternion of a rotation that lies on the side of the hypersphere where `near` is."""
    trace = c[0] + c[4] + c[8]
    a, b, d, e = trace, 2.0 * c[0] - trace, 2.0 * c[4] - trace, 2.0 * c[8] - trace
    largest = max(max(a, b), max(d, e))
    f = 0.5 / math.sqrt(1.0 + largest)
    own = 0.5 * math.sqrt(1.0 + largest)
    if largest == a:
        q = (own, (c[7] - c[5]) * f, (c[2] - c[6]) * f, (c[3] - c[1]) * f)
    elif largest == b:
        q = ((c[7] - c[5]) * f, own, (c[1] + c[3]) * f, (c[2] + c[6]) * f)
    elif largest == d:
        q = ((c[2] - c[6]) * f, (c[1] + c[3]) * f, own, (c[5] + c[7]) * f)
    else:
        q = ((c[3] - c[1]) * f, (c[2] + c[6]) * f, (c[5] + c[7]) * f, own)
    same = q[0] * near[0] + q[1] * near[1] + q[2] * near[2] + q[3] * near[3]
    if same < 0.0:
        return -q[0], -q[1], -q[2], -q[3]
    return q


@scalar_kernel
def put_attitude(lanes: Array, lane: int, c: Matrix) -> None:
    """Give an IMU an attitude: matrix and quaternion, on the side of the hypersphere where it was."""
    for k in range(9):
        lanes[bank.MATRIX + k * LANES + lane] = c[k]
    f = bank.QUATERNION + lane
    q = quaternion(c, (lanes[f], lanes[f + LANES], lanes[f + 2 * LANES], lanes[f + 3 * LANES]))
    for k in range(4):
        lanes[f + k * LANES] = q[k]
