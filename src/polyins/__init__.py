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

from polyins.version import __version__ as __version__

if TYPE_CHECKING:
    from polyins.errors import InputError as InputError
    from polyins.evaluation.summary import summarize as evaluate
    from polyins.model.recording import AidingStream as AidingStream
    from polyins.model.recording import GnssStream as GnssStream
    from polyins.model.recording import ImuStream as ImuStream
    from polyins.model.recording import Recording as Recording
    from polyins.model.recording import StartOptions as StartOptions
    from polyins.model.rig import AidingSensor as AidingSensor
    from polyins.model.rig import Imu as Imu
    from polyins.model.rig import NoiseGrade as NoiseGrade
    from polyins.model.rig import Rig as Rig
    from polyins.model.rig import Wheel as Wheel
    from polyins.model.solution import Solution as Solution
    from polyins.navigate.batch import find_start as find_start
    from polyins.navigate.batch import run as run
    from polyins.navigate.navigator import Navigator as Navigator
    from polyins.prepare.alignment import Start as Start
    from polyins.reading import datasets as datasets
    from polyins.reading.loading import load as load
    from polyins.simulation.run import simulate as simulate
    from polyins.tools.comparison import compare as compare
    from polyins.tools.export.writing import ExportOptions as ExportOptions
    from polyins.tools.export.writing import export as export

_HOMES = {
    "AidingSensor": "model.rig",
    "AidingStream": "model.recording",
    "ExportOptions": "tools.export.writing",
    "GnssStream": "model.recording",
    "Imu": "model.rig",
    "ImuStream": "model.recording",
    "InputError": "errors",
    "Navigator": "navigate.navigator",
    "NoiseGrade": "model.rig",
    "Recording": "model.recording",
    "Rig": "model.rig",
    "Solution": "model.solution",
    "Start": "prepare.alignment",
    "StartOptions": "model.recording",
    "Wheel": "model.rig",
    "compare": "tools.comparison",
    "datasets": "reading.datasets:",
    "evaluate": "evaluation.summary:summarize",
    "export": "tools.export.writing",
    "find_start": "navigate.batch",
    "load": "reading.loading",
    "run": "navigate.batch",
    "simulate": "simulation.run",
}

__all__ = ["__version__", "evaluate", *(name for name in _HOMES if name != "evaluate")]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that the command line starts fast."""
    if name not in _HOMES:
        raise AttributeError(f"module 'polyins' has no attribute {name!r}")
    home, colon, attribute = _HOMES[name].partition(":")
    module = importlib.import_module(f"polyins.{home}")
    return module if colon and not attribute else getattr(module, attribute or name)
