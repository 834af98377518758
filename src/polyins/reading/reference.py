"""The reference that a solution is judged by: a file of positions, or that of a configuration."""

from __future__ import annotations

from pathlib import Path

from polyins.checks import stream_checks
from polyins.errors import InputError
from polyins.formats.recognize import data_format
from polyins.formats.rows import Track
from polyins.model.recording import Heights, Reference
from polyins.model.solution import Solution
from polyins.reading.guess import read_stream
from polyins.reading.loading import load


def load_reference(path: str | Path, solution: Solution) -> Reference:
    """Read a file of positions, or the reference of a configuration, to judge a solution by.

    A file of positions is taken to describe the solution's own point, on its clock. Raises InputError if it has no
    time in common with the solution, or positions of the other kind (geodetic, local plane).
    """
    if data_format(path) == "configuration":
        recording = load(path)
        if recording.reference is None:
            raise InputError(f"{path}: has no reference; expected that section, or a file of positions")
        reference, geodetic = recording.reference, recording.geodetic
    else:
        track, _ = read_stream(path)
        if not isinstance(track, Track):
            raise InputError(f"{path}: holds IMU data; expected positions")
        stream_checks.check_track(track, "reference")
        stream_checks.check_within(track.source, "reference", track.time, (solution.time[0], solution.time[-1]))
        above: Heights = "sea-level" if track.above_sea else "ellipsoidal"
        if data_format(path) == "table":
            above = solution.heights
        reference = Reference(track.time, track.position, track.velocity, track.attitude, solution.point, above)
        geodetic = track.geodetic
    if geodetic and {reference.heights, solution.heights} == {"sea-level", "ellipsoidal"}:
        raise InputError(
            f"{path}: heights are {reference.heights}, those of the solution {solution.heights}; expected both alike"
        )
    if geodetic != solution.geodetic:
        kinds = {True: "latitude and longitude", False: "metres on a local plane"}
        raise InputError(f"{path}: holds {kinds[geodetic]}; expected {kinds[solution.geodetic]} as in the solution")
    return reference
