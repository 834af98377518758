"""From sections of the configuration to what the model holds in SI, and back: the unit stands in the name of the key.

A key is the name of a field with its unit behind it: `rate_std_deg_s` gives `rate_std` in rad/s. A section whose keys
are called otherwise says so in `FIELDS`. A section within a section gives the dataclass within the dataclass.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, NamedTuple, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from polyins.config.fields import Section
from polyins.model.rig import DEG, HOUR, MGAL, PPM, STANDARD_GRAVITY

Array = NDArray[np.float64]
Kind = TypeVar("Kind")


class Unit(NamedTuple):
    """A value in SI is that in the unit, times the one, by the other: in that order to the last digit."""

    times: float = 1.0
    by: float = 1.0


SI = Unit()
UNITS = {
    "s": SI,
    "h": Unit(HOUR),
    "hz": SI,
    "m": SI,
    "m_s": SI,
    "m_s2": SI,
    "m_sqrt_s": SI,
    "deg": Unit(DEG),
    "deg_s": Unit(DEG),
    "deg_h": Unit(DEG, HOUR),
    "deg_sqrt_h": Unit(DEG, HOUR**0.5),
    "m_s_sqrt_h": Unit(1.0, HOUR**0.5),
    "mgal": Unit(MGAL),
    "ppm": Unit(PPM),
    "deg_per_m_s2": Unit(DEG),
    "deg_h_sqrt_h": Unit(DEG, HOUR**1.5),
    "mgal_sqrt_h": Unit(MGAL, HOUR**0.5),
    "deg_s_g": Unit(DEG, STANDARD_GRAVITY),
    "mg": Unit(1e-3, 1.0 / STANDARD_GRAVITY),
    "mg_g2": Unit(1e-3, STANDARD_GRAVITY),
}
"""by the end of a key"""


@cache
def split(key: str) -> tuple[str, Unit]:
    """Return the name of a key without its unit, and the unit."""
    endings = [f"_{unit}" for unit in UNITS if key.endswith(f"_{unit}")]
    longest = max(endings, key=len, default="")
    return key.removesuffix(longest), UNITS[longest[1:]] if longest else SI


def matches(section: type[Section], kind: type[Any]) -> Mapping[str, str]:
    """Return which key of a section gives which field of a dataclass."""
    names = {item.name for item in fields(kind)}
    stems = {key: split(key)[0] for key in section.model_fields}
    found = {key: section.FIELDS.get(stem, stem) for key, stem in stems.items()}
    return {key: name for key, name in found.items() if name in names}


def key_of(section: type[Section], stem: str) -> str:
    """Return the key that has this name before its unit."""
    return next(key for key in section.model_fields if split(key)[0] == stem)


def read(section: Section, kind: type[Kind], /, **given: Any) -> Kind:
    """Return what a section says as the dataclass of the model; `given` are fields that are known otherwise."""
    hints = get_type_hints(kind)
    said = {
        name: _from_unit(getattr(section, key), split(key)[1], hints[name])
        for key, name in matches(type(section), kind).items()
        if name not in given
    }
    return kind(**said, **given)


def in_si(section: Section, key: str) -> Any:
    """Return the value of a key in SI."""
    return _from_unit(getattr(section, key), split(key)[1], Array)


def write(section: type[Section], value: Any) -> dict[str, Any]:
    """Return the mapping from which `read` makes a value; what is a default is left out."""
    entry = {}
    for key, name in matches(section, type(value)).items():
        field, held = section.model_fields[key], getattr(value, name)
        within = _section_of(field.annotation)
        said = in_unit(split(key)[1], held) if within is None or held is None else write(within, held)
        if field.is_required() or not _goes_without(said, field.get_default()):
            entry[key] = said
    return entry


def _goes_without(said: Any, usual: Any) -> bool:
    if isinstance(usual, Section):
        return not said
    return bool(said == (list(usual) if isinstance(usual, tuple) else usual))


def in_unit(unit: Unit, value: Any) -> Any:
    """Return an SI value in a unit, arrays as lists: the shortest number that comes to the same value."""
    if isinstance(value, np.ndarray | tuple | list):
        return [in_unit(unit, item) for item in value]
    if not isinstance(value, float):
        return value
    exact = float(value) * unit.by / unit.times
    shown = (float(f"{exact:.{digits}g}") for digits in (15, 16))
    return next((number for number in shown if _si(number, unit) == value), exact)


def _si(value: Any, unit: Unit) -> Any:
    return value if unit == SI else value * unit.times / unit.by


def _from_unit(value: Any, unit: Unit, hint: Any) -> Any:
    kinds = (hint, *get_args(hint))
    if isinstance(value, Section):
        return read(value, next(kind for kind in kinds if isinstance(kind, type) and is_dataclass(kind)))
    if isinstance(value, tuple):
        return _si(np.array(value, dtype=float), unit) if Array in kinds else tuple(_si(item, unit) for item in value)
    return _si(value, unit) if isinstance(value, float) else value


def _section_of(annotation: Any) -> type[Section] | None:
    kinds = (annotation, *(() if get_origin(annotation) is tuple else get_args(annotation)))
    return next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Section)), None)
