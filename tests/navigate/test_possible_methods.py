"""Rows that one bank makes possible: joined arrays, arrays on vehicles, velocities on wheels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from array_recordings import Array, Swing, received, scaled, sensed, shaken_path, start_at
from driven_vehicle import drive
from scipy.stats import chi2
from test_sensors import GRADE

import polyins as pi
from polyins.model.geodesy import displacement
from polyins.model.recording import Recording, Reference
from polyins.model.rig import Imu, Rig
from polyins.navigate import batch


def off_the_reference(solution: batch.Solution, recording: Recording) -> Array:
    """Horizontal errors at the reference, m."""
    reference = recording.reference
    assert reference is not None
    k = np.clip(np.searchsorted(solution.time, reference.time - 1e-6), 0, len(solution.time) - 1)
    found = displacement(solution.position[k], reference.position[0], recording.geodetic)
    true = displacement(reference.position, reference.position[0], recording.geodetic)
    return np.asarray(np.linalg.norm((found - true)[:, :2], axis=1))


def array_run(seed: int, imus: int = 4, duration: float = 120.0) -> tuple[batch.Solution, Array, Array]:
    """Run joined blocks; return errors of position and the stated variances at the end of an outage."""
    truth = shaken_path(
        duration,
        speed=Swing(8.0, 0.0, 3.0, 0.3),
        roll=Swing(0.0, 0.0, 0.05, 0.9),
        pitch=Swing(0.0, 0.0, 0.04, 0.7),
        heading=Swing(1.0, 0.05, 0.5, 0.2),
    )
    rng = np.random.default_rng([seed, 9])
    # as `sensed` draws biases: half of what the start is told
    rig = Rig(tuple(Imu(f"imu{i + 1}", GRADE, position=rng.uniform(-0.1, 0.1, 3)) for i in range(imus)))
    rig = Rig(tuple(replace(imu, initial_std=halved(imu)) for imu in rig.imus))
    gnss = received(truth, rig.antenna, np.arange(1.03, duration, 1.0), seed)
    start = start_at(truth, 0.01)
    assert start.position is not None
    recording = Recording(
        rig,
        sensed(truth, replace(rig, imus=tuple(replace(imu, initial_std=None) for imu in rig.imus)), seed, 100.0),
        gnss=replace(gnss, velocity=None, velocity_std=None),
        reference=Reference(truth_time := np.arange(1.0, duration), *at(truth, truth_time)),
        start=wrong(start, rng),
        outages=((60.0, 90.0),),
    )
    solution = batch.run(recording, "nav-fusion/centralized")
    k = int(np.searchsorted(solution.time, 89.0 - 1e-6))
    there = truth.truth(solution.time[[k]])
    error = displacement(solution.position[[k]], there.position[0], True)[0]
    return solution, error, solution.position_variance[k]


def halved(imu: Imu) -> object:
    from polyins.model.rig import ImuErrors

    return ImuErrors(*(0.5 * imu.start_std()).reshape(4, 3))


def at(truth: object, time: Array) -> tuple[Array, Array, Array]:
    found = truth.truth(time)  # type: ignore[attr-defined]
    return found.position, found.velocity, found.attitude


def wrong(start: object, rng: np.random.Generator) -> object:
    """A start that is wrong by as much as it says."""
    from polyins.model.geodesy import metres_per_unit
    from polyins.model.recording import StartOptions

    assert isinstance(start, StartOptions)
    assert start.position is not None
    assert start.velocity is not None
    assert start.roll_pitch is not None
    assert start.heading is not None
    noise = rng.standard_normal((3, 3))
    assert start.position_std is not None
    assert start.velocity_std is not None
    assert start.attitude_std is not None
    return replace(
        start,
        position=start.position + noise[0] * start.position_std / metres_per_unit(start.position, True),
        velocity=start.velocity + noise[1] * start.velocity_std,
        roll_pitch=start.roll_pitch + noise[2, :2] * start.attitude_std[:2],
        heading=start.heading + noise[2, 2] * start.attitude_std[2],
    )


def test_joined_filters_of_an_array_are_as_sure_as_they_should_be() -> None:
    """Where errors are as modelled and the noise of GNSS is common, at the end of an outage."""
    runs = 24
    nees = np.array([np.sum(error**2 / variance) for _, error, variance in map(array_run, range(runs))])
    low, high = chi2.ppf([1e-3, 1.0 - 1e-3], 3 * runs) / runs
    assert low < nees.mean() < high


def test_joined_filters_of_an_array_accept_every_honest_fix() -> None:
    solution, _, variance = array_run(3)
    assert solution.measurements["GNSS position"].accepted.all()
    assert np.isfinite(solution.position).all()
    assert (variance > 0.0).all()


def test_four_chips_on_a_body_and_a_wheel() -> None:
    """The array drifts no more than its best chip, its speed being that of the wheel."""
    recording = drive(seed=2)
    body = next(i for i, imu in enumerate(recording.rig.imus) if imu.wheel is None)
    wheel = next(i for i, imu in enumerate(recording.rig.imus) if imu.wheel is not None)
    rng = np.random.default_rng(5)
    chips, streams = [], []
    for k in range(4):
        imu, stream = recording.rig.imus[body], recording.imus[body]
        dt = float(np.median(np.diff(stream.time)))
        bias = np.radians(20.0) / 3600.0 * rng.standard_normal(3)
        noise = 2e-3 * np.sqrt(dt) * rng.standard_normal((2, *stream.dtheta.shape))
        chips.append(replace(imu, name=f"chip{k + 1}", module="", noise=scaled(imu.noise, 1.0)))
        streams.append(
            replace(stream, name=f"chip{k + 1}", dtheta=stream.dtheta + bias * dt + 0.05 * noise[0],
                    dvel=stream.dvel + noise[1])
        )  # fmt: skip
    rig = replace(recording.rig, imus=(*chips, recording.rig.imus[wheel]))
    recording = replace(recording, rig=rig, imus=(*streams, recording.imus[wheel]))
    alone = [off_the_reference(batch.run(recording, "single", imu=k), recording)[-1] for k in range(4)]
    for method in ("enav-fusion", "nav-fusion", "nav-fusion/centralized"):
        solution = batch.run(recording, method)
        assert solution.measurements["wheel speed"].time.size > 100
        assert off_the_reference(solution, recording)[-1] < 1.1 * min(alone)


@pytest.mark.parametrize("method", ["wheel-ins", "body-ins", "triple-ins", "triple-ins/centralized"])
def test_velocities_of_gnss_aid_a_vehicle(method: str) -> None:
    recording = drive(gnss=True)
    gnss = recording.gnss
    reference = recording.reference
    assert gnss is not None
    assert reference is not None
    assert reference.velocity is not None
    way = np.gradient(displacement(gnss.position, gnss.position[0], recording.geodetic), gnss.time, axis=0)
    # of the antenna, from the true positions of the vehicle: smooth where fixes are noisy
    true = np.column_stack([np.interp(gnss.time, reference.time, one) for one in reference.velocity.T])
    assert np.abs(np.median(way - true, axis=0)).max() < 0.3
    std = np.full_like(true, 0.5)
    aided = replace(recording, gnss=replace(gnss, velocity=true, velocity_std=std))
    solution = pi.run(aided, method)
    found = solution.measurements["GNSS velocity"]
    assert found.accepted.mean() > 0.95
    assert off_the_reference(solution, aided)[-1] < 0.5


def test_joined_filters_of_an_array_are_those_with_full_matrices() -> None:
    truth = shaken_path(6.0)
    rig = Rig(tuple(Imu(f"imu{i + 1}", GRADE, position=np.array([0.1 * i, 0.05, -0.02 * i])) for i in range(3)))
    recording = Recording(
        rig,
        sensed(truth, rig, 1, 100.0),
        gnss=received(truth, rig.antenna, np.arange(0.53, 6.0, 0.5), 1),
        start=start_at(truth, 0.01),
    )
    structured, matrices = (
        batch.navigate(batch.prepare(recording, "nav-fusion/centralized", dense_covariance=dense))
        for dense in (False, True)
    )
    np.testing.assert_allclose(structured.velocity, matrices.velocity, atol=1e-9)
    np.testing.assert_allclose(structured.position_variance, matrices.position_variance, rtol=1e-8)
    np.testing.assert_allclose(structured.imu_errors, matrices.imu_errors, atol=1e-9)
