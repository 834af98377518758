"""The compiled engine against the reference filter, for rigs with wheels.

Both begin with the same states, near the true ones, so that alignment plays no part. Measured on a plane: 2e-13 in
metres, m/s, rad, and in covariances relative to their standard deviations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
import reference_wheels
from reference_filter import Array, Ellipsoid, FlatEarth, skew
from reference_wheels import N, WheelState, body_matrix, run_reference, with_errors
from rolling_truth import NOISE, RollingTruth, on_body, on_wheel, tilted
from scipy.spatial.transform import Rotation

from polyins.aiding import kinds
from polyins.kernels import bank
from polyins.kernels import covariance as cov
from polyins.kernels.bank import LANES
from polyins.model.recording import GnssStream, Recording, RollingOptions, StartOptions
from polyins.model.rig import Rig
from polyins.navigate import batch, engine, update
from polyins.navigate.events import ZERO_RATE_STD, ZERO_VELOCITY_STD

ANTENNA = np.array([0.3, -0.1, -0.9])
WUHAN = np.array([np.radians(30.5278), np.radians(114.3557), 35.0])
UP = np.array([1.0, 1.0, -1.0])
TILTED = RollingTruth(tilt=tilted(0.06, 0.7))
SECONDS = 3.3  # 660 epochs: six speeds, three reference points
FIXES = range(30, 650, 100)
"""epochs outside the windows of the speed: what a fix teaches inside one, the travel added up before does not know"""
MEMBERS = {
    "wheel-ins": [0],
    "dual-wheel-ins": [0, 1],
    "body-wheel-ins": [0, 2],
    "triple-ins": [0, 1, 2],
    "body-ins": [2],
}


def covariance(run: batch.Prepared) -> list[Array]:
    """One block for each navigator, or one of all if joined."""
    if len(run.state.joint):
        return [whole(run)]
    for g in run.state.blocks[: len(run.plan.spans)]:
        cov.complete(g, cov.STRIDE)
    return [block.copy() for block in covariance_blocks(run)]


def whole(run: batch.Prepared) -> Array:
    """Between updates what is right of the diagonal blocks is in the joint matrix, those themselves in the blocks."""
    P = np.triu(run.state.joint, 1)
    for s, g in enumerate(run.state.blocks[: len(run.plan.spans)]):
        cov.complete(g, cov.STRIDE)
        P[N * s : N * s + N, N * s : N * s + N] = np.triu(covariance_blocks(run)[s])
    return np.asarray(np.triu(P) + np.triu(P, 1).T)


def of_each_imu(run: batch.Prepared, field: int, count: int) -> Array:
    rows = run.state.rows
    lanes = [first for first, _ in run.plan.spans]
    return np.array([rows[i // LANES, field + i % LANES :: LANES][:count] for i in lanes])


@dataclass(frozen=True)
class Drive:
    """A closed-form motion, its noisy recording, and where it takes place."""

    truth: RollingTruth
    recording: Recording


def drive(
    truth: RollingTruth = TILTED,
    seconds: float = SECONDS,
    geodetic: bool = False,
    gnss: Sequence[int] = (),
    **options: Any,
) -> Drive:
    """On the ellipsoid the same increments are taken for what IMUs there show, which is as good for comparing."""
    time = np.arange(0.0, seconds, 0.005)
    rng = np.random.default_rng(0)
    errors = rng.normal(size=(len(truth.imus), 12)) * NOISE.steady_std()
    recording = truth.recording(time, errors, RollingOptions(**{"standstill": False} | options), seed=0)
    start = StartOptions(
        time=0.0,
        position=WUHAN if geodetic else np.zeros(3),
        velocity=np.zeros(3),
        roll_pitch=np.zeros(2),
        heading=0.0,
        position_std=np.full(3, 0.05),
        velocity_std=np.full(3, 0.05),
        attitude_std=np.radians([1.0, 1.0, 0.5]),
        estimate_gyro_bias=False,
    )
    fixes = None
    if gnss:
        k = list(gnss)
        places = truth.reference_point(time)[k] + truth.vehicle_attitude(time[k]) @ ANTENNA
        places = (places + rng.normal(0.0, 0.02, (len(k), 3))) * UP
        if geodetic:
            places = WUHAN + places * UP / Ellipsoid().metres_per_unit(WUHAN)
        fixes = GnssStream(time[k], places, np.full((len(k), 3), 0.02))
    rig = Rig(tuple(truth.imus), ANTENNA)
    return Drive(truth, replace(recording, start=start, geodetic=geodetic, gnss=fixes, rig=rig))


def prepared(way: Drive, method: str) -> tuple[batch.Prepared, list[WheelState]]:
    """The engine at its start, put where the IMUs are, a little off."""
    run = batch.prepare(way.recording, method)
    earth = Ellipsoid() if way.recording.geodetic else FlatEarth()
    rng = np.random.default_rng(1)
    starts = []
    for row, i in enumerate(MEMBERS[method.split("/")[0]]):
        state = way.truth.states(i, way.recording.imus[0].time[:1])[0]
        if way.recording.geodetic:
            scale = earth.metres_per_unit(WUHAN)
            state = replace(state, position=WUHAN + state.position * UP / scale)
        off = np.concatenate([rng.normal(0.0, 0.03, 6), rng.normal(0.0, 0.01, 3), np.zeros(15)])
        state = with_errors(earth, state, off)
        lane = run.plan.spans[row, 0]
        w, lane = run.state.rows[lane // LANES], lane % LANES
        for at, values in (
            (bank.POSITION, state.position), (bank.VELOCITY, state.velocity), (bank.QUATERNION, state.quaternion)
        ):  # fmt: skip
            w[at + lane : at + lane + len(values) * LANES : LANES] = values
        starts.append(state)
    engine.begin(run.navigators, run.inputs.increments[0], float(np.diff(run.inputs.time[:2])[0]))
    return run, starts


def both(way: Drive, method: str, **options: Any) -> dict[str, float]:
    """The engine after its last epoch against the reference's run."""
    run, starts = prepared(way, method)
    std = np.sqrt([np.diag(P) for P in covariance_blocks(run)])
    run.advance(1, len(run.inputs.time))
    wheels = [0] if method.startswith(("body", "wheel")) else [0, 1]
    gnss, recording = [], way.recording
    if recording.gnss is not None:
        epochs = np.searchsorted(recording.imus[0].time, recording.gnss.time - 1e-4)
        gnss = list(zip(epochs, recording.gnss.position, recording.gnss.position_std, strict=True))
        assert np.all(run.outputs.event_status[of_kind(run, kinds.GNSS_POSITION)] == update.ACCEPTED)
    reference = run_reference(
        recording,
        MEMBERS[method.split("/")[0]],
        starts,
        std,
        joined=len(run.state.joint) > 0,
        wheels=wheels,
        spin_bias=[0.0] * len(wheels),
        gnss=gnss,
        **options,
    )
    return differences(run, reference)


def covariance_blocks(run: batch.Prepared) -> list[Array]:
    blocks = run.state.blocks[: len(run.plan.spans)]
    return [g[cov.P : cov.P + N * cov.STRIDE].reshape(N, cov.STRIDE)[:, :N] for g in blocks]


def of_kind(run: batch.Prepared, kind: int) -> Array:
    return np.asarray(run.inputs.event_kind == kind)


def differences(run: batch.Prepared, reference: dict[str, Any]) -> dict[str, float]:
    """The largest of each kind: SI, position in metres, covariances relative to their standard deviations."""
    metres = np.ones(3)
    if run.recording.geodetic:
        metres = np.array([6.36e6, 6.38e6 * np.cos(WUHAN[0]), 1.0])
    states = run.outputs.states[1:]
    C = Rotation.from_quat(states[:, 6:], scalar_first=True).as_matrix()
    turned = np.arctan2(C[:, 1, 0], C[:, 0, 0]) - reference["heading"][1:]
    quaternions = of_each_imu(run, bank.QUATERNION, 4)
    dots = np.sum(quaternions * reference["imu_quaternion"][-1], axis=1)
    aligned = quaternions * np.sign(dots)[:, None]
    P, Q = covariance(run), reference["covariances"]
    out = {
        "position": np.abs((states[:, :3] - reference["position"][1:]) * metres).max(),
        "heading": np.abs(np.arcsin(np.sin(turned))).max(),
        "imu position": np.abs((of_each_imu(run, bank.POSITION, 3) - reference["imu_position"][-1]) * metres).max(),
        "imu velocity": np.abs(of_each_imu(run, bank.VELOCITY, 3) - reference["imu_velocity"][-1]).max(),
        "imu attitude": np.abs(aligned - reference["imu_quaternion"][-1]).max(),
        "errors": np.abs(of_each_imu(run, bank.ERRORS, 12) - reference["errors"][-1]).max(),
        "mounting": np.abs(of_each_imu(run, bank.SPEED_SCALE, 3) - reference["mounting"][-1]).max(),
        "covariance": max(relative(p, q) for p, q in zip(P, Q, strict=True)),
    }
    return {name: float(value) for name, value in out.items()}


def relative(P: Array, Q: Array) -> float:
    std = np.sqrt(np.diag(Q))
    live = std > 0.0
    scale = np.outer(std[live], std[live])
    assert np.all(P[~live] == 0.0)
    return float(np.abs((P - Q)[np.ix_(live, live)] / scale).max())


def assert_agree(off: dict[str, float], tolerance: float, covariance: float | None = None) -> None:
    limits = dict.fromkeys(off, tolerance) | {"covariance": covariance or tolerance}
    assert not {name: value for name, value in off.items() if not value < limits[name]}


@pytest.mark.parametrize(
    ("method", "predict"),
    [(method, "window") for method in MEMBERS] + [("wheel-ins", "end"), ("triple-ins", "end")],
)
def test_apart(method: str, predict: str) -> None:
    """On a plane tilted by three degrees, seen level by wheels without a body."""
    assert_agree(both(drive(predict=predict), method), 1e-10)


@pytest.mark.parametrize("predict", ["window", "end"])
@pytest.mark.parametrize("method", ["dual-wheel-ins/centralized", "triple-ins/centralized"])
def test_joined(method: str, predict: str) -> None:
    """The engine applies the measurements of an epoch one after the other, as if all were one."""
    assert_agree(both(drive(predict=predict), method), 1e-10)


MOUNTED = (
    on_wheel("left", -0.18, 0.097, (0.004, 0.012, -0.009), radius_std=0.01, lever_arm_std=0.003),
    on_wheel("right", 0.21, 0.095, (-0.006, -0.008, 0.015), radius_std=0.02, lever_arm_std=0.002),
    on_body("body", (0.15, 0.04, -0.12), mount_std=0.02),
)


@pytest.fixture
def mount_to_first_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """The engine takes a change of the mount for a rotation of the vehicle, which is off by the mount itself."""
    complete = reference_wheels.body_matrix_derivative

    def derivative(state: WheelState) -> Array:
        out = complete(state)
        for j in (1, 2):
            out[21 + j] = skew(state.C[:, j]) @ body_matrix(state)
        return out

    monkeypatch.setattr(reference_wheels, "body_matrix_derivative", derivative)


@pytest.mark.usefixtures("mount_to_first_order")
@pytest.mark.parametrize("method", ["triple-ins", "triple-ins/centralized"])
def test_with_mounting_states(method: str) -> None:
    assert_agree(both(drive(RollingTruth(MOUNTED, tilt=tilted(0.06, 0.7)), predict="end"), method), 1e-10)


@pytest.mark.parametrize("method", ["triple-ins", "triple-ins/centralized"])
def test_with_gnss(method: str) -> None:
    way = drive(predict="end", gnss=FIXES)
    assert_agree(both(way, method), 1e-10)


@pytest.mark.parametrize("method", ["triple-ins", "triple-ins/centralized"])
def test_a_lying_fix_weighs_nearly_nothing(method: str) -> None:
    way = drive(gnss=FIXES)
    assert way.recording.gnss is not None
    position = way.recording.gnss.position.copy()
    position[4, 0] += 10.0
    gnss = replace(way.recording.gnss, position=position)
    run, _ = prepared(replace(way, recording=replace(way.recording, gnss=gnss)), method)
    run.advance(1, len(run.inputs.time))
    fixes = of_kind(run, kinds.GNSS_POSITION)
    np.testing.assert_array_equal(np.flatnonzero(run.outputs.event_status[fixes] == update.DEWEIGHTED), [4])
    residual = run.outputs.innovations[fixes, :3]
    assert residual[4, 0] == pytest.approx(-10.0, abs=0.5)
    assert np.abs(np.delete(residual, 4, axis=0)).max() < 0.5


def test_on_the_ellipsoid() -> None:
    """Positions are stored in radians; the design of the speed differs by earth rate times lever arm."""
    assert_agree(both(drive(geodetic=True, gnss=FIXES), "triple-ins"), 1e-6, covariance=1e-5)


def test_at_a_standstill() -> None:
    truth = RollingTruth(v=(1e-6, 0.0, 1.0), h=(0.3, 0.0, 0.0, 1.0), tilt=tilted(0.03, 0.3))
    std = ZERO_VELOCITY_STD, ZERO_RATE_STD
    assert_agree(both(drive(truth, standstill=True), "triple-ins", standing_std=std), 1e-9)
