"""Curves with known derivatives, from which paths of known motion are made."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Line:
    offset: float = 0.0
    slope: float = 0.0

    def __call__(self, time, nu=0):
        return [self.offset + self.slope * time, np.full_like(time, self.slope)][nu]


@dataclass(frozen=True)
class Sine:
    amplitude: float
    rate: float
    phase: float = 0.0

    def __call__(self, time, nu=0):
        return self.amplitude * self.rate**nu * np.sin(self.rate * time + self.phase + nu * np.pi / 2)
