"""What a scenario may say of the drive of a road vehicle: one of its own, or a surveyed one to be driven again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from polyins.checks.stream_checks import check_std, check_track
from polyins.config import NotNegative, Number, Positive, PositiveSpread, Section
from polyins.config.fields import blame
from polyins.config.units import read
from polyins.errors import InputError
from polyins.formats.rows import Track
from polyins.reading.guess import read_stream
from polyins.simulation.path import Driving, Path, World, drive
from polyins.simulation.replay import Ride, replay

Array = NDArray[np.float64]

Angle = Annotated[Number, Field(ge=0.0, le=10.0)]
Brisk = Annotated[Number, Field(ge=0.1, le=20.0)]
PerAcceleration = Annotated[Number, Field(ge=0.0, le=2.0)]

RTK_STD_M = (0.02, 0.02, 0.04)


class Drive(Section):
    """A drive of its own, which a seed draws: every 4 to 9 s another speed and mostly a turn, at times a stop."""

    FIELDS: ClassVar[Mapping[str, str]] = {
        "slope": "slope_std",
        "camber": "camber_std",
        "roll": "roll_per_acceleration",
    }
    top_speed_m_s: Positive = 16.0
    """m/s; a robot's is about 2"""
    acceleration_m_s2: Brisk = 2.0
    """at most, along, m/s^2"""
    lateral_acceleration_m_s2: Brisk = 2.0
    """at most, across, m/s^2"""
    turn_radius_m: Positive = 10.0
    """of the tightest turn, m"""
    slope_deg: Angle = 1.5
    """std of the road's slope, deg"""
    steepest_deg: Angle = 4.0
    """no slope is above this, deg"""
    camber_deg: Angle = 0.7
    """std of the road's slope across, deg; roads are built with 1 to 2"""
    roll_deg_per_m_s2: PerAcceleration = 0.6
    """by how much the body leans out of a turn, deg per m/s^2; passenger cars 0.3 to 0.7"""

    def path(
        self, duration: float, static: float, seed: np.random.SeedSequence, start: ArrayLike, world: World
    ) -> Path:
        """Return the path."""
        driving = read(self, Driving)
        return drive(duration, static=static, seed=seed, start=start, driving=driving, world=world)


class ReplayedDrive(Section):
    """Positions of a drive, as RTK gives them: speed, course and slope follow; the rest is said here."""

    FIELDS: ClassVar[Mapping[str, str]] = {
        "camber": "camber_std",
        "roll": "roll_per_acceleration",
        "pitch": "pitch_per_acceleration",
    }
    file: str
    """positions of what becomes the array origin: a receiver's, or a table of time, latitude, longitude, height"""
    from_s: Number | None = None
    """stamp of the file from which on it is driven, s; without it the first"""
    to_s: Number | None = None
    """stamp until which it is driven, s; without it the last"""
    position_std_m: PositiveSpread | None = None
    """north, east, down, m: the path is smoothed as far as that allows; without it the file's, or 0.02, 0.02, 0.04"""
    camber_deg: Angle = 0.7
    """std of the road's slope across, which is drawn, deg; roads are built with 1 to 2"""
    camber_length_m: Annotated[Number, Field(ge=1.0)] = 50.0
    """from one camber to the next, m"""
    slope_smoothing_m: NotNegative = 10.0
    """the height is smoothed over this way before its slope is taken, 1 sigma, m"""
    roll_deg_per_m_s2: PerAcceleration = 0.6
    """by how much the body leans out of a turn, deg per m/s^2; passenger cars 0.3 to 0.7"""
    pitch_deg_per_m_s2: PerAcceleration = 0.2
    """by how much it squats and dives, deg per m/s^2; passenger cars 0.15 to 0.25"""
    side_slip_deg_per_m_s2: PerAcceleration = 0.0
    """by how much the nose points inwards of the course in a turn, deg per m/s^2; cars at speed have about 0.3"""

    @model_validator(mode="after")
    def _begins_before_it_ends(self) -> Self:
        if self.from_s is not None and self.to_s is not None and self.from_s >= self.to_s:
            raise blame("to_s", f"is {self.to_s:g}; expected more than the {self.from_s:g} of from_s")
        return self

    def path(self, seed: int) -> Path:
        """Return the path along the positions, whose camber the seed draws; raises InputError for others."""
        track, guesses = read_stream(self.file)
        if not isinstance(track, Track) or not track.geodetic:
            raise InputError(f"{track.source.path}: holds no latitudes and longitudes; expected those of a drive")
        track, outside = self._part(track)
        warnings = check_track(track, "a replay")
        std = np.tile(self.position_std_m or RTK_STD_M, (len(track.time), 1))
        if track.position_std is not None and self.position_std_m is None:
            check_std(track.source, track.position_std)
            std = track.position_std
        path = replay(track.time, track.position, std, ride=read(self, Ride), seed=seed)
        return replace(path, warnings=(*guesses, *outside, *warnings))

    def _part(self, track: Track) -> tuple[Track, tuple[str, ...]]:
        """Return what is to be driven of the positions, and a warning if that is less than is asked for."""
        if self.from_s is None and self.to_s is None:
            return track, ()
        begin, end = (-np.inf if self.from_s is None else self.from_s), (np.inf if self.to_s is None else self.to_s)
        first, last = np.nanmin(track.time), np.nanmax(track.time)
        covers = f"{track.source.path} covers {first:g} to {last:g} s"
        if begin > last or end < first:
            raise InputError(f"replay: from_s and to_s leave no positions; {covers}")
        # stamps that are no numbers stay, to be named
        used = np.flatnonzero(~((track.time < begin) | (track.time > end)))
        early, late = np.isfinite(begin) and begin < first, np.isfinite(end) and end > last
        warning = f"replay: from_s or to_s is outside of what there is; {covers}"
        return track.at_rows(used), (warning,) if early or late else ()
