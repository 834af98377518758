"""The engine along the latest epochs, which can go back for a fix that comes late.

All that the engine remembers stands in one array, which is noted every few epochs. A fix that lies behind takes the
state back to the note before it, and the epochs since then are taken again: the result is that of a fix on time.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.aiding.rolling import Joint
from polyins.kernels.jit import compiled_for
from polyins.navigate import engine
from polyins.navigate.batch import Prepared, build_outputs
from polyins.navigate.engine import Inputs, Outputs, State

Array = NDArray[np.float64]

STRIDE = 16
"""Epochs between two notes."""
NEVER = 2**62
REMEMBERED = ("memory", "silent", "returned", "given")
"""Arrays of `Rolling` that change."""
ALIGNMENT = 8
"""Numbers: each array of the memory begins on a cache line."""


class Timeline:
    """A window of epochs and fixes that ends at the newest, and the state of the engine there."""

    def __init__(self, prepared: Prepared, depth: float) -> None:
        """Begin at the first epoch of a run that is laid out; `depth`: how far back a fix may lie, s."""
        inputs = prepared.inputs
        self.depth = depth
        self.last = 0
        self.fixes = 0
        """how many there are in the window"""
        self.whole = True
        """whether the window still begins at the start"""
        self.run = self._with_one_memory(prepared)
        interval = float(inputs.time[1] - inputs.time[0])
        size = 4 * STRIDE
        while size < 2.0 * depth / interval:
            size *= 2
        self._allocate(size, size, inputs.increments.shape[2])
        # the window's arrays come and go, their types do not
        self.run = replace(self.run, loop=compiled_for(self.run.loop, *self.run.arguments(1, 1)))
        self.inputs.time[0] = inputs.time[0]
        self.inputs.increments[0] = inputs.increments[0]
        self._note(0)

    @property
    def inputs(self) -> Inputs:
        """What the engine is given of the window."""
        return self.run.inputs

    @property
    def outputs(self) -> Outputs:
        """What it writes there."""
        return self.run.outputs

    @property
    def time(self) -> float:
        """Time of the newest epoch, s."""
        return float(self.inputs.time[self.last])

    def append(self, time: float, increments: Array, travel: Array | None = None, present: Array | None = None) -> None:
        """Take one more epoch: increments (6, N); with wheels, what they rolled (2,) and which shares have data."""
        if self.last + 1 == len(self.inputs.time):
            self._move_on()
        k = self.last + 1
        self.inputs.time[k] = time
        self.inputs.increments[k] = increments
        if self.run.rolling is not None:
            self.run.rolling.travel[k] = travel
            self.run.rolling.present[k] = present
        self.last = k
        self._advance(k, k + 1)

    def insert(self, time: float, fix: Array, velocity: Array) -> bool:
        """Apply a fix, (6,) as in `Inputs`, at its own time; return whether it lies within the window.

        The variances of `velocity` are not positive where the fix has none.
        """
        due = self.inputs.time[: self.last + 1 : STRIDE] + self.run.plan.gnss_snap
        if self.whole:
            due[0] = self.inputs.time[0]
        note = int(np.searchsorted(due, time)) - 1
        if note < 0:
            return False
        if self.fixes == len(self.inputs.fix_time):
            self._double_fixes()
        place = int(np.searchsorted(self.inputs.fix_time[: self.fixes], time, side="right"))
        row_values: list[Any] = [time, fix, engine.UNUSED, 0.0, velocity]
        for rows, row in zip(self._by_fix(), row_values, strict=False):
            rows[place + 1 : self.fixes + 1] = rows[place : self.fixes].copy()
            rows[place] = row
        self.fixes += 1
        if time <= self.time + self.run.plan.gnss_snap:
            self.memory[:] = self._notes[note]
            self._advance(note * STRIDE + 1, self.last + 1)
        return True

    def has_fix(self, time: float) -> bool:
        """Whether there is a fix of that time in the window."""
        return bool((self.inputs.fix_time[: self.fixes] == time).any())

    def _with_one_memory(self, prepared: Prepared) -> Prepared:
        """Return the run with all arrays that change moved into one, of which they become parts."""
        rolling, joined = prepared.rolling, prepared.joined
        changing: list[NDArray[np.generic]] = [array for array in prepared.state if array is not prepared.state.members]
        if rolling is not None:
            changing += [getattr(rolling, name) for name in REMEMBERED]
        if joined is not None:
            changing += list(joined)
        ends = np.cumsum([-(-array.size // ALIGNMENT) * ALIGNMENT for array in changing])
        self.memory = np.zeros(ends[-1])
        parts = []
        for array, begin in zip(changing, [0, *ends], strict=False):
            part = self.memory[begin : begin + array.size].view(array.dtype).reshape(array.shape)
            part[:] = array
            parts.append(part)
        moved = iter(parts)
        return replace(
            prepared,
            plan=prepared.plan._replace(log_every=NEVER),
            state=State(*(array if array is prepared.state.members else next(moved) for array in prepared.state)),
            rolling=None if rolling is None else rolling._replace(**{name: next(moved) for name in REMEMBERED}),
            joined=None if joined is None else Joint(*moved),
        )

    def _allocate(self, epochs: int, fixes: int, imus: int) -> None:
        rolling = self.run.rolling
        velocities = None if rolling is not None else np.full((fixes, 6), -1.0)
        if rolling is not None:
            shares = len(self.run.state.members)
            rolling = rolling._replace(travel=np.zeros((epochs, 2)), present=np.ones((epochs, shares), dtype=np.uint8))
        self.run = replace(
            self.run,
            inputs=Inputs(
                np.zeros(epochs), np.zeros((epochs, 6, imus)), np.full(fixes, np.inf), np.zeros((fixes, 6)), velocities
            ),
            outputs=build_outputs(epochs, fixes, imus, NEVER, 12 if rolling is None else 15),
            rolling=rolling,
        )
        self._notes = np.zeros((epochs // STRIDE + 1, len(self.memory)))

    def _advance(self, first: int, last: int) -> None:
        """Take epochs first ... last - 1, with a note wherever one is due."""
        while first < last:
            stop = min(last, (first - 1) // STRIDE * STRIDE + STRIDE + 1)
            self.run.advance(first, stop)
            if (stop - 1) % STRIDE == 0:
                self._note((stop - 1) // STRIDE)
            first = stop

    def _note(self, place: int) -> None:
        self._notes[place] = self.memory

    def _move_on(self) -> None:
        """Let epochs go that lie behind the depth, and make more room where few do."""
        gone = int(np.searchsorted(self.inputs.time[: self.last + 1 : STRIDE], self.time - self.depth)) - 1
        gone = min(max(gone, 0), (self.last - 1) // STRIDE)
        epochs = len(self.inputs.time)
        kept = self.last + 1 - gone * STRIDE
        self._copy_window(gone, 2 * epochs if 2 * kept > epochs else epochs, len(self.inputs.fix_time))

    def _double_fixes(self) -> None:
        self._copy_window(0, len(self.inputs.time), 2 * len(self.inputs.fix_time))

    def _copy_window(self, gone: int, epochs: int, fixes: int) -> None:
        """Copy the window without its first notes into one of that size, which may be the same."""
        by_epoch, by_fix, notes = self._by_epoch(), self._by_fix(), self._notes
        if (epochs, fixes) != (len(self.inputs.time), len(self.inputs.fix_time)):
            self._allocate(epochs, fixes, self.inputs.increments.shape[2])
        first, last = gone * STRIDE, self.last + 1
        self._notes[: len(notes) - gone] = notes[gone:]
        used = int(self._counters(self._notes[:1])[0, 0])
        kept = self.fixes - used
        for new, old in zip(self._by_epoch(), by_epoch, strict=True):
            new[: last - first] = old[first:last]
        for new, old in zip(self._by_fix(), by_fix, strict=True):
            new[:kept] = old[used : self.fixes]
        self.inputs.fix_time[kept:] = np.inf
        for rows in (self._notes, self.memory[None]):
            self._counters(rows)[:, 0] -= used
            self._counters(rows)[:, 2] = 0
        self.last -= first
        self.fixes = kept
        self.whole = self.whole and gone == 0
        engine.gather_idle_lanes(self.run.state.blocks, self.run.state.members)

    def _by_epoch(self) -> list[NDArray[np.generic]]:
        travelled = [] if self.run.rolling is None else [self.run.rolling.travel, self.run.rolling.present]
        return [self.inputs.time, self.inputs.increments, self.outputs.states, self.outputs.variances, *travelled]

    def _by_fix(self) -> list[NDArray[np.generic]]:
        velocities = [] if self.inputs.velocities is None else [self.inputs.velocities]
        return [self.inputs.fix_time, self.inputs.fixes, self.outputs.fix_status, self.outputs.innovations, *velocities]

    def _counters(self, rows: Array) -> NDArray[np.int64]:
        """Return the counters in notes, (., memory)."""
        here = self.run.state.counters
        begin = (here.ctypes.data - self.memory.ctypes.data) // 8
        return rows[:, begin : begin + len(here)].view(np.int64)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return all that is needed to go on, for a file."""
        used = self.last // STRIDE + 1
        counts = [self.last, self.fixes, self.whole, len(self.inputs.time), len(self.inputs.fix_time)]
        found: dict[str, NDArray[Any]] = {
            "memory": self.memory,
            "notes": self._notes[:used],
            "counts": np.array(counts),
        }
        found |= {f"epochs{n}": array[: self.last + 1] for n, array in enumerate(self._by_epoch())}
        return found | {f"fixes{n}": array[: self.fixes] for n, array in enumerate(self._by_fix())}

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Become the timeline of the same method whose arrays these are."""
        self.last, self.fixes, whole, epochs, fixes = (int(count) for count in arrays["counts"])
        self.whole = bool(whole)
        self._allocate(epochs, fixes, self.inputs.increments.shape[2])
        self.memory[:] = arrays["memory"]
        self._notes[: len(arrays["notes"])] = arrays["notes"]
        for n, array in enumerate(self._by_epoch()):
            array[: self.last + 1] = arrays[f"epochs{n}"]
        for n, array in enumerate(self._by_fix()):
            array[: self.fixes] = arrays[f"fixes{n}"]
