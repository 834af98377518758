"""Heights, headings and odometers against a plain dense filter of one IMU with 26 states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from array_recordings import Array, on_a_plane, shaken_recording
from reference_filter import (
    BG,
    PHI,
    SG,
    FlatEarth,
    Increment,
    State,
    compensate,
    cross,
    error_dynamics,
    feed_back,
    gain,
    joseph,
    mechanize,
    predict,
    quaternion_of_euler,
    skew,
)

from polyins.model.recording import AidingStream, Recording
from polyins.model.rig import AidingSensor
from polyins.navigate import batch

R, V = slice(0, 3), slice(3, 6)
SCALE, BIAS, OFFSET = 21, 24, 25
EARTH = FlatEarth()
PLACE = np.array([0.3, -0.2, 0.5])
OFFSET_STD = {"height": 2.0, "heading": 0.1, "odometer": 0.03}
WALK = {"height": 0.2, "heading": 0.0, "odometer": 0.0}
STATE_OF = {"height": BIAS, "heading": OFFSET, "odometer": SCALE}


@dataclass
class Filter:
    """One IMU at the array origin; `offsets` are speed scale, two of a mount, height bias, heading offset."""

    state: State
    rate: Array
    P: Array
    offsets: Array

    def apply(self, residual: Array, H: Array, std: Array) -> None:
        measured = std > 0.0
        H, Rm = H[measured], np.diag(std[measured] ** 2)
        K = gain(self.P, H, Rm)
        self.P = joseph(self.P, K, H, Rm)
        dx = K @ residual[measured]
        self.state = feed_back(EARTH, self.state, dx[:21])
        self.offsets = self.offsets + dx[21:]


def height(f: Filter, value: float) -> tuple[Array, Array]:
    """Downwards: the point less what is shown less the bias; its error is that of position and C l."""
    arm = f.state.C @ PLACE
    z = arm[2] - f.state.position[2] + value - f.offsets[3]
    H = np.zeros((1, 26))
    H[0, R] = [0.0, 0.0, 1.0]
    H[0, PHI] = skew(arm)[2]
    H[0, BIAS] = 1.0
    return np.array([z]), H


def heading(f: Filter, value: float) -> tuple[Array, Array]:
    """atan2 of the forward axis, which errs by x cross phi."""
    n, e, _ = x = f.state.C[:, 0]
    z = np.arctan2(e, n) + f.offsets[4] - value
    H = np.zeros((1, 26))
    H[0, PHI] = np.array([-e, n, 0.0]) / (n * n + e * e) @ skew(x)
    H[0, OFFSET] = -1.0
    return np.array([(z + np.pi) % (2.0 * np.pi) - np.pi]), H


def odometer(f: Filter, value: float) -> tuple[Array, Array]:
    """C' (v + (C w - w_ie) x C l) in the array's axes."""
    C, arm = f.state.C, f.state.C @ PLACE
    turning = C @ f.rate - EARTH.earth_rate(f.state.position)
    u = f.state.velocity + cross(turning, arm)
    z = C.T @ u - (1.0 + f.offsets[0]) * value * np.array([1.0, 0.0, 0.0])
    H = np.zeros((3, 26))
    H[:, V] = C.T
    du = skew(turning) @ skew(arm) - skew(arm) @ skew(C @ f.rate)
    H[:, PHI] = C.T @ (du - skew(u))
    H[:, BG] = -C.T @ skew(arm) @ C
    H[:, SG] = H[:, BG] * f.rate
    H[0, SCALE] = value
    return z, H


MODELS: dict[str, Callable[[Filter, float], tuple[Array, Array]]] = {
    "height": height,
    "heading": heading,
    "odometer": odometer,
}


def recorded(kind: str) -> Recording:
    """A shaken IMU at the origin, and a sensor that is roughly right."""
    recording = shaken_recording(1, 3.0, spread=0.0)
    at = recording.reference
    assert at is not None
    recording = on_a_plane(recording)
    k = np.arange(2, len(at.time), 2)
    time = recording.imus[0].time[np.searchsorted(recording.imus[0].time, at.time[k] - 1e-6)]
    if kind == "height":
        value, std = at.position[k, 2] - at.position[0, 2] + 1.0, np.full((len(k), 1), 0.2)
    elif kind == "heading":
        assert at.attitude is not None
        value, std = at.attitude[k, 2] + 0.05, np.full((len(k), 1), 0.03)
    else:
        assert at.velocity is not None
        value, std = np.linalg.norm(at.velocity[k], axis=1), np.tile([0.1, 0.3, 0.4], (len(k), 1))
    sensor = AidingSensor(kind, PLACE, OFFSET_STD[kind], WALK[kind])
    rig, aiding = replace(recording.rig, sensors=(sensor,)), (AidingStream(kind, time, value, std),)
    return replace(recording, rig=rig, gnss=None, aiding=aiding)


def filtered(recording: Recording, kind: str) -> list[Filter]:
    """Run the plain filter; returns it as it was at each epoch."""
    stream, imu, start = recording.imus[0], recording.rig.imus[0], recording.start
    assert start.roll_pitch is not None
    assert start.heading is not None
    std = np.zeros(26)
    std[:9] = np.concatenate([start.position_std, start.velocity_std, start.attitude_std])
    std[9:21] = imu.start_std()
    std[STATE_OF[kind]] = OFFSET_STD[kind]
    errors = imu.initial_errors.as_array()
    state = State(np.array(start.position), np.array(start.velocity),
                  quaternion_of_euler(*start.roll_pitch, start.heading), errors)  # fmt: skip
    first = int(np.searchsorted(stream.time, start.time - 1e-6))
    dt = float(stream.time[first + 1] - stream.time[first])
    before = compensate(Increment(stream.dtheta[first], stream.dvel[first], dt), errors)
    f = Filter(state, before.rate, np.diag(std**2), np.zeros(5))
    due = {round(float(time), 6): k for k, time in enumerate(recording.aiding[0].time)} if recording.aiding else {}
    found = []
    for k in range(first + 1, len(stream.time)):
        dt = float(stream.time[k] - stream.time[k - 1])
        raw = Increment(stream.dtheta[k], stream.dvel[k], dt)
        now = compensate(raw, f.state.errors)
        P = f.P.copy()
        P[:21, :21] = predict(EARTH, f.P[:21, :21], f.state, now.rate, now.force, dt, imu.noise)
        Phi = np.eye(21) + error_dynamics(EARTH, f.state, now.rate, now.force, imu.noise.correlation_time) * dt
        P[:21, 21:] = Phi @ f.P[:21, 21:]
        P[21:, :21] = P[:21, 21:].T
        P[STATE_OF[kind], STATE_OF[kind]] += WALK[kind] ** 2 * dt
        f = Filter(mechanize(EARTH, f.state, before, now, True), now.rate, P, f.offsets)
        row = due.get(round(float(stream.time[k]), 6))
        if row is not None:
            sensor = recording.aiding[0]
            z, H = MODELS[kind](f, float(sensor.value[row]))
            f.apply(z, H, sensor.std[row])
        before = now
        found.append(f)
    return found


@pytest.mark.parametrize("kind", MODELS)
def test_it_is_the_plain_filter(kind: str) -> None:
    recording = recorded(kind)
    expected, solution = filtered(recording, kind), batch.run(recording, "single")
    assert len(expected) == len(solution.time)
    velocity = np.array([f.state.velocity for f in expected])
    quaternion = np.array([f.state.quaternion for f in expected])
    np.testing.assert_allclose(solution.velocity, velocity, rtol=0.0, atol=1e-11)
    signs = np.sign(np.sum(quaternion * solution.attitude, axis=1))[:, None]
    np.testing.assert_allclose(solution.attitude, signs * quaternion, rtol=0.0, atol=1e-11)
    variances = np.array([np.diag(f.P) for f in expected])
    np.testing.assert_allclose(solution.velocity_variance, variances[:, 3:6], rtol=1e-9)
    np.testing.assert_allclose(solution.position_variance, variances[:, :3], rtol=1e-9)
    (offset,) = solution.offsets.values()
    logged = np.searchsorted(solution.time, solution.imu_error_time)
    place = STATE_OF[kind]
    np.testing.assert_allclose(offset.value, [expected[k].offsets[place - 21] for k in logged], atol=1e-11)
    np.testing.assert_allclose(offset.std, np.sqrt(variances[logged, place]), rtol=1e-9)
