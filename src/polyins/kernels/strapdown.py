"""Strapdown mechanization in n of the eight IMUs of a block, paper A (1).

Two-sample coning and sculling corrections; gravity, radii and rates at the extrapolated middle of the interval.
Order: velocity, position, attitude.
"""

from __future__ import annotations

import math

from polyins.kernels import earth
from polyins.kernels.bank import (
    AT_MATRIX,
    AT_POSITION,
    AT_VELOCITY,
    DTHETA,
    DVEL,
    DVEL_N,
    EARTH_RATE,
    ERRORS,
    GRAVITY,
    LANES,
    MATRIX,
    POSITION,
    PREVIOUS_DTHETA,
    PREVIOUS_DVEL,
    QUATERNION,
    RAW_DTHETA,
    RAW_DVEL,
    ROTATION,
    SENSITIVITY,
    TO_LATITUDE,
    TO_LONGITUDE,
    TRANSPORT_RATE,
    VELOCITY,
)
from polyins.kernels.jit import Array, formula, kernel

X = 0
Y = LANES
Z = 2 * LANES

SIXTH = 1.0 / 6.0

# series of cos(a/2) and sin(a/2)/a in powers of (a/2)^2
C = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(10))
S = tuple(0.5 * (-1.0) ** k / math.factorial(2 * k + 1) for k in range(10))


@kernel
def compensate(w: Array, fraction: float, dt: float) -> None:
    """Correct the part `fraction` of the measured increments, which took `dt` seconds, for the estimated errors.

    (increment - bias dt) / (1 + scale); the corrected ones that were there become the previous ones,
    which spares a pass of its own.
    """
    for i in range(3 * LANES):
        w[PREVIOUS_DTHETA + i] = w[DTHETA + i]
        w[PREVIOUS_DVEL + i] = w[DVEL + i]
        w[DTHETA + i] = (w[RAW_DTHETA + i] * fraction - w[ERRORS + i] * dt) * w[SENSITIVITY + i]
        w[DVEL + i] = (w[RAW_DVEL + i] * fraction - w[ERRORS + 3 * LANES + i] * dt) * w[SENSITIVITY + 3 * LANES + i]


@kernel
def update_sensitivity(w: Array) -> None:
    """Write 1 / (1 + scale) after the errors have changed."""
    for i in range(6 * LANES):
        w[SENSITIVITY + i] = 1.0 / (1.0 + w[ERRORS + 6 * LANES + i])


@kernel
def remember_matrix(w: Array) -> None:
    """Keep the attitude of the start of an interval."""
    for i in range(9 * LANES):
        w[AT_MATRIX + i] = w[MATRIX + i]


@kernel
def evaluate_at_own_state(w: Array) -> None:
    """Let each IMU's own state be where the earth is evaluated."""
    for i in range(3 * LANES):
        w[AT_POSITION + i] = w[POSITION + i]
        w[AT_VELOCITY + i] = w[VELOCITY + i]


@kernel
def correct_coning_and_sculling(w: Array, ratio: float) -> None:
    """Write the rotation vector, and into DVEL_N the velocity increment with rotation and sculling terms.

    The rotation's second order counts where an IMU turns with a wheel: 0.2 rad per interval make 0.7 % of the force.

    `ratio` is 1/12 for intervals of equal length; for a previous one of T1 and a current one of T2 seconds it is
    T2^2 / (6 T1 (T1 + T2)), from rates and forces linear in time over both.
    """
    for i in range(LANES):
        tx, ty, tz = w[DTHETA + X + i], w[DTHETA + Y + i], w[DTHETA + Z + i]
        vx, vy, vz = w[DVEL + X + i], w[DVEL + Y + i], w[DVEL + Z + i]
        px, py, pz = w[PREVIOUS_DTHETA + X + i], w[PREVIOUS_DTHETA + Y + i], w[PREVIOUS_DTHETA + Z + i]
        ux, uy, uz = w[PREVIOUS_DVEL + X + i], w[PREVIOUS_DVEL + Y + i], w[PREVIOUS_DVEL + Z + i]
        w[ROTATION + X + i] = tx + ratio * (py * tz - pz * ty)
        w[ROTATION + Y + i] = ty + ratio * (pz * tx - px * tz)
        w[ROTATION + Z + i] = tz + ratio * (px * ty - py * tx)
        sx = py * vz - pz * vy + uy * tz - uz * ty
        sy = pz * vx - px * vz + uz * tx - ux * tz
        sz = px * vy - py * vx + ux * ty - uy * tx
        cx, cy, cz = ty * vz - tz * vy, tz * vx - tx * vz, tx * vy - ty * vx
        w[DVEL_N + X + i] = vx + 0.5 * cx + (ty * cz - tz * cy) * SIXTH + ratio * sx
        w[DVEL_N + Y + i] = vy + 0.5 * cy + (tz * cx - tx * cz) * SIXTH + ratio * sy
        w[DVEL_N + Z + i] = vz + 0.5 * cz + (tx * cy - ty * cx) * SIXTH + ratio * sz


@kernel
def rotate_at_own_state(w: Array) -> None:
    """Let each IMU's own state be where the earth is evaluated and what rotates its velocity increment into n.

    One loop, since LLVM unrolls shorter ones before it could vectorize.
    """
    for i in range(LANES):
        w[AT_POSITION + X + i] = w[POSITION + X + i]
        w[AT_POSITION + Y + i] = w[POSITION + Y + i]
        w[AT_POSITION + Z + i] = w[POSITION + Z + i]
        w[AT_VELOCITY + X + i] = w[VELOCITY + X + i]
        w[AT_VELOCITY + Y + i] = w[VELOCITY + Y + i]
        w[AT_VELOCITY + Z + i] = w[VELOCITY + Z + i]
        x, y, z = w[DVEL_N + X + i], w[DVEL_N + Y + i], w[DVEL_N + Z + i]
        m = MATRIX + i
        w[DVEL_N + X + i] = w[m] * x + w[m + LANES] * y + w[m + 2 * LANES] * z
        w[DVEL_N + Y + i] = w[m + 3 * LANES] * x + w[m + 4 * LANES] * y + w[m + 5 * LANES] * z
        w[DVEL_N + Z + i] = w[m + 6 * LANES] * x + w[m + 7 * LANES] * y + w[m + 8 * LANES] * z


@formula
def velocity_change(w: Array, i: int, dt: float) -> tuple[float, float, float]:
    """Return the change of velocity in n: rotated specific force, gravity and Coriolis, rates as last evaluated."""
    x, y, z = w[DVEL_N + X + i], w[DVEL_N + Y + i], w[DVEL_N + Z + i]
    vn, ve, vd = w[AT_VELOCITY + X + i], w[AT_VELOCITY + Y + i], w[AT_VELOCITY + Z + i]
    ien, ied = w[EARTH_RATE + i], w[EARTH_RATE + LANES + i]
    enn, ene, end = w[TRANSPORT_RATE + X + i], w[TRANSPORT_RATE + Y + i], w[TRANSPORT_RATE + Z + i]
    # n turns by w_in dt during the interval; the increment is seen from its middle
    hn, he, hd = 0.5 * dt * (ien + enn), 0.5 * dt * ene, 0.5 * dt * (ied + end)
    # Coriolis: 2 w_ie + w_en
    cn, ce, cd = 2.0 * ien + enn, ene, 2.0 * ied + end
    dn = x - (he * z - hd * y) - (ce * vd - cd * ve) * dt
    de = y - (hd * x - hn * z) - (cd * vn - cn * vd) * dt
    dd = z - (hn * y - he * x) - (cn * ve - ce * vn) * dt + w[GRAVITY + i] * dt
    return dn, de, dd


@kernel
def extrapolate_to_middle(w: Array, dt: float) -> None:
    """Move AT_VELOCITY and AT_POSITION to the middle of the interval."""
    for i in range(LANES):
        dn, de, dd = velocity_change(w, i, dt)
        vn = w[AT_VELOCITY + X + i] + 0.5 * dn
        ve = w[AT_VELOCITY + Y + i] + 0.5 * de
        vd = w[AT_VELOCITY + Z + i] + 0.5 * dd
        w[AT_VELOCITY + X + i] = vn
        w[AT_VELOCITY + Y + i] = ve
        w[AT_VELOCITY + Z + i] = vd
        w[AT_POSITION + X + i] += 0.5 * dt * vn * w[TO_LATITUDE + i]
        w[AT_POSITION + Y + i] += 0.5 * dt * ve * w[TO_LONGITUDE + i]
        w[AT_POSITION + Z + i] -= 0.5 * dt * vd


@kernel
def advance_velocity_and_position(w: Array, dt: float) -> None:
    """Advance velocity with the rates of the middle, position with the mean of old and new velocity."""
    for i in range(LANES):
        dn, de, dd = velocity_change(w, i, dt)
        vn, ve, vd = w[VELOCITY + X + i], w[VELOCITY + Y + i], w[VELOCITY + Z + i]
        w[VELOCITY + X + i] = vn + dn
        w[VELOCITY + Y + i] = ve + de
        w[VELOCITY + Z + i] = vd + dd
        w[POSITION + X + i] += dt * (vn + 0.5 * dn) * w[TO_LATITUDE + i]
        w[POSITION + Y + i] += dt * (ve + 0.5 * de) * w[TO_LONGITUDE + i]
        w[POSITION + Z + i] -= dt * (vd + 0.5 * dd)


@kernel
def advance_attitude(w: Array, dt: float) -> None:
    """Advance the quaternion: q = q(-w_in dt) q q(rotation).

    Sine and cosine of half the angle by their series, which is exact to rounding up to 2 rad per interval.
    """
    for i in range(LANES):
        x, y, z = w[ROTATION + X + i], w[ROTATION + Y + i], w[ROTATION + Z + i]
        h = 0.25 * (x * x + y * y + z * z)
        c = 1.0 + h * (
            C[1] + h * (C[2] + h * (C[3] + h * (C[4] + h * (C[5] + h * (C[6] + h * (C[7] + h * (C[8] + h * C[9])))))))
        )
        s = 0.5 + h * (
            S[1] + h * (S[2] + h * (S[3] + h * (S[4] + h * (S[5] + h * (S[6] + h * (S[7] + h * (S[8] + h * S[9])))))))
        )
        bx, by, bz = s * x, s * y, s * z
        # n turns by less than 1e-6 rad: second order is beyond double precision
        nn = -0.5 * dt * (w[EARTH_RATE + i] + w[TRANSPORT_RATE + X + i])
        ne = -0.5 * dt * w[TRANSPORT_RATE + Y + i]
        nd = -0.5 * dt * (w[EARTH_RATE + LANES + i] + w[TRANSPORT_RATE + Z + i])
        q0, q1, q2, q3 = _quaternion(w, i)
        a0 = q0 - nn * q1 - ne * q2 - nd * q3
        a1 = q1 + nn * q0 + ne * q3 - nd * q2
        a2 = q2 + ne * q0 + nd * q1 - nn * q3
        a3 = q3 + nd * q0 + nn * q2 - ne * q1
        r0 = a0 * c - a1 * bx - a2 * by - a3 * bz
        r1 = a0 * bx + a1 * c + a2 * bz - a3 * by
        r2 = a0 * by - a1 * bz + a2 * c + a3 * bx
        r3 = a0 * bz + a1 * by - a2 * bx + a3 * c
        norm = 1.5 - 0.5 * (r0 * r0 + r1 * r1 + r2 * r2 + r3 * r3)
        w[QUATERNION + i] = r0 * norm
        w[QUATERNION + LANES + i] = r1 * norm
        w[QUATERNION + 2 * LANES + i] = r2 * norm
        w[QUATERNION + 3 * LANES + i] = r3 * norm


@formula
def _quaternion(w: Array, i: int) -> tuple[float, float, float, float]:
    return w[QUATERNION + i], w[QUATERNION + LANES + i], w[QUATERNION + 2 * LANES + i], w[QUATERNION + 3 * LANES + i]


@kernel
def update_matrix(w: Array) -> None:
    """Write C_nb from the quaternion."""
    for i in range(LANES):
        q0, q1, q2, q3 = _quaternion(w, i)
        w[MATRIX + i] = q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3
        w[MATRIX + LANES + i] = 2.0 * (q1 * q2 - q0 * q3)
        w[MATRIX + 2 * LANES + i] = 2.0 * (q1 * q3 + q0 * q2)
        w[MATRIX + 3 * LANES + i] = 2.0 * (q1 * q2 + q0 * q3)
        w[MATRIX + 4 * LANES + i] = q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3
        w[MATRIX + 5 * LANES + i] = 2.0 * (q2 * q3 - q0 * q1)
        w[MATRIX + 6 * LANES + i] = 2.0 * (q1 * q3 - q0 * q2)
        w[MATRIX + 7 * LANES + i] = 2.0 * (q2 * q3 + q0 * q1)
        w[MATRIX + 8 * LANES + i] = q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3


@kernel
def advance(w: Array, dt: float, near: Array) -> None:
    """Advance the eight IMUs of a block by `dt` seconds from ROTATION and DVEL_N.

    AT_POSITION and AT_VELOCITY hold the state at the start of the interval, which the rates and gravity of the last
    interval's middle take to that of this one, where the earth is evaluated. That leaves an error of
    dt^2 / 2 times the change of Coriolis and gravity per second in AT_VELOCITY: with 1e-4 m/s^3 (a turn at 1 m/s^2)
    5e-9 m/s at 100 Hz, and of this times 2 w_ie, 1e-12 m/s^2, in the acceleration.

    `near` is (geodetic, latitude, sine, cosine, plane gravity), see `earth.evaluate`.
    """
    extrapolate_to_middle(w, dt)
    if near[0] != 0.0:
        earth.evaluate(w, near[1], near[2], near[3])
    advance_velocity_and_position(w, dt)
    advance_attitude(w, dt)
    update_matrix(w)


@kernel
def mechanize(w: Array, dt: float, ratio: float, near: Array) -> None:
    """Advance the eight IMUs of a block by `dt` seconds, from corrected increments and each IMU's own state."""
    correct_coning_and_sculling(w, ratio)
    rotate_at_own_state(w)
    advance(w, dt, near)
