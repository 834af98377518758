"""A path that repeats a drive of which only satellite positions are known.

A quintic smoothing spline through the positions gives the horizontal velocity; its size is the speed and its direction
the heading, which is held below a speed at which noise would turn it. The slope is that of the smoothed height over the
way travelled. Camber and how the body moves on its springs are not in the data: `Ride` says them. The body does not
slip sideways unless it is asked to.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polyins.errors import InputError
from polyins.model.geodesy import metres_per_unit
from polyins.model.rig import DEG
from polyins.simulation.path import Path, Profile, path

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

Array = NDArray[np.float64]

DEGREE = 5
"""of all splines: four continuous derivatives"""
STEP = 0.5
"""s between the coefficients of the curves: they smooth over 0.7 of it, 1 sigma"""
HELD_BELOW = 0.7
"""m/s: no heading from the course of slower motion"""
STANDS_BELOW = 0.15
"""m/s: the spline's wobble while the vehicle stands"""


@dataclass(frozen=True)
class Ride:
    """What positions do not tell of a drive: the road's camber, and how the body moves on its springs and tyres."""

    camber_std: float = 0.7 * DEG
    camber_length: float = 50.0
    """m of way from one camber to the next"""
    slope_smoothing: float = 10.0
    """m of way, 1 sigma, over which the height is smoothed"""
    roll_per_acceleration: float = 0.6 * DEG
    """rad per m/s^2: it leans out of the turn"""
    pitch_per_acceleration: float = 0.2 * DEG
    """rad per m/s^2: it squats and dives"""
    side_slip: float = 0.0
    """rad per m/s^2: in turns the nose points inwards of the course"""


def replay(time: ArrayLike, position: ArrayLike, std: ArrayLike, *, ride: Ride = Ride(), seed: int = 0) -> Path:
    """Return the path along positions, (latitude rad, longitude rad, height m), shape (P, 3), at times, s, shape (P,).

    `std` is how sure they are, m, north, east, down, shape (P, 3); the path's time 0 is that of the first. `seed` draws
    the camber. The positions are those of the point that becomes the array origin.

    Raises InputError for positions that make no path.
    """
    times, points, spread = (np.asarray(values, dtype=float) for values in (time, position, std))
    if (
        len(times) <= DEGREE
        or not np.all(np.diff(times) > 0.0)
        or not np.all(np.isfinite(points))
        or not np.all(spread > 0.0)
    ):
        raise InputError(
            f"replay: {len(times)} positions; expected at least {DEGREE + 1} at increasing times, none of them missing,"
            " with standard deviations above zero"
        )
    grid = np.arange(-DEGREE, np.ceil((times[-1] - times[0]) / STEP) + DEGREE + 1) * STEP
    velocity, height = _smoothed(times - times[0], points, spread, grid)
    speed = np.hypot(*velocity.T)
    speed[speed < STANDS_BELOW] = 0.0
    way = np.append(0.0, np.cumsum(STEP * (speed[1:] + speed[:-1]) / 2.0))
    if way[-1] == 0.0:
        raise InputError(f"replay: the positions never move faster than {STANDS_BELOW:g} m/s; expected a drive")
    heading = _course(velocity, speed, way)
    roll, pitch = _attitude(ride, speed, heading, way, height, np.random.default_rng(seed))
    inwards = ride.side_slip * speed * np.gradient(heading, STEP)
    along = speed / np.cos(pitch)
    # a body that leans slips downwards too: its nose takes that back, for the height is the road's
    pitch = pitch - np.tan(inwards) * np.sin(roll)
    profile = Profile(
        _curve(grid, along * np.cos(inwards)),
        _curve(grid, roll),
        _curve(grid, pitch),
        _curve(grid, heading + inwards),
        _curve(grid, -along * np.sin(inwards)) if ride.side_slip else None,
    )
    return path(profile, duration=float(times[-1] - times[0]), static=standing_start(grid, speed), start=points[0])


def standing_start(grid: Array, speed: Array) -> float:
    """Return how long the curves stand still from time 0 on, s: the coefficients that move reach three steps back."""
    first = grid[np.flatnonzero(speed)[0]] - (DEGREE + 1) / 2.0 * STEP
    return float(max(np.floor(first), 0.0))


def _smoothed(time: Array, points: Array, std: Array, grid: Array) -> tuple[Array, Array]:
    """Return horizontal velocity, m/s, shape (G, 2), and height, m, shape (G,), at the times of the grid."""
    from scipy.interpolate import UnivariateSpline

    metres = (points - points[0]) * np.abs(metres_per_unit(points[0], geodetic=True))
    north, east, up = (
        UnivariateSpline(time, metres[:, axis], w=1.0 / std[:, axis], k=DEGREE, s=float(len(time))) for axis in range(3)
    )
    inside = np.clip(grid, time[0], time[-1])
    velocity = np.column_stack([north(inside, 1), east(inside, 1)])
    return velocity, up(inside)


def _course(velocity: Array, speed: Array, way: Array) -> Array:
    """Return the heading, rad, shape (G,): the course; while slow, the courses before and after, over the way."""
    fast = speed >= HELD_BELOW
    if not fast.any():
        raise InputError(f"replay: the positions never move faster than {HELD_BELOW:g} m/s; expected a drive")
    course = np.unwrap(np.arctan2(velocity[fast, 1], velocity[fast, 0]))
    return np.asarray(np.interp(way, way[fast], course))


def _attitude(
    ride: Ride, speed: Array, heading: Array, way: Array, height: Array, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return roll and pitch, rad, shape (G,) each: the road's, and what the springs add."""
    along, across = np.gradient(speed, STEP), speed * np.gradient(heading, STEP)
    pitch = _slope(way, height, ride.slope_smoothing) + ride.pitch_per_acceleration * along
    knots = np.arange(0.0, way[-1] + 2.0 * ride.camber_length, ride.camber_length)
    camber = np.interp(way, knots, rng.normal(0.0, ride.camber_std, knots.size))
    return camber - ride.roll_per_acceleration * across, pitch


def _slope(way: Array, height: Array, smoothing: float) -> Array:
    """Return the slope of the road, rad, from the height over the way, both shape (G,)."""
    from scipy.ndimage import gaussian_filter1d

    even = np.arange(0.0, way[-1] + 1.0)
    moves = np.append(True, np.diff(way) > 0.0)
    profile = np.interp(even, way[moves], height[moves])
    if smoothing > 0.0:
        profile = gaussian_filter1d(profile, smoothing, mode="nearest")
    slope = np.arctan(np.gradient(profile)) if even.size > 1 else np.zeros(1)
    return np.asarray(np.interp(way, even, slope))


def _curve(grid: Array, values: Array) -> BSpline:
    """Return the spline whose coefficients are the values at an even grid: smooth, and nowhere beyond them."""
    from scipy.interpolate import BSpline

    reach = (DEGREE + 1) / 2.0
    knots = grid[0] + STEP * (np.arange(grid.size + DEGREE + 1) - reach)
    return BSpline(knots, values, DEGREE)
