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
def compensate(lanes: Array, fraction: float, dt: float) -> None:
    """Correct the part `fraction` of the measured increments, which took `dt` seconds, for the estimated errors.

    (increment - bias dt) / (1 + scale); the corrected ones that were there become the previous ones,
    which spares a pass of its own.
    """
    for i in range(3 * LANES):
        lanes[PREVIOUS_DTHETA + i] = lanes[DTHETA + i]
        lanes[PREVIOUS_DVEL + i] = lanes[DVEL + i]
        lanes[DTHETA + i] = (lanes[RAW_DTHETA + i] * fraction - lanes[ERRORS + i] * dt) * lanes[SENSITIVITY + i]
        lanes[DVEL + i] = (lanes[RAW_DVEL + i] * fraction - lanes[ERRORS + 3 * LANES + i] * dt) * lanes[
            SENSITIVITY + 3 * LANES + i
        ]


@kernel
def update_sensitivity(lanes: Array) -> None:
    """Write 1 / (1 + scale) after the errors have changed."""
    for i in range(6 * LANES):
        lanes[SENSITIVITY + i] = 1.0 / (1.0 + lanes[ERRORS + 6 * LANES + i])


@kernel
def remember_matrix(lanes: Array) -> None:
    """Keep the attitude of the start of an interval."""
    for i in range(9 * LANES):
        lanes[AT_MATRIX + i] = lanes[MATRIX + i]


@kernel
def evaluate_at_own_state(lanes: Array) -> None:
    """Let each IMU's own state be where the earth is evaluated."""
    for i in range(3 * LANES):
        lanes[AT_POSITION + i] = lanes[POSITION + i]
        lanes[AT_VELOCITY + i] = lanes[VELOCITY + i]


@kernel
def correct_coning_and_sculling(lanes: Array, ratio: float) -> None:
    """Write the rotation vector, and into DVEL_N the velocity increment with rotation and sculling terms.

    The rotation's second order counts where an IMU turns with a wheel: 0.2 rad per interval make 0.7 % of the force.

    `ratio` is 1/12 for intervals of equal length; for a previous one of T1 and a current one of T2 seconds it is
    T2^2 / (6 T1 (T1 + T2)), from rates and forces linear in time over both.
    """
    for i in range(LANES):
        tx, ty, tz = lanes[DTHETA + X + i], lanes[DTHETA + Y + i], lanes[DTHETA + Z + i]
        vx, vy, vz = lanes[DVEL + X + i], lanes[DVEL + Y + i], lanes[DVEL + Z + i]
        px, py, pz = lanes[PREVIOUS_DTHETA + X + i], lanes[PREVIOUS_DTHETA + Y + i], lanes[PREVIOUS_DTHETA + Z + i]
        ux, uy, uz = lanes[PREVIOUS_DVEL + X + i], lanes[PREVIOUS_DVEL + Y + i], lanes[PREVIOUS_DVEL + Z + i]
        lanes[ROTATION + X + i] = tx + ratio * (py * tz - pz * ty)
        lanes[ROTATION + Y + i] = ty + ratio * (pz * tx - px * tz)
        lanes[ROTATION + Z + i] = tz + ratio * (px * ty - py * tx)
        sx = py * vz - pz * vy + uy * tz - uz * ty
        sy = pz * vx - px * vz + uz * tx - ux * tz
        sz = px * vy - py * vx + ux * ty - uy * tx
        cx, cy, cz = ty * vz - tz * vy, tz * vx - tx * vz, tx * vy - ty * vx
        lanes[DVEL_N + X + i] = vx + 0.5 * cx + (ty * cz - tz * cy) * SIXTH + ratio * sx
        lanes[DVEL_N + Y + i] = vy + 0.5 * cy + (tz * cx - tx * cz) * SIXTH + ratio * sy
        lanes[DVEL_N + Z + i] = vz + 0.5 * cz + (tx * cy - ty * cx) * SIXTH + ratio * sz


@kernel
def rotate_at_own_state(lanes: Array) -> None:
    """Let each IMU's own state be where the earth is evaluated and what rotates its velocity increment into n.

    One loop, since LLVM unrolls shorter ones before it could vectorize.
    """
    for i in range(LANES):
        lanes[AT_POSITION + X + i] = lanes[POSITION + X + i]
        lanes[AT_POSITION + Y + i] = lanes[POSITION + Y + i]
        lanes[AT_POSITION + Z + i] = lanes[POSITION + Z + i]
        lanes[AT_VELOCITY + X + i] = lanes[VELOCITY + X + i]
        lanes[AT_VELOCITY + Y + i] = lanes[VELOCITY + Y + i]
        lanes[AT_VELOCITY + Z + i] = lanes[VELOCITY + Z + i]
        x, y, z = lanes[DVEL_N + X + i], lanes[DVEL_N + Y + i], lanes[DVEL_N + Z + i]
        m = MATRIX + i
        lanes[DVEL_N + X + i] = lanes[m] * x + lanes[m + LANES] * y + lanes[m + 2 * LANES] * z
        lanes[DVEL_N + Y + i] = lanes[m + 3 * LANES] * x + lanes[m + 4 * LANES] * y + lanes[m + 5 * LANES] * z
        lanes[DVEL_N + Z + i] = lanes[m + 6 * LANES] * x + lanes[m + 7 * LANES] * y + lanes[m + 8 * LANES] * z


@formula
def velocity_change(lanes: Array, i: int, dt: float) -> tuple[float, float, float]:
    """Return the change of velocity in n: rotated specific force, gravity and Coriolis, rates as last evaluated."""
    x, y, z = lanes[DVEL_N + X + i], lanes[DVEL_N + Y + i], lanes[DVEL_N + Z + i]
    vn, ve, vd = lanes[AT_VELOCITY + X + i], lanes[AT_VELOCITY + Y + i], lanes[AT_VELOCITY + Z + i]
    ien, ied = lanes[EARTH_RATE + i], lanes[EARTH_RATE + LANES + i]
    enn, ene, end = lanes[TRANSPORT_RATE + X + i], lanes[TRANSPORT_RATE + Y + i], lanes[TRANSPORT_RATE + Z + i]
    # n turns by w_in dt during the interval; the increment is seen from its middle
    hn, he, hd = 0.5 * dt * (ien + enn), 0.5 * dt * ene, 0.5 * dt * (ied + end)
    # Coriolis: 2 w_ie + w_en
    cn, ce, cd = 2.0 * ien + enn, ene, 2.0 * ied + end
    dn = x - (he * z - hd * y) - (ce * vd - cd * ve) * dt
    de = y - (hd * x - hn * z) - (cd * vn - cn * vd) * dt
    dd = z - (hn * y - he * x) - (cn * ve - ce * vn) * dt + lanes[GRAVITY + i] * dt
    return dn, de, dd


@kernel
def extrapolate_to_middle(lanes: Array, dt: float) -> None:
    """Move AT_VELOCITY and AT_POSITION to the middle of the interval."""
    for i in range(LANES):
        dn, de, dd = velocity_change(lanes, i, dt)
        vn = lanes[AT_VELOCITY + X + i] + 0.5 * dn
        ve = lanes[AT_VELOCITY + Y + i] + 0.5 * de
        vd = lanes[AT_VELOCITY + Z + i] + 0.5 * dd
        lanes[AT_VELOCITY + X + i] = vn
        lanes[AT_VELOCITY + Y + i] = ve
        lanes[AT_VELOCITY + Z + i] = vd
        lanes[AT_POSITION + X + i] += 0.5 * dt * vn * lanes[TO_LATITUDE + i]
        lanes[AT_POSITION + Y + i] += 0.5 * dt * ve * lanes[TO_LONGITUDE + i]
        lanes[AT_POSITION + Z + i] -= 0.5 * dt * vd


@kernel
def advance_velocity_and_position(lanes: Array, dt: float) -> None:
    """Advance velocity with the rates of the middle, position with the mean of old and new velocity."""
    for i in range(LANES):
        dn, de, dd = velocity_change(lanes, i, dt)
        vn, ve, vd = lanes[VELOCITY + X + i], lanes[VELOCITY + Y + i], lanes[VELOCITY + Z + i]
        lanes[VELOCITY + X + i] = vn + dn
        lanes[VELOCITY + Y + i] = ve + de
        lanes[VELOCITY + Z + i] = vd + dd
        lanes[POSITION + X + i] += dt * (vn + 0.5 * dn) * lanes[TO_LATITUDE + i]
        lanes[POSITION + Y + i] += dt * (ve + 0.5 * de) * lanes[TO_LONGITUDE + i]
        lanes[POSITION + Z + i] -= dt * (vd + 0.5 * dd)


@kernel
def advance_attitude(lanes: Array, dt: float) -> None:
    """Advance the quaternion: q = q(-w_in dt) q q(rotation).

    Sine and cosine of half the angle by their series, which is exact to rounding up to 2 rad per interval.
    """
    for i in range(LANES):
        x, y, z = lanes[ROTATION + X + i], lanes[ROTATION + Y + i], lanes[ROTATION + Z + i]
        h = 0.25 * (x * x + y * y + z * z)
        c = 1.0 + h * (
            C[1] + h * (C[2] + h * (C[3] + h * (C[4] + h * (C[5] + h * (C[6] + h * (C[7] + h * (C[8] + h * C[9])))))))
        )
        s = 0.5 + h * (
            S[1] + h * (S[2] + h * (S[3] + h * (S[4] + h * (S[5] + h * (S[6] + h * (S[7] + h * (S[8] + h * S[9])))))))
        )
        bx, by, bz = s * x, s * y, s * z
        # n turns by less than 1e-6 rad: second order is beyond double precision
        nn = -0.5 * dt * (lanes[EARTH_RATE + i] + lanes[TRANSPORT_RATE + X + i])
        ne = -0.5 * dt * lanes[TRANSPORT_RATE + Y + i]
        nd = -0.5 * dt * (lanes[EARTH_RATE + LANES + i] + lanes[TRANSPORT_RATE + Z + i])
        q0, q1, q2, q3 = _quaternion(lanes, i)
        a0 = q0 - nn * q1 - ne * q2 - nd * q3
        a1 = q1 + nn * q0 + ne * q3 - nd * q2
        a2 = q2 + ne * q0 + nd * q1 - nn * q3
        a3 = q3 + nd * q0 + nn * q2 - ne * q1
        r0 = a0 * c - a1 * bx - a2 * by - a3 * bz
        r1 = a0 * bx + a1 * c + a2 * bz - a3 * by
        r2 = a0 * by - a1 * bz + a2 * c + a3 * bx
        r3 = a0 * bz + a1 * by - a2 * bx + a3 * c
        norm = 1.5 - 0.5 * (r0 * r0 + r1 * r1 + r2 * r2 + r3 * r3)
        lanes[QUATERNION + i] = r0 * norm
        lanes[QUATERNION + LANES + i] = r1 * norm
        lanes[QUATERNION + 2 * LANES + i] = r2 * norm
        lanes[QUATERNION + 3 * LANES + i] = r3 * norm


@formula
def _quaternion(lanes: Array, i: int) -> tuple[float, float, float, float]:
    return (
        lanes[QUATERNION + i],
        lanes[QUATERNION + LANES + i],
        lanes[QUATERNION + 2 * LANES + i],
        lanes[QUATERNION + 3 * LANES + i],
    )


@kernel
def update_matrix(lanes: Array) -> None:
    """Write C_nb from the quaternion."""
    for i in range(LANES):
        q0, q1, q2, q3 = _quaternion(lanes, i)
        lanes[MATRIX + i] = q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3
        lanes[MATRIX + LANES + i] = 2.0 * (q1 * q2 - q0 * q3)
        lanes[MATRIX + 2 * LANES + i] = 2.0 * (q1 * q3 + q0 * q2)
        lanes[MATRIX + 3 * LANES + i] = 2.0 * (q1 * q2 + q0 * q3)
        lanes[MATRIX + 4 * LANES + i] = q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3
        lanes[MATRIX + 5 * LANES + i] = 2.0 * (q2 * q3 - q0 * q1)
        lanes[MATRIX + 6 * LANES + i] = 2.0 * (q1 * q3 - q0 * q2)
        lanes[MATRIX + 7 * LANES + i] = 2.0 * (q2 * q3 + q0 * q1)
        lanes[MATRIX + 8 * LANES + i] = q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3


@kernel
def advance(lanes: Array, dt: float, earth_reference: Array) -> None:
    """Advance the eight IMUs of a block by `dt` seconds from ROTATION and DVEL_N.

    AT_POSITION and AT_VELOCITY hold the state at the start of the interval, which the rates and gravity of the last
    interval's middle take to that of this one, where the earth is evaluated. That leaves an error of
    dt^2 / 2 times the change of Coriolis and gravity per second in AT_VELOCITY: with 1e-4 m/s^3 (a turn at 1 m/s^2)
    5e-9 m/s at 100 Hz, and of this times 2 w_ie, 1e-12 m/s^2, in the acceleration.

    `earth_reference` is (geodetic, latitude, sine, cosine, plane gravity), see `earth.evaluate`.
    """
    extrapolate_to_middle(lanes, dt)
    if earth_reference[0] != 0.0:
        earth.evaluate(lanes, earth_reference[1], earth_reference[2], earth_reference[3])
    advance_velocity_and_position(lanes, dt)
    advance_attitude(lanes, dt)
    update_matrix(lanes)


@kernel
def mechanize(lanes: Array, dt: float, ratio: float, earth_reference: Array) -> None:
    """Advance the eight IMUs of a block by `dt` seconds, from corrected increments and each IMU's own state."""
    correct_coning_and_sculling(lanes, ratio)
    rotate_at_own_state(lanes)
    advance(lanes, dt, earth_reference)
