"""The reference filter against first principles, simulated truth and KF-GINS's own output."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import reference_filter
from numpy.typing import NDArray
from reference_filter import (
    BA,
    BG,
    METHODS,
    PHI,
    SA,
    SG,
    Array,
    Earth,
    Ellipsoid,
    Fix,
    FlatEarth,
    Increment,
    R,
    State,
    V,
    compensate,
    coning_factor,
    error_dynamics,
    euler_of_matrix,
    feed_back,
    matrix_of_quaternion,
    mean_quaternion,
    mechanize,
    move_position,
    move_velocity,
    position_design,
    position_residual,
    predict,
    quaternion_of_euler,
    quaternion_of_vector,
    quaternion_product,
    run,
    run_single,
    skew,
    vector_of_quaternion,
    velocity_design,
    velocity_residual,
    virtual_imu,
)
from scipy.integrate import fixed_quad
from scipy.linalg import expm

from polyins.model.rig import NoiseGrade

DEG = np.pi / 180.0
NAMES = {"r": R, "v": V, "phi": PHI, "bg": BG, "ba": BA, "sg": SG, "sa": SA}

NOISE = NoiseGrade.from_datasheet(
    angle_random_walk_deg_sqrt_h=0.24,
    velocity_random_walk_m_s_sqrt_h=0.24,
    gyro_bias_deg_h=50.0,
    accel_bias_mgal=250.0,
    gyro_scale_ppm=1000.0,
    accel_scale_ppm=1000.0,
    correlation_time_h=1.0,
)
IMU_STD = np.concatenate([NOISE.gyro_bias_std, NOISE.accel_bias_std, NOISE.gyro_scale_std, NOISE.accel_scale_std])


class Sphere(Ellipsoid):
    """The earth whose error dynamics the filter's F describes exactly: constant radii, gravity by Newton's law."""

    e2 = 0.0

    def gravity(self, position: Array) -> float:
        return 9.8 * (self.a / (self.a + position[2])) ** 2


# --- attitude ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rotation", [[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0], [0.3, -1.1, 0.7], [2.0, 1.0, -2.0]])
def test_the_quaternion_of_a_rotation_vector_is_the_matrix_exponential(rotation: list[float]) -> None:
    vector = np.array(rotation)
    q = quaternion_of_vector(vector)
    np.testing.assert_allclose(matrix_of_quaternion(q), expm(skew(vector)), atol=1e-15)
    np.testing.assert_allclose(vector_of_quaternion(-q), vector, atol=1e-15)


def test_products_of_quaternions_are_products_of_matrices() -> None:
    p, q = quaternion_of_vector(np.array([0.3, -1.0, 0.2])), quaternion_of_vector(np.array([-0.5, 0.1, 2.0]))
    expected = matrix_of_quaternion(p) @ matrix_of_quaternion(q)
    np.testing.assert_allclose(matrix_of_quaternion(quaternion_product(p, q)), expected, atol=1e-15)


def test_euler_angles_are_yaw_then_pitch_then_roll() -> None:
    roll, pitch, yaw = 0.2, -1.2, 2.9
    C = expm(yaw * skew(np.eye(3)[2])) @ expm(pitch * skew(np.eye(3)[1])) @ expm(roll * skew(np.eye(3)[0]))
    np.testing.assert_allclose(matrix_of_quaternion(quaternion_of_euler(roll, pitch, yaw)), C, atol=1e-15)
    np.testing.assert_allclose(euler_of_matrix(C), [roll, pitch, yaw], atol=1e-14)


def test_headings_on_both_sides_of_south_average_to_south() -> None:
    west, east = quaternion_of_euler(0.0, 0.0, -179.0 * DEG), quaternion_of_euler(0.0, 0.0, 179.0 * DEG)
    for pair in ([west, east], [west, -east]):
        assert abs(euler_of_matrix(matrix_of_quaternion(mean_quaternion(pair)))[2]) == pytest.approx(np.pi)


# --- earth ------------------------------------------------------------------------------------------------------------


def to_ecef(position: Array) -> Array:
    latitude, longitude, h = position
    n = Ellipsoid.a / np.sqrt(1.0 - Ellipsoid.e2 * np.sin(latitude) ** 2)
    horizontal = (n + h) * np.cos(latitude)
    return np.array([
        horizontal * np.cos(longitude),
        horizontal * np.sin(longitude),
        (n * (1.0 - Ellipsoid.e2) + h) * np.sin(latitude),
    ])  # fmt: skip


def north_east_down(position: Array) -> Array:
    """C_n^e."""
    return np.asarray(expm(position[1] * skew(np.eye(3)[2])) @ expm(-(position[0] + np.pi / 2) * skew(np.eye(3)[1])))


def derivative(function: Callable[[Array], Any], at: Array, step: Array) -> Array:
    """Central differences; the column of each coordinate, last axis."""
    columns = [
        (np.asarray(function(at + e)) - np.asarray(function(at - e))) / (2.0 * h)
        for h, e in zip(step, np.diag(step), strict=True)
    ]
    return np.stack(columns, axis=-1)


PLACE = np.array([0.53, 0.1, 250.0])
STEP = np.array([1e-4, 1e-4, 100.0])


def test_metres_per_unit_are_the_metric_of_the_ellipsoid() -> None:
    jacobian = north_east_down(PLACE).T @ derivative(to_ecef, PLACE, STEP)
    np.testing.assert_allclose(jacobian, np.diag(Ellipsoid().metres_per_unit(PLACE)), rtol=1e-7, atol=0.1)


def test_the_transport_rate_turns_the_local_frame() -> None:
    earth, velocity = Ellipsoid(), np.array([80.0, -150.0, 20.0])
    rate = velocity / earth.metres_per_unit(PLACE)
    change = derivative(lambda t: north_east_down(PLACE + rate * t[0]), np.zeros(1), np.ones(1))[..., 0]
    turned = north_east_down(PLACE).T @ change
    np.testing.assert_allclose(turned, skew(earth.transport(PLACE) @ velocity), atol=1e-14)


def test_the_earth_turns_about_its_axis() -> None:
    rate = north_east_down(PLACE) @ Ellipsoid().earth_rate(PLACE)
    np.testing.assert_allclose(rate, [0.0, 0.0, 7.2921151467e-5], atol=1e-19)


def test_gravity_at_the_equator_the_pole_and_above() -> None:
    earth = Ellipsoid()
    assert earth.gravity(np.zeros(3)) == 9.7803267715
    assert earth.gravity(np.array([np.pi / 2, 0.0, 0.0])) == pytest.approx(9.8321863685, abs=1e-9)  # GRS 80
    slope = derivative(lambda r: np.array([earth.gravity(r)]), PLACE, STEP)[0, 2]
    assert -slope == pytest.approx(earth.gravity_gradient(PLACE), rel=0.01)


def test_gradients_on_the_sphere_are_derivatives() -> None:
    earth, velocity = Sphere(), np.array([80.0, -150.0, 20.0])
    per_metre = 1.0 / earth.metres_per_unit(PLACE)
    by_earth_rate = derivative(earth.earth_rate, PLACE, STEP) * per_metre
    by_transport = derivative(lambda r: earth.transport(r) @ velocity, PLACE, STEP) * per_metre
    by_gravity = derivative(lambda r: np.array([earth.gravity(r)]), PLACE, STEP)[0] * per_metre
    np.testing.assert_allclose(earth.earth_rate_gradient(PLACE), by_earth_rate, rtol=1e-7, atol=1e-20)
    np.testing.assert_allclose(earth.transport_gradient(PLACE, velocity), by_transport, rtol=1e-7, atol=1e-20)
    np.testing.assert_allclose([0.0, 0.0, earth.gravity_gradient(PLACE)], by_gravity, rtol=1e-7, atol=1e-15)


# --- error model ------------------------------------------------------------------------------------------------------

MOVING = State(PLACE, np.array([30.0, -50.0, 8.0]), quaternion_of_euler(0.3, -0.4, 2.0), np.full(12, 1e-3))
SIZES = np.repeat([1e4, 1.0, 1e-4, 1e-3, 1e-1, 1e-3, 1e-3], 3)


def with_error(earth: Earth, truth: State, dx: Array) -> State:
    """The estimate whose error is dx, after the definitions at the top of the reference filter."""
    return State(
        truth.position + dx[R] / earth.metres_per_unit(truth.position),
        truth.velocity + dx[V],
        quaternion_product(quaternion_of_vector(-dx[PHI]), truth.quaternion),
        truth.errors - dx[9:],
    )


def error_of(earth: Earth, estimate: State, truth: State) -> Array:
    relative = quaternion_product(estimate.quaternion, truth.quaternion * [1.0, -1.0, -1.0, -1.0])
    return np.concatenate([
        earth.metres_per_unit(truth.position) * (estimate.position - truth.position),
        estimate.velocity - truth.velocity,
        -vector_of_quaternion(relative),
        truth.errors - estimate.errors,
    ])  # fmt: skip


def test_feeding_the_error_back_gives_the_truth() -> None:
    earth, dx = Sphere(), 1e-3 * SIZES
    corrected = feed_back(earth, with_error(earth, MOVING, dx), dx)
    assert np.all(np.abs(error_of(earth, corrected, MOVING)) < 1e-5 * np.abs(dx))


def rows_agree(actual: Array, expected: Array, tolerance: float, floor: Array) -> None:
    """Compare row by row within each 3 x 3 block: `tolerance` relative to the row's largest element, plus `floor`."""
    for row in range(len(actual)):
        for name, columns in NAMES.items():
            scale = np.abs(expected[row, columns]).max()
            difference = np.abs(actual[row, columns] - expected[row, columns]).max()
            allowed = tolerance * scale + floor[row, columns].max()
            assert difference <= allowed, f"row {row} by {name}: {difference} of {scale}"


@pytest.mark.parametrize(
    ("earth", "tolerance"),
    [(Sphere(), 2e-3), (Ellipsoid(), 0.015), (FlatEarth(), 2e-3)],
    ids=["sphere", "wgs84", "flat"],
)
def test_error_dynamics_are_the_derivative_of_the_mechanization(earth: Earth, tolerance: float) -> None:
    dt = 2e-3
    raw = Increment(np.array([0.3, -0.2, 0.5]) * dt, np.array([1.0, 2.0, -9.0]) * dt, dt)

    def step(dx: Array) -> State:
        state = with_error(earth, MOVING, dx)
        current = compensate(raw, state.errors)
        return mechanize(earth, state, current, current, rescale_coning=True)

    after = step(np.zeros(21))
    jacobian = derivative(lambda dx: error_of(earth, step(dx), after), np.zeros(21), SIZES)
    current = compensate(raw, MOVING.errors)
    F = error_dynamics(earth, MOVING, current.rate, current.force, np.inf)
    # Where the filter's first order is zero, the second one is what there is to see; the third one is not compared.
    expected = F * dt + F @ F * dt**2 / 2.0
    third_order = np.linalg.matrix_power(np.abs(F) * dt, 3)
    rounding = np.repeat([1e-9, 1e-14, 1e-15], 3)[:, None] / SIZES
    rows_agree((jacobian - np.eye(21))[:9], expected[:9], tolerance, third_order[:9] + rounding)


def test_design_matrices_are_the_derivatives_of_the_residuals() -> None:
    earth, arm = Sphere(), np.array([0.4, -0.7, -1.1])
    raw = Increment(np.array([0.6, -0.3, 0.5]) * 0.01, np.zeros(3), 0.01)
    fix = Fix(0.0, move_position(earth, MOVING, arm), np.ones(3), np.array([1.0, 2.0, 3.0]), np.ones(3))

    def position(dx: Array) -> Array:
        return position_residual(earth, with_error(earth, MOVING, dx), arm, fix)

    def velocity(dx: Array) -> Array:
        state = with_error(earth, MOVING, dx)
        return velocity_residual(earth, state, compensate(raw, state.errors).rate, arm, fix)

    rate = compensate(raw, MOVING.errors).rate
    H = velocity_design(earth, MOVING.position, MOVING.C, rate, arm)
    # The compensation divides by 1 + scale, which the design takes as one.
    H[:, BG] /= 1.0 + MOVING.errors[6:9]
    H[:, SG] /= 1.0 + MOVING.errors[6:9]
    zero, floor = np.zeros(21), np.full((3, 21), 1e-14)
    near = np.where(np.arange(21) < 3, 1.0, SIZES)  # metres per radian, too, change with the position
    rows_agree(derivative(position, zero, near), position_design(MOVING.C, arm), 1e-5, floor + 1e-9 / near)
    rows_agree(derivative(velocity, zero, SIZES), H, 1e-5, floor * 1e-3 + 1e-14 / SIZES)


def test_random_walks_grow_and_biases_keep_their_steady_state() -> None:
    earth, dt, count = FlatEarth(), 0.01, 500
    state = State(np.zeros(3), np.zeros(3), quaternion_of_euler(0.3, -0.4, 2.0))
    noise = replace(NOISE, correlation_time=2.0, gyro_bias_std=np.zeros(3), gyro_scale_std=np.zeros(3))
    P = np.diag(np.concatenate([np.zeros(12), noise.accel_bias_std, np.zeros(3), noise.accel_scale_std]) ** 2)
    first = np.diag(P).copy()
    for _ in range(count):
        P = predict(earth, P, state, np.zeros(3), np.zeros(3), dt, noise)
    np.testing.assert_allclose(P[PHI, PHI], np.diag(noise.angle_random_walk**2 * dt * count), rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(np.diag(P)[9:], first[9:], rtol=3e-3)  # first order in dt / correlation time
    # Without bias the velocity is a random walk and the position its integral, t^3 / 3.
    no_bias = replace(noise, accel_bias_std=np.zeros(3), accel_scale_std=np.zeros(3))
    P = np.zeros((21, 21))
    for _ in range(count):
        P = predict(earth, P, state, np.zeros(3), np.zeros(3), dt, no_bias)
    density, t = noise.velocity_random_walk[0] ** 2, dt * count
    np.testing.assert_allclose(np.diag(P)[V], density * t, rtol=1e-12)
    np.testing.assert_allclose(np.diag(P)[R], density * t**3 / 3.0, rtol=1e-4)


# --- coning, sculling -------------------------------------------------------------------------------------------------


def test_equal_intervals_give_one_twelfth() -> None:
    assert coning_factor(0.005, 0.005, rescale=True) == pytest.approx(1.0 / 12.0)
    assert coning_factor(0.002, 0.005, rescale=False) == 1.0 / 12.0


@pytest.mark.parametrize(("before", "now"), [(0.02, 0.02), (0.005, 0.02), (0.02, 0.005)])
def test_rescaled_coning_and_sculling_are_exact_for_rates_linear_in_time(before: float, now: float) -> None:
    earth, q0 = FlatEarth(), np.array([1.0, 0.0, 0.0, 0.0])
    rate, rate_slope = np.array([0.5, -0.2, 0.3]), np.array([-2.0, 4.0, 1.0])
    force, force_slope = np.array([1.0, 3.0, -9.0]), np.array([30.0, -20.0, 10.0])

    def over(start: float, end: float) -> Increment:
        linear, square = end - start, 0.5 * (end**2 - start**2)
        return Increment(rate * linear + rate_slope * square, force * linear + force_slope * square, linear)

    pieces, state, C = 400, State(np.zeros(3), np.zeros(3), q0), np.eye(3)
    velocity = np.zeros(3)
    for k in range(pieces):  # midpoint rule on C' = C (w x), v' = C f
        t, h = (k + 0.5) * now / pieces, now / pieces
        w = rate + rate_slope * t
        velocity = velocity + C @ expm(skew(w * h / 2.0)) @ (force + force_slope * t) * h
        C = C @ expm(skew(w * h))
    velocity[2] += earth.g * now

    def miss(rescale: bool) -> tuple[float, float]:
        out = mechanize(earth, state, over(-before, 0.0), over(0.0, now), rescale)
        return float(np.linalg.norm(out.C - C)), float(np.linalg.norm(out.velocity - velocity))

    angle, speed = miss(rescale=True)
    current = over(0.0, now)
    third_order = np.linalg.norm(current.dtheta) ** 2 * np.linalg.norm(current.dvel) / 6.0
    assert angle < 2e-9
    assert speed < 1.1 * third_order
    if before != now:
        wrong_angle, wrong_speed = miss(rescale=False)
        assert wrong_angle > 10.0 * angle
        assert wrong_speed > 3.0 * speed


# --- arrays over a simulated truth ------------------------------------------------------------------------------------


@dataclass
class Truth:
    """An array that turns about a tilted axis through its origin, which drives straight on (flat) or stands (earth)."""

    earth: Earth
    positions: Array
    antenna: Array
    amplitude: float
    """of a swing on top of the steady turn, rad"""

    def __post_init__(self) -> None:
        self.axis = np.array([0.6, 0.0, 0.8])
        self.q0 = quaternion_of_euler(0.1, -0.2, 2.5)
        flat = isinstance(self.earth, FlatEarth)
        self.origin = np.array([10.0, 20.0, 5.0]) if flat else np.array([30.46 * DEG, 114.47 * DEG, 20.0])
        self.velocity = np.array([2.0, -1.0, 0.3]) if flat else np.zeros(3)

    def swing(self, t: float) -> tuple[float, float, float]:
        """Angle, its rate and acceleration."""
        a, s, c = self.amplitude, np.sin(2.0 * t), np.cos(2.0 * t)
        return a * s + 0.5 * t, 2.0 * a * c + 0.5, -4.0 * a * s

    def quaternion(self, t: float) -> Array:
        return quaternion_product(self.q0, quaternion_of_vector(self.axis * self.swing(t)[0]))

    def position(self, t: float, arm: Array) -> Array:
        metres = self.velocity * t + matrix_of_quaternion(self.quaternion(t)) @ arm
        return self.origin + metres / self.earth.metres_per_unit(self.origin)

    def point_velocity(self, t: float, arm: Array) -> Array:
        rate = self.axis * self.swing(t)[1]
        return self.velocity + matrix_of_quaternion(self.quaternion(t)) @ np.cross(rate, arm)

    def sensed(self, t: float, arm: Array) -> Array:
        """Angular rate w_ib and specific force of an IMU at `arm`, six numbers."""
        C = matrix_of_quaternion(self.quaternion(t))
        rate, acceleration = self.axis * self.swing(t)[1], self.axis * self.swing(t)[2]
        w_ie = self.earth.earth_rate(self.origin)
        gravity = np.array([0.0, 0.0, self.earth.gravity(self.position(t, arm))])
        coriolis = np.cross(2.0 * w_ie, self.point_velocity(t, arm))
        at_point = np.cross(rate, np.cross(rate, arm)) + np.cross(acceleration, arm)
        return np.concatenate([rate + C.T @ w_ie, at_point + C.T @ (coriolis - gravity)])

    def recording(self, rate_hz: float, duration: float) -> tuple[Array, Array, Array]:
        time = np.arange(round(rate_hz * duration)) / rate_hz
        data = np.array([[self.increment(t - 1.0 / rate_hz, t, arm) for arm in self.positions] for t in time])
        return time, data[..., :3], data[..., 3:]

    def increment(self, start: float, end: float, arm: Array) -> Array:
        def many(times: Array) -> Array:
            return np.stack([self.sensed(t, arm) for t in times], axis=-1)

        return np.asarray(fixed_quad(many, start, end, n=3)[0])

    def fixes(self, times: Array, with_velocity: bool) -> list[Fix]:
        std = np.full(3, 0.02)
        velocities = [self.point_velocity(t, self.antenna) if with_velocity else None for t in times]
        return [
            Fix(t, self.position(t, self.antenna), std, velocity, std)
            for t, velocity in zip(times, velocities, strict=True)
        ]

    def start(self, t: float) -> State:
        return State(self.position(t, np.zeros(3)), self.point_velocity(t, np.zeros(3)), self.quaternion(t))


POSITIONS = np.array([[0.3, 0.1, 0.0], [-0.2, 0.25, 0.05], [0.1, -0.3, -0.1], [0.2, 0.2, 0.3]])
ANTENNA = np.array([0.4, -0.6, -0.9])
START_STD = np.concatenate([[0.05] * 3, [0.05] * 3, np.array([0.3, 0.3, 0.5]) * DEG, IMU_STD])
FIX_TIMES = np.array([0.2033, 0.4, 0.6017, 0.8, 1.2, 1.4017, 1.4031])  # between epochs, at epochs, two in one interval


@pytest.fixture(scope="module", params=[FlatEarth(), Ellipsoid()], ids=["flat", "wgs84"])
def truth(request: pytest.FixtureRequest) -> Truth:
    return Truth(request.param, POSITIONS, ANTENNA, amplitude=0.4)


@pytest.fixture(scope="module")
def recording(truth: Truth) -> tuple[Array, Array, Array]:
    return truth.recording(200.0, 1.5)


def worst_off(truth: Truth, result: dict[str, Any]) -> tuple[float, float]:
    """Largest distance of the fused position (m) and velocity (m/s) from those of the array origin."""
    expected = np.array([truth.position(t, np.zeros(3)) for t in result["time"]])
    metres = (result["position"] - expected) * truth.earth.metres_per_unit(truth.origin)
    return float(np.abs(metres).max()), float(np.abs(result["velocity"] - truth.velocity).max())


@pytest.mark.parametrize("method", METHODS[1:])
def test_the_truth_has_no_residuals(truth: Truth, recording: tuple[Array, Array, Array], method: str) -> None:
    fixes = truth.fixes(FIX_TIMES, with_velocity=False)
    result = run(
        method, *recording, POSITIONS, ANTENNA, fixes, truth.start(0.0), START_STD, NOISE, earth=truth.earth
    )  # fmt: skip
    # The differenced angular acceleration of the virtual IMU lags by half an interval, and so does the rate with which
    # the fused velocity is seen from each IMU, whose own position takes that up; the mean does not.
    tolerance = 1e-4 if method == "imu-fusion" else 1e-5
    each = 1e-3 if method == "enav-fusion-shared-mechanization" else tolerance
    assert len(result["innovation"]) == len(FIX_TIMES)
    assert np.abs(result["innovation"]).max() < each
    metres, speed = worst_off(truth, result)
    assert metres < tolerance
    assert speed < 5e-4  # the projection's mean rate lags by half an interval, too
    attitudes = np.array([truth.quaternion(t) for t in result["time"]])
    assert np.abs(np.abs(np.sum(attitudes * result["quaternion"], axis=1)) - 1.0).max() < 1e-10


@pytest.mark.parametrize("method", METHODS[1:])
@pytest.mark.parametrize("earth", [FlatEarth(), Ellipsoid()], ids=["flat", "wgs84"])
def test_true_velocities_change_nothing_in_a_steady_turn(earth: Earth, method: str) -> None:
    turn = Truth(earth, POSITIONS, ANTENNA, amplitude=0.0)
    fixes = turn.fixes(np.array([0.1033, 0.2, 0.3017]), with_velocity=True)
    recording = turn.recording(200.0, 0.4)
    result = run(method, *recording, POSITIONS, ANTENNA, fixes, turn.start(0.0), START_STD, NOISE, earth=earth)
    assert np.linalg.norm(fixes[0].velocity - turn.velocity) > 0.2  # type: ignore[operator]
    assert np.abs(result["innovation"]).max() < 2e-6
    metres, speed = worst_off(turn, result)
    assert metres < 2e-6
    assert speed < 1e-5


def test_the_virtual_imu_senses_what_the_origin_senses(truth: Truth, recording: tuple[Array, Array, Array]) -> None:
    time, dtheta, dvel = recording
    mean_dtheta, mean_dvel = virtual_imu(time, dtheta, dvel, POSITIONS)
    origin = Truth(truth.earth, np.zeros((1, 3)), ANTENNA, truth.amplitude).recording(200.0, 1.5)
    np.testing.assert_allclose(mean_dtheta, origin[1][:, 0], atol=1e-12)
    dt = time[1] - time[0]
    lag = 3.2 * 0.5 * dt * np.linalg.norm(POSITIONS.mean(axis=0))  # largest jerk times half an interval times the arm
    assert np.abs(mean_dvel - origin[2][:, 0])[1:].max() < 1.1 * lag * dt
    assert np.abs(dvel.mean(axis=1) - origin[2][:, 0])[1:].max() > 20.0 * lag * dt  # what leaving it out would cost


def test_projections_there_and_back_cancel(truth: Truth) -> None:
    state, rate, arm = truth.start(0.3), np.array([0.3, -0.4, 0.9]), np.array([0.5, -1.0, 0.2])
    there = replace(
        state,
        position=move_position(truth.earth, state, arm),
        velocity=move_velocity(truth.earth, state, rate, arm),
    )
    assert np.linalg.norm(there.velocity - state.velocity) > 0.1
    np.testing.assert_allclose(move_velocity(truth.earth, there, rate, -arm), state.velocity, atol=1e-10)
    np.testing.assert_allclose(move_position(truth.earth, there, -arm), state.position, rtol=1e-12)


# --- what must not matter ---------------------------------------------------------------------------------------------


def noisy(time: Array, seed: int, imus: int) -> tuple[Array, Array]:
    """Raw increments (T, N, 3) of a standing array with noise and biases of its own."""
    rng = np.random.default_rng(seed)
    dtheta = rng.normal(0.0, 1e-4, (len(time), imus, 3)) + rng.normal(0.0, 1e-6, (imus, 3))
    standing = np.array([0.0, 0.0, -9.79 * 0.005])
    dvel = rng.normal(0.0, 1e-3, (len(time), imus, 3)) + standing + rng.normal(0.0, 1e-5, (imus, 3))
    return dtheta, dvel


TIME = np.arange(300) / 200.0
HOME = State(np.array([30.46 * DEG, 114.47 * DEG, 20.0]), np.zeros(3), quaternion_of_euler(0.0, 0.0, 1.0))
NEAR_HOME = HOME.position + np.array([1e-9, -2e-9, 0.01])
FIXES = [
    Fix(t, NEAR_HOME, np.full(3, 0.02), np.array([0.01, 0.0, 0.0]), np.full(3, 0.05)) for t in (0.3021, 0.7, 1.1033)
]


def assert_same(actual: dict[str, Any], expected: dict[str, Any], rtol: float) -> None:
    for name in ("position", "velocity", "quaternion"):
        scale = np.abs(expected[name]).max()
        np.testing.assert_allclose(actual[name], expected[name], rtol=rtol, atol=rtol * scale)


@pytest.mark.parametrize("method", METHODS[1:])
def test_identical_imus_at_one_place_navigate_like_one(method: str) -> None:
    dtheta, dvel = noisy(TIME, seed=1, imus=1)
    arm = np.array([0.136, -0.301, -0.184])
    one = run_single(TIME, dtheta[:, 0], dvel[:, 0], arm, FIXES, HOME, START_STD, NOISE)
    three = np.repeat(dtheta, 3, axis=1), np.repeat(dvel, 3, axis=1)
    many = run(
        method, TIME, *three, np.zeros((3, 3)), arm, FIXES, HOME, START_STD, NOISE
    )  # fmt: skip
    assert_same(many, one, 1e-12)
    deviation = np.abs(many["errors"] - one["errors"][:, None]) / np.sqrt(one["variance"][:, None, 9:])
    assert deviation.max() < 1e-10
    np.testing.assert_allclose(many["variance"], np.repeat(one["variance"][:, None], many["variance"].shape[1], axis=1),
                               rtol=1e-11)  # fmt: skip


@pytest.mark.parametrize("method", [m for m in METHODS if m != "imu-fusion"])
def test_an_array_of_one_is_the_single_imu_to_the_last_bit(method: str) -> None:
    dtheta, dvel = noisy(TIME, seed=2, imus=1)
    place = np.array([[0.2, 0.3, -0.1]])
    one = run_single(TIME, dtheta[:, 0], dvel[:, 0], ANTENNA - place[0], FIXES, HOME, START_STD, NOISE)
    array = run(method, TIME, dtheta, dvel, place, ANTENNA, FIXES, HOME, START_STD, NOISE)
    for name in ("position", "velocity", "quaternion", "innovation_time"):
        np.testing.assert_array_equal(array[name], one[name])
    np.testing.assert_array_equal(array["variance"][:, 0], one["variance"])


def test_each_imu_learns_its_own_biases_from_the_common_gain() -> None:
    time = np.arange(1200) / 100.0
    bias = np.array([[0.05, 0.0, 0.02], [-0.03, 0.0, 0.01]])
    dtheta = np.zeros((len(time), 2, 3))
    dvel = np.tile(np.array([0.0, 0.0, -9.80665]) * 0.01 + bias * 0.01, (len(time), 1, 1))
    start = State(np.zeros(3), np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    noise = replace(NOISE, accel_bias_std=np.full(3, 0.05), accel_scale_std=np.full(3, 1e-9))
    std = np.concatenate([np.full(6, 0.01), np.full(3, 1e-5), np.zeros(3), np.full(3, 0.05), np.zeros(6)])
    fixes = [Fix(t, np.zeros(3), np.full(3, 0.005)) for t in np.arange(1.003, 12.0)]
    positions = np.zeros((2, 3))
    for method in ("nav-fusion", "enav-fusion"):
        result = run(method, time, dtheta, dvel, positions, np.zeros(3), fixes, start, std, noise, earth=FlatEarth())
        np.testing.assert_allclose(result["errors"][-1][:, 3:6], bias, atol=2e-3)


def test_the_covariance_stays_symmetric_and_positive() -> None:
    dtheta, dvel = noisy(TIME, seed=4, imus=2)
    for method in ("nav-fusion", "enav-fusion"):
        result = run(method, TIME, dtheta, dvel, POSITIONS[:2], ANTENNA, FIXES, HOME, START_STD, NOISE)
        scale = np.sqrt(result["variance"][-1])
        correlation = result["covariance"] / (scale[:, :, None] * scale[:, None, :])
        np.testing.assert_allclose(correlation, correlation.transpose(0, 2, 1), atol=1e-12)
        assert np.linalg.eigvalsh(correlation).min() > 0.0


# --- when a fix is used -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("offset", [-0.0009, 0.0009])
def test_a_fix_next_to_an_epoch_is_used_at_that_epoch(offset: float) -> None:
    dtheta, dvel = noisy(TIME, seed=5, imus=1)

    def at(time: float) -> dict[str, Any]:
        fixes = [replace(FIXES[0], time=time)]
        return run_single(TIME, dtheta[:, 0], dvel[:, 0], ANTENNA, fixes, HOME, START_STD, NOISE)

    near, exact = at(0.3 + offset), at(0.3)
    np.testing.assert_array_equal(near["position"], exact["position"])
    assert at(0.3 + 2.0 * offset)["position"][61, 2] != exact["position"][61, 2]


def test_a_fix_just_after_another_is_used_where_that_one_was() -> None:
    dtheta, dvel = noisy(TIME, seed=8, imus=1)

    def second_at(time: float) -> dict[str, Any]:
        fixes = [replace(FIXES[0], time=0.3021), replace(FIXES[0], time=time)]
        return run_single(TIME, dtheta[:, 0], dvel[:, 0], ANTENNA, fixes, HOME, START_STD, NOISE)

    near, same = second_at(0.3026), second_at(0.3021)
    np.testing.assert_array_equal(near["position"], same["position"])
    assert second_at(0.3033)["position"][61, 2] != same["position"][61, 2]


def test_splitting_an_interval_changes_hardly_anything_when_the_fix_says_nothing() -> None:
    dtheta, dvel = noisy(TIME, seed=6, imus=1)
    silent = [Fix(t, HOME.position, np.full(3, 1e9)) for t in (0.3021, 0.3032, 0.9015)]
    inputs = (TIME, dtheta[:, 0], dvel[:, 0], ANTENNA)
    split = run_single(*inputs, silent, HOME, START_STD, NOISE)
    whole = run_single(*inputs, [], HOME, START_STD, NOISE)
    assert len(split["innovation"]) == 3
    np.testing.assert_allclose(split["velocity"], whole["velocity"], atol=1e-6)
    np.testing.assert_allclose(split["variance"], whole["variance"], rtol=1e-4)


def test_fixes_up_to_the_start_are_left_out() -> None:
    dtheta, dvel = noisy(TIME, seed=7, imus=1)
    early = [replace(FIXES[0], time=t) for t in (-1.0, 0.0)]
    result = run_single(TIME, dtheta[:, 0], dvel[:, 0], ANTENNA, early, HOME, START_STD, NOISE)
    assert len(result["innovation"]) == 0


# --- KF-GINS ----------------------------------------------------------------------------------------------------------


def test_the_single_imu_filter_reproduces_kf_gins(data_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference_filter, "SECOND_ORDER", 0.0)
    folder = data_folder / "kfgins-parity"
    if not folder.is_dir():
        pytest.skip(f"no data set: {folder}")
    imu = np.loadtxt(folder / "imu.txt.gz")
    imu = imu[(imu[:, 0] > 100000.007) & (imu[:, 0] <= 100300.0)]
    gnss = np.loadtxt(folder / "gnss.txt")
    fixes = [Fix(row[0], row[1:4] * [DEG, DEG, 1.0], row[4:7]) for row in gnss]
    start = State(np.array([30.46 * DEG, 114.47 * DEG, 20.0]), np.zeros(3),
                  quaternion_of_euler(0.1 * DEG, -0.1 * DEG, 40.607046 * DEG))  # fmt: skip
    std = np.concatenate([[0.1, 0.1, 0.2], [0.05] * 3, np.array([0.5, 0.5, 1.0]) * DEG, IMU_STD])
    arm = np.array([0.136, -0.301, -0.184])
    result = run_single(imu[:, 0], imu[:, 1:4], imu[:, 4:7], arm, fixes, start, std, NOISE, rescale_coning=False)

    def rows(name: str, column: int) -> tuple[Array, NDArray[np.intp]]:
        expected = np.loadtxt(folder / name)
        k = np.searchsorted(result["time"], expected[:, column] - 1e-6)
        np.testing.assert_allclose(result["time"][k], expected[:, column], atol=1e-6)
        return expected, k

    nav, k = rows("expected_nav.txt.gz", 1)
    metres = Ellipsoid().metres_per_unit(start.position) * [DEG, DEG, 1.0]
    euler = np.array([euler_of_matrix(matrix_of_quaternion(q)) for q in result["quaternion"][k]]) / DEG
    turn = (euler - nav[:, 8:11] + 180.0) % 360.0 - 180.0
    settled = nav[:, 1] > nav[0, 1] + 10.0
    assert len(nav) == 6000
    assert np.abs((result["position"][k] / [DEG, DEG, 1.0] - nav[:, 2:5]) * metres).max() < 1e-4
    assert np.abs(result["velocity"][k] - nav[:, 5:8]).max() < 5e-7
    assert np.abs(turn[settled]).max() < 2e-6

    units = np.repeat([1.0, 1.0, 1.0 / DEG, 3600.0 / DEG, 1e5, 1e6, 1e6], 3)
    expected_std, k = rows("expected_std.txt.gz", 0)
    np.testing.assert_allclose(np.sqrt(result["variance"][k]) * units, expected_std[:, 1:], rtol=1e-6)
    errors, k = rows("expected_imu_err.txt.gz", 0)
    difference = result["errors"][k] * units[9:] - errors[:, 1:]
    assert np.abs(difference / expected_std[:, 10:]).max() < 1e-4
