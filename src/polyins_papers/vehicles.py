"""The robot and the car of paper B's lab: four chips in each wheel, four on the body, no GNSS."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path as FilePath
from typing import Any, Literal

from polyins.simulation.scenario import Scenario, SensorErrors
from polyins.simulation.wheel_scenario import Laps, Slip, SurveyedTrack
from polyins.studies.scenario_files import read, scenarios

Earth = Literal["turning", "plane"]


@dataclass(frozen=True)
class Vehicle:
    """A vehicle and its drive."""

    name: str
    """of its scenario file"""
    dataset: str
    """with its track.csv and odometer.csv"""

    @cached_property
    def base(self) -> Scenario:
        """The scenario of its file; where its track is, a data set's folder says."""
        return read(Scenario, __package__, self.name)

    @cached_property
    def laps(self) -> Laps | None:
        """What stands in for its track."""
        return scenarios(__package__, "laps")[self.name].laps

    def _track(self, folder: FilePath) -> SurveyedTrack:
        track = self.base.track
        assert track is not None
        return track.model_copy(update={key: str(folder / getattr(track, key)) for key in ("file", "odometer")})

    def scenario(
        self,
        folder: FilePath | None = None,
        *,
        level: bool = False,
        earth: Earth | None = None,
        errors: SensorErrors | None = None,
        slip: Slip | None = None,
        duration_s: float | None = None,
    ) -> Scenario:
        """Return the scenario on the data set's track, or on its own laps.

        `folder`: of the data set; without it laps are driven. `level`: the ground has no slopes. `errors`: which errors
        the chips have; `slip`: of both wheels; `duration_s`: how long it drives at most; those of the file unless
        given. The filter knows the radius that fits each chip's gyro.
        """
        way: dict[str, Any] = {"track": self._track(folder) if folder else None, "laps": None if folder else self.laps}
        if level:
            way = {key: ground and ground.model_copy(update={"slope_deg": 0.0}) for key, ground in way.items()}
        given: dict[str, Any] = {"earth": earth, "errors": errors, "duration_s": duration_s}
        if slip:
            given["wheels"] = tuple(wheel.model_copy(update={"slip": slip}) for wheel in self.base.wheels)
        changed = {key: value for key, value in given.items() if value is not None}
        return self.base.model_copy(update={**way, **changed})


ROBOT = Vehicle(name="robot", dataset="whu-robot")
CAR = Vehicle(name="car", dataset="whu-car")

CHIPS = ROBOT.base.noise
"""of both vehicles"""
GYRO_SCALE_PPM = CHIPS.gyro_scale_ppm[0]
"""the same about all axes"""
FILTER_NOISE = ROBOT.base.filter_noise or CHIPS
"""what the paper's lab tells its filter"""
