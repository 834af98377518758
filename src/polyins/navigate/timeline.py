"""The engine along the latest epochs, which can go back for a measurement that comes late.

All that the engine remembers stands in one array, which is noted every few epochs. An event that lies behind takes the
state back to the note before it, and the epochs since then are taken again: the result is that of an event on time.
"""

from __future__ import annotations

from array import array as growing
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polyins.kernels.jit import compiled_for
from polyins.navigate import engine, outcome
from polyins.navigate.batch import USUAL_AIDING, Prepared, empty_outputs
from polyins.navigate.events import Events
from polyins.navigate.state import LOG_EVERY, NEXT_EVENT, NEXT_LOG, SNAP, VALUES, Inputs, Outputs
from polyins.navigate.update import UNUSED

Array = NDArray[np.float64]

STRIDE = 16
"""Epochs between two notes."""
NEVER = 2.0**62


class Timeline:
    """A window of epochs and events that ends at the newest, and the state of the engine there."""

    def __init__(self, prepared: Prepared, depth: float) -> None:
        """Begin at the first epoch of a run that is laid out; `depth`: how far back an event may lie, s."""
        inputs = prepared.inputs
        self.depth = depth
        self.last = 0
        self.events = 0
        """how many there are in the window"""
        self.whole = True
        """whether the window still begins at the start"""
        self.run = prepared
        self.run.plan.settings[LOG_EVERY] = NEVER
        self.snap = float(self.run.plan.settings[SNAP])
        self._measured: growing[float] = growing("d")
        """rows of the measurements that the window has left behind, see `outcome`"""
        interval = float(inputs.time[1] - inputs.time[0])
        size = 4 * STRIDE
        while size < 2.0 * depth / interval:
            size *= 2
        self._allocate(size, size)
        # the window's arrays come and go, their types do not
        others = (self.run.further, self.run.full_matrices, slice(1, 1))
        loop = compiled_for(self.run.loop, self.run.navigators, self.inputs, self.outputs, *others)
        self.run = replace(self.run, loop=loop)
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

    def append(self, time: float, increments: Array, present: NDArray[np.uint8], travel: Array, due: Events) -> None:
        """Take one more epoch: increments (6, N), what each IMU has (N,), what wheels rolled (2,), what is due then."""
        if self.last + 1 == len(self.inputs.time):
            self._move_on()
        k = self.last + 1
        self.inputs.time[k] = time
        self.inputs.increments[k] = increments
        self.inputs.present[k] = present
        if len(self.inputs.travel):
            self.inputs.travel[k] = travel
        for row in range(len(due.time)):
            # before all else that is at the same epoch
            self._place(due.at(slice(row, row + 1)), "left" if row == 0 else "right")
        self.last = k
        self._advance(k, k + 1)

    def insert(self, event: Events) -> bool:
        """Apply one event at its own time; return whether it lies within the window."""
        time = float(event.time[0])
        noted = self.inputs.time[: self.last + 1 : STRIDE] + self.snap
        if self.whole:
            noted[0] = self.inputs.time[0]
        note = int(np.searchsorted(noted, time)) - 1
        if note < 0:
            return False
        self._place(event, "right")
        if time <= self.time + self.snap:
            self.run.memory[:] = self._notes[note]
            self._advance(note * STRIDE + 1, self.last + 1)
        return True

    @property
    def measured(self) -> Array:
        """What became of all measurements so far, a row of each, see `outcome`."""
        used = int(np.searchsorted(self.inputs.event_time[: self.events], self.time + self.snap, "right"))
        gone = np.array(self._measured).reshape(-1, outcome.WIDTH)
        return np.concatenate([gone, outcome.rows_of(self.inputs, self.outputs, slice(0, used), self.last)])

    @property
    def aided(self) -> Array:
        """When positions or speeds were accepted, s: of the window, and the latest before it, or the start."""
        return np.concatenate([self.run.aided, self._aided(self.events)])

    def _aided(self, used: int) -> Array:
        kind, status = self.inputs.event_kind[:used], self.outputs.event_status[:used]
        return outcome.aided_at(kind, status, self.inputs.event_time[:used])

    def has_event(self, kind: int, time: float) -> bool:
        """Whether there is an event of that kind and time in the window."""
        same = self.inputs.event_time[: self.events] == time
        return bool((same & (self.inputs.event_kind[: self.events] == kind)).any())

    def _place(self, event: Events, side: Any) -> None:
        """Put an event into the queue, among those of its time after them, or before them if `side` is left."""
        if self.events == len(self.inputs.event_time):
            self._double_events()
        place = int(np.searchsorted(self.inputs.event_time[: self.events], event.time[0], side=side))
        row: list[Any] = [event.time[0], event.kind[0], event.value[0], event.variance[0], UNUSED, 0.0]
        for rows, value in zip(self._by_event(), row, strict=True):
            rows[place + 1 : self.events + 1] = rows[place : self.events].copy()
            rows[place] = value
        self.events += 1

    def _allocate(self, epochs: int, events: int) -> None:
        imus = self.run.inputs.increments.shape[2]
        inputs = Inputs(
            time=np.zeros(epochs),
            increments=np.zeros((epochs, 6, imus)),
            present=np.ones((epochs, imus), dtype=np.uint8),
            travel=np.zeros((epochs if self.run.choice.speed else 0, self.run.inputs.travel.shape[1])),
            event_time=np.full(events, np.inf),
            event_kind=np.zeros(events, dtype=np.int8),
            event_value=np.zeros((events, VALUES)),
            event_variance=np.zeros((events, 3)),
        )
        outputs = empty_outputs(inputs, self.run.plan, self.run.outputs.log.shape[2])
        self.run = replace(self.run, inputs=inputs, outputs=outputs)
        self._notes = np.zeros((epochs // STRIDE + 1, len(self.run.memory)))

    def _advance(self, first: int, last: int) -> None:
        """Take epochs first ... last - 1, with a note wherever one is due."""
        while first < last:
            stop = min(last, (first - 1) // STRIDE * STRIDE + STRIDE + 1)
            self.run.advance(first, stop)
            if (stop - 1) % STRIDE == 0:
                self._note((stop - 1) // STRIDE)
            first = stop

    def _note(self, place: int) -> None:
        self._notes[place] = self.run.memory

    def _move_on(self) -> None:
        """Let epochs go that lie behind the depth, and make more room where few do."""
        gone = int(np.searchsorted(self.inputs.time[: self.last + 1 : STRIDE], self.time - self.depth)) - 1
        gone = min(max(gone, 0), (self.last - 1) // STRIDE)
        epochs = len(self.inputs.time)
        kept = self.last + 1 - gone * STRIDE
        self._copy_window(gone, 2 * epochs if 2 * kept > epochs else epochs, len(self.inputs.event_time))

    def _double_events(self) -> None:
        self._copy_window(0, len(self.inputs.time), 2 * len(self.inputs.event_time))

    def _copy_window(self, gone: int, epochs: int, events: int) -> None:
        """Copy the window without its first notes into one of that size, which may be the same."""
        by_epoch, by_event, notes = self._by_epoch(), self._by_event(), self._notes
        self._leave_behind(int(self._scalars(notes[gone : gone + 1])[0, NEXT_EVENT]))
        if (epochs, events) != (len(self.inputs.time), len(self.inputs.event_time)):
            self._allocate(epochs, events)
        first, last = gone * STRIDE, self.last + 1
        self._notes[: len(notes) - gone] = notes[gone:]
        scalars = self._scalars(self._notes)
        used = int(scalars[0, NEXT_EVENT])
        kept = self.events - used
        for new, old in zip(self._by_epoch(), by_epoch, strict=True):
            new[: last - first] = old[first:last]
        for new, old in zip(self._by_event(), by_event, strict=True):
            new[:kept] = old[used : self.events]
        self.inputs.event_time[kept:] = np.inf
        for rows in (scalars, self._scalars(self.run.memory[None])):
            rows[:, NEXT_EVENT] -= used
            rows[:, NEXT_LOG] = 0.0
        self.last -= first
        self.events = kept
        self.whole = self.whole and gone == 0
        engine.tidy(self.run.navigators)

    def _leave_behind(self, used: int) -> None:
        """Keep what became of the first events of the window."""
        rows = outcome.rows_of(self.inputs, self.outputs, slice(0, used), self.last)
        self._measured.frombytes(np.ascontiguousarray(rows).tobytes())
        aided = np.concatenate([self.run.aided, self._aided(used)])
        self.run.aided[:] = [float(time) for time in aided[-USUAL_AIDING:]]

    def _by_epoch(self) -> list[NDArray[Any]]:
        travelled = [self.inputs.travel] if len(self.inputs.travel) else []
        inputs = [self.inputs.time, self.inputs.increments, self.inputs.present, *travelled]
        return [*inputs, self.outputs.states, self.outputs.variances]

    def _by_event(self) -> list[NDArray[Any]]:
        return [*self.inputs[4:8], self.outputs.event_status, self.outputs.innovations]

    def _scalars(self, rows: Array) -> Array:
        """Return the scalars of the state in notes, (., memory)."""
        here = self.run.state.scalars
        begin = (here.ctypes.data - self.run.memory.ctypes.data) // here.itemsize
        return rows[:, begin : begin + len(here)]

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return all that is needed to go on, for a file."""
        used = self.last // STRIDE + 1
        counts = [self.last, self.events, self.whole, len(self.inputs.time), len(self.inputs.event_time)]
        found: dict[str, NDArray[Any]] = {
            "memory": self.run.memory,
            "notes": self._notes[:used],
            "counts": np.array(counts),
            "measured": np.array(self._measured),
            "aided": np.array(self.run.aided),
        }
        found |= {f"epochs{n}": array[: self.last + 1] for n, array in enumerate(self._by_epoch())}
        return found | {f"events{n}": array[: self.events] for n, array in enumerate(self._by_event())}

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Become the timeline of the same method whose arrays these are."""
        self.last, self.events, whole, epochs, events = (int(count) for count in arrays["counts"])
        self.whole = bool(whole)
        self._allocate(epochs, events)
        self.run.memory[:] = arrays["memory"]
        self._measured = growing("d", arrays["measured"])
        self.run.aided[:] = [float(time) for time in arrays["aided"]]
        self._notes[: len(arrays["notes"])] = arrays["notes"]
        for n, array in enumerate(self._by_epoch()):
            array[: self.last + 1] = arrays[f"epochs{n}"]
        for n, array in enumerate(self._by_event()):
            array[: self.events] = arrays[f"events{n}"]
