"""A simulated recording from a short description: a drive, an array of IMUs with errors, GNSS with outages and lies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator

from polyins.config import (
    Noise,
    Number,
    Outages,
    OutageSchedule,
    Positive,
    Section,
    Spread,
    StartPosition,
    Triple,
    validated,
)
from polyins.errors import InputError
from polyins.io.checks import axes_matrix
from polyins.io.imu_stream import noise_grade
from polyins.io.yaml_document import read_yaml, write_yaml
from polyins.recording import GnssStream, ImuStream, Recording, Reference, StartOptions
from polyins.rig import DEG, Imu, Rig
from polyins.simulation import gnss
from polyins.simulation.imu_errors import Imperfections, TrueErrors, corrupt, draw_errors
from polyins.simulation.increments import Increments, increments
from polyins.simulation.path import Path, drive

Array = NDArray[np.float64]

Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
Count = Annotated[int, Field(ge=1, strict=True)]
NotNegative = Annotated[Number, Field(ge=0.0)]


def _geodetic(position: StartPosition) -> StartPosition:
    if not position.geodetic:
        raise ValueError("expected latitude_deg and longitude_deg")
    return position


class Board(Section):
    """The IMUs, row by row on a level board whose centre is the array origin."""

    count: Count = 16
    """how many"""
    columns: Count | None = None
    """IMUs per row; without it as near to a square as can be"""
    pitch_m: NotNegative = 0.015
    """from one IMU to the next, m"""
    mounts: Annotated[tuple[tuple[Axis, Axis, Axis], ...], Field(min_length=1)] = (("x", "y", "z"),)
    """which sensor axes point forward, right and down, one triple for each IMU in turn"""

    def positions(self) -> Array:
        """Return where the IMUs sit in the array frame, m, shape (count, 3)."""
        row, column = np.divmod(np.arange(self.count), self.columns or int(np.ceil(np.sqrt(self.count))))
        grid = self.pitch_m * np.column_stack([-row, column, np.zeros(self.count)])
        return np.asarray(grid - grid.mean(axis=0))

    def rotation(self, index: int) -> Array:
        """Return C_ab of an IMU, shape (3, 3)."""
        return axes_matrix(self.mounts[index % len(self.mounts)])


class Errors(Section):
    """Which errors the IMUs have, beyond the statistics under `noise`."""

    noise: bool = True
    """white noise"""
    biases: bool = True
    """biases"""
    scales: bool = True
    """scale factor errors"""
    turn_on_share: Annotated[Number, Field(ge=0.0, le=1.0)] = 0.0
    """share of the variance of biases and scale factors that is constant; the rest drifts"""
    misalignment_deg: NotNegative = 0.0
    """std of the rotation of gyro and accelerometer triads about each axis, deg"""

    def imperfections(self) -> Imperfections:
        """Return the same in SI."""
        std = self.misalignment_deg * DEG
        return Imperfections(self.turn_on_share, std, self.noise, self.biases, self.scales)


class Lies(Section):
    """Fixes that are wrong by much more than they claim, outside of outages, while driving."""

    count: Annotated[int, Field(ge=0, strict=True)] = 0
    """how many"""
    size_m: Positive = 50.0
    """how far off, in a random horizontal direction, m"""


class Fixes(Section):
    """The GNSS receiver."""

    rate_hz: Positive = 1.0
    """fixes per second"""
    phase_s: NotNegative = 0.3012
    """time of the first fix, s"""
    antenna_position_m: Triple = (-0.3, 0.2, -1.0)
    """of the antenna from the array origin: forward, right, down, m"""
    position_std_m: Spread = (0.02, 0.02, 0.04)
    """of the white noise, north, east, down, m"""
    velocity_std_m_s: Spread | None = None
    """of the velocity's noise, north, east, down, m/s; without it there are no velocities"""
    lies: Lies = Lies()
    """wrong fixes"""


class Scenario(Section):
    """The whole file."""

    name: str = "simulated drive"
    """of the recording"""
    seed: Annotated[int, Field(ge=0, strict=True)] = 0
    """another seed gives another drive with other errors"""
    duration_s: Positive = 1000.0
    """the standing start included, s"""
    static_s: NotNegative = 60.0
    """length of the standing start, s"""
    start: Annotated[StartPosition, AfterValidator(_geodetic)] = StartPosition(
        latitude_deg=30.5278, longitude_deg=114.3557, height_m=35.0
    )
    """where the drive starts"""
    rate_hz: Positive = 200.0
    """of the IMUs"""
    imus: Board = Board()
    """how many and where"""
    noise: Noise = Field(default_factory=lambda: Noise.model_validate("consumer-mems"))
    """how good the IMUs are: a mapping, or just the name of a grade"""
    errors: Errors = Errors()
    """which errors they have"""
    gnss: Fixes | None = Fixes()
    """the receiver; null: none"""
    outages: Outages = OutageSchedule(length_s=30.0, every_s=90.0)
    """GNSS is withheld: a list of [from, to] in s, or a schedule that counts from the end of the standing start"""
    reference_rate_hz: Positive = 10.0
    """of the true states, which serve as the reference"""

    @model_validator(mode="after")
    def _fits_its_duration(self) -> Self:
        inside = f"expected within the {self.duration_s:g} s of duration_s"
        if self.static_s >= self.duration_s:
            raise ValueError(f"static_s is {self.static_s:g}; {inside}")
        if self.duration_s * self.rate_hz < 2.0:
            raise ValueError(f"rate_hz is {self.rate_hz:g}; expected at least two samples {inside[9:]}")
        if self.gnss and self.gnss.phase_s >= self.duration_s:
            raise ValueError(f"gnss.phase_s is {self.gnss.phase_s:g}; {inside}")
        for begin, end in self.outage_intervals():
            if not 0.0 <= begin < end <= self.duration_s:
                raise ValueError(f"outages: [{begin:g}, {end:g}]; expected [from, to] {inside[9:]}")
        return self

    def rig(self) -> Rig:
        """Return what is mounted where."""
        grade = noise_grade(self.noise)
        imus = [
            Imu(f"imu{index + 1}", grade, self.imus.rotation(index), position)
            for index, position in enumerate(self.imus.positions())
        ]
        return Rig(tuple(imus), np.array(self.gnss.antenna_position_m if self.gnss else (0.0, 0.0, 0.0)))

    def outage_intervals(self) -> tuple[tuple[float, float], ...]:
        """Return begin and end of the outages, s; of a schedule those that end before the drive does.

        Without a receiver there are none.
        """
        if self.gnss is None:
            return ()
        if not isinstance(self.outages, OutageSchedule):
            return self.outages
        length, every, after = self.outages.length_s, self.outages.every_s, self.outages.first_after_s
        first = self.static_s + (every - length if after is None else after)
        begins = np.arange(first, self.duration_s - length, every)
        return tuple((float(begin), float(begin + length)) for begin in begins)


@dataclass(frozen=True)
class Simulation:
    """A recording and the truth behind it."""

    recording: Recording
    path: Path
    errors: tuple[TrueErrors, ...]
    """in the order of the rig's IMUs"""
    lies: NDArray[np.intp]
    """indices of the fixes that are wrong"""


def demo() -> Scenario:
    """Return the scenario of the demonstration: 16 IMUs, six minutes, four outages of 30 s."""
    return Scenario(
        name="demo",
        duration_s=360.0,
        static_s=40.0,
        errors=Errors(turn_on_share=0.5, misalignment_deg=0.05),
        outages=OutageSchedule(length_s=30.0, every_s=75.0, first_after_s=60.0),
    )


def read_scenario(path: str | FilePath) -> Scenario:
    """Read a scenario from a YAML file.

    Raises InputError that names file, line and key of the first thing wrong.
    """
    return validated(Scenario, read_yaml(path))


def simulate(scenario: Scenario | str | FilePath | None = None, *, seed: int | None = None) -> Recording:
    """Return the recording of a scenario, or of the file that describes it; None: the default scenario.

    `seed` takes the place of the scenario's. Raises InputError for a scenario that cannot be.
    """
    return simulate_with_truth(scenario, seed=seed).recording


def simulate_with_truth(scenario: Scenario | str | FilePath | None = None, *, seed: int | None = None) -> Simulation:
    """Return the recording of a scenario like `simulate`, with the path and the errors behind it.

    Each IMU draws from a generator of its own: one IMU more changes nothing for the others.
    """
    if isinstance(scenario, str | FilePath):
        scenario = read_scenario(scenario)
    scenario = scenario or Scenario()
    if seed is not None and seed < 0:
        raise InputError(f"seed is {seed}; expected a whole number that is not negative")
    if seed is not None:
        scenario = scenario.model_copy(update={"seed": seed})
    drive_seed, gnss_seed, imu_seed = np.random.SeedSequence(scenario.seed).spawn(3)
    rig, path = scenario.rig(), _drive(scenario, drive_seed)
    exact = increments(path, scenario.rate_hz)
    imperfections = scenario.errors.imperfections()
    sensed = [
        _sense(imu, exact, imperfections, np.random.default_rng(own_seed))
        for imu, own_seed in zip(rig.imus, imu_seed.spawn(len(rig.imus)), strict=True)
    ]
    too_short = bool(scenario.gnss and scenario.outages) and not scenario.outage_intervals()
    still = (float(exact.time[0]), scenario.static_s)
    stream, lies = _receive(scenario, path, np.random.default_rng(gnss_seed))
    recording = Recording(
        rig=rig,
        imus=tuple(stream for stream, _ in sensed),
        gnss=stream,
        reference=_reference(path, scenario.reference_rate_hz),
        outages=scenario.outage_intervals(),
        start=StartOptions(static_interval=still if still[0] < still[1] else None),
        name=scenario.name,
        warnings=("outages: the drive is too short for one",) if too_short else (),
        config_text=write_yaml(scenario.model_dump(mode="json")),
    )
    return Simulation(recording, path, tuple(errors for _, errors in sensed), lies)


def _drive(scenario: Scenario, seed: np.random.SeedSequence) -> Path:
    place = scenario.start
    start = np.array([place.latitude_deg, place.longitude_deg, place.height_m], dtype=float) * [DEG, DEG, 1.0]
    return drive(scenario.duration_s, static=scenario.static_s, seed=seed, start=start)


def _sense(
    imu: Imu, exact: Increments, imperfections: Imperfections, rng: np.random.Generator
) -> tuple[ImuStream, TrueErrors]:
    """Return what one IMU puts out, turned into array axes as a reader does, and its errors."""
    dtheta, dvel = exact.at(imu.position, imu.rotation)
    errors = draw_errors(exact.time[-1], imu.noise, imperfections, rng)
    white = imperfections.limit(imu.noise)
    dtheta, dvel = corrupt(exact.time, dtheta, dvel, errors, white, rng)
    return ImuStream(imu.name, exact.time, dtheta @ imu.rotation.T, dvel @ imu.rotation.T), errors


def _receive(scenario: Scenario, path: Path, rng: np.random.Generator) -> tuple[GnssStream | None, NDArray[np.intp]]:
    """Return the fixes and the indices of the lies among them."""
    if scenario.gnss is None:
        return None, np.zeros(0, dtype=np.intp)
    receiver = scenario.gnss
    stream = gnss.fixes(
        path,
        receiver.antenna_position_m,
        rng=rng,
        position_std=receiver.position_std_m,
        velocity_std=receiver.velocity_std_m_s,
        rate_hz=receiver.rate_hz,
        phase=receiver.phase_s,
    )
    shown = stream.time > scenario.static_s
    for begin, end in scenario.outage_intervals():
        shown &= (stream.time < begin) | (stream.time > end)
    return gnss.with_lies(stream, np.flatnonzero(shown), receiver.lies.count, receiver.lies.size_m, rng)


def _reference(path: Path, rate_hz: float) -> Reference:
    time = np.arange(1.0, np.floor(path.duration * rate_hz + 1e-6) + 1.0) / rate_hz
    truth = path.truth(time)
    return Reference(time, truth.position, truth.velocity, truth.attitude)
