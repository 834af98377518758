"""Wheels on drives over slopes, on the earth and on a plane, as the tests of wheels use them."""

from functools import cache

import numpy as np

from polyins.simulation import earth
from polyins.simulation.ground import without_twist
from polyins.simulation.path import START, Driving, drive
from polyins.simulation.plane import Plane
from polyins.simulation.rolling import roll

CENTRE = np.array([0.0, -0.165, 0.0])
RADIUS = 0.097
LEVER_ARM = np.array([0.002, 0.015, -0.004])
WORLDS = {"earth": earth, "plane": Plane()}


@cache
def drawn(world, duration=120.0, top_speed=1.9):
    start = START if world == "earth" else (0.0, 0.0, 0.0)
    driving = Driving(top_speed=top_speed)
    twisting = drive(duration, static=10.0, seed=2, start=start, driving=driving, world=WORLDS[world])
    return without_twist(twisting)


@cache
def wheel(world):
    return roll(drawn(world), CENTRE, RADIUS, phase=0.3)


def in_body(motion, vector):
    """Return vectors of n in the axes that a motion is of."""
    return np.einsum("tji,tj->ti", motion.C_nb, vector)
