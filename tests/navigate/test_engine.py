"""The compiled engine against the reference filter, and what must hold of every method.

Measured: on a plane all methods agree with the reference to 3e-13 (in metres, m/s, rad and standard deviations). On the
ellipsoid positions are stored in radians, whose last bit is 0.7 nm of latitude and 2 nm of longitude at mid-latitudes;
near the equator and the zero meridian it is below a picometre, and agreement is as good as on the plane.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import reference_filter as reference
from array_recordings import (
    ANTENNA,
    NOISE,
    Swing,
    received,
    shaken_path,
    shaken_recording,
    start_at,
)
from array_recordings import on_a_plane as moved_to_a_plane
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from polyins.aiding import kinds
from polyins.kernels import bank
from polyins.kernels import covariance as cov
from polyins.kernels.bank import LANES
from polyins.model.geodesy import metres_per_unit
from polyins.model.methods import ARRAY_METHODS as METHODS
from polyins.model.recording import FilterOptions, GnssStream, Recording
from polyins.model.rig import DEG, NoiseGrade, Rig
from polyins.navigate import batch, update
from polyins.navigate.state import NEXT_EVENT, NEXT_LOG

Array = NDArray[np.float64]

ARRAY_METHODS = [name for name in METHODS if name != "single"]
SECONDS = 5.0  # 1,000 epochs
# at epochs, between them, two in one interval
FIX_TIMES = np.array([0.3021, 0.6, 0.9017, 1.2, 1.5033, 1.8, 2.1004, 2.4, 2.7049, 3.0, 3.3, 3.6012, 3.6031, 4.2, 4.8])
WITH_VELOCITY = 3  # the fix at 1.2 s
NEAR_ZERO = np.array([1e-4, 1e-4, 35.0])
WUHAN = np.array([30.5278 * DEG, 114.3557 * DEG, 35.0])


def covariances(run: batch.Prepared) -> Array:
    """P of each block, shape (blocks, 21, 21)."""
    out = []
    for g in run.state.blocks[: len(run.plan.spans)]:
        cov.complete(g, cov.STRIDE)
        out.append(g[cov.P : cov.P + 21 * cov.STRIDE].reshape(21, cov.STRIDE)[:, :21].copy())
    return np.array(out)


def of_kind(run: batch.Prepared, kind: int) -> NDArray[np.bool_]:
    return np.asarray(run.inputs.event_kind == kind)


def with_events(run: batch.Prepared, kept: NDArray[np.bool_]) -> batch.Prepared:
    """The same run with some of its events only."""
    inputs, outputs = run.inputs, run.outputs
    few = inputs._replace(**{name: getattr(inputs, name)[kept] for name in inputs._fields if name.startswith("event")})
    names = ("event_status", "innovations")
    return replace(run, inputs=few, outputs=outputs._replace(**{name: getattr(outputs, name)[kept] for name in names}))


def of_each_imu(run: batch.Prepared, field: int, count: int) -> Array:
    """A field of the bank, shape (N, count)."""
    rows = run.state.rows
    return np.array([rows[i // LANES, field + i % LANES :: LANES][:count] for i in run.bank.lanes])


# --- the reference filter ---------------------------------------------------------------------------------------------


class AsUpdatesTakeIt(reference.Ellipsoid):
    """The Earth of the engine's updates: two choices that are a matter of convention.

    A block takes the metric of its fused state for all its members (the reference that of each; neither is nearer to
    the truth, which has it half way to the fix; 1e-7 m). A velocity's design leaves out that the Earth rate varies with
    latitude (the reference is complete; 1e-11 rad/s per metre and metre of lever arm).
    """

    def __init__(self, place: Array | None) -> None:
        self.place = place

    def metres_per_unit(self, position: Array) -> Array:
        return super().metres_per_unit(position if self.place is None else self.place)

    def earth_rate_gradient(self, position: Array) -> Array:
        return np.zeros((3, 3))


@pytest.fixture
def updates_by_the_same_convention(monkeypatch: pytest.MonkeyPatch) -> None:
    update, correct = reference.Bank.update, reference.Bank.correct

    def on_the_earth_of_updates(self: reference.Bank) -> None:
        if isinstance(self.earth, reference.Ellipsoid):
            one = isinstance(self, reference.EnavFusion) or len(self.states) == 1
            self.earth = AsUpdatesTakeIt(self.fused().position if one else None)

    def updated(self: reference.Bank, fix: reference.Fix) -> None:
        earth = self.earth
        on_the_earth_of_updates(self)
        update(self, fix)
        self.earth = earth

    def corrected(self: reference.Bank, *arguments: Any) -> None:
        # a velocity comes after what its position has corrected
        on_the_earth_of_updates(self)
        correct(self, *arguments)

    monkeypatch.setattr(reference.Bank, "update", updated)
    monkeypatch.setattr(reference.Bank, "correct", corrected)


def mean_noise(rig: Rig) -> NoiseGrade:
    """What drives a block, or the virtual IMU: the means of the noise densities and of the rates of decay."""
    noises = [imu.noise for imu in rig.imus]
    time = float(1.0 / np.mean([1.0 / noise.correlation_time for noise in noises]))

    def mean(name: str) -> Array:
        return np.asarray(np.sqrt(np.mean([getattr(noise, name) ** 2 for noise in noises], axis=0)))

    def steady(name: str) -> Array:
        driven = np.mean([getattr(noise, name) ** 2 / noise.correlation_time for noise in noises], axis=0)
        return np.asarray(np.sqrt(time * driven))

    slow = ("gyro_bias_std", "accel_bias_std", "gyro_scale_std", "accel_scale_std")
    walks = mean("angle_random_walk"), mean("velocity_random_walk")
    return NoiseGrade(*walks, *(steady(name) for name in slow), correlation_time=time)


def by_the_reference(recording: Recording, method: str, velocity_of: int, velocities: Array) -> dict[str, Any]:
    """Run the reference filter; each IMU starts with the velocity given, shape (N, 3)."""
    rig, start, gnss = recording.rig, recording.start, recording.gnss
    assert gnss is not None
    assert gnss.velocity is not None
    assert gnss.velocity_std is not None
    assert start.position is not None
    assert start.roll_pitch is not None
    earth = reference.Ellipsoid() if recording.geodetic else reference.FlatEarth(recording.options.gravity)
    origin = reference.State(
        start.position, start.velocity, reference.quaternion_of_euler(*start.roll_pitch, start.heading)
    )
    errors = [imu.initial_errors.as_array() for imu in rig.imus]
    states: Any = [
        replace(origin, position=reference.move_position(earth, origin, imu.position), velocity=velocity, errors=own)
        for imu, own, velocity in zip(rig.imus, errors, velocities, strict=True)
    ]
    noise = mean_noise(rig)
    if method == "imu-fusion":
        states = replace(origin, errors=np.mean(errors, axis=0))
    std = np.sqrt(np.mean([imu.start_std() ** 2 for imu in rig.imus], axis=0))
    fixes = []
    for k, t in enumerate(gnss.time):
        velocity = (gnss.velocity[k], gnss.velocity_std[k]) if k == velocity_of else ()
        fixes.append(reference.Fix(t, gnss.position[k], gnss.position_std[k], *velocity))
    return reference.run(
        method,
        recording.imus[0].time,
        np.stack([imu.dtheta for imu in recording.imus], axis=1),
        np.stack([imu.dvel for imu in recording.imus], axis=1),
        np.array([imu.position for imu in rig.imus]),
        rig.antenna,
        fixes,
        states,
        np.concatenate([start.position_std, start.velocity_std, start.attitude_std, std]),
        noise,
        earth=earth,
        gnss_snap=recording.options.gnss_snap,
    )


def differences(recording: Recording, method: str) -> dict[str, float]:
    """The largest ones: m, m/s and rad of the merged states at all epochs; standard deviations for the rest."""
    run = batch.prepare(recording, method)
    run = with_events(run, (of_kind(run, kinds.GNSS_POSITION)) | (run.inputs.event_time == FIX_TIMES[WITH_VELOCITY]))
    velocities = np.broadcast_to(of_each_imu(run, bank.VELOCITY, 3), (len(recording.imus), 3)).copy()
    run.advance(1, len(run.inputs.time))
    expected = by_the_reference(recording, method, WITH_VELOCITY, velocities)
    states = run.outputs.states[1:]
    metres = metres_per_unit(run.start.position, recording.geodetic)
    P, reference_P = covariances(run), expected["covariance"]
    sigma = np.sqrt(np.diagonal(reference_P, axis1=1, axis2=2))
    turned = Rotation.from_quat(states[:, 6:], scalar_first=True).inv() * Rotation.from_quat(
        expected["quaternion"][1:], scalar_first=True
    )
    apart = P.shape[0] == len(run.bank.lanes)
    own_sigma = sigma[:, 9:] if apart else np.repeat(sigma[:1, 9:], len(run.bank.lanes), axis=0)
    assert len(states) == round(SECONDS * 200.0) - 1
    fixes = of_kind(run, kinds.GNSS_POSITION)
    assert np.count_nonzero(fixes) == len(FIX_TIMES)
    return {
        "position": np.abs((states[:, :3] - expected["position"][1:]) * metres).max(),
        "imu position": np.abs((of_each_imu(run, bank.POSITION, 3) - expected["imu_position"][-1]) * metres).max(),
        "velocity": np.abs(states[:, 3:6] - expected["velocity"][1:]).max(),
        "attitude": turned.magnitude().max(),
        "covariance": np.abs((P - reference_P) / (sigma[:, :, None] * sigma[:, None, :])).max(),
        "imu errors": np.abs((of_each_imu(run, bank.ERRORS, 12) - expected["errors"][-1]) / own_sigma).max(),
        "innovation": np.abs(run.outputs.innovations[fixes, :3] - expected["innovation"].mean(axis=1)).max(),
    }


def recorded(count: int, place: Array, *, equal: bool) -> Recording:
    recording = shaken_recording(count, SECONDS, fixes=FIX_TIMES, equal=equal, place=place).as_published()
    return replace(recording, gnss=received(shaken_path(SECONDS, start=place), recording.rig.antenna, FIX_TIMES, 1))


def with_noise_of_one(recording: Recording) -> Recording:
    """All IMUs with one noise grade; what is known of their errors stays their own."""
    imus = tuple(replace(imu, noise=NOISE) for imu in recording.rig.imus)
    return replace(recording, rig=replace(recording.rig, imus=imus))


def assert_agree(actual: dict[str, float], tolerance: float, **others: float) -> None:
    wrong = {name: value for name, value in actual.items() if not value < others.get(name.replace(" ", "_"), tolerance)}
    assert not wrong


def cases(counts: tuple[int, ...]) -> list[Any]:
    return [
        pytest.param(method, count, id=f"{method}-{count}")
        for count in counts
        for method in METHODS
        if method != "single" or count == 1
    ]


def prepared_for(method: str, count: int, place: Array) -> Recording:
    """Unequal noise where the reference can have it: where there is one covariance."""
    recording = recorded(count, place, equal=False)
    return with_noise_of_one(recording) if method == "nav-fusion" else recording


@pytest.mark.usefixtures("updates_by_the_same_convention")
@pytest.mark.parametrize(("method", "count"), cases((1, 3)))
def test_on_a_plane_the_engine_is_the_reference_to_rounding(method: str, count: int) -> None:
    recording = moved_to_a_plane(prepared_for(method, count, WUHAN))
    assert_agree(differences(recording, method), 1e-11)


@pytest.mark.usefixtures("updates_by_the_same_convention")
@pytest.mark.parametrize(("method", "count"), cases((1, 3, 9)))
def test_where_radians_are_fine_the_engine_is_the_reference_to_rounding(method: str, count: int) -> None:
    # only the merged position shows that lever arms are turned into radians where the Earth was last evaluated
    assert_agree(differences(prepared_for(method, count, NEAR_ZERO), method), 1e-11, position=5e-8)


@pytest.mark.parametrize("method", METHODS)
def test_at_mid_latitudes_the_engine_is_the_reference_to_nanometres(method: str) -> None:
    count = 1 if method == "single" else 3
    assert_agree(differences(prepared_for(method, count, WUHAN), method), 1e-7, imu_errors=2e-6)


def test_in_nav_fusion_each_imu_navigates_as_if_alone() -> None:
    """With noise, errors and lever arm of its own, to the last bit; nine IMUs cross from one block into the next."""
    recording = recorded(9, WUHAN, equal=False)
    together = batch.run(recording, "nav-fusion")
    for i in (0, 3, 7, 8):
        alone = batch.run(recording, "single", imu=i)
        np.testing.assert_array_equal(together.imu_errors[:, i], alone.imu_errors[:, 0])
        np.testing.assert_array_equal(together.imu_error_std[:, i], alone.imu_error_std[:, 0])
    assert np.abs(together.imu_errors[-1, 0] - together.imu_errors[-1, 8]).max() > 1e-5


def test_the_dense_covariance_gives_the_same_solution() -> None:
    recording = recorded(3, WUHAN, equal=False)
    structured, matrices = (
        batch.navigate(batch.prepare(recording, "enav-fusion", dense_covariance=dense)) for dense in (False, True)
    )  # fmt: skip
    np.testing.assert_allclose(matrices.velocity, structured.velocity, atol=1e-7)
    np.testing.assert_allclose(matrices.position_variance, structured.position_variance, rtol=1e-8)
    np.testing.assert_allclose(matrices.phi_covariance, structured.phi_covariance, rtol=1e-6, atol=1e-12)


# --- what must not matter ---------------------------------------------------------------------------------------------

WRITTEN = ("position", "velocity", "attitude", "position_variance", "velocity_variance", "phi_covariance",
           "imu_errors", "imu_error_std")  # fmt: skip


def assert_bit_equal(actual: Any, expected: Any) -> None:
    for name in WRITTEN:
        np.testing.assert_array_equal(getattr(actual, name), getattr(expected, name), err_msg=name)
    np.testing.assert_array_equal(actual.innovations.residual, expected.innovations.residual)
    np.testing.assert_array_equal(actual.innovations.nis, expected.innovations.nis)


def assert_same_to_rounding(actual: Any, expected: Any) -> None:
    metres = metres_per_unit(expected.position[0], expected.geodetic)
    assert np.abs((actual.position - expected.position) * metres).max() < 2e-7
    np.testing.assert_allclose(actual.velocity, expected.velocity, atol=2e-7)
    turned = (Rotation.from_quat(actual.attitude) * Rotation.from_quat(expected.attitude).inv()).magnitude()
    assert turned.max() < 2e-8
    np.testing.assert_allclose(actual.position_variance, expected.position_variance, rtol=1e-7)
    np.testing.assert_allclose(actual.velocity_variance, expected.velocity_variance, rtol=1e-7)


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.4, -0.2, 0.3)], ids=["at-origin", "off-origin"])
@pytest.mark.parametrize("method", ["nav-fusion", "enav-fusion", "enav-fusion-shared-mechanization"])
def test_an_array_of_one_is_the_single_imu_to_the_last_bit(method: str, place: tuple[float, ...]) -> None:
    recording = recorded(1, WUHAN, equal=False)
    imu = replace(recording.rig.imus[0], position=np.array(place))
    recording = replace(recording, rig=replace(recording.rig, imus=(imu,)))
    assert_bit_equal(batch.run(recording, method), batch.run(recording, "single"))


def test_a_virtual_imu_of_one_at_the_origin_is_the_single_imu() -> None:
    recording = recorded(1, WUHAN, equal=False)
    imu = replace(recording.rig.imus[0], position=np.zeros(3))
    recording = replace(recording, rig=replace(recording.rig, imus=(imu,)))
    assert_bit_equal(batch.run(recording, "imu-fusion"), batch.run(recording, "single"))


@pytest.mark.parametrize("method", ARRAY_METHODS)
@pytest.mark.parametrize("common", [0.0, 1.0])
@pytest.mark.parametrize("chunk", [1, 7, 333])
def test_chunks_of_any_size_give_the_same_bits(
    method: str, common: float, chunk: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = recorded(3, WUHAN, equal=False)
    recording = replace(recording, options=replace(recording.options, common_share=common))
    whole, again = batch.run(recording, method), batch.run(recording, method)
    assert_bit_equal(again, whole)
    monkeypatch.setattr(batch, "CHUNK", chunk)
    shares: list[float] = []
    assert_bit_equal(batch.run(recording, method, progress=shares.append), whole)
    assert len(shares) == -(-(len(whole.time)) // chunk)
    assert shares[-1] == 1.0


@pytest.mark.parametrize("method", ARRAY_METHODS)
def test_identical_imus_at_one_place_navigate_like_one(method: str) -> None:
    one = recorded(1, WUHAN, equal=True)
    imu = replace(one.rig.imus[0], position=np.zeros(3))
    one = replace(one, rig=replace(one.rig, imus=(imu,)))
    imus = tuple(replace(imu, name=f"copy{i}") for i in range(9))
    many = replace(one, rig=replace(one.rig, imus=imus), imus=one.imus * 9)
    assert_same_to_rounding(batch.run(many, method), batch.run(one, "single"))


@pytest.mark.parametrize("method", ARRAY_METHODS)
def test_the_order_of_the_imus_does_not_matter(method: str) -> None:
    recording = recorded(9, WUHAN, equal=False)
    order = np.random.default_rng(1).permutation(9)
    plain, permuted = batch.run(recording, method), batch.run(recording.subset(order), method)
    assert_same_to_rounding(permuted, plain)
    if plain.imu_errors.shape[1] == 9:
        np.testing.assert_allclose(permuted.imu_errors, plain.imu_errors[:, order], atol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_where_the_globe_is_cut_does_not_matter(method: str) -> None:
    """The path crosses the antimeridian eastwards; fixes beyond it have negative longitudes."""
    recording = recorded(3, np.array([0.5, 1.0, 35.0]), equal=False)
    truth = shaken_path(SECONDS, start=np.array([0.5, 1.0, 35.0])).truth(np.array([2.5])).position[0]
    shift = np.array([0.0, np.pi - truth[1], 0.0])
    assert recording.gnss is not None
    fixes = recording.gnss.position + shift
    fixes[:, 1] = (fixes[:, 1] + np.pi) % (2.0 * np.pi) - np.pi
    assert np.ptp(fixes[:, 1]) > 6.0
    there = replace(
        recording,
        gnss=replace(recording.gnss, position=fixes),
        start=replace(recording.start, position=recording.start.position + shift),
    )
    here, across = batch.run(recording, method), batch.run(there, method)
    wrapped = across.position - shift - here.position
    wrapped[:, 1] = (wrapped[:, 1] + np.pi) % (2.0 * np.pi) - np.pi
    assert np.abs(wrapped * metres_per_unit(here.position[0], True)).max() < 1e-6
    np.testing.assert_allclose(across.velocity, here.velocity, atol=1e-6)
    np.testing.assert_allclose(across.innovations.residual, here.innovations.residual, atol=1e-7)


@pytest.mark.parametrize("method", ARRAY_METHODS)
@pytest.mark.parametrize(("heading", "pitch"), [(180.0, 0.0), (-120.0, 80.0)])
def test_attitudes_merge_at_any_heading_and_pitch(method: str, heading: float, pitch: float) -> None:
    """Euler angles would average 179 and -179 degrees to zero, and lose heading and roll near 90 degrees of pitch."""
    truth = shaken_path(
        SECONDS,
        heading=Swing(heading * DEG, 0.0, 0.08, 4.0),
        pitch=Swing(pitch * DEG, 0.0, 0.08, 3.0),
        speed=Swing(3.0),
    )
    recording = replace(shaken_recording(9, SECONDS, truth=truth), gnss=None)
    solution = batch.run(recording, method)
    expected = truth.truth(solution.time).attitude
    if pitch == 0.0:
        assert np.abs(np.diff(expected[:, 2])).max() > 6.0
    error = Rotation.from_quat(solution.attitude, scalar_first=True) * Rotation.from_euler(
        "ZYX", expected[:, ::-1]
    ).inv()  # fmt: skip
    assert error.magnitude().max() < 0.2 * DEG


# --- the start --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["single", "nav-fusion", "enav-fusion"])
def test_each_imu_starts_with_the_velocity_of_its_own_place(method: str) -> None:
    """The start is that of the array origin; where the array turns, an IMU away from it moves differently."""
    recording = recorded(3, WUHAN, equal=False)
    run = batch.prepare(recording, method)
    truth, time = shaken_path(SECONDS), np.array([run.start.time])
    places = [run.bank.members[lane].imu.position for lane in run.bank.lanes]
    expected = np.array([truth.truth(time, place).velocity[0] for place in places])
    assert np.abs(expected - run.start.velocity).max() > 0.1
    np.testing.assert_allclose(of_each_imu(run, bank.VELOCITY, 3), expected, atol=0.02)
    positions = np.array([truth.truth(time, place).position[0] for place in places])
    metres = metres_per_unit(run.start.position, True)
    assert np.abs((of_each_imu(run, bank.POSITION, 3) - positions) * metres).max() < 1e-6


# --- hours ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["enav-fusion", "nav-fusion"])
def test_over_two_hours_the_covariance_stays_symmetric_and_positive(method: str) -> None:
    """One minute of swinging on the spot, 120 times over; every fourth without GNSS."""
    whole_turns, interval = 2.0 * np.pi / 60.0, 0.02
    truth = shaken_path(
        60.0 + interval,  # the last epoch is where the first was
        speed=Swing(0.0),
        roll=Swing(0.1, 0.0, 0.2, 20 * whole_turns),
        pitch=Swing(0.0, 0.0, 0.2, 13 * whole_turns),
        heading=Swing(2.5, 0.0, 0.8, 7 * whole_turns),
    )
    times = np.arange(1.0033, 60.0)
    recording = shaken_recording(2, truth.duration, fixes=times, truth=truth, rate_hz=1.0 / interval)
    run = batch.prepare(recording, method)
    for minute in range(120):
        run.state.scalars[[NEXT_EVENT, NEXT_LOG]] = 0.0
        if minute % 4 == 1:
            run.state.scalars[NEXT_EVENT] = len(times)
        run.advance(1, len(run.inputs.time))
        for P in covariances(run):
            sigma = np.sqrt(np.diag(P))
            np.testing.assert_array_equal(P, P.T)
            assert np.linalg.eigvalsh(P / np.outer(sigma, sigma)).min() > 1e-9
    assert np.isfinite(run.state.rows).all()  # lanes without an IMU, too: nothing times zero is not always nothing
    off = (run.outputs.states[-1, :3] - run.start.position) * metres_per_unit(run.start.position, True)
    assert np.abs(off).max() < 0.2


# --- the gate ---------------------------------------------------------------------------------------------------------

EVERY_HALF_SECOND = np.arange(0.5, 6.0, 0.5)
GATED = FilterOptions(gate_limit=100.0)


def shifted(recording: Recording, which: slice | list[int], metres: Array) -> Recording:
    """The recording with some fixes displaced, m north, east, down."""
    assert recording.gnss is not None
    position = recording.gnss.position.copy()
    position[which] += metres / metres_per_unit(position[0], recording.geodetic)
    return replace(recording, gnss=replace(recording.gnss, position=position))


def gated(count: int = 3, *, options: FilterOptions = GATED) -> Recording:
    return replace(shaken_recording(count, 6.0, fixes=EVERY_HALF_SECOND, equal=True), options=options)


@pytest.mark.parametrize("method", METHODS)
def test_a_lying_fix_weighs_nearly_nothing(method: str) -> None:
    recording = gated()
    lied = batch.run(shifted(recording, [6], np.array([50.0, 0.0, 0.0])), method)
    np.testing.assert_array_equal(np.flatnonzero(~lied.innovations.accepted), [6])
    assert not lied.innovations.reset.any()
    assert lied.innovations.nis[6] > 100.0
    assert lied.innovations.residual[6, 0] == pytest.approx(-50.0, abs=1.0)

    def without(gnss: GnssStream) -> GnssStream:
        kept = np.arange(len(gnss.time)) != 6
        return replace(gnss, time=gnss.time[kept], position=gnss.position[kept], position_std=gnss.position_std[kept])

    assert recording.gnss is not None
    missing = batch.run(replace(recording, gnss=without(recording.gnss)), method)
    off = (lied.position - missing.position) * metres_per_unit(lied.position[0], True)
    assert np.abs(off).max() < 0.03
    assert np.abs(lied.velocity - missing.velocity).max() < 0.03


@pytest.mark.parametrize("method", METHODS)
def test_a_lasting_jump_is_followed_by_the_position_alone(method: str) -> None:
    """After ten seconds, of a jump below 20 m; velocity, attitude and biases stay what they were."""
    fixes = np.arange(0.5, 16.0, 0.5)
    recording = replace(shaken_recording(3, 16.0, fixes=fixes, equal=True), options=GATED)
    jump = np.array([0.0, 8.0, 0.0])
    solution, free = batch.run(shifted(recording, slice(4, None), jump), method), batch.run(recording, method)
    (when,) = np.flatnonzero(solution.innovations.reset)
    assert solution.innovations.time[when] - solution.innovations.time[4] == pytest.approx(10.0, abs=0.51)
    np.testing.assert_array_equal(np.flatnonzero(~solution.innovations.accepted), np.arange(4, when))
    assert np.abs(solution.innovations.residual[when, 1]) > 7.0
    assert np.abs(solution.innovations.residual[when + 1 :]).max() < 0.5
    k = np.searchsorted(solution.time, solution.innovations.time[when])
    moved = (solution.position[k] - solution.position[k - 1]) * metres_per_unit(solution.position[0], True)
    assert moved[1] > 7.0
    assert np.abs(solution.velocity - free.velocity).max() < 0.3
    turned = 2.0 * np.arccos(np.minimum(1.0, np.abs(np.sum(solution.attitude * free.attitude, axis=1))))
    assert np.degrees(turned).max() < 0.5


def test_lies_apart_do_not_add_up() -> None:
    """Two lies, good fixes, a lie: nothing is believed."""
    recording = replace(shaken_recording(3, 16.0, fixes=np.arange(0.5, 16.0, 0.5), equal=True), options=GATED)
    solution = batch.run(shifted(recording, [10, 11, 25], np.array([50.0, 0.0, 0.0])), "enav-fusion")
    np.testing.assert_array_equal(np.flatnonzero(~solution.innovations.accepted), [10, 11, 25])
    assert not solution.innovations.reset.any()


def test_noise_that_is_not_stated_is_found_and_used() -> None:
    """A metre of noise stated as two centimetres."""
    rng = np.random.default_rng(8)
    fixes = np.arange(0.5, 40.0, 0.5)
    recording = replace(shaken_recording(3, 40.0, fixes=fixes, equal=True), options=GATED)
    noisy = recording
    for k in range(20, len(fixes)):
        noisy = shifted(noisy, [k], rng.normal(0.0, 1.0, 3))
    found = batch.run(noisy, "enav-fusion").innovations
    assert found.noise_ratio is not None
    assert (found.noise_ratio[:20] == 1.0).all()
    late = found.noise_ratio[32:] * recording.gnss.position_std[32:, 0] ** 2
    assert np.median(late) == pytest.approx(1.0, rel=0.8)
    assert (found.nis[32:] / 3.0).mean() < 4.0


def test_without_a_gate_every_fix_is_believed() -> None:
    lied = shifted(gated(options=FilterOptions(gate_limit=None)), [6], np.array([50.0, 0.0, 0.0]))
    solution = batch.run(lied, "enav-fusion")
    assert solution.innovations.accepted.all()
    assert not solution.innovations.reset.any()
    at = np.searchsorted(solution.time, EVERY_HALF_SECOND[6])
    moved = (solution.position[at] - solution.position[at - 1]) * metres_per_unit(solution.position[0], True)
    assert moved[0] > 10.0


@pytest.mark.parametrize("method", ["single", "enav-fusion", "nav-fusion"])
def test_good_data_pass_a_narrow_gate(method: str) -> None:
    """Errors as the filter models them: the normalized innovations are those of three degrees of freedom."""
    truth = shaken_path(60.0)
    times = np.arange(0.5, 60.0, 0.5)
    recording = shaken_recording(3, 60.0, fixes=times, truth=truth, rate_hz=100.0, equal=True, spread=0.01, seed=3)
    options = FilterOptions(gate_limit=22.0)  # exceeded by chance once in 15,000 fixes
    solution = batch.run(replace(recording, options=options), method)
    assert solution.innovations.accepted.all()
    # an array's errors average, which its covariance does not say
    assert (1.5 if method != "single" else 2.3) < solution.innovations.nis.mean() < 3.7


@pytest.mark.parametrize("method", METHODS)
def test_a_wrong_velocity_weighs_nearly_nothing_and_its_position_is_used(method: str) -> None:
    truth = shaken_path(6.0)
    recording = gated()
    gnss = received(truth, ANTENNA, EVERY_HALF_SECOND, 1)
    assert gnss.velocity is not None
    lying = gnss.velocity.copy()
    lying[6] += [0.0, 20.0, 0.0]
    lied = advanced_with(replace(recording, gnss=replace(gnss, velocity=lying)), method)
    for kind, doubted in ((kinds.GNSS_POSITION, []), (kinds.GNSS_VELOCITY, [6])):
        status = lied.outputs.event_status[of_kind(lied, kind)]
        np.testing.assert_array_equal(np.flatnonzero(status == update.DEWEIGHTED), doubted)
        assert np.count_nonzero(status == update.ACCEPTED) == len(EVERY_HALF_SECOND) - len(doubted)
    wrong = EVERY_HALF_SECOND[6]

    def drop(run: batch.Prepared) -> batch.Prepared:
        return with_events(run, ~(of_kind(run, kinds.GNSS_VELOCITY) & (run.inputs.event_time == wrong)))

    missing = advanced_with(replace(recording, gnss=gnss), method, drop)
    assert np.abs(lied.outputs.states[1:, 3:6] - missing.outputs.states[1:, 3:6]).max() < 0.02


def advanced_with(
    recording: Recording, method: str, change: Callable[[batch.Prepared], batch.Prepared] = lambda run: run
) -> batch.Prepared:
    run = change(batch.prepare(recording, method))
    run.advance(1, len(run.inputs.time))
    return run


def test_a_doubted_position_takes_its_velocity_with_it() -> None:
    recording = replace(gated(), gnss=received(shaken_path(6.0), ANTENNA, EVERY_HALF_SECOND, 1))
    run = advanced_with(shifted(recording, [6], np.array([50.0, 0.0, 0.0])), "enav-fusion")
    assert run.outputs.event_status[of_kind(run, kinds.GNSS_POSITION)][6] == update.DEWEIGHTED
    assert run.outputs.event_status[of_kind(run, kinds.GNSS_VELOCITY)][6] == update.UNUSED


# --- which fixes are used ---------------------------------------------------------------------------------------------


def test_fixes_strictly_inside_an_outage_are_withheld() -> None:
    recording = replace(gated(), outages=((1.5, 3.0), (4.2, 4.7)))
    solution = batch.run(recording, "enav-fusion")
    np.testing.assert_array_equal(solution.innovations.time, [0.5, 1.0, 1.5, 3.0, 3.5, 4.0, 5.0, 5.5])
    assert recording.gnss is not None
    kept = np.isin(recording.gnss.time, solution.innovations.time)
    gnss = GnssStream(
        recording.gnss.time[kept], recording.gnss.position[kept], recording.gnss.position_std[kept]
    )  # fmt: skip
    assert_bit_equal(solution, batch.run(replace(recording, gnss=gnss, outages=()), "enav-fusion"))


def test_the_std_grows_through_an_outage_and_shrinks_at_its_end() -> None:
    solution = batch.run(replace(gated(), outages=((1.5, 3.0),)), "enav-fusion")
    at = dict(zip(("in", "late", "end"), np.searchsorted(solution.time, [1.6, 2.99, 3.0]), strict=True))
    std = np.sqrt(solution.position_variance[:, 0])
    assert std[at["late"]] > 1.5 * std[at["in"]]
    assert std[at["end"]] < std[at["late"]]


def test_fixes_up_to_the_start_and_after_the_end_are_left_out() -> None:
    recording = gated(1)
    start = replace(start_at(shaken_path(6.0), 1.0), end_time=4.0)
    solution = batch.run(replace(recording, start=start), "single")
    np.testing.assert_array_equal(solution.innovations.time, np.arange(1.5, 4.1, 0.5))
    assert solution.time[0] == pytest.approx(1.005)
    assert solution.time[-1] == 4.0


@pytest.mark.parametrize("offset", [-0.9e-4, 0.9e-4])
def test_a_fix_next_to_an_epoch_is_used_at_that_epoch(offset: float) -> None:
    recording = gated(1)
    assert recording.gnss is not None

    def moved(by: float) -> Any:
        time = recording.gnss.time.copy()  # type: ignore[union-attr]
        time[4] += by
        return batch.run(replace(recording, gnss=replace(recording.gnss, time=time)), "single")

    exact, near, beyond = moved(0.0), moved(offset), moved(3.0 * offset)
    np.testing.assert_array_equal(near.velocity, exact.velocity)
    assert np.abs(beyond.velocity - exact.velocity).max() > 0.0


def test_without_gnss_the_array_coasts() -> None:
    recording = replace(shaken_recording(3, 3.0, equal=True), gnss=None)
    solution = batch.run(recording, "enav-fusion")
    assert len(solution.innovations.time) == 0
    expected = shaken_path(3.0).truth(solution.time)
    off = (solution.position - expected.position) * metres_per_unit(expected.position[0], True)
    assert np.abs(off).max() < 0.2


# --- plain Python -----------------------------------------------------------------------------------------------------

SCRIPT = """
import sys
import numpy as np
from array_recordings import shaken_recording
from polyins.navigate import batch
recording = shaken_recording(3, 2.04, fixes=np.array([0.1033, 0.2]), rate_hz=25.0)
np.save(sys.argv[1], [batch.run(recording, method).position[-1] for method in ("enav-fusion", "imu-fusion")])
"""


def test_the_engine_runs_uncompiled(tmp_path: Path) -> None:
    tests = str(Path(__file__).parents[1])
    positions = []
    for disabled in ("0", "1"):
        out = tmp_path / f"{disabled}.npy"
        paths = os.pathsep.join([tests, *filter(None, [os.environ.get("PYTHONPATH")])])
        environment = {**os.environ, "NUMBA_DISABLE_JIT": disabled, "PYTHONPATH": paths}
        subprocess.run([sys.executable, "-c", SCRIPT, str(out)], env=environment, check=True, timeout=300)
        positions.append(np.load(out))
    np.testing.assert_allclose(positions[1], positions[0], rtol=1e-13)
    assert np.isfinite(positions[1]).all()
