"""What a scenario may say of wheels, and of a surveyed track or laps to roll along."""

from __future__ import annotations

import re
from typing import Annotated, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import AfterValidator, Field, model_validator

from polyins.config import NotNegative, Number, Positive, Section, Triple
from polyins.config.fields import blame
from polyins.config.units import read
from polyins.formats.columns import column_names, read_columns
from polyins.model.rig import DEG, Imu, NoiseGrade, Wheel
from polyins.simulation import earth
from polyins.simulation.laps import lap_length, lap_points, lap_speeds
from polyins.simulation.path import Path, World
from polyins.simulation.rolling import RollingWheel, roll
from polyins.simulation.slip import slip_periods
from polyins.simulation.track import Odometer, Slopes, Survey, track_path

Array = NDArray[np.float64]

Share = Annotated[Number, Field(gt=-1.0, le=10.0)]


def _file_name(name: str) -> str:
    if not re.fullmatch(r"\w[\w .+-]*", name):
        raise ValueError("expected letters, digits, blanks, and . _ + -")
    return name


class Slip(Section):
    """By which share a wheel turns more than it rolls."""

    constant: Share = 0.0
    """all the time; below zero it turns less"""
    size: Annotated[Number, Field(ge=0.0, le=10.0)] = 0.0
    """at most this much more in periods of slip, drawn evenly"""
    length_s: Positive = 1.0
    """of a period of slip, s"""
    every_s: Positive = 30.0
    """mean time from the end of one to the next, s"""


class WheelModule(Section):
    """A board of IMUs in a wheel. Its axes: x along the axle to the right, y and z in the wheel."""

    name: Annotated[str, AfterValidator(_file_name)]
    """of the module; its IMUs are named name1, name2, ..."""
    position_m: Triple
    """of the wheel's centre from the middle of the rear axle: forward, right, down, m"""
    radius_m: Positive = 0.35
    """rolling, m"""
    chips: Annotated[int, Field(ge=1, strict=True)] = 4
    """how many IMUs, all at one place"""
    lever_arm_m: Triple = (0.0, 0.015, 0.0)
    """from them to the wheel's centre, in the module's axes, m"""
    calibrated: bool = True
    """the configuration gives each IMU the radius that fits its gyro's scale factor at the start"""
    slip: Slip = Slip()
    """of the wheel"""

    def imus(self, grade: NoiseGrade) -> list[Imu]:
        """Return the module's IMUs."""
        wheel = read(self, Wheel)
        return [
            Imu(f"{self.name}{number}", grade, position=np.array(self.position_m), wheel=wheel, module=self.name)
            for number in range(1, self.chips + 1)
        ]

    def rolls(self, path: Path, rng: np.random.Generator) -> RollingWheel:
        """Return the wheel as it rolls along a path, from an angle that is drawn and with its slip."""
        phase, slip = rng.uniform(-np.pi, np.pi), self.slip
        if not (slip.constant or slip.size):
            return roll(path, self.position_m, self.radius_m, phase=phase)
        share = slip_periods(
            path.duration, rng, constant=slip.constant, size=slip.size, length=slip.length_s, every=slip.every_s
        )
        return roll(path, self.position_m, self.radius_m, phase=phase, slip=share)


class Terrain(Section):
    """The ground along a way: level unless slopes are asked for."""

    slope_deg: Annotated[Number, Field(ge=0.0, le=5.0)] = 0.0
    """of ground in waves along the way, deg; with wheels it is bent until it does not twist, and rolls as well"""
    slope_length_m: Positive = 60.0
    """of a wave of the ground, m"""
    slope_adapts_m: Annotated[Number, Field(ge=1.0)] = 20.0
    """the way over which the ground, bent until it does not twist, comes back to these waves, m"""

    def over(self, survey: Survey, odometer: Odometer, start: ArrayLike, world: World) -> Path:
        """Return the path along points over this ground, see `track_path`."""
        slopes = Slopes(self.slope_deg * DEG, self.slope_length_m)
        return track_path(survey, odometer, slopes, start=start, world=world)


class SurveyedTrack(Terrain):
    """A surveyed track and the speeds at which it is travelled."""

    file: str
    """a table of points in their order: latitude_deg, longitude_deg, or north_m, east_m"""
    odometer: str
    """a table of speeds: time_s, speed_m_s"""
    smoothing_m: NotNegative = 0.7
    """bends much shorter than this are smoothed away, m"""
    rest_s: NotNegative = 5.0
    """standing at the end, s"""

    def path(self, static: float, start: ArrayLike, world: World) -> Path:
        """Return the path along the track; raises InputError for files that give none."""
        _, (time, speed) = read_columns(self.odometer, ("time_s", "speed_m_s"))
        survey = Survey(*self._points(), self.smoothing_m)
        return self.over(survey, Odometer(time, speed, static, self.rest_s), start, world)

    def _points(self) -> tuple[Array, Array]:
        """Return the points north and east of the first one, m."""
        if "north_m" in column_names(self.file):
            _, (north, east) = read_columns(self.file, ("north_m", "east_m"))
            return north - north[0], east - east[0]
        _, (latitude, longitude) = read_columns(self.file, ("latitude_deg", "longitude_deg"))
        meridian, transverse = earth.radii(np.array([[latitude[0] * DEG, 0.0, 0.0]]))
        east = (longitude - longitude[0]) * DEG * transverse * np.cos(latitude[0] * DEG)
        return (latitude - latitude[0]) * DEG * meridian, east


class Laps(Terrain):
    """Laps of a rectangle with round corners, counterclockwise, at a speed that goes up and down."""

    length_m: Positive = 100.0
    """of the rectangle, m"""
    width_m: Positive = 30.0
    """m"""
    corner_m: Positive = 3.0
    """radius of the corners, m"""
    count: Annotated[int, Field(ge=1, strict=True)] = 1
    """how many laps"""
    speed_m_s: Positive = 1.4
    """mean, m/s"""
    change_m_s: NotNegative = 0.0
    """by which the speed goes up and down about its mean, m/s"""
    change_every_s: Annotated[Number, Field(ge=5.0)] = 40.0
    """from one time of greatest speed to the next, s"""
    starting_s: Annotated[Number, Field(ge=1.0)] = 10.0
    """until the speed is reached, and from when it falls to rest, s"""

    @model_validator(mode="after")
    def _can_be_driven(self) -> Self:
        if 2.0 * self.corner_m > min(self.length_m, self.width_m):
            raise blame("corner_m", f"is {self.corner_m:g}; expected at most half of length_m and of width_m")
        if self._length < 2.0 * self.starting_s * self.speed_m_s:
            raise blame("count", f"is {self.count}; expected laps of at least {2.0 * self.starting_s:g} s at speed_m_s")
        if self.change_m_s >= self.speed_m_s:
            raise blame("change_m_s", f"is {self.change_m_s:g}; expected less than the {self.speed_m_s:g} of speed_m_s")
        return self

    def path(self, static: float, start: ArrayLike, world: World) -> Path:
        """Return the path around; it begins and ends at rest."""
        points = lap_points(self.length_m, self.width_m, self.corner_m, self.count)
        speeds = lap_speeds(
            self._length, self.speed_m_s, change=self.change_m_s, every=self.change_every_s, starting=self.starting_s
        )
        return self.over(Survey(*points), Odometer(*speeds, static), start, world)

    @property
    def _length(self) -> float:
        return self.count * lap_length(self.length_m, self.width_m, self.corner_m)
