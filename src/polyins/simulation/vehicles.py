"""The robot and the car of paper B's lab on their real tracks: four chips in each wheel, four on the body, no GNSS."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Literal

from polyins.config import Noise
from polyins.simulation.laps import Laps
from polyins.simulation.path import Path
from polyins.simulation.run import TrueRun, true_run
from polyins.simulation.scenario import Board, Errors, Scenario
from polyins.simulation.wheel_scenario import Slip, Track, WheelModule

Earth = Literal["turning", "plane"]

STATIC_S = 30.0
LONGEST_S = 1e5

GYRO_SCALE_PPM = 1500.0
"""the spread of such chips; Table III's 30,000 does not fit Table VI's headings"""
PRINTED_GYRO_SCALE_PPM = 30_000.0

FILTER_NOISE = Noise(
    angle_random_walk_deg_sqrt_h=1.2,
    velocity_random_walk_m_s_sqrt_h=6.0,
    gyro_bias_deg_h=50.0,
    accel_bias_mgal=2000.0,
    gyro_scale_ppm=50.0,
    accel_scale_ppm=500.0,
    correlation_time_h=1.0,
)
"""what the paper's lab tells its filter in its published single Wheel-INS runs"""


def chips(gyro_scale_ppm: float = GYRO_SCALE_PPM) -> Noise:
    """Return Table III's figures of an ICM-20602, with a gyro scale, ppm."""
    return Noise(
        angle_random_walk_deg_sqrt_h=0.24,
        velocity_random_walk_m_s_sqrt_h=3.0,
        gyro_bias_deg_h=200.0,
        accel_bias_mgal=1000.0,
        gyro_scale_ppm=gyro_scale_ppm,
        accel_scale_ppm=30_000.0,
        correlation_time_h=1.0,
    )


@dataclass(frozen=True)
class Vehicle:
    """A vehicle and its drive."""

    name: str
    dataset: str
    """with its track.csv and odometer.csv"""
    wheel_radius_m: float
    track_width_m: float
    """between the wheels of the rear axle"""
    body_position_m: tuple[float, float, float]
    """of the body's module from the middle of the rear axle: forward, right, down"""
    stand_in: Laps
    """in place of the data set"""

    def scenario(
        self,
        folder: FilePath | None = None,
        *,
        earth: Earth = "plane",
        noise: Noise | None = None,
        errors: Errors | None = None,
        slip: Slip | None = None,
        duration_s: float = LONGEST_S,
    ) -> Scenario:
        """Return the scenario on level ground.

        `folder`: of the data set; without it the scenario has no track. `noise`: how good the chips are (`chips()`
        unless given); `errors`: which errors they have (unless given all, constant from turn-on). The filter knows the
        radius that fits each chip's gyro.
        """
        half, slip = self.track_width_m / 2.0, slip or Slip()
        track = Track(file=str(folder / "track.csv"), odometer=str(folder / "odometer.csv")) if folder else None
        return Scenario(
            name=self.name,
            duration_s=duration_s,
            static_s=STATIC_S,
            earth=earth,
            track=track,
            imus=Board(count=4, pitch_m=0.0, position_m=self.body_position_m),
            wheels=tuple(
                WheelModule(name=name, position_m=(0.0, right, 0.0), radius_m=self.wheel_radius_m, slip=slip)
                for name, right in (("left", -half), ("right", half))
            ),
            noise=noise or chips(),
            filter_noise=FILTER_NOISE,
            errors=errors or Errors(turn_on_share=1.0),
            gnss=None,
        )

    def drive(self, scenario: Scenario) -> TrueRun:
        """Return the truth of its scenario; the stand-in's laps are driven where the scenario has no track."""
        return true_run(scenario, None if scenario.track else self.laps(scenario))

    def laps(self, scenario: Scenario) -> Path:
        """Return the path of the stand-in's laps."""
        return self.stand_in.path(scenario.static_s, scenario.start_position(), scenario.world())


ROBOT = Vehicle(
    name="robot",
    dataset="whu-robot",
    wheel_radius_m=0.097,
    track_width_m=0.33,
    body_position_m=(0.1, 0.0, -0.15),
    stand_in=Laps(length_m=105.0, width_m=28.0, corner_m=3.0, count=5, speed_m_s=1.4, change_m_s=0.4),
)
"""Pioneer 3DX; the body's module above the platform, ahead of the axle: the paper does not give it"""
CAR = Vehicle(
    name="car",
    dataset="whu-car",
    wheel_radius_m=0.3525,
    track_width_m=1.5,
    body_position_m=(1.3, 0.0, -0.4),
    stand_in=Laps(length_m=1700.0, width_m=1380.0, corner_m=20.0, count=2, speed_m_s=4.7, change_m_s=2.5),
)
"""the lab's car; width and the body's module as a passenger car may have them: they are not published"""
