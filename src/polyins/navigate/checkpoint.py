"""A navigator in a file: what it was made of as JSON, what it remembers as arrays.

The numbers are those of the memory, so that a navigator which goes on from the file gives what it would have given.
"""

from __future__ import annotations

import io
import json
import operator
import typing
import zipfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from polyins.errors import InputError
from polyins.files import write_bytes
from polyins.model.findings import Finding
from polyins.model.recording import FilterOptions
from polyins.model.rig import Rig
from polyins.navigate.events import Events
from polyins.prepare.alignment import Start
from polyins.prepare.assembly import Epoch
from polyins.version import __version__

if TYPE_CHECKING:
    from cattrs import Converter

Arrays = dict[str, NDArray[Any]]

MADE, SAMPLES, EARLY, LINE, RECORD = "made", "samples.", "early.", "line.", "record."


@dataclass(frozen=True)
class Made:
    """What a navigator is made of."""

    polyins: str
    """version"""
    rig: Rig
    start: Start | None
    """None as long as it is looked for, which is not written"""
    method: str
    options: FilterOptions
    geodetic: bool
    imu: int
    delay: float
    wait: float
    counts: dict[str, int]
    first: Epoch | None
    """of which the run begins, as long as there is only one"""
    due: tuple[float, float, float, float, bool] | None
    """what the schedule of its own measurements remembers"""
    findings: tuple[Finding, ...] = ()
    """of the parts before pauses, and of those"""
    fixes: bool = False
    """whether there were any"""


@dataclass(frozen=True)
class Remembered:
    """What a navigator remembers, as arrays."""

    samples: Arrays
    """of its assembly"""
    early: Events
    """that came before its first epoch"""
    line: Arrays
    """of its timeline; empty without one"""
    record: Arrays


def write(path: Path, made: Made, remembered: Remembered) -> None:
    """Write a navigator to a file, which is whole or absent."""
    text = json.dumps(_converter().unstructure(made))
    arrays: Arrays = {MADE: np.frombuffer(text.encode(), dtype=np.uint8)}
    arrays |= {SAMPLES + name: array for name, array in remembered.samples.items()}
    arrays |= {EARLY + name: array for name, array in remembered.early._asdict().items()}
    arrays |= {LINE + name: array for name, array in remembered.line.items()}
    arrays |= {RECORD + name: array for name, array in remembered.record.items()}
    content = io.BytesIO()
    np.savez(content, allow_pickle=False, **arrays)
    write_bytes(path, content.getvalue())


def read(path: Path) -> tuple[Made, Remembered]:
    """Return what `write` was given; raise InputError for any other file."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays: Arrays = dict(file)
        values = json.loads(arrays.pop(MADE).tobytes())
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: is no checkpoint ({error}); expected a file that a navigator saved") from error
    if values["polyins"] != __version__:
        raise InputError(f"{path}: of polyins {values['polyins']}; expected one of {__version__}")
    early = Events(**_named(EARLY, arrays))
    remembered = Remembered(_named(SAMPLES, arrays), early, _named(LINE, arrays), _named(RECORD, arrays))
    return _converter().structure(values, Made), remembered


def _named(prefix: str, arrays: Arrays) -> Arrays:
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}


def _converter() -> Converter:
    """Return what turns dataclasses with arrays into JSON's values and back, each number exactly."""
    from cattrs import Converter

    converter = Converter()
    converter.register_unstructure_hook_func(_is_array, lambda array: array.tolist())
    converter.register_structure_hook_func(_is_array, lambda value, _: np.array(value))
    for plain in (float | str | None, float | Literal["auto"]):
        converter.register_structure_hook_func(partial(operator.eq, plain), lambda value, _: value)
    return converter


def _is_array(kind: object) -> bool:
    return kind is np.ndarray or typing.get_origin(kind) is np.ndarray
