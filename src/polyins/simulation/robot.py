"""Paper B's robot (Pioneer 3DX) on its real track: four chips in each wheel and four on the body, no GNSS."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path as FilePath
from typing import Literal

from polyins.config import Noise
from polyins.recording import Recording
from polyins.simulation.run import TrueRun, record, true_run
from polyins.simulation.scenario import Board, Errors, Scenario
from polyins.simulation.wheel_scenario import Slip, Track, WheelModule

WHEEL_RADIUS_M = 0.097
TRACK_WIDTH_M = 0.33
BODY_POSITION_M = (0.1, 0.0, -0.15)
"""of the body's module: above the platform, ahead of the axle; the paper does not give it"""
STATIC_S = 30.0

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


def robot_scenario(
    folder: str | FilePath,
    *,
    earth: Literal["turning", "plane"] = "plane",
    noise: Noise | None = None,
    errors: Errors | None = None,
    calibrated: bool = True,
    slip: Slip | None = None,
) -> Scenario:
    """Return the scenario of the robot; `folder` holds track.csv and odometer.csv of the data set whu-robot.

    `noise`: how good the chips are (`chips()` unless given); `errors`: which errors they have (unless given all,
    constant from turn-on); `calibrated`: whether the filter knows the radius that fits each chip's gyro.
    """
    half, slip = TRACK_WIDTH_M / 2.0, slip or Slip()
    return Scenario(
        name="robot",
        static_s=STATIC_S,
        earth=earth,
        track=Track(file=str(FilePath(folder) / "track.csv"), odometer=str(FilePath(folder) / "odometer.csv")),
        imus=Board(count=4, pitch_m=0.0, position_m=BODY_POSITION_M),
        wheels=tuple(
            WheelModule(
                name=name,
                position_m=(0.0, right, 0.0),
                radius_m=WHEEL_RADIUS_M,
                calibrated=calibrated,
                slip=slip,
            )
            for name, right in (("left", -half), ("right", half))
        ),
        noise=noise or chips(),
        filter_noise=FILTER_NOISE,
        errors=errors or Errors(turn_on_share=1.0),
        gnss=None,
    )


def robot(folder: str | FilePath, seed: int = 0, *, earth: Literal["turning", "plane"] = "plane") -> Recording:
    """Return the robot's run with errors drawn by a seed; the path and the wheels' angles are the same for all seeds.

    For other chips, slip or no errors at all: `record(true_run(robot_scenario(...)), seed=...)`.
    """
    return record(_robot_run(str(folder), earth), seed=seed).recording


@lru_cache(maxsize=2)
def _robot_run(folder: str, earth: Literal["turning", "plane"]) -> TrueRun:
    return true_run(robot_scenario(folder, earth=earth))
