"""A navigator killed at random points and resumed from its checkpoint: `python benchmarks/kill_and_resume.py`.

A simulated array is played through it, fixes 0.2 s late. At each of 1,000 random events it is saved, forgotten, read
back and given the rest; then every state of the last second, its std and the counts must have the bits of the run
without interruption.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np

import polyins as pi
from polyins.prepare import alignment, timesync
from polyins.simulation.scenario import Board, Scenario

POINTS, LATE_S = 1000, 0.2
METHODS = ("enav-fusion", "nav-fusion")


def events(recording: pi.Recording) -> list[tuple[float, int, int]]:
    """Return arrival, IMU (-1: GNSS) and row of every sample and fix in the order of arrival."""
    gnss = recording.gnss
    assert gnss is not None
    found = [(float(time), i, row) for i, imu in enumerate(recording.imus) for row, time in enumerate(imu.time)]
    found += [(float(time) + LATE_S, -1, row) for row, time in enumerate(gnss.time)]
    return sorted(found)


def play(navigator: pi.Navigator, recording: pi.Recording, played: list[tuple[float, int, int]]) -> None:
    """Hand the events over."""
    gnss = recording.gnss
    assert gnss is not None
    for _, imu, row in played:
        if imu < 0:
            navigator.gnss(gnss.time[row], gnss.position[row], gnss.position_std[row])
        else:
            stream = recording.imus[imu]
            navigator.imu(stream.time[row], stream.dtheta[row], stream.dvel[row], imu)


def bits(navigator: pi.Navigator) -> list[bytes]:
    """Return everything that can be read of the last second."""
    found = []
    for state in navigator.history():
        for value in (state.time, state.position, state.velocity, state.attitude, state.position_std):
            found.append(np.asarray(value).tobytes())
        found += [state.velocity_std.tobytes(), state.phi_covariance.tobytes()]
    return [*found, repr(sorted(navigator.counts.items())).encode()]


def differing(recording: pi.Recording, method: str, folder: Path) -> int:
    """Return after how many of the interruptions anything differed."""
    start = alignment.find_start(recording, timesync.align(recording.imus))
    played = [event for event in events(recording) if event[0] > start.time - 1.0]
    played = played[: next(k for k, event in enumerate(played) if event[0] > start.time + 3.0)]
    whole = pi.Navigator(recording.rig, start, method=method)
    play(whole, recording, played)
    expected, differ = bits(whole), 0
    for point in np.random.default_rng(1).integers(0, len(played), POINTS):
        navigator = pi.Navigator(recording.rig, start, method=method)
        play(navigator, recording, played[:point])
        navigator.save(folder / "checkpoint")
        navigator = pi.Navigator.resume(folder / "checkpoint")
        play(navigator, recording, played[point:])
        differ += bits(navigator) != expected
    return differ


def main() -> None:
    """Print the figures as JSON."""
    recording = pi.simulate(Scenario(duration_s=30, static_s=10, rate_hz=50, imus=Board(count=3)))
    with tempfile.TemporaryDirectory() as folder:
        figures = {method: differing(recording, method, Path(folder)) for method in METHODS}
    print(json.dumps({"points": POINTS, "differing": figures}, indent=2))


if __name__ == "__main__":
    main()
