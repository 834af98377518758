"""IMUs at the tips of steel rulers that bend and twist as the robot's body shakes their clamps.

Rulers lie across the robot, along y. A tip whose ruler bends by d downwards is d lower, turned about x by slope d / L,
nearer to the clamp by shortening d^2 / L, and turned about y by the twist. Together with roll and pitch of the body

    C_ps = Ry(pitch) Rx(roll + bend) Ry(twist),    u = heave + C_pb (place in b),

is where the IMU s is as seen from the smooth path p. Gravity bends the rulers at rest: the sag is in d.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from polyins.kernels.jit import kernel
from polyins.simulation.cantilever import Cantilever
from polyins.simulation.shaking import Shaking
from polyins.simulation.transmission import transmit

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FlexibleMount:
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
        return np.asarray(self.tip - np.array([0.0, 0.0, self.beam.tip_height]))

    @property
    def bending_rate(self) -> float:
        """rad/s."""
        return self.tuning * self.beam.bending_rate


def flex(ruler: FlexibleMount, shaking: Shaking, gravity: float) -> Array:
    """Return bend, m, twist, rad, and their derivatives, shape (T, 4), of a ruler on a body that shakes.

    Seen from outside, the tip is a mass on a spring whose foot is the clamp: the deflection is what it lags behind.
    """
    if ruler.stiff:
        return np.zeros((len(shaking.motion), 4))
    beam, foot = ruler.beam, foot_of(ruler)
    moved, moving = shaking.motion @ foot, shaking.change @ foot
    place, speed = transmit(moved, shaking.step, ruler.bending_rate, ruler.damping)
    sag = beam.gain * gravity / ruler.bending_rate**2
    turn, turning = shaking.motion[:, 1], shaking.change[:, 1]
    angle, rate = transmit(turn, shaking.step, ruler.tuning * beam.torsion_rate, ruler.damping)
    flexing = np.empty((len(moved), 4))
    # without copies: a drive of ten minutes has 1.2 million rows
    for column, (seen, clamp) in enumerate([(place, moved - sag), (angle, turn), (speed, moving), (rate, turning)]):
        np.subtract(seen, clamp, out=flexing[:, column])
    return flexing


def foot_of(ruler: FlexibleMount) -> Array:
    """Return by how much heave, pitch and roll of the body move the foot of the bending mode, shape (3,)."""
    beam = ruler.beam
    clamp = ruler.tip[1] - ruler.side * beam.length
    return np.array(
        [beam.gain, -beam.gain * ruler.tip[0], beam.gain * clamp + beam.swing_gain * ruler.side * beam.length]
    )


@kernel
def tip_motion(motion: Array, change: Array, flexing: Array, shape: Array, moved: Array) -> None:
    """Write how an IMU moves relative to the smooth path p.

    `motion` is heave, pitch, roll of the body, `change` its derivative, `flexing` bend, twist and their derivatives;
    `shape` is from `shape_of`. `moved` holds C_ps row by row; w_ps in s, rad/s; u in p, m; du/dt in p, m/s: (18,).
    """
    heave, pitch, roll = motion[0], motion[1], motion[2]
    rise, pitching, rolling = change[0], change[1], change[2]
    d, b, d_rate, b_rate = flexing[0], flexing[1], flexing[2], flexing[3]
    per_metre, short, h = shape[3], shape[4], shape[5]
    g, g_rate = roll + per_metre * d, rolling + per_metre * d_rate
    sg, sp, sb, sr, cg, cp, cb, cr = (
        sin(g), sin(pitch), sin(b), sin(roll), cos(g), cos(pitch), cos(b), cos(roll)
    )  # fmt: skip
    moved[0], moved[1], moved[2] = cp * cb - sp * cg * sb, sp * sg, cp * sb + sp * cg * cb
    moved[3], moved[4], moved[5] = sg * sb, cg, -sg * cb
    moved[6], moved[7], moved[8] = -sp * cb - cp * cg * sb, cp * sg, -sp * sb + cp * cg * cb
    across = -pitching * sg
    moved[9], moved[10], moved[11] = g_rate * cb - across * sb, pitching * cg + b_rate, g_rate * sb + across * cb
    # the tip from the array origin, turned by the roll
    along, along_rate = shape[1] - short * d * d, -2.0 * short * d * d_rate
    down, down_rate = shape[2] + d, d_rate
    y, z = cr * along - sr * down, sr * along + cr * down
    y_rate = cr * along_rate - sr * down_rate - rolling * z
    z_rate = sr * along_rate + cr * down_rate + rolling * y
    # the module above the tip
    x, x_rate = shape[0] - h * sb, -h * cb * b_rate
    y, y_rate = y + h * sg * cb, y_rate + h * (cg * cb * g_rate - sg * sb * b_rate)
    z, z_rate = z - h * cg * cb, z_rate + h * (sg * cb * g_rate + cg * sb * b_rate)
    # all turned by the pitch, and heaved
    moved[12], moved[13], moved[14] = cp * x + sp * z, y, cp * z - sp * x + heave
    moved[15] = cp * x_rate + sp * z_rate + pitching * (cp * z - sp * x)
    moved[16] = y_rate
    moved[17] = cp * z_rate - sp * x_rate - pitching * (sp * z + cp * x) + rise


def shape_of(ruler: FlexibleMount) -> Array:
    """Return what `tip_motion` has to know of a ruler: its tip, slope and shortening, and the module's height, (6,)."""
    beam, side = ruler.beam, ruler.side
    bending = (side * beam.slope / beam.length, side * beam.shortening / beam.length)
    return np.array([*ruler.tip, *bending, beam.tip_height])
