"""The robot and the car of paper B's lab on their real tracks: four chips in each wheel, four on the body, no GNSS."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from pathlib import Path as FilePath
from typing import Any, Literal

from polyins.config import Noise
from polyins.simulation.laps import Laps
from polyins.simulation.path import Path
from polyins.simulation.run import TrueRun, true_run
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
    stand_in: Laps
    """in place of the data set"""

    @cached_property
    def base(self) -> Scenario:
        """The scenario of its file, which has no track."""
        with resources.as_file(resources.files("polyins.reproduce") / f"{self.name}.yaml") as file:
            return read_scenario(file)

    def scenario(
        self,
        folder: FilePath | None = None,
        *,
        earth: Earth | None = None,
        noise: Noise | None = None,
        errors: Errors | None = None,
        slip: Slip | None = None,
        duration_s: float | None = None,
    ) -> Scenario:
        """Return the scenario on level ground.

        `folder`: of the data set; without it the scenario has no track. `noise`: how good the chips are; `errors`:
        which errors they have; `slip`: of both wheels; `duration_s`: how long it drives at most; those of the file
        unless given. The filter knows the radius that fits each chip's gyro.
        """
        track = Track(file=str(folder / "track.csv"), odometer=str(folder / "odometer.csv")) if folder else None
        given: dict[str, Any] = {"earth": earth, "noise": noise, "errors": errors, "duration_s": duration_s}
        if slip:
            given["wheels"] = tuple(wheel.model_copy(update={"slip": slip}) for wheel in self.base.wheels)
        changed = {key: value for key, value in given.items() if value is not None}
        return self.base.model_copy(update={"track": track, **changed})

    def drive(self, scenario: Scenario) -> TrueRun:
        """Return the truth of its scenario; the stand-in's laps are driven where the scenario has no track."""
        return true_run(scenario, None if scenario.track else self.laps(scenario))

    def laps(self, scenario: Scenario) -> Path:
        """Return the path of the stand-in's laps."""
        return self.stand_in.path(scenario.static_s, scenario.start_position(), scenario.world())


ROBOT = Vehicle(
    name="robot",
    dataset="whu-robot",
    stand_in=Laps(length_m=105.0, width_m=28.0, corner_m=3.0, count=5, speed_m_s=1.4, change_m_s=0.4),
)
CAR = Vehicle(
    name="car",
    dataset="whu-car",
    stand_in=Laps(length_m=1700.0, width_m=1380.0, corner_m=20.0, count=2, speed_m_s=4.7, change_m_s=2.5),
)

CHIPS = ROBOT.base.noise
"""of both vehicles"""
GYRO_SCALE_PPM = CHIPS.gyro_scale_ppm[0]
"""the same about all axes"""
FILTER_NOISE = ROBOT.base.filter_noise or CHIPS
"""what the paper's lab tells its filter"""
