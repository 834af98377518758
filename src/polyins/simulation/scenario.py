"""A simulated recording from a short description: a path, IMUs with errors, GNSS with outages and lies."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from polyins.config import (
    InitialStd,
    Noise,
    NotNegative,
    Outages,
    OutageSchedule,
    Positive,
    PositiveSpread,
    Rolling,
    Section,
    Spread,
    StartPosition,
    Triple,
    validated,
)
from polyins.config.fields import blame
from polyins.config.units import read
from polyins.config.yaml_document import read_yaml
from polyins.model.axes import axes_matrix
from polyins.model.recording import FilterOptions
from polyins.model.rig import Imu, NoiseGrade, Rig
from polyins.reading.imu_stream import initial_std
from polyins.simulation import earth
from polyins.simulation.drive_scenario import Drive, ReplayedDrive
from polyins.simulation.error_scenario import SensorErrors as SensorErrors
from polyins.simulation.flexible_scenario import FlexibleMounts, Road, Shuttle
from polyins.simulation.path import START, World
from polyins.simulation.plane import Plane
from polyins.simulation.wheel_scenario import Laps, SurveyedTrack, WheelModule

Array = NDArray[np.float64]

Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
Count = Annotated[int, Field(ge=1, strict=True)]

LARGEST_JITTER = 0.1
"""over the interval: ten sigma still stay within one"""


class Board(Section):
    """The IMUs on the body, row by row on a level board."""

    count: Count = 16
    """how many"""
    columns: Count | None = None
    """IMUs per row; without it as near to a square as can be"""
    pitch_m: NotNegative = 0.015
    """from one IMU to the next, m"""
    position_m: Triple = (0.0, 0.0, 0.0)
    """of the board's centre from the array origin, with wheels the middle of the rear axle: forward, right, down, m"""
    mounts: Annotated[tuple[tuple[Axis, Axis, Axis], ...], Field(min_length=1)] = (("x", "y", "z"),)
    """which sensor axes point forward, right and down, one triple for each IMU in turn"""

    def positions(self) -> Array:
        """Return where the IMUs sit in the array frame, m, shape (count, 3)."""
        row, column = np.divmod(np.arange(self.count), self.columns or int(np.ceil(np.sqrt(self.count))))
        grid = self.pitch_m * np.column_stack([-row, column, np.zeros(self.count)])
        return np.asarray(grid - grid.mean(axis=0) + self.position_m)

    def rotation(self, index: int) -> Array:
        """Return C_ab of an IMU, shape (3, 3)."""
        return axes_matrix(self.mounts[index % len(self.mounts)])


class WrongFixes(Section):
    """Fixes that are wrong by much more than they claim, outside of outages, while driving."""

    count: Annotated[int, Field(ge=0, strict=True)] = 0
    """how many"""
    size_m: Positive = 50.0
    """how far off, in a random horizontal direction, m"""


class Fixes(Section):
    """The GNSS receiver."""

    FIELDS: ClassVar[Mapping[str, str]] = {"antenna_position": "antenna"}
    rate_hz: Positive = 1.0
    """fixes per second"""
    phase_s: NotNegative = 0.3012
    """time of the first fix, s"""
    antenna_position_m: Triple = (-0.3, 0.2, -1.0)
    """of the antenna from the array origin: forward, right, down, m"""
    position_std_m: Spread = (0.02, 0.02, 0.04)
    """of the white noise, north, east, down, m"""
    slow_std_m: Spread = (0.0, 0.0, 0.0)
    """of an error that wanders, north, east, down, m; RTK in the open 0.005 to 0.02"""
    slow_time_s: Positive = 60.0
    """its correlation time, s"""
    stated_std_m: PositiveSpread | None = None
    """what the fixes claim, north, east, down, m; without it the white noise's"""
    velocity_std_m_s: Spread | None = None
    """of the velocity's noise, north, east, down, m/s; without it there are no velocities"""
    lies: WrongFixes = WrongFixes()
    """wrong fixes"""


class StartStd(Section):
    """How sure a start that the truth gives claims to be, 1 sigma; paper B's lab starts like that."""

    FIELDS: ClassVar[Mapping[str, str]] = {name: f"{name}_std" for name in ("position", "velocity", "attitude")}
    position_m: Spread = (0.05, 0.05, 0.05)
    """north, east, down, m"""
    velocity_m_s: Spread = (0.05, 0.05, 0.05)
    """north, east, down, m/s"""
    attitude_deg: Spread = (1.0, 1.0, 0.1)
    """roll, pitch, heading, deg"""


class Scenario(Section):
    """The whole file."""

    name: str = "simulated drive"
    """of the recording"""
    seed: Annotated[int, Field(ge=0, strict=True)] = 0
    """another seed gives other errors, and another drive, camber of a replay, lawn and rulers, or slip, as there are"""
    path_seed: Annotated[int, Field(ge=0, strict=True)] | None = None
    """of the drive, the ground and the wheels' slip, where they are to stay while seed draws other errors"""
    duration_s: Positive = 1000.0
    """the standing start included, s; a track, laps or a replay are driven to their end unless this is given"""
    static_s: NotNegative = 60.0
    """length of the standing start, s"""
    earth: Literal["turning", "plane"] = "turning"
    """the WGS 84 Earth, or a local tangent plane that does not turn"""
    gravity_m_s2: Positive = FilterOptions.gravity
    """on the plane only, m/s^2"""
    start: StartPosition | None = None
    """where the drive starts; without it in Wuhan, or at the plane's origin"""
    drive: Drive = Drive()
    """how it is driven, and over which roads, where no track or laps or replay or shuttle is given"""
    start_std: StartStd = StartStd()
    """of the start that the truth gives where there are wheels and no receiver"""
    track: SurveyedTrack | None = None
    """a surveyed track instead of a drive"""
    laps: Laps | None = None
    """laps of a rectangle instead of a drive; they are driven to their end unless duration_s is given"""
    replay: ReplayedDrive | None = None
    """a surveyed drive, driven again, instead of one of its own; its length and its standing start are its own"""
    shuttle: Shuttle | None = None
    """to and fro on straights instead of a drive"""
    rate_hz: Positive = 200.0
    """of the IMUs"""
    imus: Board = Board()
    """how many and where"""
    rulers: FlexibleMounts | None = None
    """flexible mounts instead of the board under imus"""
    road: Road | None = None
    """the ground that shakes the rulers; without it they are at rest"""
    wheels: tuple[WheelModule, ...] = ()
    """the modules on wheels; with them the drive is over ground that does not twist, so that no wheel skids"""
    noise: Noise = Field(default_factory=lambda: Noise.model_validate("consumer-mems"))
    """how good the IMUs are: a mapping, or just the name of a grade or of a common IMU"""
    filter_noise: Noise | None = None
    """how good the configuration says they are; without it as good as they are"""
    initial_std: InitialStd | None = None
    """how far off they may be at the start, as `initial_std` of a configuration; the rest is as noise and errors say"""
    rolling: Rolling = Rolling()
    """how wheels aid the filter, as the configuration has it under filter.rolling"""
    errors: SensorErrors = SensorErrors()
    """which errors they have"""
    gnss: Fixes | None = Fixes()
    """the receiver; null: none"""
    outages: Outages = OutageSchedule(length_s=30.0, every_s=90.0)
    """GNSS is withheld: a list of [from, to] in s, or a schedule that counts from the end of the standing start"""
    reference_rate_hz: Positive = 10.0
    """of the true states, which serve as the reference"""

    @model_validator(mode="after")
    def _fits_its_duration(self) -> Self:
        whole = (self.track or self.laps or self.replay) and not self.limited
        longest = math.inf if whole else self.duration_s
        inside = "expected within the drive" if whole else f"expected within the {longest:g} s of duration_s"
        if self.static_s >= longest and not self.replay:
            raise ValueError(f"static_s is {self.static_s:g}; {inside}")
        if longest * self.rate_hz < 2.0:
            raise ValueError(f"rate_hz is {self.rate_hz:g}; expected at least two samples {inside[9:]}")
        if self.gnss and self.gnss.phase_s >= longest:
            raise ValueError(f"gnss.phase_s is {self.gnss.phase_s:g}; {inside}")
        if self.errors.jitter_s * self.rate_hz > LARGEST_JITTER:
            raise ValueError(f"errors.jitter_s is {self.errors.jitter_s:g}; expected at most a tenth of 1 / rate_hz")
        for begin, end in self.outage_intervals():
            if not 0.0 <= begin < end <= longest:
                raise ValueError(f"outages: [{begin:g}, {end:g}]; expected [from, to] {inside[9:]}")
        return self

    @model_validator(mode="after")
    def _start_fits_the_earth(self) -> Self:
        if self.start is not None and self.start.geodetic != (self.earth == "turning"):
            wanted = "latitude_deg and longitude_deg" if self.earth == "turning" else "north_m and east_m"
            raise blame("start", f"expected {wanted} where earth is {self.earth}")
        return self

    @model_validator(mode="after")
    def _mounts_and_ground_fit(self) -> Self:
        ways = [name for name in ("track", "laps", "replay", "shuttle") if getattr(self, name)]
        if len(ways) > 1:
            raise blame(ways[-1], f"is given with {ways[0]}; expected one of them")
        if self.replay and self.earth != "turning":
            raise blame("replay", "has latitudes and longitudes; expected earth: turning")
        if self.replay and self.start:
            raise blame("start", "is given with a replay, which starts where it did; expected one of them")
        if self.replay and self.wheels:
            raise blame("replay", "is of a body that leans; with wheels expected a track")
        if self.rulers and self.wheels:
            raise blame("rulers", "are given with wheels; expected one of them")
        if self.road and not self.rulers:
            raise blame("road", "is given without rulers; expected both or none")
        if self.road and self.road.books and not self.shuttle:
            raise blame("road.books", "lie on the straights of a shuttle; expected one")
        return self

    @model_validator(mode="after")
    def _books_lie_on_the_straights(self) -> Self:
        if self.road and self.shuttle:
            end, straight = max(self.road.book_ends(), default=0.0), self.shuttle.straight_m
            if end > straight:
                raise blame("road.books", f"reach to {end:g} m; expected all within the {straight:g} m of straight_m")
        return self

    @model_validator(mode="after")
    def _modules_differ(self) -> Self:
        names = ["body", *(wheel.name for wheel in self.wheels)]
        for index, name in enumerate(names):
            if name in names[:index]:
                raise blame("wheels", f"two modules are named {name!r}; expected a name of its own for each")
        return self

    def without_effect(self) -> tuple[str, ...]:
        """Return what is said for nothing, in words."""
        way = next((name for name in ("track", "laps", "replay", "shuttle") if getattr(self, name)), "")
        idle = {
            f"drive: has no effect beside {way}": bool(way) and self.drive != Drive(),
            "start_std: has an effect only with wheels and without gnss": self.start_std != StartStd()
            and bool(self.gnss or not self.wheels),
            "rolling: has no effect without wheels": self.rolling != Rolling() and not self.wheels,
            "gnss.slow_time_s: has no effect without slow_std_m": self.gnss is not None
            and self.gnss.slow_time_s != Fixes().slow_time_s
            and not any(self.gnss.slow_std_m),
        }
        return tuple(words for words, is_so in idle.items() if is_so)

    @property
    def limited(self) -> bool:
        """Whether it says how long it drives."""
        return "duration_s" in self.model_fields_set

    def world(self) -> World:
        """Return what the path lies on."""
        return earth if self.earth == "turning" else Plane(self.gravity_m_s2)

    def start_position(self) -> Array:
        """Return where the path starts, in the world's coordinates, shape (3,)."""
        if self.start is not None:
            return self.start.coordinates()
        return np.array(START) if self.earth == "turning" else np.zeros(3)

    def rig(self) -> Rig:
        """Return what is mounted where: the IMUs on the body, then those on the wheels."""
        grade = read(self.filter_noise or self.noise, NoiseGrade)
        name = "body" if self.wheels else "imu"
        module = "body" if self.wheels and self.imus.pitch_m == 0.0 else ""
        if self.rulers:
            imus = [Imu(f"imu{k}", grade, position=ruler.nominal) for k, ruler in enumerate(self.rulers.mounts(), 1)]
        else:
            imus = [
                Imu(f"{name}{index + 1}", grade, self.imus.rotation(index), position, module=module)
                for index, position in enumerate(self.imus.positions())
            ]
        imus += [imu for wheel in self.wheels for imu in wheel.imus(grade)]
        std = self.errors.start_std(grade)
        if self.initial_std:
            std = initial_std(self.initial_std, std or grade.slow_std())
        imus = [replace(imu, initial_std=std) for imu in imus]
        return Rig(tuple(imus), np.array(self.gnss.antenna_position_m if self.gnss else (0.0, 0.0, 0.0)))

    def outage_intervals(self) -> tuple[tuple[float, float], ...]:
        """Return begin and end of the outages, s; of a schedule those that end before the drive does.

        Without a receiver there are none.
        """
        if self.gnss is None:
            return ()
        if not isinstance(self.outages, OutageSchedule):
            return self.outages
        return self.outages.intervals(self.static_s, self.duration_s)


def demo() -> Scenario:
    """Return the scenario of the demonstration: 16 IMUs, six minutes, four outages of 30 s."""
    return Scenario(
        name="demo",
        duration_s=360.0,
        static_s=40.0,
        errors=SensorErrors(turn_on_share=0.5, misalignment_deg=0.05),
        outages=OutageSchedule(length_s=30.0, every_s=75.0, first_after_s=60.0),
    )


def read_scenario(path: str | FilePath) -> Scenario:
    """Read a scenario from a YAML file; paths in it count from the file.

    Raises InputError that names file, line and key of the first thing wrong.
    """
    scenario = validated(Scenario, read_yaml(path))
    folder = FilePath(path).parent.resolve()
    located = {}
    for name, keys in {"track": ("file", "odometer"), "replay": ("file",)}.items():
        if section := getattr(scenario, name):
            files = {key: str(folder / FilePath(getattr(section, key)).expanduser()) for key in keys}
            located[name] = section.model_copy(update=files)
    return scenario.model_copy(update=located)
