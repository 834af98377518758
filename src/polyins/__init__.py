"""Navigation with several inertial measurement units.

    import polyins as pi
    recording = pi.load("drive.yaml")
    solution = pi.run(recording, method="enav-fusion")
    scores = pi.evaluate(solution, recording.reference, outages=recording.outages)

Frames: n is north-east-down, b an IMU's forward-right-down, a the array's. SI and radians inside; a name whose unit is
not SI carries it. Shapes are time first.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from polyins import datasets as datasets
    from polyins.alignment import Start as Start
    from polyins.batch import run as run
    from polyins.comparison import compare as compare
    from polyins.errors import InputError as InputError
    from polyins.evaluation.summary import summarize as evaluate
    from polyins.loading import load as load
    from polyins.navigator import Navigator as Navigator
    from polyins.recording import Recording as Recording
    from polyins.rig import Imu as Imu
    from polyins.rig import NoiseGrade as NoiseGrade
    from polyins.rig import Rig as Rig
    from polyins.simulation.scenario import simulate as simulate
    from polyins.solution import Solution as Solution

_HOMES = {
    "InputError": "errors",
    "Imu": "rig",
    "Navigator": "navigator",
    "NoiseGrade": "rig",
    "Recording": "recording",
    "Rig": "rig",
    "Solution": "solution",
    "Start": "alignment",
    "compare": "comparison",
    "load": "loading",
    "run": "batch",
    "simulate": "simulation.scenario",
}

__all__ = ["__version__", "datasets", "evaluate", *_HOMES]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that the command line starts fast."""
    if name == "datasets":
        return importlib.import_module("polyins.datasets")
    if name == "evaluate":
        return importlib.import_module("polyins.evaluation.summary").summarize
    if name in _HOMES:
        return getattr(importlib.import_module(f"polyins.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'polyins' has no attribute {name!r}")
