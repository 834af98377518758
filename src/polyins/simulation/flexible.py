"""IMUs at the tips of steel rulers that bend and twist as the robot's body shakes their clamps.

Rulers lie across the robot, along y. A tip whose ruler bends by d downwards is d lower, turned about x by slope d / L,
nearer to the clamp by shortening d^2 / L, and turned about y by the twist. Together with roll and pitch of the body

    C_ps = Ry(pitch) Rx(roll + bend) Ry(twist),    u = heave + C_pb (place in b),

is where the IMU s is as seen from the smooth path p. Gravity bends the rulers at rest: the sag is in d.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polyins.simulation.cantilever import Cantilever
from polyins.simulation.shaking import Shaking
from polyins.simulation.transmission import transmit

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Ruler:
    """A ruler as it is mounted, and how it really vibrates."""

    beam: Cantilever
    tip: Array
    """where the ruler's tip is nominally, straight, in the array frame, m, shape (3,)"""
    side: float
    """1: it points to the right, along y; -1: to the left"""
    tuning: float = 1.0
    """its natural frequencies over those of an ideal clamp"""
    damping: float = 0.02
    """ratio"""
    stiff: bool = False
    """it neither bends nor twists"""

    @property
    def nominal(self) -> Array:
        """Where the IMU is nominally, in the array frame, m, shape (3,)."""
        return self.tip - np.array([0.0, 0.0, self.beam.tip_height])

    @property
    def bending_rate(self) -> float:
        """rad/s."""
        return self.tuning * self.beam.bending_rate


@dataclass(frozen=True)
class Flexing:
    """How a ruler bends and twists, every `step` s from time 0; its derivatives beside it. Shape (T,) each."""

    bend: Array
    """d, m"""
    bend_rate: Array
    """m/s"""
    twist: Array
    """rad"""
    twist_rate: Array
    """rad/s"""


def flex(ruler: Ruler, shaking: Shaking, gravity: float) -> Flexing:
    """Return how a ruler bends and twists on a body that shakes.

    Seen from outside, the tip is a mass on a spring whose foot is the clamp: the deflection is what it lags behind.
    """
    if ruler.stiff:
        return Flexing(*np.zeros((4, len(shaking.motion))))
    beam, foot = ruler.beam, foot_of(ruler)
    moved, moving = shaking.motion @ foot, shaking.change @ foot
    place, speed = transmit(moved, shaking.step, ruler.bending_rate, ruler.damping)
    sag = beam.gain * gravity / ruler.bending_rate**2
    turn, turning = shaking.motion[:, 1], shaking.change[:, 1]
    angle, rate = transmit(turn, shaking.step, ruler.tuning * beam.torsion_rate, ruler.damping)
    return Flexing(place - moved + sag, speed - moving, angle - turn, rate - turning)


def foot_of(ruler: Ruler) -> Array:
    """Return by how much heave, pitch and roll of the body move the foot of the bending mode, shape (3,)."""
    beam = ruler.beam
    clamp = ruler.tip[1] - ruler.side * beam.length
    return np.array(
        [beam.gain, -beam.gain * ruler.tip[0], beam.gain * clamp + beam.swing_gain * ruler.side * beam.length]
    )


@dataclass(frozen=True)
class TipMotion:
    """Where a tip is relative to the smooth path p, and how it moves there; shape (T, ...)."""

    C_ps: Array
    """(T, 3, 3)"""
    angles: Array
    """about x, y, z, rad: roll + bend, pitch + twist, 0, (T, 3)"""
    angle_rates: Array
    """their derivatives, which `rate` is but for products of small angles, (T, 3)"""
    rate: Array
    """w_ps in s, rad/s, (T, 3)"""
    place: Array
    """u in p, m, (T, 3)"""
    speed: Array
    """du/dt in p, m/s, (T, 3)"""


def tip_motion(ruler: Ruler, flexing: Flexing, shaking: Shaking, part: slice) -> TipMotion:
    """Return how the IMU of a ruler moves relative to the smooth path, for a part of the samples."""
    heave, pitch, roll = shaking.motion[part].T
    rise, pitching, rolling = shaking.change[part].T
    d, d_rate = flexing.bend[part], flexing.bend_rate[part]
    b, b_rate = flexing.twist[part], flexing.twist_rate[part]
    beam, side = ruler.beam, ruler.side
    per_metre = side * beam.slope / beam.length
    g, g_rate = roll + per_metre * d, rolling + per_metre * d_rate
    short = side * beam.shortening / beam.length
    none = np.zeros_like(d)
    arm = ruler.tip + np.column_stack([none, -short * d**2, d])
    arm_rate = np.column_stack([none, -2.0 * short * d * d_rate, d_rate])
    (sg, sp, sb, sr), (cg, cp, cb, cr) = np.sin([g, pitch, b, roll]), np.cos([g, pitch, b, roll])
    # from p: turned by pitch, then about x by the roll for the arm, by roll and bend for the module
    y, z = cr * arm[:, 1] - sr * arm[:, 2], sr * arm[:, 1] + cr * arm[:, 2]
    y_rate = cr * arm_rate[:, 1] - sr * arm_rate[:, 2] - rolling * z
    z_rate = sr * arm_rate[:, 1] + cr * arm_rate[:, 2] + rolling * y
    h = beam.tip_height
    x = arm[:, 0] - h * sb
    x_rate = -h * cb * b_rate
    y, y_rate = y + h * sg * cb, y_rate + h * (cg * cb * g_rate - sg * sb * b_rate)
    z, z_rate = z - h * cg * cb, z_rate + h * (sg * cb * g_rate + cg * sb * b_rate)
    place = np.column_stack([cp * x + sp * z, y, cp * z - sp * x + heave])
    speed = np.column_stack(
        [
            cp * x_rate + sp * z_rate + pitching * (cp * z - sp * x),
            y_rate,
            cp * z_rate - sp * x_rate - pitching * (sp * z + cp * x) + rise,
        ]
    )
    C_ps = np.stack(
        [
            cp * cb - sp * cg * sb, sp * sg, cp * sb + sp * cg * cb,
            sg * sb, cg, -sg * cb,
            -sp * cb - cp * cg * sb, cp * sg, -sp * sb + cp * cg * cb,
        ],
        axis=-1,
    ).reshape(-1, 3, 3)  # fmt: skip
    across = pitching * -sg
    rate = np.column_stack([g_rate * cb - across * sb, pitching * cg + b_rate, g_rate * sb + across * cb])
    angles, angle_rates = np.column_stack([g, pitch + b, none]), np.column_stack([g_rate, pitching + b_rate, none])
    return TipMotion(C_ps, angles, angle_rates, rate, place, speed)
