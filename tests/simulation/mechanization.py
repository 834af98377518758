"""A strapdown mechanization of its own, written from the navigation equations, as a judge of simulated increments.

Two-sample coning and sculling terms; Earth rates, gravity and radii at the extrapolated midpoint of each interval.
"""

import numba
import numpy as np

A = 6378137.0
E2 = 0.00669437999014
W = 7.2921151467e-5


@numba.njit
def _gravity(lat, h):
    s2 = np.sin(lat) ** 2
    series = 1 + 0.0052790414 * s2 + 0.0000232718 * s2**2 + 0.0000001262 * s2**3 + 0.0000000007 * s2**4
    return 9.7803267715 * series - (3.0877e-6 - 4.3e-9 * s2) * h + 0.72e-12 * h**2


@numba.njit
def _cross(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@numba.njit
def _product(P, Q):
    R = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                R[i, j] += P[i, k] * Q[k, j]
    return R


@numba.njit
def _rotation(v):
    """Rodrigues' formula: the matrix of a rotation vector."""
    angle2 = v[0] ** 2 + v[1] ** 2 + v[2] ** 2
    angle = np.sqrt(angle2)
    a = np.sin(angle) / angle if angle > 1e-4 else 1 - angle2 / 6
    b = (1 - np.cos(angle)) / angle2 if angle > 1e-4 else 0.5 - angle2 / 24
    K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + a * K + b * _product(K, K)


@numba.njit
def _turned(P, v):
    return np.array([P[0, 0] * v[0] + P[0, 1] * v[1] + P[0, 2] * v[2],
                     P[1, 0] * v[0] + P[1, 1] * v[1] + P[1, 2] * v[2],
                     P[2, 0] * v[0] + P[2, 1] * v[1] + P[2, 2] * v[2]])  # fmt: skip


@numba.njit
def _rates(lat, h, v):
    """Return w_ie, w_en, gravity (all in n), R_M + h, R_N + h."""
    w = 1 - E2 * np.sin(lat) ** 2
    rm, rn = A * (1 - E2) / w**1.5 + h, A / np.sqrt(w) + h
    w_ie = np.array([W * np.cos(lat), 0.0, -W * np.sin(lat)])
    w_en = np.array([v[1] / rn, -v[0] / rm, -v[1] * np.tan(lat) / rn])
    return w_ie, w_en, _gravity(lat, h), rm, rn


@numba.njit
def mechanize(position, velocity, C, dtheta, dvel, dt):
    """Return positions, velocities and C_nb at the end of each interval."""
    count = len(dtheta)
    positions, velocities, attitudes = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3, 3))
    p, v, C = position.copy(), velocity.copy(), np.ascontiguousarray(C)
    last_dtheta, last_dvel, last_change = dtheta[0], dvel[0], np.zeros(3)
    for k in range(count):
        middle = v + last_change / 2
        _, _, _, rm, rn = _rates(p[0], p[2], v)
        lat = p[0] + v[0] / rm * dt / 2
        w_ie, w_en, g, _, _ = _rates(lat, p[2] - v[2] * dt / 2, middle)
        th, dv = dtheta[k], dvel[k]
        turning = _cross(th, dv) / 2 + _cross(th, _cross(th, dv)) / 6
        dv_b = dv + turning + (_cross(last_dtheta, dv) + _cross(last_dvel, th)) / 12
        zeta = (w_ie + w_en) * dt
        dv_n = _turned(_product(_rotation(-zeta / 2), C), dv_b)
        change = dv_n + (np.array([0, 0, g]) - _cross(2 * w_ie + w_en, middle)) * dt
        mean = v + change / 2
        _, w_en, _, rm, rn = _rates(lat, p[2] - mean[2] * dt / 2, mean)
        v = v + change
        lat_rate = mean[0] / rm
        middle_lat = p[0] + lat_rate * dt / 2
        p = np.array([p[0] + lat_rate * dt, p[1] + mean[1] * dt / (rn * np.cos(middle_lat)), p[2] - mean[2] * dt])
        C = _product(_rotation(-(w_ie + w_en) * dt), C)
        C = _product(C, _rotation(th + _cross(last_dtheta, th) / 12))
        positions[k], velocities[k], attitudes[k] = p, v, C
        last_dtheta, last_dvel, last_change = th, dv, change
    return positions, velocities, attitudes
