"""The attitude of a vehicle as it follows from the IMUs on its wheels and body, and the middle of its rear axle.

v is forward-right-down. An IMU on a wheel has its x axis along the axle, to the right; what else it knows of the
vehicle's attitude is nothing, so roll and pitch are lent by an IMU on the body, or zero.
"""

from __future__ import annotations

import math

from polyins.kernels import bank, share
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
def matrix_at(g: Array, c: int) -> Matrix:
    """Return the matrix at an offset of a share."""
    return g[c], g[c + 1], g[c + 2], g[c + 3], g[c + 4], g[c + 5], g[c + 6], g[c + 7], g[c + 8]


@scalar_kernel
def put_matrix(g: Array, c: int, v: Matrix) -> None:
    """Write a matrix at an offset of a share."""
    g[c], g[c + 1], g[c + 2], g[c + 3], g[c + 4], g[c + 5], g[c + 6], g[c + 7], g[c + 8] = v


@scalar_kernel
def lane_matrix(w: Array, c: int) -> Matrix:
    """Return the matrix of one IMU at an offset of its block, its lane included."""
    return (
        w[c],
        w[c + LANES],
        w[c + 2 * LANES],
        w[c + 3 * LANES],
        w[c + 4 * LANES],
        w[c + 5 * LANES],
        w[c + 6 * LANES],
        w[c + 7 * LANES],
        w[c + 8 * LANES],
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
def vehicle_matrix(w: Array, lane: int, lent: Matrix) -> Matrix:
    """C_nv as it follows from the attitude of one IMU."""
    c = lane_matrix(w, bank.MATRIX + lane)
    if w[bank.WHEEL + lane] != 0.0:
        return turned_to_axle(lent, c[0], c[3])
    return on_body(c, w[bank.MOUNTING + LANES + lane], w[bank.MOUNTING + 2 * LANES + lane])


@scalar_kernel
def lent_matrix(groups: Array, lender: int) -> Matrix:
    """C_nv of the share that lends roll and pitch; level without one."""
    if lender < 0:
        return 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    return matrix_at(groups[lender], share.VEHICLE)


@scalar_kernel
def update_attitudes(blocks: Array, groups: Array, members: Array, lenders: Array) -> None:
    """Write C_nv of each share from its fused attitude; the shares that lend come first in time, not in place."""
    for lending in (True, False):
        for s in range(members.shape[0]):
            w, lane = blocks[members[s, 0] // LANES], members[s, 0] % LANES
            if (w[bank.WHEEL + lane] == 0.0) == lending:
                g = groups[s]
                c = matrix_at(g, share.MATRIX)
                if lending:
                    v = on_body(c, w[bank.MOUNTING + LANES + lane], w[bank.MOUNTING + 2 * LANES + lane])
                else:
                    v = turned_to_axle(lent_matrix(groups, lenders[s]), c[0], c[3])
                put_matrix(g, share.VEHICLE, v)


@scalar_kernel
def lever_to_wheel(w: Array, lane: int) -> Three:
    """From the IMU to the centre of its wheel, as estimated, m, in its axes; zero on the body."""
    if w[bank.WHEEL + lane] == 0.0:
        return 0.0, 0.0, 0.0
    return (
        w[bank.TO_WHEEL + lane],
        w[bank.TO_WHEEL + LANES + lane] + w[bank.MOUNTING + LANES + lane],
        w[bank.TO_WHEEL + 2 * LANES + lane] + w[bank.MOUNTING + 2 * LANES + lane],
    )


@scalar_kernel
def lever_to_speed(w: Array, lane: int, lateral: float) -> Three:
    """From the IMU to the point whose speed the wheels give, `lateral` m to the right in the rear axle, in its axes.

    The axle of a wheel is the x axis of its IMU, so the spin does not move a point on it.
    """
    x, y, z = w[bank.TO_SPEED + lane], w[bank.TO_SPEED + LANES + lane], w[bank.TO_SPEED + 2 * LANES + lane]
    if w[bank.WHEEL + lane] == 0.0:
        return x, y + lateral, z
    return x + lateral, y + w[bank.MOUNTING + LANES + lane], z + w[bank.MOUNTING + 2 * LANES + lane]


@scalar_kernel
def merge(blocks: Array, groups: Array, members: Array, lenders: Array, silent: Array) -> None:
    """Write the middle of the rear axle, its velocity and the vehicle's attitude into the last group.

    Position and velocity are the means over the shares that are not silent, the heading is their mean direction; roll
    and pitch are those lent. Paper B (7)-(8), with all IMUs in one frame.
    """
    update_attitudes(blocks, groups, members, lenders)
    measuring = 0
    for s in range(members.shape[0]):
        if silent[s] < 0.0:
            measuring += 1
    if measuring == 0:
        return
    merged = groups[-1]
    for k in range(6):
        merged[share.POSITION + k] = 0.0
    forward_n, forward_e = 0.0, 0.0
    base, lender = -1, -1
    for s in range(members.shape[0]):
        if silent[s] >= 0.0:
            continue
        g = groups[s]
        w, lane = blocks[members[s, 0] // LANES], members[s, 0] % LANES
        if base < 0:
            base = s
        if lender < 0 and (w[bank.WHEEL + lane] == 0.0 or lenders[s] >= 0):
            lender = lenders[s] if w[bank.WHEEL + lane] != 0.0 else s
        v = matrix_at(g, share.VEHICLE)
        c = matrix_at(g, share.MATRIX)
        x, y, z = lever_to_wheel(w, lane)
        ln, le, ld = rotated(c, x, y, z)
        px, py, pz = w[bank.IN_VEHICLE + lane], w[bank.IN_VEHICLE + LANES + lane], w[bank.IN_VEHICLE + 2 * LANES + lane]
        pn, pe, pd = rotated(v, px, py, pz)
        merged[share.POSITION] += (ln - pn) * w[bank.TO_LATITUDE + lane]
        merged[share.POSITION + 1] += (le - pe) * w[bank.TO_LONGITUDE + lane]
        merged[share.POSITION + 2] -= ld - pd
        rn, re, rd = rotated(c, g[share.RATE], g[share.RATE + 1], g[share.RATE + 2])
        rn -= w[bank.EARTH_RATE + lane]
        rd -= w[bank.EARTH_RATE + LANES + lane]
        an, ae, ad = cross(rn, re, rd, ln, le, ld)
        if w[bank.WHEEL + lane] != 0.0:
            spin = rn * c[0] + re * c[3] + rd * c[6]
            rn, re, rd = rn - spin * c[0], re - spin * c[3], rd - spin * c[6]
        bn, be, bd = cross(rn, re, rd, pn, pe, pd)
        merged[share.VELOCITY] += g[share.VELOCITY] + an - bn
        merged[share.VELOCITY + 1] += g[share.VELOCITY + 1] + ae - be
        merged[share.VELOCITY + 2] += g[share.VELOCITY + 2] + ad - bd
        for k in range(3):
            merged[share.POSITION + k] += g[share.POSITION + k] - groups[base, share.POSITION + k]
        norm = 1.0 / math.sqrt(v[0] * v[0] + v[3] * v[3])
        forward_n += v[0] * norm
        forward_e += v[3] * norm
    for k in range(3):
        merged[share.POSITION + k] = groups[base, share.POSITION + k] + merged[share.POSITION + k] / measuring
        merged[share.VELOCITY + k] /= measuring
    lent = lent_matrix(groups, lender)
    v = turned_about_down(lent, lent[0], lent[3], forward_n, forward_e)
    put_matrix(merged, share.MATRIX, v)
    put_matrix(merged, share.VEHICLE, v)
    # of the two quaternions the one whose scalar part, or near the half turn the vertical one, is positive
    reference = (1.0, 0.0, 0.0, 0.0) if v[0] + v[4] + v[8] > 0.0 else (0.0, 0.0, 0.0, 1.0)
    q = quaternion(v, reference)
    for k in range(4):
        merged[share.QUATERNION + k] = q[k]


@scalar_kernel
def wheel_turned(w: Array, lane: int, v: Matrix, angle: float) -> Matrix:
    """Return C_nb of an IMU on a wheel whose axle is that of the vehicle, turned about it from where it was."""
    xn, xe, xd = v[1], v[4], v[7]
    yn, ye, yd = w[bank.MATRIX + LANES + lane], w[bank.MATRIX + 4 * LANES + lane], w[bank.MATRIX + 7 * LANES + lane]
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
def put_attitude(w: Array, lane: int, c: Matrix) -> None:
    """Give an IMU an attitude: matrix and quaternion, on the side of the hypersphere where it was."""
    for k in range(9):
        w[bank.MATRIX + k * LANES + lane] = c[k]
    f = bank.QUATERNION + lane
    q = quaternion(c, (w[f], w[f + LANES], w[f + 2 * LANES], w[f + 3 * LANES]))
    for k in range(4):
        w[f + k * LANES] = q[k]
