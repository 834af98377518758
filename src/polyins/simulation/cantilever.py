"""A steel ruler clamped at one end with a module at its tip: its first bending mode and its first torsion mode.

Bending follows Euler and Bernoulli with a point mass m at the tip. With x = beta L and mu = m / (mass of the ruler),

    1 + cos x cosh x + mu x (cos x sinh x - sin x cosh x) = 0,    w = x^2 sqrt(EI / (mass / L)) / L^2,

and the shape is psi = cosh - cos - s (sinh - sin), scaled to 1 at the tip (Rao, Mechanical Vibrations, chapter 8). The
tip's deflection d is the mode's amplitude; slope and shortening follow from the shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NODES = 24  # of the quadrature along the ruler: exact to rounding


@dataclass(frozen=True)
class Cantilever:
    """A ruler of rectangular section and what it carries."""

    length: float
    """free, m"""
    width: float
    """m"""
    thickness: float
    """m, in the direction in which it bends"""
    tip_mass: float
    """kg, a point as far as bending goes"""
    tip_height: float
    """m: of the tip's mass above the ruler"""
    tip_width: float
    """m: of the module"""
    young: float = 200e9
    """of steel, Pa"""
    shear: float = 79e9
    """shear modulus of steel, Pa"""
    density: float = 7850.0
    """of steel, kg/m^3"""

    @property
    def stiffness(self) -> float:
        """Force at the tip over the tip's static deflection, 3 EI / L^3, N/m."""
        return 3.0 * self._bending_rigidity / self.length**3

    @property
    def mass(self) -> float:
        """Of the free length, kg."""
        return self.density * self.width * self.thickness * self.length

    @property
    def bending_rate(self) -> float:
        """Natural frequency of bending, undamped, rad/s."""
        return float(self._root**2 * np.sqrt(self._bending_rigidity / (self.mass * self.length**3)))

    @property
    def gain(self) -> float:
        """How much the mode is driven when the clamp moves, over what the tip's mass alone would be."""
        _, weight, shape, _ = self._shape
        return float((self.tip_mass + self.mass * weight @ shape) / self._modal_mass)

    @property
    def swing_gain(self) -> float:
        """How much the mode is driven when the clamp turns, over what the tip's mass alone at its arm would be."""
        along, weight, shape, _ = self._shape
        return float((self.tip_mass + self.mass * weight @ (shape * along)) / self._modal_mass)

    @property
    def slope(self) -> float:
        """Slope at the tip over the deflection, times the length."""
        return float(self._slope_at(np.ones(1))[0] / self._shape_at(np.ones(1))[0])

    @property
    def shortening(self) -> float:
        """By how much the tip comes nearer to the clamp over the square of the deflection, times the length."""
        _, weight, _, slope = self._shape
        return float(0.5 * weight @ slope**2)

    @property
    def torsion_rate(self) -> float:
        """Natural frequency of torsion, undamped, rad/s; a thin strip's rigidity is G b t^3 / 3."""
        rigidity = self.shear * self.width * self.thickness**3 / 3.0
        tip = self.tip_mass * (self.tip_width**2 / 12.0 + self.tip_height**2)
        strip = self.mass * self.width**2 / 12.0
        return float(np.sqrt(rigidity / self.length / (tip + strip / 3.0)))

    @property
    def _bending_rigidity(self) -> float:
        return self.young * self.width * self.thickness**3 / 12.0

    @property
    def _modal_mass(self) -> float:
        _, weight, shape, _ = self._shape
        return float(self.tip_mass + self.mass * weight @ shape**2)

    @cached_property
    def _root(self) -> float:
        from scipy.optimize import brentq

        ratio = self.tip_mass / self.mass

        def residual(x: float) -> float:
            c, s, ch, sh = np.cos(x), np.sin(x), np.cosh(x), np.sinh(x)
            return float(1.0 + c * ch + ratio * x * (c * sh - s * ch))

        # 1.8751 without a tip mass, less with one
        return float(brentq(residual, 1e-3, 1.9, xtol=1e-14))

    @cached_property
    def _shape(self) -> tuple[Array, Array, Array, Array]:
        """Places along the ruler over its length, weights, and the shape and its slope there, 1 at the tip."""
        node, weight = np.polynomial.legendre.leggauss(NODES)
        along = (1.0 + node) / 2.0
        tip = self._shape_at(np.ones(1))[0]
        return along, weight / 2.0, self._shape_at(along) / tip, self._slope_at(along) / tip

    def _shape_at(self, along: Array) -> Array:
        x = self._root * along
        return np.asarray(np.cosh(x) - np.cos(x) - self._mix * (np.sinh(x) - np.sin(x)))

    def _slope_at(self, along: Array) -> Array:
        x = self._root * along
        return np.asarray(self._root * (np.sinh(x) + np.sin(x) - self._mix * (np.cosh(x) - np.cos(x))))

    @property
    def _mix(self) -> float:
        x = self._root
        return float((np.cosh(x) + np.cos(x)) / (np.sinh(x) + np.sin(x)))
