"""A path along a track of surveyed points at the speeds of an odometer, on ground that is level or goes up and down.

The points give the shape of the curve, the speeds give how it is travelled: heading is a function of the way travelled,
so it is the course at departure as long as the vehicle stands.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.errors import InputError
from polyins.simulation import earth
from polyins.simulation.path import START, Path, Profile, World, path

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

    from polyins.simulation.path import Curve

Array = NDArray[np.float64]

LEAST_STEP = 0.3  # m from one point to the next: nearer ones tell nothing of the course
DEGREE = 5  # of all splines: four continuous derivatives
COURSE_STEP = 0.1  # m
FINE_STEPS = 10  # per COURSE_STEP
NOISE_AT_REST = 0.05  # m/s, of an odometer


@dataclass(frozen=True)
class Level:
    """The curve that is zero."""

    def __call__(self, time: Array, nu: int = 0) -> Array:
        """Return zeros."""
        return np.zeros_like(time)


@dataclass(frozen=True)
class TrackHeading:
    """The heading as a function of the way travelled."""

    heading: Curve
    """rad, over m"""
    distance: Curve
    """m, over s"""

    def __call__(self, time: Array, nu: int = 0) -> Array:
        """Return the heading, rad, or its first derivative, rad/s, at the times."""
        way = self.distance(time)
        return self.heading(way) if nu == 0 else self.heading(way, 1) * self.distance(time, 1)


@dataclass(frozen=True)
class Waves:
    """A slope that goes up and down along the way."""

    distance: Curve
    """m, over s"""
    steepest: float
    """rad"""
    length: float
    """of a wave, m"""

    def __call__(self, time: Array, nu: int = 0) -> Array:
        """Return the pitch, rad, or its first derivative, rad/s, at the times."""
        number = 2.0 * np.pi / self.length
        way = number * self.distance(time)
        return self.steepest * (np.sin(way) if nu == 0 else np.cos(way) * number * self.distance(time, 1))


class Survey(NamedTuple):
    """The points of a track, in their order."""

    north: ArrayLike
    """m, shape (P,)"""
    east: ArrayLike
    """m, shape (P,)"""
    smoothing: float = 0.7
    """m: bends much shorter than this are smoothed away"""


class Odometer(NamedTuple):
    """The speeds at which a track is travelled, between two stands."""

    time: ArrayLike
    """s, shape (S,)"""
    speed: ArrayLike
    """m/s, shape (S,)"""
    static: float = 30.0
    """s of standing before"""
    rest: float = 5.0
    """s of standing after"""


class Slopes(NamedTuple):
    """Ground that goes up and down along the way."""

    steepest: float = 0.0
    """rad; 0: it is level"""
    wave: float = 60.0
    """length of a wave, m"""


LEVEL = Slopes()


def track_path(
    survey: Survey,
    odometer: Odometer,
    slopes: Slopes = LEVEL,
    *,
    start: ArrayLike = START,
    world: World = earth,
) -> Path:
    """Return the path from `start`, in the world's coordinates, along the points at the speeds; the roll is zero.

    The speeds are smoothed over 0.7 of their interval (1 sigma) and scaled so that they last to the end of the curve.
    Backward speeds within an odometer's noise at rest, 0.05 m/s, are taken as rest.

    Raises InputError for points or speeds that make no path.
    """
    points, static = _distinct(survey.north, survey.east), odometer.static
    times, speeds = np.asarray(odometer.time, dtype=float), np.asarray(odometer.speed, dtype=float)
    if (
        points.shape[1] <= DEGREE
        or len(times) < 2
        or not np.all(np.diff(times) > 0.0)
        or not np.all(speeds >= -NOISE_AT_REST)
    ):
        raise InputError(
            f"track: {points.shape[1]} points apart from each other and {len(times)} speeds; expected at least"
            f" {DEGREE + 1} points, two speeds at increasing times, and none of them backward"
        )
    speeds = np.maximum(speeds, 0.0)
    if not np.any(speeds > 0.0):
        raise InputError("track: the speeds are all zero; expected some above zero")
    length, heading = _course(points, survey.smoothing)
    step = float(np.median(np.diff(times)))
    reach = (DEGREE + 1) / 2.0 * step
    duration = float(np.ceil(static + times[-1] - times[0] + 2.0 * reach + odometer.rest))
    pace = _smooth_speed(times - times[0] + static + reach, speeds, step, duration)
    pace.c = pace.c * (length / float(pace.integrate(0.0, duration)))
    course = TrackHeading(heading, pace.antiderivative())
    slope = Waves(course.distance, slopes.steepest, slopes.wave) if slopes.steepest else Level()
    return path(Profile(pace, Level(), slope, course), duration=duration, static=static, start=start, world=world)


def _distinct(north: ArrayLike, east: ArrayLike) -> Array:
    """Return the points, shape (2, P), without those that are too near to the one before."""
    points = np.asarray([north, east], dtype=float)
    if not np.all(np.isfinite(points)):
        raise InputError("track: a point has no coordinates; expected two numbers for each")
    kept = [0]
    for index in range(1, points.shape[1]):
        if np.hypot(*(points[:, index] - points[:, kept[-1]])) >= LEAST_STEP:
            kept.append(index)
    return points[:, kept]


def _course(points: Array, smoothing: float) -> tuple[float, Curve]:
    """Return the length of the smooth curve through the points and its heading over the way travelled."""
    from scipy.interpolate import CubicSpline, make_interp_spline, make_smoothing_spline

    chords = np.hypot(*np.diff(points))
    along = np.append(0.0, np.cumsum(chords))
    # a wave is halved whose wavelength is 2 pi times `smoothing`
    penalty = smoothing**4 / chords.mean()
    fine = np.linspace(0.0, along[-1], int(np.ceil(along[-1] / COURSE_STEP)) * FINE_STEPS + 1)
    tangent = np.array([make_smoothing_spline(along, values, lam=penalty)(fine, 1) for values in points])
    way = CubicSpline(fine, np.hypot(*tangent)).antiderivative()(fine)
    heading = np.unwrap(np.arctan2(tangent[1], tangent[0]))
    return float(way[-1]), make_interp_spline(way[::FINE_STEPS], heading[::FINE_STEPS], k=DEGREE)


def _smooth_speed(time: Array, speed: Array, step: float, duration: float) -> BSpline:
    """Return the spline whose coefficients are the speeds: it smooths, and is nowhere negative."""
    from scipy.interpolate import BSpline

    grid = time[0] + step * np.arange(np.floor(-time[0] / step) - DEGREE, np.ceil((duration - time[0]) / step) + DEGREE)
    knots = grid[0] + step * (np.arange(grid.size + DEGREE + 1) - (DEGREE + 1) / 2.0)
    return BSpline(knots, np.interp(grid, time, speed, left=0.0, right=0.0), DEGREE)
