"""What makes the errors of the simulated robot run: one thing changed at a time, each by an amount with a source.

Errors that the filter knows nothing of are put into what it is told: a radius, a lever arm, a start that are off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from polyins.config import Noise, Positive, Section
from polyins.model.recording import Recording
from polyins.model.rig import DEG, HOUR, Imu, Wheel
from polyins.prepare.alignment import rotation_matrix
from polyins.simulation import earth
from polyins.simulation.run import TrueRun, record, true_run
from polyins.simulation.scenario import SensorErrors
from polyins.simulation.wheel_scenario import Slip
from polyins.studies.scenario_files import read
from polyins_papers.robot import WINDOW, as_in_the_paper
from polyins_papers.sites import Site
from polyins_papers.vehicles import CHIPS, FILTER_NOISE, GYRO_SCALE_PPM, ROBOT

Array = NDArray[np.float64]
World = Literal["plane", "turning", "slip", "level"]
"""as in the scenario; on the Earth, which turns; with slip; without slopes"""


class Sizes(Section):
    """By how much each experiment differs; `experiments.yaml` says where from."""

    printed_gyro_scale_ppm: Positive
    low_gyro_scale_ppm: Positive
    wandering_bias_deg_h: Positive
    wandering_time_s: Positive
    misalignment_deg: Positive
    radius_error: Positive
    """of the radius"""
    lever_arm_error_m: Positive
    heading_error_deg: Positive
    tilt_deg: Positive
    clock_error_s: Positive
    slip: Slip


SIZES = read(Sizes, __package__, "experiments")
CONSTANT = ROBOT.base.errors
WANDERING = SensorErrors(turn_on_share=1.0 - (SIZES.wandering_bias_deg_h / CHIPS.gyro_bias_deg_h[0]) ** 2)
WANDERING_TIME_H = SIZES.wandering_time_s / HOUR
FIELD_SEEDS = 3


@dataclass(frozen=True)
class Experiment:
    """A run that differs from Table III's chips, constant errors, a known installation, on a plane Earth."""

    source: str
    """what differs, and where its size is from"""
    world: World = "plane"
    errors: SensorErrors = CONSTANT
    noise: Noise = CHIPS
    """of the chips"""
    filter_noise: Noise = FILTER_NOISE
    """that the filter is told"""
    change: Callable[[Recording], Recording] = lambda recording: recording
    """of what the filter is told besides"""
    predict: str = "end"
    window: float = WINDOW
    """s"""
    seeds: int = 1

    def recording(self, site: Site, seed: int) -> Recording:
        """Return its recording with errors drawn by a seed."""
        drawn = _drawn(site, self.world, self.errors, self.noise, self.filter_noise, seed)
        return as_in_the_paper(self.change(drawn), self.predict, self.window)


@lru_cache(maxsize=1)
def _drawn(site: Site, world: World, errors: SensorErrors, noise: Noise, filter_noise: Noise, seed: int) -> Recording:
    run = truth(site, world)
    scenario = run.scenario.model_copy(update={"errors": errors, "noise": noise, "filter_noise": filter_noise})
    return record(replace(run, scenario=scenario), seed=seed).recording.as_published().without_gate()


@lru_cache(maxsize=4)
def truth(site: Site, world: World = "plane") -> TrueRun:
    """Return the error-free run of a site's vehicle in a world."""
    if world == "level":
        return true_run(site.scenario(level=True))
    if world == "slip":
        return true_run(site.scenario(slip=SIZES.slip))
    return true_run(site.scenario(earth=world))


def without_earth_rate(recording: Recording) -> Recording:
    """Return a recording on the turning Earth as a filter takes it that has no Earth rate: on a plane."""
    from pymap3d import geodetic2ned

    origin, reference = recording.start.position, recording.reference
    assert origin is not None
    assert reference is not None
    latitude, longitude, height = reference.position.T
    north, east, down = geodetic2ned(latitude, longitude, height, *origin, deg=False)
    gravity = float(earth.gravity(origin[None])[0])
    return replace(
        recording,
        geodetic=False,
        reference=replace(reference, position=np.column_stack([north, east, -down])),
        start=replace(recording.start, position=np.zeros(3)),
        options=replace(recording.options, gravity=gravity),
    )


def with_wheels(recording: Recording, change: Callable[[Wheel], Wheel]) -> Recording:
    """Return the recording with other wheels in its rig."""

    def changed(imu: Imu) -> Imu:
        return imu if imu.wheel is None else replace(imu, wheel=change(imu.wheel))

    return replace(recording, rig=replace(recording.rig, imus=tuple(changed(imu) for imu in recording.rig.imus)))


def wrong_radius(recording: Recording) -> Recording:
    """Return the recording with radii that are too large."""
    return with_wheels(recording, lambda wheel: replace(wheel, radius=wheel.radius * (1.0 + SIZES.radius_error)))


def wrong_lever_arm(recording: Recording) -> Recording:
    """Return the recording with lever arms that are off in the plane of the wheel."""
    off = np.array([0.0, SIZES.lever_arm_error_m, SIZES.lever_arm_error_m])
    return with_wheels(recording, lambda wheel: replace(wheel, lever_arm=wheel.lever_arm + off))


def wrong_heading(recording: Recording) -> Recording:
    """Return the recording with a start heading that is off."""
    assert recording.start.heading is not None
    heading = recording.start.heading + SIZES.heading_error_deg * DEG
    return replace(recording, start=replace(recording.start, heading=heading))


def tilted_modules(recording: Recording) -> Recording:
    """Return the recording with each module turned about its y and z axes, by drawn angles."""
    rng = np.random.default_rng(0)
    turned = {
        name: rotation_matrix(np.array([0.0, *rng.normal(0.0, SIZES.tilt_deg * DEG, 2)]))
        for name in recording.rig.modules()
    }
    streams = tuple(
        replace(stream, dtheta=stream.dtheta @ turned[imu.module], dvel=stream.dvel @ turned[imu.module])
        for imu, stream in zip(recording.rig.imus, recording.imus, strict=True)
    )
    return replace(recording, imus=streams)


def late_clocks(recording: Recording) -> Recording:
    """Return the recording with the right wheel's stamps too late and the body's too early."""
    offset = {"left": 0.0, "right": SIZES.clock_error_s, "body": -SIZES.clock_error_s}
    streams = tuple(
        replace(stream, time=stream.time + offset[imu.module])
        for imu, stream in zip(recording.rig.imus, recording.imus, strict=True)
    )
    return replace(recording, imus=streams)


def in_the_field(recording: Recording) -> Recording:
    """Return the recording with all that an installation leaves wrong."""
    return tilted_modules(wrong_heading(wrong_lever_arm(wrong_radius(without_earth_rate(recording)))))


def grade(base: Noise = FILTER_NOISE, **values: object) -> Noise:
    """Return noise figures with some of them changed."""
    return Noise.model_validate({**base.model_dump(), **values})


def _scales(axle: float, across: float) -> Noise:
    return grade(CHIPS, gyro_scale_ppm=(axle, across, across))


def _in_the_field(gyro_scale_ppm: float, source: str) -> Experiment:
    return Experiment(
        source,
        world="turning",
        errors=WANDERING.model_copy(update={"misalignment_deg": SIZES.misalignment_deg}),
        noise=grade(CHIPS, gyro_scale_ppm=gyro_scale_ppm, correlation_time_h=WANDERING_TIME_H),
        change=in_the_field,
        seeds=FIELD_SEEDS,
    )


EXPERIMENTS: dict[str, Experiment] = {
    # the first nine share their recordings
    "base": Experiment("Table III, gyro scale 0.0015; predicted at the window's end"),
    "base, window": Experiment("predicted over the same 0.1 s", predict="window"),
    "window of one sample": Experiment("5 ms instead of 0.1 s", predict="window", window=0.005),
    "window of 0.5 s": Experiment("as long as the interval between updates", predict="window", window=0.5),
    "radius 0.5 % too large": Experiment("half of the last digit of the lab's 0.097 m", change=wrong_radius),
    "lever arm 3 mm off": Experiment("in y and z; the lab's 1.5 cm were measured by hand", change=wrong_lever_arm),
    "start heading 0.5 deg off": Experiment(
        "plausible between a reference and the axle; not published", change=wrong_heading
    ),
    "modules tilted 0.5 deg": Experiment(
        "plausible after a calibration that found 3.4 and 1.3 deg; not published", change=tilted_modules
    ),
    "clocks 5 ms off": Experiment("right against left, body the other way; one sample of 200 Hz", change=late_clocks),
    "gyro scale 0.03": Experiment(
        "as Table III prints it", noise=grade(CHIPS, gyro_scale_ppm=SIZES.printed_gyro_scale_ppm)
    ),
    "turning earth": Experiment("the Earth turns and the filter knows", world="turning"),
    "no gyro scale": Experiment("what everything else in Table III makes", noise=_scales(0.0, 0.0)),
    "gyro scale about the axle": Experiment("of the x gyro only", noise=_scales(GYRO_SCALE_PPM, 0.0)),
    "gyro scale about the axle, window": Experiment(
        "of the x gyro only", noise=_scales(GYRO_SCALE_PPM, 0.0), predict="window"
    ),
    "gyro scale across the axle": Experiment("of the y and z gyros only", noise=_scales(0.0, GYRO_SCALE_PPM)),
    "filter knows the gyro scale, window": Experiment(
        "the filter is told 1500 ppm instead of the lab's 50",
        filter_noise=grade(gyro_scale_ppm=GYRO_SCALE_PPM),
        predict="window",
    ),
    "no earth rate in the filter": Experiment(
        "paper B (2) has none, the robot ran on the Earth", world="turning", change=without_earth_rate
    ),
    "wandering biases": Experiment(
        "25 of the 200 deg/h and an eighth of the other errors wander within 600 s, as such chips do",
        errors=WANDERING,
        noise=grade(CHIPS, correlation_time_h=WANDERING_TIME_H),
    ),
    "misaligned triads": Experiment(
        "0.2 deg about each axis, the spread of these chips in whu-array",
        errors=CONSTANT.model_copy(update={"misalignment_deg": SIZES.misalignment_deg}),
    ),
    "slip": Experiment("up to 20 % for 1 s, every 30 s, each wheel; plausible, not published", world="slip"),
    "level ground": Experiment("no slopes; the robot's scenario has some", world="level"),
    "gyro scale 0.005": Experiment(
        "half of the 1 % that the chip's data sheet allows", noise=grade(CHIPS, gyro_scale_ppm=SIZES.low_gyro_scale_ppm)
    ),
    "in the field": _in_the_field(
        GYRO_SCALE_PPM,
        "no earth rate, wandering biases, misaligned triads, radius, lever arm, heading and tilt together",
    ),
    "in the field, gyro scale 0.005": _in_the_field(SIZES.low_gyro_scale_ppm, "the last two together"),
    "in the field, gyro scale 0.005, window": replace(
        _in_the_field(SIZES.low_gyro_scale_ppm, "predicted over the same 0.1 s"), predict="window"
    ),
}
