"""The whole file: filled in, validated, and what is wrong with it said in the user's words."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import BeforeValidator, Field, ValidationError, model_validator
from pydantic_core import ErrorDetails

from polyins.config.checks import Checks
from polyins.config.fields import AT_KEY, Positive, Section, number
from polyins.config.imu import ImuEntry, ImuSettings
from polyins.config.positions import GnssEntry, ReferenceEntry
from polyins.config.rolling import Rolling
from polyins.config.sensors import HeadingEntry, HeightEntry, OdometerEntry
from polyins.config.timing import Outages, StartEntry
from polyins.config.units import UNITS, in_unit
from polyins.config.yaml_document import Document, Key
from polyins.errors import InputError
from polyins.model.recording import FilterOptions, StandstillOptions

REST = StandstillOptions()

SomeSection = TypeVar("SomeSection", bound=Section)


class Standstill(Section):
    """Updates by zero velocity and zero rate where an array without wheels is found at rest."""

    interval_s: Positive = REST.interval
    """whether it rests is judged over this time, s; the longer, the rarer a false standstill"""
    velocity_std_m_s: Positive = REST.velocity_std
    """m/s; the larger, the less a standstill weighs"""
    rate_std_deg_s: Positive = in_unit(UNITS["deg_s"], REST.rate_std)
    """of the mean rate, deg/s; the larger, the less a standstill weighs; above what an idling engine shakes"""


Share = Annotated[float, BeforeValidator(number), Field(ge=0.0, le=1.0)]


class Filter(Section):
    """What the filter is told beyond the sensors."""

    gate_limit: Positive | None = FilterOptions.gate_limit
    """a measurement weighs less whose normalized innovation squared, at fourfold prediction std,
    exceeds this; the larger, the fewer do; null: none does, and no receiver is doubted"""
    gnss_snap_s: Annotated[float, BeforeValidator(number), Field(ge=0.0, le=0.1)] = FilterOptions.gnss_snap
    """a fix nearer than this to an IMU epoch is applied at that epoch, s; the larger, the fewer intervals are split,
    and the farther a fix is moved"""
    gravity_m_s2: Positive = FilterOptions.gravity
    """on a local tangent plane only, m/s^2; one that is too large shows as an acceleration downwards"""
    common_share: Share = FilterOptions.common_share
    """of the variances of noise and slow errors, what the IMUs of an array have in common, 0 to 1; the larger, the less
    the array is believed to be better than one of them; 1: not at all, and no IMU is told from the others (paper A)"""
    relative_interval_s: Positive | None = FilterOptions.relative_interval
    """s between two comparisons of the IMUs of an array with their mean; the longer, the later a sick one is found;
    null: they are not compared"""
    own_noise: Literal["auto"] | Positive = FilterOptions.own_noise
    """times the variances that the IMUs are said to have of their own; the larger, the more aids weigh; auto: as the
    comparisons show, at least 1"""
    exclusion: bool = FilterOptions.exclusion
    """an IMU that deviates from the others by more than they do counts no more, until it agrees again"""
    rolling: Rolling = Rolling()
    """how wheels aid the filter"""
    standstill: Standstill | None = None
    """updates at rest, of an array without wheels; null: none"""


class Config(Section):
    """The whole file."""

    name: str = ""
    """of the recording; without it the file's"""
    dataset: str | None = None
    """relative paths count from this data set's folder instead of the file's"""
    imu_defaults: ImuSettings | None = None
    """holds for each IMU that does not say otherwise"""
    imus: Annotated[tuple[ImuEntry, ...], Field(min_length=1)]
    """the IMUs of the array"""
    gnss: GnssEntry | None = None
    """the positions that aid the filter"""
    height: HeightEntry | None = None
    """heights of a barometer, or known ones"""
    heading: HeadingEntry | None = None
    """headings of two antennas, a compass or another system"""
    odometer: OdometerEntry | None = None
    """speeds of an encoder; that the vehicle does not slip"""
    reference: ReferenceEntry | None = None
    """what the solution is judged by"""
    start: StartEntry = StartEntry()
    """how the navigation state is found at the start"""
    outages: Outages = ()
    """intervals in which GNSS is withheld: a schedule, or a list of [from, to] in s"""
    filter: Filter = Filter()
    """what the filter is told beyond the sensors"""
    checks: Checks = Checks()
    """which judgements of the data do not count"""

    @model_validator(mode="before")
    @classmethod
    def _fill_imus(cls, values: Any) -> Any:
        """Complete each IMU by the defaults and by a name."""
        if not isinstance(values, dict) or not isinstance(values.get("imus"), list):
            return values
        defaults = values.get("imu_defaults")
        imus = [
            {"name": f"imu{number}", **_merged(defaults, imu)} if isinstance(imu, dict) else imu
            for number, imu in enumerate(values["imus"], 1)
        ]
        return {**values, "imus": imus}

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [imu.name for imu in self.imus]
        for index, name in enumerate(names):
            if name in names[:index]:
                raise ValueError(f"imus: two are named {name!r}; expected a name of its own for each")
            if not re.fullmatch(r"\w[\w .+-]*", name):
                raise ValueError(f"imus: one is named {name!r}; expected letters, digits, blanks, and . _ + -")
        return self


def parse(document: Document) -> Config:
    """Validate what a configuration says; raises InputError as `validated` does."""
    return validated(Config, document)


def validated(model: type[SomeSection], document: Document) -> SomeSection:
    """Validate what a YAML file says as a section of the given kind.

    Raises InputError that names file, line and key of the first thing wrong.
    """
    if document.duplicate:
        raise InputError(f"{document.duplicate}; expected each key once")
    try:
        return model.model_validate(document.values)
    except ValidationError as error:
        raise InputError(_explain(error.errors()[0], document)) from error


def _merged(defaults: object, given: dict[str, Any]) -> dict[str, Any]:
    """Lay `given` over `defaults`, mappings key by key."""
    if not isinstance(defaults, dict):
        return given
    both = {**defaults, **given}
    for key, value in given.items():
        if isinstance(value, dict):
            both[key] = _merged(defaults.get(key), value)
    return both


def _explain(error: ErrorDetails, document: Document) -> str:
    """Say in the user's words where validation failed and what was expected."""
    context = error.get("ctx", {})
    keys: list[Key] = [key for key in error["loc"] if key not in ("schedule", "list", "str", "int")]
    if "key" in context:
        keys.append(context["key"])
    place = document.place(keys)
    kind = error["type"]
    if kind == "missing":
        return f"{place}: is missing; expected it in this mapping"
    if kind == "literal_error":
        return f"{place}: is {error['input']!r}; expected {context['expected']}"
    if kind == "too_short":
        return f"{place}: is empty; expected at least one"
    if kind in ("tuple_type", "model_type", "dict_type"):
        return f"{place}: is {error['input']!r}; expected a {'list' if kind == 'tuple_type' else 'mapping'}"
    message = error["msg"].removeprefix("Value error, ")
    if kind in ("unknown_key", AT_KEY) or not message.startswith(("expected", "Input should be")):
        return f"{place}: {message[0].lower()}{message[1:]}"
    return f"{place}: is {error['input']!r}; {message.replace('Input should be', 'expected')}"
