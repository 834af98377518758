"""The covariance of the mean and of how IMUs deviate from it, against one dense filter of the states of all IMUs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from reference_filter import Ellipsoid, State, error_dynamics, gain, joseph, noise_density, position_design

from polyins.aiding import kinds
from polyins.kernels import bank, covariance
from polyins.kernels.bank import LANES
from polyins.model.geodesy import metres_per_unit
from polyins.model.recording import Recording
from polyins.model.rig import AidingSensor, NoiseGrade
from polyins.model.solution import Solution
from polyins.model.states import NAVIGATION, place, stride_for
from polyins.navigate import batch, sharing
from polyins.simulation.run import simulate
from polyins.simulation.scenario import Board, Scenario

Array = NDArray[np.float64]

SECONDS, RATE_HZ, COMMON = 14.0, 20.0, 0.3
SNAP = 0.026
"""s: half an interval, so that no fix splits one"""
STATES = 24
"""of one IMU: the 21 of the paper, and how its axes lie"""
AXES = slice(21, 24)


def recording(imus: int, *, seconds: float = SECONDS, common: float = COMMON, **options: Any) -> Recording:
    """A drive of IMUs that lie at one point, as the equations of deviations have them."""
    scenario = Scenario(duration_s=seconds, static_s=6.0, imus=Board(count=imus), rate_hz=RATE_HZ)
    made = simulate(scenario, seed=5)
    rig = replace(made.rig, imus=tuple(replace(imu, position=np.zeros(3)) for imu in made.rig.imus))
    return replace(
        made,
        rig=rig,
        outages=(),
        options=replace(made.options, common_share=common, gate_limit=None, gnss_snap=SNAP, **options),
    )


@dataclass
class Dense:
    """The states of all IMUs in one filter; each has the error model of their mean."""

    count: int
    P: Array

    @classmethod
    def begin(cls, block: Array, own: Array, count: int) -> Dense:
        """Independent deviations about a mean: P = 1 1' x (M - D / N) + 1 x D."""
        mean, each = sharing.square_of(block), sharing.square_of(own)
        return cls(count, np.kron(np.ones((count, count)), mean - each / count) + np.kron(np.eye(count), each))

    def predict(self, phi: Array, noise: Array) -> None:
        """Own noise drives each, common noise all alike; half of it comes before and half after."""
        every = COMMON * np.kron(np.ones((self.count, self.count)), noise)
        every += (1.0 - COMMON) * np.kron(np.eye(self.count), noise)
        whole = np.kron(np.eye(self.count), phi)
        self.P = whole @ (self.P + 0.5 * every) @ whole.T + 0.5 * every

    def fix(self, design: Array, variances: Array, residual: Array) -> Array:
        """Measure the mean of what all predict; returns the corrections (N, 24)."""
        whole = np.kron(np.full((1, self.count), 1.0 / self.count), design)
        return self._update(whole, np.diag(variances), residual)

    def compare(self, differences: Array, attitude: Array) -> Array:
        """Measure position, velocity and attitude of each against the mean, (N, 9); returns the corrections (N, 24)."""
        contrasts = np.linalg.qr(np.column_stack([np.ones(self.count), np.eye(self.count)]))[0][:, 1 : self.count].T
        total = np.zeros((self.count, STATES))
        for group, std in enumerate(sharing.HOLDS):
            design = np.zeros((3, STATES))
            design[:, 3 * group : 3 * group + 3] = np.eye(3)
            if group == 2:
                design[:, AXES] = attitude
            left = differences[:, 3 * group : 3 * group + 3] - total @ design.T
            whole = np.kron(contrasts, design)
            total += self._update(whole, std**2 * np.eye(3 * (self.count - 1)), (contrasts @ left).ravel())
        return total

    def _update(self, design: Array, variances: Array, residual: Array) -> Array:
        k = gain(self.P, design, variances)
        self.P = joseph(self.P, k, design, variances)
        return np.asarray(k @ residual).reshape(self.count, STATES)

    def parts(self) -> tuple[Array, Array]:
        """M and D of it."""
        blocks = self.P.reshape(self.count, STATES, self.count, STATES)
        return blocks.mean(axis=(0, 2)), blocks[0, :, 0] - blocks[0, :, 1]


def members(run: batch.Prepared, field: int, size: int) -> Array:
    """The numbers of each member, (N, size)."""
    end = field + size * LANES
    return np.array([run.state.rows[i // LANES, field + i % LANES : end : LANES] for i in run.bank.lanes])


def differences(run: batch.Prepared, rotation: Array) -> Array:
    """By how much position, velocity and attitude of each differ from the mean, (N, 9), m, m/s, rad."""
    block = run.state.blocks[0]
    metres = metres_per_unit(block[covariance.POSITION : covariance.POSITION + 3], True)
    place = (members(run, bank.POINT_POSITION, 3) - block[covariance.POSITION : covariance.POSITION + 3]) * metres
    velocity = members(run, bank.POINT_VELOCITY, 3) - block[covariance.VELOCITY : covariance.VELOCITY + 3]
    turned = rotation @ members(run, bank.MATRIX, 9).reshape(-1, 3, 3).transpose(0, 2, 1)
    phi = 0.5 * np.array([turned[:, 2, 1] - turned[:, 1, 2], turned[:, 0, 2] - turned[:, 2, 0],
                          turned[:, 1, 0] - turned[:, 0, 1]]).T  # fmt: skip
    axes = members(run, bank.AXES, 3)
    return np.hstack([place, velocity, phi - (axes - axes.mean(axis=0)) @ rotation.T])


def assert_alike(block: Array, dense: Array, size: int, tolerance: float) -> None:
    """P of a block agrees with the dense one, in products of the standard deviations."""
    completed = block.copy()
    covariance.complete(completed, STATES)
    ours, theirs = sharing.square_of(completed)[:size, :size], dense[:size, :size]
    std = np.sqrt(np.maximum(np.diag(theirs), 1e-30))
    np.testing.assert_allclose(ours / np.outer(std, std), theirs / np.outer(std, std), rtol=0.0, atol=tolerance)


@pytest.mark.parametrize("imus", [3, 5])
def test_the_two_blocks_are_the_dense_filter_of_all_states(imus: int) -> None:
    run = batch.prepare(recording(imus, exclusion=False, own_noise=1.0, relative_interval=0.35), "enav-fusion")
    block, own, queue = run.state.blocks[0], run.state.deviations[0], run.inputs
    dense, noise, counted = (
        Dense.begin(block, own, imus),
        run.recording.rig.imus[0].noise,
        dict.fromkeys((kinds.GNSS_POSITION, kinds.DEVIATIONS), 0),
    )
    first = 0
    for k in range(1, len(queue.time)):
        begins, axes = run.memory.copy(), None
        last = int(np.searchsorted(queue.event_time, queue.time[k] + SNAP))
        c = block[covariance.MATRIX : covariance.MATRIX + 9].reshape(3, 3).copy()
        state = State(*(block[at : at + n].copy() for at, n in STATE), np.zeros(12))
        for j in range(first, last + 1):
            run.memory[:] = begins
            upto = queue._replace(**{name: getattr(queue, name)[:j] for name in QUEUE})
            replace(run, inputs=upto).advance(k, k + 1)
            if j == first:
                dense.predict(*transition(state, block, noise, float(queue.time[k] - queue.time[k - 1])))
            else:
                corrected = members(run, bank.CORRECTION, 21)
                std = np.sqrt(np.diag(dense.parts()[0])[:21] + np.diag(dense.parts()[1])[:21])
                np.testing.assert_allclose(corrected / std, axes[:, :21] / std, rtol=0.0, atol=1e-9)
            if j < last:
                c = block[covariance.MATRIX : covariance.MATRIX + 9].reshape(3, 3).copy()
                kind = int(queue.event_kind[j])
                counted[kind] += 1
                if kind == kinds.DEVIATIONS:
                    axes = dense.compare(differences(run, c), c)
                else:
                    design = np.hstack([position_design(c, run.recording.rig.antenna), np.zeros((3, 3))])
                    axes = dense.fix(design, queue.event_variance[j], residual(run, queue.event_value[j]))
        first = last
        mean, each = dense.parts()
        assert_alike(block, mean, 21, 1e-11)
        # where axes and attitudes begin wholly correlated, rounding is larger
        assert_alike(own, each, STATES, 1e-8)
    assert min(counted.values()) > 5


STATE = ((covariance.POSITION, 3), (covariance.VELOCITY, 3), (covariance.QUATERNION, 4))
QUEUE = ("event_time", "event_kind", "event_value", "event_variance")


def transition(state: State, block: Array, noise: NoiseGrade, dt: float) -> tuple[Array, Array]:
    """Phi and Q over an interval that begins at a state, with the rates that a block has there."""
    rate, force = block[covariance.RATE : covariance.RATE + 3], block[covariance.FORCE : covariance.FORCE + 3]
    phi, density = np.eye(STATES), np.zeros((STATES, STATES))
    phi[:21, :21] += error_dynamics(Ellipsoid(), state, rate, force, noise.correlation_time) * dt
    density[:21, :21] = noise_density(state.C, noise) * dt
    return phi, density


def residual(run: batch.Prepared, fix: Array) -> Array:
    """The mean of what all predict of an antenna less what a fix says, m."""
    block, arm = run.state.blocks[0], run.recording.rig.antenna
    metres = metres_per_unit(block[covariance.POSITION : covariance.POSITION + 3], True)
    c = members(run, bank.MATRIX, 9).reshape(-1, 3, 3)
    return np.asarray(((members(run, bank.POSITION, 3) - fix[:3]) * metres + c @ arm).mean(axis=0))


# --- who is left out --------------------------------------------------------------------------------------------------


def with_bias(recording: Recording, index: int, begins: float, ends: float, size: float) -> Recording:
    """One gyro shows more about down for a while, rad/s."""
    stream = recording.imus[index]
    dtheta = stream.dtheta.copy()
    dtheta[(stream.time > begins) & (stream.time <= ends), 2] += size / RATE_HZ
    imus = tuple(replace(one, dtheta=dtheta) if i == index else one for i, one in enumerate(recording.imus))
    return replace(recording, imus=imus)


@pytest.mark.parametrize("index", [0, 2])
def test_a_sick_gyro_is_left_out_and_taken_back(index: int) -> None:
    healthy = recording(4, seconds=240.0, common=0.0)
    sick = with_bias(healthy, index, 30.0, np.inf, 0.0035)
    solution, as_healthy = batch.run(sick, "enav-fusion"), batch.run(healthy, "enav-fusion")
    (found,) = solution.exclusions
    assert found.imu == healthy.rig.imus[index].name
    assert 30.0 < found.from_s <= 33.0
    # its bias has been found by then
    assert found.to_s is not None
    assert found.sensor == "gyro"
    assert not as_healthy.exclusions
    apart = np.abs((solution.position - as_healthy.position) * metres_per_unit(solution.position[0], True))
    assert apart.max() < 0.5


def test_of_two_imus_none_is_left_out() -> None:
    sick = with_bias(recording(2, seconds=60.0, common=0.0), 1, 30.0, 60.0, 0.02)
    assert not batch.run(sick, "enav-fusion").exclusions


def test_no_imu_is_left_out_unasked() -> None:
    sick = with_bias(recording(4, seconds=60.0, common=0.0, exclusion=False), 1, 30.0, 60.0, 0.02)
    assert not batch.run(sick, "enav-fusion").exclusions


def test_the_noise_of_their_own_is_found() -> None:
    told = recording(4, seconds=200.0, common=0.0)
    quiet = tuple(replace(imu, noise=weaker(imu.noise, 3.0)) for imu in told.rig.imus)
    believed = batch.run(told, "enav-fusion").comparisons
    too_quiet = batch.run(replace(told, rig=replace(told.rig, imus=quiet)), "enav-fusion").comparisons
    assert believed.own_noise[-1] < 1.5
    assert too_quiet.own_noise[-1] > 3.0


def weaker(noise: NoiseGrade, factor: float) -> NoiseGrade:
    """Random walks that are smaller by a factor."""
    return replace(
        noise,
        angle_random_walk=noise.angle_random_walk / factor,
        velocity_random_walk=noise.velocity_random_walk / factor,
    )


def test_as_published_nothing_is_compared() -> None:
    solution = batch.run(recording(3, common=1.0), "enav-fusion")
    assert not len(solution.comparisons.time)


def test_the_mean_is_surer_of_its_heading_than_one_imu() -> None:
    drive = recording(4, seconds=200.0, common=0.0)
    ours, paper = batch.run(drive, "enav-fusion"), batch.run(drive.as_published(), "enav-fusion")
    apart = batch.run(drive, "nav-fusion")
    at = np.flatnonzero(ours.time > 150.0)
    for solution in (ours, apart):
        ratio = np.sqrt(solution.phi_covariance[at, 5] / paper.phi_covariance[at, 5])
        assert np.all(ratio < 0.9)


def test_states_that_are_not_of_the_imus_stay_as_they_are() -> None:
    """An IMU less and noise that adapts change nothing of an offset of another sensor, of a mount or of its std."""
    healthy = recording(4, seconds=60.0, common=0.0)
    rig = replace(healthy.rig, sensors=(AidingSensor("height", offset_std=1.0, offset_random_walk=0.1),))
    sick = replace(with_bias(healthy, 1, 30.0, np.inf, 0.0035), rig=rig)
    run = batch.prepare(sick, "enav-fusion")
    solution = batch.navigate(run)
    assert len(solution.exclusions) == 1
    block = run.state.blocks[0]
    assert block[covariance.ERROR_PSD + place("height_bias") - NAVIGATION] == pytest.approx(0.01)
    completed = block.copy()
    covariance.complete(completed, stride_for(place("height_bias") + 1))
    p = sharing.square_of(completed)
    between = slice(place("speed_scale"), place("height_bias"))
    np.testing.assert_array_equal(p[between], 0.0)
    np.testing.assert_array_equal(p[:, between], 0.0)
    np.testing.assert_array_equal(members(run, bank.MOUNT, 2), 0.0)
    (height,) = solution.offsets.values()
    np.testing.assert_allclose(height.std, np.sqrt(1.0 + 0.01 * (height_times(solution))), rtol=1e-6)


def height_times(solution: Solution) -> Array:
    """s since the start, of the log."""
    return solution.imu_error_time - float(solution.start["time_s"])  # type: ignore[arg-type]


def test_an_imu_whose_samples_leap_is_left_out_at_once() -> None:
    healthy = recording(4, seconds=40.0, common=0.0, relative_interval=5.0)
    stream = healthy.imus[2]
    dtheta = stream.dtheta.copy()
    begins = int(np.searchsorted(stream.time, 31.0))
    dtheta[begins:, 0] += 0.2
    leaping = replace(healthy, imus=(*healthy.imus[:2], replace(stream, dtheta=dtheta), *healthy.imus[3:]))
    solution, as_healthy = batch.run(leaping, "enav-fusion"), batch.run(healthy, "enav-fusion")
    assert [one.imu for one in solution.exclusions] == [healthy.rig.imus[2].name]
    turned = np.abs(solution.attitude - as_healthy.attitude).max()
    assert turned < 0.01


def test_vibration_does_not_adapt_faster_than_time_goes() -> None:
    """Leaps bring comparisons forward; the scale of the noise follows those that are due."""
    healthy = recording(4, seconds=40.0, common=0.0, exclusion=False)
    rng = np.random.default_rng(4)
    shaken = tuple(
        replace(one, dvel=one.dvel + rng.normal(0.0, 1.5, one.dvel.shape) * (one.time > 38.0)[:, None])
        for one in healthy.imus
    )
    found = batch.run(replace(healthy, imus=shaken), "enav-fusion").comparisons
    late = found.own_noise[found.time > 38.5]
    assert 1.0 < late.max() < found.own_noise[found.time < 38.0][-1] * 4.0 ** (4.0 * len(late) / 30.0)
