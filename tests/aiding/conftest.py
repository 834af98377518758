"""Banks in motion whose residuals are differenced, for the tests of every kind of measurement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from array_recordings import on_a_plane, shaken_recording
from driven_vehicle import DEG, drive
from numpy.typing import NDArray

from polyins.aiding import measurement as fields
from polyins.aiding import vehicle_attitude
from polyins.kernels import bank, earth, fuse, kalman
from polyins.kernels import covariance as cov
from polyins.kernels import vehicle as vehicle_frames
from polyins.kernels.bank import LANES
from polyins.navigate import batch, update
from polyins.navigate.batch import Prepared
from polyins.navigate.state import EARTH, INTERVAL, Navigators

Array = NDArray[np.float64]

STEPS = np.concatenate([np.repeat([1e-2, 1e-3, 1e-5, 1e-5, 1e-2, 1e-4, 1e-4], 3), np.full(5, 1e-5)])
"""by which each error state is changed"""
BODY = 2
"""the block of the vehicle's body"""


@cache
def triple() -> Prepared:
    """Triple INS in a bend on a slope, each IMU a little off where the others have it."""
    recording = drive()
    imus = tuple(replace(imu, mount_std=0.0 if imu.wheel else 0.5 * DEG) for imu in recording.rig.imus)
    options = replace(recording.options, rolling=replace(recording.options.rolling, predict="end"))
    run = batch.prepare(replace(recording, rig=replace(recording.rig, imus=imus), options=options), "triple-ins")
    run.advance(1, int(60.0 / np.median(np.diff(run.inputs.time))))
    return run


@cache
def shaken(method: str, geodetic: bool) -> Prepared:
    """Three IMUs of an array that turns about all axes."""
    recording = shaken_recording(3, 2.5)
    run = batch.prepare(recording if geodetic else on_a_plane(recording), method)
    run.advance(1, 300)
    return run


@dataclass(frozen=True)
class Moving:
    """A run in motion, of which copies measure."""

    run: Prepared

    def measure(self, event: Array, s: int, corrected: int, correction: Array) -> Array:
        """Return the work array of block s after a correction of another, or of its own.

        `event`: kind, then the value.
        """
        run = self.run
        memory = run.memory.copy()
        parts, begin = [], 0
        for part in run.state:
            begin = (part.ctypes.data - run.memory.ctypes.data) // 8
            parts.append(memory[begin : begin + part.size].reshape(part.shape))
        state = type(run.state)(*parts)
        navigators = Navigators(state, run.plan, run.navigators.work)
        first, last = run.plan.spans[corrected]
        for lane in range(first, last):
            place = bank.CORRECTION + lane % LANES
            state.rows[lane // LANES, place : bank.CORRECTION + 26 * LANES : LANES] = correction
        block = state.blocks[corrected]
        metres = np.empty(3)
        earth.metric(block[cov.POSITION : cov.POSITION + 3], bool(state.scalars[EARTH]), metres)
        fuse.correct_members(state.rows, first, last, metres, 26)
        self._compensate(state, float(state.scalars[INTERVAL]))
        update.update_derived(state, run.plan, navigators.work)
        for t, (begin_, _) in enumerate(run.plan.spans):
            if run.plan.spans[t, 1] - begin_ == 1:
                fuse.take_measurement(state.rows, begin_, state.blocks[t], float(state.scalars[INTERVAL]))
        vehicle_frames.update_attitudes(state.rows, state.blocks, run.plan.spans, run.plan.lenders)
        record = np.zeros(fields.SIZE)
        record[fields.KIND], record[fields.VALUE : fields.VALUE + len(event) - 1] = event[0], event[1:]
        record[fields.VARIANCE : fields.VARIANCE + 3] = 1.0
        record[fields.DT], record[fields.GEODETIC] = state.scalars[INTERVAL], state.scalars[EARTH]
        out = np.zeros(kalman.SIZE)
        update.measure_block(state, run.plan, record, s, out)
        if run.plan.lenders[s] >= 0:
            vehicle_attitude.write_lent(state.blocks, s, run.plan.lenders[s], out)
        return out

    def _compensate(self, state: object, dt: float) -> None:
        """Correct the last increments anew for the errors that have changed."""
        rows = state.rows  # type: ignore[attr-defined]
        before = self.run.state.rows
        for new, old in zip(rows, before, strict=True):
            for k in range(6):
                lane = slice(LANES * k, LANES * (k + 1))
                sensitivity = 1.0 / (1.0 + old[bank.ERRORS + 6 * LANES :][lane])
                raw = old[bank.DTHETA :][lane] / sensitivity + old[bank.ERRORS :][lane] * dt
                scale = 1.0 + new[bank.ERRORS + 6 * LANES :][lane]
                new[bank.DTHETA :][lane] = (raw - new[bank.ERRORS :][lane] * dt) / scale

    def differences(self, event: Array, s: int, corrected: int, states: range) -> Array:
        """Return what errors of these states do to the residual, per unit, shape (3, len(states))."""
        found = np.zeros((3, len(states)))
        for k, state in enumerate(states):
            for sign in (1.0, -1.0):
                correction = np.zeros(26)
                correction[state] = sign * STEPS[state]
                residual = self.measure(event, s, corrected, correction)[kalman.RESIDUAL : kalman.RESIDUAL + 3]
                found[:, k] -= sign * residual / (2.0 * STEPS[state])
        return found

    def design(self, event: Array, s: int, states: range, at: int = kalman.H) -> Array:
        """Return columns of the design matrix."""
        out = self.measure(event, s, s, np.zeros(26))
        return out[at : at + 3 * cov.LARGEST].reshape(3, cov.LARGEST)[:, states.start : states.stop]


@pytest.fixture(scope="session")
def vehicle() -> Moving:
    return Moving(triple())


@pytest.fixture(scope="session", params=["single", "nav-fusion"])
def array(request: pytest.FixtureRequest) -> Moving:
    return Moving(shaken(request.param, True))


Check = Callable[..., None]


@pytest.fixture
def check_design() -> Check:
    """Compare the design matrix of a block with differences of its residual."""

    def check(moving: Moving, event: Array, s: int = 0, states: range = range(26), atol: float = 1e-6) -> None:
        differences = moving.differences(event, s, s, states)
        # an estimated scale divides what a bias adds, which the design leaves out
        np.testing.assert_allclose(moving.design(event, s, states), differences, atol=atol, rtol=1e-3)
        assert np.abs(differences).max() > 0.1

    return check
