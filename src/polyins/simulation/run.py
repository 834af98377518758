"""The truth of a scenario, and recordings of it: errors, noise and fixes are drawn apart from the truth.

Many recordings of one run are cheap: what error-free IMUs put out is worked out once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path as FilePath

import numpy as np
from numpy.typing import NDArray

from polyins.config.units import read
from polyins.config.yaml_document import write_yaml
from polyins.errors import InputError
from polyins.model.recording import (
    FilterOptions,
    GnssStream,
    ImuStream,
    Recording,
    Reference,
    RollingOptions,
    StartOptions,
)
from polyins.model.rig import Imu, NoiseGrade
from polyins.simulation import gnss
from polyins.simulation.flexible import flex
from polyins.simulation.flexible_scenario import Road
from polyins.simulation.ground import without_twist
from polyins.simulation.imu_errors import TrueErrors, TrueIncrements, corrupt, draw_errors
from polyins.simulation.increments import Increments, increments, stamps
from polyins.simulation.moving_imu import FINE_STEPS, moving_increments, smooth_rates
from polyins.simulation.path import Path
from polyins.simulation.rolling import RollingWheel
from polyins.simulation.scenario import Scenario, read_scenario
from polyins.simulation.shaking import shake, shaken_path
from polyins.simulation.shared_noise import SharedNoise
from polyins.simulation.triads import product
from polyins.simulation.wheels import wheel_increments

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TrueRun:
    """The truth of a scenario: everything that does not depend on errors."""

    scenario: Scenario
    """its seeds and its duration are those of the path"""
    path: Path
    body: Increments | None
    """error-free, of the body; None where the IMUs are on rulers"""
    wheels: tuple[RollingWheel, ...]
    """in the order of the scenario's"""
    spinning: tuple[Increments, ...]
    """error-free, of the modules on the wheels"""
    tips: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    """error-free (dtheta, dvel) of the IMUs on rulers, by name"""

    @property
    def time(self) -> Array:
        """When the IMUs put out their increments, s, shape (T,)."""
        return stamps(self.path, self.scenario.rate_hz)

    def sensed(self, imu: Imu) -> tuple[Array, Array]:
        """Return the error-free (dtheta, dvel) of an IMU in its own axes, shape (T, 3) each."""
        if imu.name in self.tips:
            return self.tips[imu.name]
        if imu.wheel is None:
            assert self.body is not None
            return self.body.at(imu.position, imu.rotation)
        names = [wheel.name for wheel in self.scenario.wheels]
        return self.spinning[names.index(imu.module)].at(-imu.wheel.lever_arm)


@dataclass(frozen=True)
class Simulation:
    """A recording and the truth behind it."""

    recording: Recording
    path: Path
    errors: tuple[TrueErrors, ...]
    """in the order of the rig's IMUs"""
    wrong_fixes: NDArray[np.intp]
    """indices of the fixes that are wrong"""
    wheels: tuple[RollingWheel, ...] = ()
    """in the order of the scenario's"""


def true_run(scenario: Scenario) -> TrueRun:
    """Return the truth of a scenario: its path, its wheels, and what error-free IMUs put out.

    Raises InputError for a scenario that cannot be.
    """
    seed = scenario.seed if scenario.path_seed is None else scenario.path_seed
    drive_seed, _, _, wheel_seed, ground_seed = np.random.SeedSequence(seed).spawn(5)
    path = _path(scenario, drive_seed)
    fitted = _fitted(scenario.model_copy(update={"path_seed": seed}), path)
    wheels = tuple(
        wheel.rolls(path, np.random.default_rng(own_seed))
        for wheel, own_seed in zip(scenario.wheels, wheel_seed.spawn(len(scenario.wheels)), strict=True)
    )
    run = TrueRun(
        fitted,
        path,
        None if scenario.rulers else increments(path, scenario.rate_hz),
        wheels,
        tuple(wheel_increments(wheel, scenario.rate_hz) for wheel in wheels),
    )
    return _on_flexible_mounts(run, np.random.default_rng(ground_seed)) if scenario.rulers else run


def _on_flexible_mounts(run: TrueRun, rng: np.random.Generator) -> TrueRun:
    """Return a run whose body shakes on its road, and whose IMUs are at the tips of rulers."""
    scenario, path, interval = run.scenario, run.path, 1.0 / run.scenario.rate_hz
    assert scenario.rulers is not None
    rulers = scenario.rulers.mounts(rng)
    road = scenario.road or Road()
    begins = scenario.shuttle.straights(path.duration, scenario.static_s)[1] if scenario.shuttle else ()
    shaking = shake(path, road.ground(path, begins, rng), road.suspension(), interval / FINE_STEPS)
    smooth = smooth_rates(path, len(run.time), interval)
    gravity = float(path.world.gravity(path.position(np.zeros(1)))[0])
    tips = {}
    for imu, ruler in zip(scenario.rig().imus, rulers, strict=True):
        tips[imu.name] = moving_increments(smooth, ruler, flex(ruler, shaking, gravity), shaking)
    return replace(run, path=shaken_path(path, shaking), tips=tips)


def simulate(scenario: Scenario | str | FilePath | None = None, *, seed: int | None = None) -> Recording:
    """Return the recording of a scenario, or of the file that describes it; None: the default scenario.

    `seed` takes the place of the scenario's. Raises InputError for a scenario that cannot be.
    """
    return simulate_with_truth(scenario, seed=seed).recording


def simulate_with_truth(scenario: Scenario | str | FilePath | None = None, *, seed: int | None = None) -> Simulation:
    """Return the recording of a scenario like `simulate`, with the path and the errors behind it."""
    if isinstance(scenario, str | FilePath):
        scenario = read_scenario(scenario)
    scenario = scenario or Scenario()
    if seed is not None:
        scenario = scenario.model_copy(update={"seed": checked(seed)})
    return record(true_run(scenario), seed=scenario.seed)


def record(run: TrueRun, *, seed: int) -> Simulation:
    """Return a recording of a true run, with errors, noise and fixes that the seed draws.

    Each IMU draws from a generator of its own: one IMU more changes nothing for those before it.
    """
    own_path = run.scenario.path_seed if run.scenario.path_seed != seed else None
    scenario = run.scenario.model_copy(update={"seed": checked(seed), "path_seed": own_path})
    _, gnss_seed, imu_seed, _, board_seed = np.random.SeedSequence(seed).spawn(5)
    rig = scenario.rig()
    shared = scenario.errors.shared(int(board_seed.generate_state(1)[0]))
    sensed = [
        _sense(number, imu, run, shared, np.random.default_rng(own_seed))
        for number, (imu, own_seed) in enumerate(zip(rig.imus, imu_seed.spawn(len(rig.imus)), strict=True))
    ]
    imus, streams, errors = zip(*sensed, strict=True)
    lacks_outages = bool(scenario.gnss and scenario.outages) and not scenario.outage_intervals()
    too_short = ("outages: the drive is too short for one",) if lacks_outages else ()
    fixes, wrong_fixes = _receive(scenario, run.path, np.random.default_rng(gnss_seed))
    recording = Recording(
        rig=replace(rig, imus=imus),
        imus=streams,
        gnss=fixes,
        reference=_reference(run.path, scenario.reference_rate_hz),
        geodetic=scenario.earth == "turning",
        outages=scenario.outage_intervals(),
        start=_start(scenario, run),
        options=FilterOptions(gravity=scenario.gravity_m_s2, rolling=read(scenario.rolling, RollingOptions)),
        name=scenario.name,
        warnings=(*run.path.warnings, *scenario.without_effect(), *too_short),
        config_text=write_yaml(scenario.model_dump(mode="json")),
    )
    return Simulation(recording, run.path, errors, wrong_fixes, run.wheels)


def checked(seed: int) -> int:
    """Return the seed; raise InputError for one that is negative."""
    if seed < 0:
        raise InputError(f"seed is {seed}; expected a whole number that is not negative")
    return seed


def _path(scenario: Scenario, seed: np.random.SeedSequence) -> Path:
    start, world = scenario.start_position(), scenario.world()
    if way := scenario.track or scenario.laps:
        path = way.path(scenario.static_s, start, world)
        uneven = scenario.wheels and way.slope_deg
        return _shortened(without_twist(path, way.slope_adapts_m) if uneven else path, scenario)
    if scenario.replay:
        return _shortened(scenario.replay.path(int(seed.generate_state(1)[0])), scenario)
    if scenario.shuttle:
        return scenario.shuttle.path(scenario.duration_s, scenario.static_s, start, world)
    path = scenario.drive.path(scenario.duration_s, scenario.static_s, seed, start, world)
    return without_twist(path) if scenario.wheels else path


def _shortened(path: Path, scenario: Scenario) -> Path:
    """Return the path up to the duration that the scenario gives; all of it if it gives none."""
    return replace(path, duration=min(path.duration, scenario.duration_s)) if scenario.limited else path


def _fitted(scenario: Scenario, path: Path) -> Scenario:
    """Return the scenario with the duration and the standing start of its path; raise InputError if it does not fit."""
    if path.static >= path.duration:
        raise InputError(f"duration_s: is {path.duration:g}; expected more than the {path.static:g} s it stands first")
    fitted = scenario.model_copy(update={"duration_s": path.duration, "static_s": path.static})
    for begin, end in fitted.outage_intervals():
        if end > path.duration + 1e-6:
            raise InputError(
                f"outages: [{begin:g}, {end:g}]; expected [from, to] within the {path.duration:g} s of the drive"
            )
    return fitted


def _sense(
    number: int, imu: Imu, run: TrueRun, shared: SharedNoise, rng: np.random.Generator
) -> tuple[Imu, ImuStream, TrueErrors]:
    """Return an IMU as it is configured, what it puts out, turned into array axes as a reader does, and its errors."""
    scenario, time = run.scenario, run.time
    imperfections, grade = scenario.errors.imperfections(), read(scenario.noise, NoiseGrade)
    errors = draw_errors(time[-1], grade, imperfections, rng, shared=shared, number=number)
    true = TrueIncrements(time, *run.sensed(imu), scenario.errors.vibration(run.path.speed(time)))
    white = imperfections.limit(grade)
    dtheta, dvel = corrupt(true, errors, white, rng, imperfections=imperfections, shared=shared)
    # row by row, as recordings are read
    dtheta, dvel = (np.ascontiguousarray(product(imu.rotation, vectors)) for vectors in (dtheta, dvel))
    stream = ImuStream(imu.name, time, dtheta, dvel)
    return _calibrated(imu, scenario, errors), stream, errors


def _calibrated(imu: Imu, scenario: Scenario, errors: TrueErrors) -> Imu:
    """Return an IMU whose wheel, if it has one and it is calibrated, has the radius that its gyro shows."""
    known = {wheel.name for wheel in scenario.wheels if wheel.calibrated}
    if imu.wheel is None or imu.module not in known:
        return imu
    scale = float(errors.start(imu.rotation).gyro_scale[0])
    return replace(imu, wheel=replace(imu.wheel, radius=imu.wheel.radius / (1.0 + scale)))


def _start(scenario: Scenario, run: TrueRun) -> StartOptions:
    """Return what is known of the start: when it stands, and with nothing but wheels to go by where and how.

    A robot that goes to and fro is too slow for its course to show the heading, so a reference gives it, as in paper A.
    Paper B's lab starts from its reference.
    """
    still = (float(run.time[0]), scenario.static_s)
    interval = still if still[0] < still[1] else None
    truth = run.path.truth([scenario.static_s])
    if scenario.shuttle:
        return StartOptions(static_interval=interval, heading=float(truth.attitude[0, 2]), heading_from="value")
    if not scenario.wheels or scenario.gnss:
        return StartOptions(static_interval=interval)
    return read(
        scenario.start_std,
        StartOptions,
        static_interval=interval,
        position=truth.position[0],
        heading=float(truth.attitude[0, 2]),
        heading_from="value",
    )


def _receive(scenario: Scenario, path: Path, rng: np.random.Generator) -> tuple[GnssStream | None, NDArray[np.intp]]:
    """Return the fixes and the indices of the wrong ones among them."""
    if scenario.gnss is None:
        return None, np.zeros(0, dtype=np.intp)
    receiver = scenario.gnss
    stream = gnss.fixes(path, read(receiver, gnss.GnssReceiver), rng)
    shown = stream.time > scenario.static_s
    for begin, end in scenario.outage_intervals():
        shown &= (stream.time < begin) | (stream.time > end)
    return gnss.with_wrong_fixes(
        stream, np.flatnonzero(shown), receiver.lies.count, receiver.lies.size_m, rng, path.world
    )


def _reference(path: Path, rate_hz: float) -> Reference:
    time = np.arange(1.0, np.floor(path.duration * rate_hz + 1e-6) + 1.0) / rate_hz
    truth = path.truth(time)
    return Reference(time, truth.position, truth.velocity, truth.attitude)
