"""The kinds of value that a configuration holds, and what all its sections have in common."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, model_validator
from pydantic_core import PydanticCustomError


def number(value: object) -> float:
    """Take numbers only: text and true are wrong even where they could be converted."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("expected a number")
    return float(value)


def _three(value: object) -> tuple[float, ...]:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError("expected three numbers, like [0, 0, 0]")
    return tuple(number(item) for item in value)


def _one_or_three(value: object) -> tuple[float, ...]:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (float(value),) * 3
    try:
        return _three(value)
    except ValueError as error:
        raise ValueError("expected one number or three, like [0, 0, 0]") from error


def _two(value: object) -> tuple[float, ...]:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise ValueError("expected two numbers, like [0, 10]")
    return tuple(number(item) for item in value)


def _not_negative(value: Any) -> Any:
    if min(value) < 0.0:
        raise ValueError("expected no negative number")
    return value


def _all_positive(value: tuple[float, ...]) -> tuple[float, ...]:
    if min(value) <= 0.0:
        raise ValueError("expected numbers above zero")
    return value


def _positive(value: float) -> float:
    if value <= 0.0:
        raise ValueError("expected a number above zero")
    return value


def _not_below_zero(value: float) -> float:
    if value < 0.0:
        raise ValueError("expected a number that is not negative")
    return value


Number = Annotated[float, BeforeValidator(number)]
NotNegative = Annotated[float, BeforeValidator(lambda value: _not_below_zero(number(value)))]
Positive = Annotated[float, BeforeValidator(lambda value: _positive(number(value)))]
Pair = Annotated[tuple[float, float], BeforeValidator(_two)]
Triple = Annotated[tuple[float, float, float], BeforeValidator(_three)]
Matrix = tuple[Triple, Triple, Triple]
"""three rows of three"""
PerAxis = Annotated[tuple[float, float, float], BeforeValidator(_one_or_three)]
"""One number or three; held as three."""
Spread = Annotated[tuple[float, float, float], BeforeValidator(lambda value: _not_negative(_one_or_three(value)))]
"""Standard deviations: one number or three, none negative; held as three."""
PositiveSpread = Annotated[
    tuple[float, float, float], BeforeValidator(lambda value: _all_positive(_one_or_three(value)))
]
"""Standard deviations that a filter divides by: one number or three above zero; held as three."""
Column = str | int
"""A column's name, or its number counted from 1 where a file has no header."""
ThreeColumns = tuple[Column, Column, Column]

ORIGIN = (0.0, 0.0, 0.0)
IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

AT_KEY = "at_key"
"""Type of an error whose context names the `key` of the section that is to blame, and the `problem`."""


def blame(key: str, problem: str) -> PydanticCustomError:
    """Return the error to raise from a validator of a whole section for one of its keys."""
    return PydanticCustomError(AT_KEY, "{problem}", {"key": key, "problem": problem})


class Section(BaseModel):
    """A mapping in the file."""

    FIELDS: ClassVar[Mapping[str, str]] = {}
    """what the model calls the values of keys, without their units, where it calls them otherwise"""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    @model_validator(mode="before")
    @classmethod
    def _know_every_key(cls, values: Any) -> Any:
        for key in values if isinstance(values, dict) else ():
            if key not in cls.model_fields:
                similar = difflib.get_close_matches(key, cls.model_fields, n=1, cutoff=0.5)
                hint = f"did you mean {similar[0]}?" if similar else f"expected one of {', '.join(cls.model_fields)}"
                raise PydanticCustomError("unknown_key", "unknown key; {hint}", {"key": key, "hint": hint})
        return values
