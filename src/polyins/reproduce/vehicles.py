"""The robot and the car of paper B's lab: four chips in each wheel, four on the body, no GNSS."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from pathlib import Path as FilePath
from typing import Any, Literal

from polyins.config import Noise
from polyins.simulation.scenario import Errors, Scenario, read_scenario
from polyins.simulation.wheel_scenario import Slip, Track

Earth = Literal["turning", "plane"]

PRINTED_GYRO_SCALE_PPM = 30_000.0
"""Table III's"""


@dataclass(frozen=True)
class Vehicle:
    """A vehicle and its drive."""

    name: str
    """of its scenario file"""
    dataset: str
    """with its track.csv and odometer.csv"""

    @cached_property
    def base(self) -> Scenario:
        """The scenario of its file, which drives laps."""
        with resources.as_file(resources.files("polyins.reproduce") / f"{self.name}.yaml") as file:
            return read_scenario(file)

    def scenario(
        self,
        folder: FilePath | None = None,
        *,
        level: bool = False,
        earth: Earth | None = None,
        noise: Noise | None = None,
        errors: Errors | None = None,
        slip: Slip | None = None,
        duration_s: float | None = None,
    ) -> Scenario:
        """Return the scenario on the data set's track, or on its own laps.

        `folder`: of the data set; without it laps are driven. `level`: the ground has no slopes. `noise`: how good the
        chips are; `errors`: which errors they have; `slip`: of both wheels; `duration_s`: how long it drives at most;
        those of the file unless given. The filter knows the radius that fits each chip's gyro.
        """
        laps = self.base.laps
        assert laps is not None
        terrain = {"slope_deg": 0.0 if level else laps.slope_deg, "slope_length_m": laps.slope_length_m}
        way: dict[str, Any] = {"laps": laps.model_copy(update=terrain)}
        if folder:
            track = Track(file=str(folder / "track.csv"), odometer=str(folder / "odometer.csv"), **terrain)
            way = {"laps": None, "track": track}
        given: dict[str, Any] = {"earth": earth, "noise": noise, "errors": errors, "duration_s": duration_s}
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
