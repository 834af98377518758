"""Names for places in a flat array, and arrays whose vectors of eight do not straddle cache lines."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

EIGHT = 8


def zeros(*shape: int) -> npt.NDArray[Any]:
    """Return zeros that begin with a cache line, so that each vector of eight lies in one."""
    count = math.prod(shape)
    room = np.zeros(count + EIGHT - 1)
    first = -(room.ctypes.data // room.itemsize) % EIGHT
    return room[first : first + count].reshape(shape)


class Layout:
    """Hands out places one after the other; `width` numbers stand in each field."""

    def __init__(self, width: int = 1) -> None:
        self._width = width
        self._end = 0

    def take(self, fields: int) -> int:
        """Return the offset of the first of that many fields."""
        offset = self._end
        self._end += fields * self._width
        return offset

    def aligned(self) -> int:
        """Return the offset of what follows, at the begin of a vector of eight."""
        self._end = self.size
        return self._end

    @property
    def size(self) -> int:
        """Length of the array, in whole vectors of eight."""
        return (self._end + EIGHT - 1) // EIGHT * EIGHT
