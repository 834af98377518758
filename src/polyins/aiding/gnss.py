"""Position and velocity of a GNSS antenna, paper A (6)-(7).

The residual of each IMU is its own; design matrix, gain and covariance are those of its share.
"""

from __future__ import annotations

import math

from polyins.kernels import bank, kalman, share
from polyins.kernels.bank import LANES
from polyins.kernels.jit import Array, scalar_kernel
from polyins.kernels.share import STRIDE


@scalar_kernel
def position_design(g: Array, m: Array) -> None:
    """Write H = [I, 0, (C l) x, 0 ...], paper A (7)."""
    _clear(m)
    n, e, d = _rotate(g, g[share.ANTENNA], g[share.ANTENNA + 1], g[share.ANTENNA + 2])
    for a in range(3):
        m[kalman.H + a * (STRIDE + 1)] = 1.0
    _skew(m, 6, n, e, d)


@scalar_kernel
def velocity_design(g: Array, m: Array, earth_rate_n: float, earth_rate_d: float) -> None:
    """Write the design matrix of v + (C w - w_ie) x (C l): gyro errors enter through w."""
    _clear(m)
    lx, ly, lz = g[share.ANTENNA], g[share.ANTENNA + 1], g[share.ANTENNA + 2]
    wx, wy, wz = g[share.RATE], g[share.RATE + 1], g[share.RATE + 2]
    ln, le, ld = _rotate(g, lx, ly, lz)
    wn, we, wd = _rotate(g, wx, wy, wz)
    for a in range(3):
        m[kalman.H + a * STRIDE + 3 + a] = 1.0
    # -phi x (C w) x C l  -  (C w - w_ie) x (phi x C l), gathered by phi: the earth's rate does not turn with C
    c = share.MATRIX
    for k in range(3):
        en, ee, ed = 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0
        an, ae, ad = _cross(wn, we, wd, en, ee, ed)
        bn, be, bd = _cross(an, ae, ad, ln, le, ld)
        pn, pe, pd = _cross(ln, le, ld, en, ee, ed)
        qn, qe, qd = _cross(wn - earth_rate_n, we, wd - earth_rate_d, pn, pe, pd)
        m[kalman.H + 6 + k] = bn + qn
        m[kalman.H + STRIDE + 6 + k] = be + qe
        m[kalman.H + 2 * STRIDE + 6 + k] = bd + qd
        # C e_k x C l for the gyro bias, times w_k for its scale
        gn, ge, gd = _cross(g[c + k], g[c + 3 + k], g[c + 6 + k], ln, le, ld)
        for a, value in enumerate((gn, ge, gd)):
            m[kalman.H + a * STRIDE + 9 + k] = value
            m[kalman.H + a * STRIDE + 15 + k] = value * g[share.RATE + k]


@scalar_kernel
def position_residuals(
    blocks: Array, first: int, last: int, fix: Array, metres: Array, geodetic: bool, m: Array
) -> None:
    """Write predicted minus measured antenna position of each member, m north, east, down, and their mean."""
    for a in range(3):
        m[kalman.RESIDUAL + a] = 0.0
    weights = 0.0
    for i in range(first, last):
        w = blocks[i // LANES]
        lane = i % LANES
        x, y, z = _antenna(w, lane)
        east = w[bank.POSITION + LANES + lane] - fix[1]
        if geodetic:
            east -= 2.0 * math.pi * math.floor(east / (2.0 * math.pi) + 0.5)
        rn = (w[bank.POSITION + lane] - fix[0]) * metres[0] + x
        re = east * metres[1] + y
        rd = (w[bank.POSITION + 2 * LANES + lane] - fix[2]) * metres[2] + z
        weights += _keep_residual(w, lane, rn, re, rd, m)
    for a in range(3):
        m[kalman.RESIDUAL + a] /= weights


@scalar_kernel
def velocity_residuals(blocks: Array, first: int, last: int, fix: Array, dt: float, m: Array) -> None:
    """Write predicted minus measured antenna velocity of each member, m/s, and their mean.

    The rate is the mean of the last `dt` seconds.
    """
    for a in range(3):
        m[kalman.RESIDUAL + a] = 0.0
    weights = 0.0
    for i in range(first, last):
        w = blocks[i // LANES]
        lane = i % LANES
        ln, le, ld = _antenna(w, lane)
        c = bank.MATRIX + lane
        x, y, z = w[bank.DTHETA + lane] / dt, w[bank.DTHETA + LANES + lane] / dt, w[bank.DTHETA + 2 * LANES + lane] / dt
        wn = w[c] * x + w[c + LANES] * y + w[c + 2 * LANES] * z - w[bank.EARTH_RATE + lane]
        we = w[c + 3 * LANES] * x + w[c + 4 * LANES] * y + w[c + 5 * LANES] * z
        wd = w[c + 6 * LANES] * x + w[c + 7 * LANES] * y + w[c + 8 * LANES] * z - w[bank.EARTH_RATE + LANES + lane]
        vn, ve, vd = _cross(wn, we, wd, ln, le, ld)
        rn = w[bank.VELOCITY + lane] + vn - fix[0]
        re = w[bank.VELOCITY + LANES + lane] + ve - fix[1]
        rd = w[bank.VELOCITY + 2 * LANES + lane] + vd - fix[2]
        weights += _keep_residual(w, lane, rn, re, rd, m)
    for a in range(3):
        m[kalman.RESIDUAL + a] /= weights


@scalar_kernel
def _keep_residual(w: Array, lane: int, rn: float, re: float, rd: float, m: Array) -> float:
    weight: float = w[bank.WEIGHT + lane]
    for a, value in enumerate((rn, re, rd)):
        w[bank.CORRECTION + a * LANES + lane] = value
        m[kalman.RESIDUAL + a] += weight * value
    return weight


@scalar_kernel
def residuals_to_corrections(blocks: Array, first: int, last: int, m: Array) -> None:
    """Turn each member's residual into its error state, dx = K z, paper A (11)."""
    for i in range(first, last):
        w = blocks[i // LANES]
        lane = i % LANES
        z0 = w[bank.CORRECTION + lane]
        z1 = w[bank.CORRECTION + LANES + lane]
        z2 = w[bank.CORRECTION + 2 * LANES + lane]
        for k in range(share.STATES):
            r = kalman.K + kalman.ROWS * k
            w[bank.CORRECTION + k * LANES + lane] = m[r] * z0 + m[r + 1] * z1 + m[r + 2] * z2


@scalar_kernel
def _antenna(w: Array, lane: int) -> tuple[float, float, float]:
    """C l of one IMU, m north, east, down."""
    x = w[bank.TO_ANTENNA + lane]
    y = w[bank.TO_ANTENNA + LANES + lane]
    z = w[bank.TO_ANTENNA + 2 * LANES + lane]
    c = bank.MATRIX + lane
    return (
        w[c] * x + w[c + LANES] * y + w[c + 2 * LANES] * z,
        w[c + 3 * LANES] * x + w[c + 4 * LANES] * y + w[c + 5 * LANES] * z,
        w[c + 6 * LANES] * x + w[c + 7 * LANES] * y + w[c + 8 * LANES] * z,
    )


@scalar_kernel
def _rotate(g: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    c = share.MATRIX
    return (
        g[c] * x + g[c + 1] * y + g[c + 2] * z,
        g[c + 3] * x + g[c + 4] * y + g[c + 5] * z,
        g[c + 6] * x + g[c + 7] * y + g[c + 8] * z,
    )


@scalar_kernel
def _cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@scalar_kernel
def _clear(m: Array) -> None:
    for k in range(kalman.ROWS * STRIDE):
        m[kalman.H + k] = 0.0


@scalar_kernel
def _skew(m: Array, column: int, x: float, y: float, z: float) -> None:
    h = kalman.H + column
    m[h + 1], m[h + 2] = -z, y
    m[h + STRIDE], m[h + STRIDE + 2] = z, -x
    m[h + 2 * STRIDE], m[h + 2 * STRIDE + 1] = -y, x
