"""The reference filter for wheels against geometry, closed-form motion, and Wheel-INS's own output."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import reference_filter
from reference_filter import (
    BG,
    I3,
    PHI,
    SG,
    Array,
    Earth,
    Ellipsoid,
    FlatEarth,
    Increment,
    V,
    compensate,
    quaternion_of_vector,
    quaternion_product,
    skew,
)
from reference_wheels import (
    MOUNT,
    N,
    WheelState,
    body_matrix,
    heading,
    lever_arm,
    point_displacement,
    point_velocity,
    point_velocity_derivative,
    rate_derivative,
    rate_over_ground,
    remove_errors,
    run_reference,
    speed_arm,
    vehicle_matrix,
    vehicle_point,
    vehicle_point_derivative,
    velocity_derivative,
    with_errors,
)
from rolling_truth import MODULE, NOISE, ROBOT, RollingTruth, on_wheel, tilted
from scipy.spatial.transform import Rotation

from polyins.model.recording import FilterOptions, ImuStream, Recording, RollingOptions
from polyins.model.rig import Imu, NoiseGrade, Rig

POINT = np.mean([imu.position for imu in ROBOT if imu.wheel is not None], axis=0)
ANTENNA = np.array([0.3, -0.1, -0.9])
HERE = np.array([0.53, 1.99, 20.0])
EARTHS: list[Earth] = [FlatEarth(), Ellipsoid()]
earths = pytest.mark.parametrize("earth", EARTHS, ids=["flat", "ellipsoid"])
members = pytest.mark.parametrize("i", range(len(ROBOT)), ids=[imu.name for imu in ROBOT])
lent_or_not = pytest.mark.parametrize("lends", [True, False], ids=["lent", "level"])


# --- a vehicle caught in random motion --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Instant:
    """True states of the robot's IMUs and what error-free gyros show."""

    states: list[WheelState]
    rates: list[Array]
    C_v: Array
    origin: Array
    """position of the reference point"""
    velocity: Array
    """of POINT in v"""


def random_instant(earth: Earth, seed: int, level: bool = False) -> Instant:
    """Any attitude within some 20 degrees of level, any turn rate; the wheels do not slip sideways at the axle."""
    rng = np.random.default_rng(seed)
    lean = np.zeros(2) if level else rng.normal(0.0, 0.2, 2)
    C_v = Rotation.from_euler("ZYX", [rng.uniform(-np.pi, np.pi), *lean]).as_matrix()
    origin = HERE if isinstance(earth, Ellipsoid) else rng.normal(0.0, 50.0, 3)
    turning = np.array([0.0, 0.0, 1.0]) * rng.normal() if level else rng.normal(0.0, 0.5, 3)
    velocity = np.array([rng.uniform(-2.0, 2.0), 0.0, 0.0])  # of POINT
    states, rates = [], []
    for imu in ROBOT:
        C_module, spin, arm = np.eye(3), np.zeros(3), np.zeros(3)
        if imu.wheel is not None:
            C_module = MODULE @ Rotation.from_rotvec([rng.uniform(-np.pi, np.pi), 0.0, 0.0]).as_matrix()
            spin, arm = np.array([rng.uniform(-15.0, 15.0), 0.0, 0.0]), imu.wheel.lever_arm
        C = C_v @ C_module
        w = C_module.T @ turning + spin
        v = C_v @ (velocity + np.cross(turning, imu.position - POINT)) - C @ np.cross(w, arm)
        position = origin + (C_v @ imu.position - C @ arm) / earth.metres_per_unit(origin)
        state = WheelState(position, v, Rotation.from_matrix(C).as_quat(scalar_first=True))
        states.append(state)
        rates.append(w + C.T @ earth.earth_rate(position))
    return Instant(states, rates, C_v, origin, velocity)


def lender(instant: Instant, lends: bool = True) -> WheelState | None:
    return instant.states[2] if lends else None


@earths
@members
@pytest.mark.parametrize("seed", range(5))
def test_at_the_true_states_speed_and_reference_points_are_the_vehicles(earth: Earth, i: int, seed: int) -> None:
    truth = random_instant(earth, seed)
    imu, state = ROBOT[i], truth.states[i]
    np.testing.assert_allclose(vehicle_matrix(imu, state, lender(truth)), truth.C_v, atol=1e-12)
    predicted = point_velocity(earth, imu, state, lender(truth), truth.rates[i], POINT)
    np.testing.assert_allclose(predicted, truth.velocity, atol=1e-8)
    scale = earth.metres_per_unit(truth.origin)
    for point in (np.zeros(3), ANTENNA):
        found = vehicle_point(earth, imu, state, lender(truth), point)
        expected = truth.origin + truth.C_v @ point / scale
        np.testing.assert_allclose((found - expected) * scale, 0.0, atol=1e-6)


@members
@pytest.mark.parametrize("seed", range(5))
def test_on_level_ground_no_body_is_needed(i: int, seed: int) -> None:
    earth = FlatEarth()
    truth = random_instant(earth, seed, level=True)
    predicted = point_velocity(earth, ROBOT[i], truth.states[i], None, truth.rates[i], POINT)
    np.testing.assert_allclose(predicted, truth.velocity, atol=1e-12)
    found = vehicle_point(earth, ROBOT[i], truth.states[i], None, np.zeros(3))
    np.testing.assert_allclose((found - truth.origin) * [1.0, 1.0, -1.0], 0.0, atol=1e-12)


@earths
@members
def test_a_standing_imu_has_no_residual(earth: Earth, i: int) -> None:
    state = replace(random_instant(earth, 1).states[i], velocity=np.zeros(3))
    rate = state.C.T @ earth.earth_rate(state.position)
    np.testing.assert_allclose(rate_over_ground(earth, state, rate), 0.0, atol=1e-18)


# --- every column against differences ---------------------------------------------------------------------------------

Prediction = Callable[[WheelState, WheelState | None, Array], Array]


def differences(earth: Earth, i: int, truth: Instant, lends: bool, predict: Prediction) -> tuple[Array, Array]:
    """Of a prediction by own and the lender's error states; gyros compensated with what the estimate says."""
    step = 1e-6
    raw = Increment(truth.rates[i], np.zeros(3), 1.0)

    def predicted(dx: Array, lent_dx: Array) -> Array:
        own = with_errors(earth, truth.states[i], dx)
        body = with_errors(earth, truth.states[2], lent_dx) if lends else None
        return predict(own, body, compensate(raw, own.errors).rate)

    def column(j: int, lent: bool) -> Array:
        dx = np.zeros((2, N))
        dx[int(lent), j] = step
        return (predicted(*dx) - predicted(*-dx)) / (2.0 * step)

    return tuple(np.array([column(j, lent) for j in range(N)]).T for lent in (False, True))  # type: ignore[return-value]


def mounted(truth: Instant) -> Instant:
    """The same estimates with mountings that are not zero: lever arms of centimetres, mounts of degrees."""
    values = ((0.01, 0.004, -0.006), (-0.02, -0.003, 0.008), (0.03, 0.02, -0.05))
    states = [replace(s, mounting=np.array(m)) for s, m in zip(truth.states, values, strict=True)]
    return replace(truth, states=states)


@earths
@members
@lent_or_not
@pytest.mark.parametrize("seed", range(3))
def test_derivative_of_the_speed(earth: Earth, i: int, lends: bool, seed: int) -> None:
    truth, speed = mounted(random_instant(earth, seed)), 1.7

    def predict(state: WheelState, body: WheelState | None, rate: Array) -> Array:
        measured = np.array([(1.0 + state.mounting[0]) * speed, 0.0, 0.0])
        return point_velocity(earth, ROBOT[i], state, body, rate, POINT) - measured

    own, lent = point_velocity_derivative(earth, ROBOT[i], truth.states[i], lender(truth, lends), truth.rates[i], POINT)
    own[0, 21] = speed
    expected_own, expected_lent = differences(earth, i, truth, lends, predict)
    # the earth's turning below the lever arm is left out: earth rate x arm
    tolerance = 2e-8 if isinstance(earth, FlatEarth) else 1e-4
    np.testing.assert_allclose(own, expected_own, atol=tolerance)
    np.testing.assert_allclose(lent, expected_lent, atol=tolerance)
    assert np.abs(lent).max() > 0.1 or not lends or i == 2


@earths
@members
@lent_or_not
@pytest.mark.parametrize("point", [np.zeros(3), ANTENNA], ids=["origin", "antenna"])
def test_derivative_of_a_point_of_the_vehicle(earth: Earth, i: int, lends: bool, point: Array) -> None:
    truth = mounted(random_instant(earth, 7))
    scale = earth.metres_per_unit(truth.states[i].position)

    def predict(state: WheelState, body: WheelState | None, rate: Array) -> Array:
        return (vehicle_point(earth, ROBOT[i], state, body, point) - truth.origin) * scale

    own, lent = vehicle_point_derivative(ROBOT[i], truth.states[i], lender(truth, lends), point)
    expected_own, expected_lent = differences(earth, i, truth, lends, predict)
    tolerance = 2e-8 if isinstance(earth, FlatEarth) else 1e-3  # metres out of radians
    np.testing.assert_allclose(own, expected_own, atol=tolerance)
    np.testing.assert_allclose(lent, expected_lent, atol=tolerance)


@earths
@members
def test_derivative_of_a_standstill(earth: Earth, i: int) -> None:
    truth = random_instant(earth, 3)
    expected, _ = differences(earth, i, truth, True, lambda state, _, rate: rate_over_ground(earth, state, rate))
    np.testing.assert_allclose(rate_derivative(truth.rates[i]), expected, atol=1e-4)
    expected, _ = differences(earth, i, truth, True, lambda state, _, rate: state.velocity)
    np.testing.assert_allclose(velocity_derivative(), expected, atol=1e-9)


@pytest.mark.parametrize("i", [0, 1])
@pytest.mark.parametrize("seed", range(3))
def test_columns_of_a_wheel_in_closed_form(i: int, seed: int) -> None:
    """Paper B's (5) and (12) with the signs that differences confirm."""
    earth, truth = FlatEarth(), random_instant(FlatEarth(), seed)
    state, body, w = truth.states[i], truth.states[2], truth.rates[i]
    C, C_v, arm = state.C, truth.C_v, speed_arm(ROBOT[i], state, POINT)
    spinning = C @ np.cross(w, arm)
    pitch, yaw = -np.arcsin(C[2, 0]), np.arctan2(C[1, 0], C[0, 0])
    heading_row = np.array([np.tan(pitch) * np.cos(yaw), np.tan(pitch) * np.sin(yaw), 1.0])
    own, lent = point_velocity_derivative(earth, ROBOT[i], state, body, w, POINT)
    turned = skew(state.velocity + spinning)
    np.testing.assert_allclose(own[:, V], C_v.T, atol=1e-12)
    np.testing.assert_allclose(
        own[:, PHI], C_v.T @ skew(spinning) - np.outer(C_v.T @ turned[:, 2], heading_row), atol=1e-12
    )
    np.testing.assert_allclose(own[:, BG], -C_v.T @ C @ skew(arm), atol=1e-12)
    np.testing.assert_allclose(own[:, SG], -C_v.T @ C @ skew(arm) @ np.diag(w), atol=1e-12)
    np.testing.assert_allclose(own[:, MOUNT], -(C_v.T @ C @ skew(w))[:, 1:], atol=1e-12)
    # the body's phi turns with Rz, its heading goes out
    b = body_matrix(body)[:, 1]
    slope = -b[2] / np.hypot(*b[:2])
    own_heading = np.array([slope * np.cos(heading(b)), slope * np.sin(heading(b)), 1.0])
    turn = Rotation.from_rotvec([0.0, 0.0, heading(C[:, 0]) - heading(b)]).as_matrix()
    psi = turn - np.outer(I3[2], own_heading)
    np.testing.assert_allclose(lent[:, PHI], -C_v.T @ turned @ psi, atol=1e-12)
    np.testing.assert_allclose(lent[:, MOUNT], (C_v.T @ turned @ psi @ body.C)[:, 1:], atol=1e-12)


@pytest.mark.parametrize("i", range(3))
def test_columns_of_the_reference_point_in_closed_form(i: int) -> None:
    truth = random_instant(FlatEarth(), 4)
    imu, state = ROBOT[i], truth.states[i]
    C, C_v, p = state.C, truth.C_v, imu.position
    own, _ = vehicle_point_derivative(imu, state, lender(truth), np.zeros(3))
    if imu.wheel is None:
        np.testing.assert_allclose(own[:, PHI], -skew(C_v @ p), atol=1e-12)
        np.testing.assert_allclose(own[:, MOUNT], (C @ skew(p))[:, 1:], atol=1e-12)
        return
    pitch, yaw = -np.arcsin(C[2, 0]), np.arctan2(C[1, 0], C[0, 0])
    heading_row = np.array([np.tan(pitch) * np.cos(yaw), np.tan(pitch) * np.sin(yaw), 1.0])
    expected = skew(C @ lever_arm(imu, state)) - np.outer(skew(C_v @ p)[:, 2], heading_row)
    np.testing.assert_allclose(own[:, PHI], expected, atol=1e-12)
    np.testing.assert_allclose(own[:, MOUNT], -C[:, 1:], atol=1e-12)


@earths
def test_feedback_removes_what_was_put_in(earth: Earth) -> None:
    truth = random_instant(earth, 2).states[0]
    dx = np.random.default_rng(0).normal(size=N) * 1e-5
    back = remove_errors(earth, with_errors(earth, truth, dx), dx)
    off = (back.position - truth.position) * earth.metres_per_unit(truth.position)
    np.testing.assert_allclose(off, 0.0, atol=1e-9)
    for name in ("velocity", "quaternion", "errors", "mounting"):
        np.testing.assert_allclose(getattr(back, name), getattr(truth, name), atol=1e-9)


# --- the truth in closed form, and the mean over a window -------------------------------------------------------------


def test_the_closed_form_is_a_motion() -> None:
    """Velocities are the positions' differences, and mechanizing the increments leads along the states."""
    truth = RollingTruth(tilt=tilted(0.1, 0.7))
    dt = 1e-3
    time = np.arange(0.0, 0.1, dt)
    for i in range(3):
        states = truth.states(i, time)
        position = np.array([s.position for s in states]) * [1.0, 1.0, -1.0]
        velocity = np.array([s.velocity for s in states])
        np.testing.assert_allclose(np.gradient(position, dt, axis=0)[1:-1], velocity[1:-1], atol=3e-5)
        stream = truth.stream(i, time)
        gravity = np.array([0.0, 0.0, truth.gravity])
        C = np.array([s.C for s in states])
        gained = np.einsum("kij,kj->ki", 0.5 * (C[1:] + C[:-1]), stream.dvel[1:]) + gravity * dt
        np.testing.assert_allclose(np.diff(velocity, axis=0), gained, atol=1e-6)
        for k in range(1, 5):
            turned = quaternion_product(states[k - 1].quaternion, quaternion_of_vector(stream.dtheta[k]))
            assert abs(turned @ states[k].quaternion) == pytest.approx(1.0, abs=1e-12)


@members
def test_the_mean_over_a_window_has_no_residual(i: int) -> None:
    """Twenty samples, tilted plane: to second order of the step; the end of the window is late by half of it.

    What is left at 200 Hz is the trapezoidal rule on the velocity of an IMU that turns 0.07 rad a step.
    """
    truth, rate, window = RollingTruth(tilt=tilted(0.1, 0.7)), 200.0, 20
    errors = []
    for factor in (1, 2):
        dt = 1.0 / rate / factor
        time = 3.0 + dt * np.arange(window * factor + 1)
        own, bodies = truth.states(i, time), truth.states(2, time)
        steps = range(1, len(time))
        ways = [point_displacement(ROBOT[i], own[k - 1], own[k], (bodies[k - 1], bodies[k]), dt, POINT) for k in steps]
        spins = [truth.stream(j, time).dtheta[1:, 0].sum() for j in (0, 1)]
        radii = [imu.wheel.radius for imu in ROBOT if imu.wheel is not None]
        measured = -np.mean([radius * spin for radius, spin in zip(radii, spins, strict=True)])
        errors.append(np.abs(np.sum(ways, axis=0) - [measured, 0.0, 0.0]).max() / (time[-1] - time[0]))
    end = point_velocity(
        FlatEarth(), ROBOT[i], own[-1], bodies[-1], truth.rates(i, time[-1:])[0][0], POINT
    )  # fmt: skip
    late = np.abs(end - [measured / (time[-1] - time[0]), 0.0, 0.0]).max()
    assert errors[0] < 2e-4
    assert errors[1] < errors[0] / 3.5
    assert late > 20.0 * errors[0]


# --- runs -------------------------------------------------------------------------------------------------------------

START_STD = np.concatenate([
    np.full(3, 0.05), np.full(3, 0.05), np.radians([1.0, 1.0, 0.1]), NOISE.steady_std(), np.zeros(3)
])  # fmt: skip


def run_truth(truth: RollingTruth, indices: list[int], recording: Recording, **options: object) -> dict[str, Array]:
    time = recording.imus[0].time
    starts = [truth.states(i, time[:1])[0] for i in indices]
    return run_reference(recording, indices, starts, np.tile(START_STD, (len(indices), 1)), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("joined", [False, True], ids=["distributed", "joined"])
@pytest.mark.parametrize("indices", [[0], [0, 1], [0, 2], [0, 1, 2]], ids=["wheel", "dual", "body-wheel", "triple"])
def test_perfect_increments_keep_to_the_truth(indices: list[int], joined: bool) -> None:
    """Where there is a body the plane is tilted, by six degrees.

    The strapdown of a wheel leaves out dtheta^2 / 6 of the specific force, here 8 mm/s^2 across the plane.
    """
    truth = RollingTruth(tilt=tilted(0.1, 0.7) if 2 in indices else np.eye(3))
    time = np.arange(0.0, 3.0, 0.005)
    result = run_truth(truth, indices, truth.recording(time), joined=joined)
    expected = truth.reference_point(time) * [1.0, 1.0, -1.0]
    off = (result["position"] - expected) * [1.0, 1.0, -1.0] @ truth.tilt
    assert np.abs(off[:, :2]).max() < 5e-4
    assert np.abs(off[:, 2]).max() < 5e-3
    C_v = truth.vehicle_attitude(time)
    heading_error = result["heading"] - np.arctan2(C_v[:, 1, 0], C_v[:, 0, 0])
    assert np.abs(np.arcsin(np.sin(heading_error))).max() < 5e-5
    assert np.ptp(result["reference_points"], axis=1).max() < 5e-3


def test_the_body_alone_keeps_to_the_truth() -> None:
    truth = RollingTruth(tilt=tilted(0.1, 0.7))
    time = np.arange(0.0, 3.0, 0.005)
    result = run_truth(truth, [2], truth.recording(time), wheels=[0, 1], spin_bias=[0.0, 0.0])
    expected = truth.reference_point(time) * [1.0, 1.0, -1.0]
    assert np.abs(result["position"] - expected).max() < 2e-5


def test_the_end_of_the_window_is_late() -> None:
    truth = RollingTruth(v=(1.3, 1.0, 1.5))
    time = np.arange(0.0, 2.0, 0.005)
    rolling = RollingOptions(standstill=False, predict="end")
    late = run_truth(truth, [0], truth.recording(time, rolling=rolling))
    mean = run_truth(truth, [0], truth.recording(time))
    expected = truth.reference_point(time) * [1.0, 1.0, -1.0]
    assert np.abs(late["position"] - expected).max() > 10.0 * np.abs(mean["position"] - expected).max()


def test_what_is_not_coupled_gives_the_same_joined_or_not() -> None:
    """Two wheels, no body, no constraint: nothing makes them correlate."""
    truth = RollingTruth()
    rolling = RollingOptions(standstill=False, constraint_interval=1e9)
    recording = truth.recording(np.arange(0.0, 1.6, 0.005), rolling=rolling, seed=1)
    apart, joined = (run_truth(truth, [0, 1], recording, joined=joined) for joined in (False, True))
    for name in ("imu_position", "errors", "variance"):
        np.testing.assert_allclose(joined[name], apart[name], rtol=1e-9, atol=1e-12)


def test_joined_covariance_knows_what_is_shared() -> None:
    """After the constraint the reference points' errors are correlated, and the lent roll and pitch as well."""
    truth = RollingTruth()
    result = run_truth(truth, [0, 1, 2], truth.recording(np.arange(0.0, 2.1, 0.005), seed=2), joined=True)
    P = result["covariances"][0]
    correlation = P / np.sqrt(np.outer(P.diagonal(), P.diagonal()) + 1e-300)
    assert correlation[0, N] > 0.05
    assert np.abs(correlation[6:9, 2 * N + 6 : 2 * N + 8]).max() > 1e-4
    np.testing.assert_allclose(P, P.T, atol=1e-15)
    live = P.diagonal() > 0.0
    assert np.linalg.eigvalsh(P[np.ix_(live, live)]).min() > 0.0


@pytest.mark.parametrize("joined", [False, True], ids=["distributed", "joined"])
def test_errors_of_the_radius_and_the_lever_arm_are_found(joined: bool) -> None:
    """GNSS every half second makes the speed observable; the lever arm shows in the wheel's turns."""
    truth = RollingTruth()
    time = np.arange(0.0, 8.0, 0.005)
    recording = truth.recording(time, seed=3)
    wrong = list(recording.rig.imus)
    for i, (factor, arm) in enumerate(((1.01, [0.0, 0.003, 0.0]), (1.01, [0.0, 0.0, 0.0]))):
        wheel = wrong[i].wheel
        assert wheel is not None
        changed = replace(wheel, radius=wheel.radius * factor, lever_arm=wheel.lever_arm + np.array(arm))
        wrong[i] = replace(wrong[i], wheel=changed)
    recording = replace(recording, rig=Rig(tuple(wrong), ANTENNA))
    std = np.tile(START_STD, (3, 1))
    std[:, 21] = 0.02
    std[:2, 22:] = 0.005
    antenna = truth.reference_point(time) + truth.vehicle_attitude(time) @ ANTENNA
    gnss = [(k, antenna[k] * [1.0, 1.0, -1.0], np.full(3, 0.005)) for k in range(50, len(time), 100)]
    starts = [truth.states(i, time[:1])[0] for i in range(3)]
    result = run_reference(recording, [0, 1, 2], starts, std, joined=joined, gnss=gnss)
    mounting, variance = result["mounting"][-1], result["variance"][-1]
    expected = np.array([[-0.01 / 1.01, -0.003, 0.0], [-0.01 / 1.01, 0.0, 0.0]])
    assert np.all(variance[:, 21] < 0.013**2)
    assert np.all(variance[:2, 22:] < 0.001**2)
    assert np.all(np.abs(mounting[:2] - expected) < 4.0 * np.sqrt(variance[:2, 21:]))


def test_a_mount_of_the_body_is_found() -> None:
    """From a known velocity and attitude the nonholonomic constraint shows in what direction the body drives."""
    truth = RollingTruth()
    time = np.arange(0.0, 6.0, 0.005)
    recording = truth.recording(time, rolling=RollingOptions(standstill=False, body_speed_std=np.full(3, 0.002)))
    mount = np.array([0.0, 0.03, -0.02])
    turn = np.asarray(Rotation.from_rotvec(-mount).as_matrix())
    body = recording.imus[2]
    turned = ImuStream(body.name, body.time, body.dtheta @ turn.T, body.dvel @ turn.T)
    quiet = replace(NOISE, velocity_random_walk=np.full(3, 1e-4), accel_bias_std=np.full(3, 1e-3))
    rig = Rig((*ROBOT[:2], replace(ROBOT[2], noise=quiet)))
    recording = replace(recording, imus=(*recording.imus[:2], turned), rig=rig)
    start = truth.states(2, time[:1])[0]
    C = start.C @ turn.T
    start = replace(start, quaternion=Rotation.from_matrix(C).as_quat(scalar_first=True))
    std = START_STD.copy()
    std[3:9] = 1e-4
    std[9:21] = quiet.steady_std()
    std[22:] = 0.05
    result = run_reference(recording, [2], [start], std[None], wheels=[0, 1], spin_bias=[0.0, 0.0])
    np.testing.assert_allclose(result["mounting"][-1, 0, 1:], mount[1:], atol=2e-3)


def test_a_standstill_finds_gyro_biases() -> None:
    truth = RollingTruth(v=(1e-9, 0.0, 1.0), h=(0.3, 0.0, 0.0, 1.0))
    time = np.arange(0.0, 2.0, 0.005)
    errors = np.zeros((3, 12))
    errors[:, :3] = np.random.default_rng(5).normal(0.0, 1e-3, (3, 3))
    recording = truth.recording(time, errors, rolling=RollingOptions(standstill=True))
    result = run_truth(truth, [0, 1, 2], recording, standing_std=(0.01, 1e-4))
    np.testing.assert_allclose(result["errors"][-1, :, :3], errors[:, :3], atol=2e-4)


# --- Wheel-INS --------------------------------------------------------------------------------------------------------


def test_one_wheel_goes_where_wheel_ins_goes(data_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve seconds, five of them at rest: a start from zero, level vehicle, no lever arm.

    That program leaves the axle's tilt out of the heading error: some micrometres here.
    """
    monkeypatch.setattr(reference_filter, "SECOND_ORDER", 0.0)
    folder = data_folder / "wheelins-parity"
    if not folder.is_dir():
        pytest.skip(f"no data set: {folder}")
    records = np.frombuffer(gzip.decompress((folder / "wheel_imu.bin.gz").read_bytes()), dtype="<f8").reshape(-1, 7)
    records = records[:2400]
    time = records[:, 0]
    dt = np.diff(time, prepend=2.0 * time[0] - time[1])[:, None]
    grade = NoiseGrade.from_datasheet(
        angle_random_walk_deg_sqrt_h=1.2,
        velocity_random_walk_m_s_sqrt_h=6.0,
        gyro_bias_deg_h=50.0,
        accel_bias_mgal=2000.0,
        gyro_scale_ppm=50.0,
        accel_scale_ppm=500.0,
        correlation_time_h=1.0,
    )
    imu: Imu = replace(on_wheel("wheel", 0.0, 0.3525), noise=grade)
    rolling = RollingOptions(standstill=False, predict="end", wheel_speed_std=np.array([0.035, 0.02, 0.02]))
    recording = Recording(
        Rig((imu,)),
        (ImuStream("wheel", time, records[:, 1:4] * dt, records[:, 4:] * dt),),
        geodetic=False,
        options=FilterOptions(gravity=9.782940329221166, rolling=rolling),
    )
    start = WheelState(np.zeros(3), np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    std = np.concatenate([np.full(6, 0.05), np.radians([1.0, 1.0, 0.1]), grade.steady_std(), np.zeros(3)])
    result = run_reference(recording, [0], [start], std[None])

    expected = np.loadtxt(folder / "expected_traj.txt.gz")
    expected = expected[expected[:, 0] < time[-1] + 1e-4]
    k = np.searchsorted(time, expected[:, 0] - 1e-4)
    assert len(k) == 240
    np.testing.assert_allclose(result["position"][k] * [1.0, 1.0, -1.0], expected[:, 1:4], atol=1e-5)
    np.testing.assert_allclose(result["imu_velocity"][k, 0], expected[:, 4:7], atol=1e-5)
    np.testing.assert_allclose(np.sin(result["heading"][k] - np.radians(expected[:, 9] - 90.0)), 0.0, atol=1e-7)
    std_rows = np.loadtxt(folder / "expected_std.txt.gz")
    std_rows = std_rows[std_rows[:, 0] < time[-1] + 1e-4]
    k = np.searchsorted(time, std_rows[:, 0] - 1e-4)
    units = np.repeat([1.0, 1.0, np.degrees(1.0)], 3)
    np.testing.assert_allclose(np.sqrt(result["variance"][k, 0, :9]) * units, std_rows[:, 1:10], atol=1e-5)
