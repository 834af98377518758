"""The configuration as typed, validated models: what a polyins YAML file may say, with units and defaults.

A key whose unit is not SI carries it. An unknown key is an error that names the nearest known one.
"""

from polyins.config.columns import (
    AccelColumns,
    AttitudeColumns,
    GyroColumns,
    ImuColumns,
    PositionColumns,
    StdColumns,
    TimeColumn,
    TrackColumns,
    VelocityColumns,
)
from polyins.config.fields import Number, Pair, PerAxis, Positive, Section, Spread, Triple
from polyins.config.file import Config, Filter, parse, validated
from polyins.config.imu import NOISE_GRADES, ImuEntry, ImuSettings, InitialErrors, InitialStd, Noise
from polyins.config.positions import GnssEntry, ReferenceEntry
from polyins.config.timing import Outages, OutageSchedule, Start, StartPosition

__all__ = [
    "NOISE_GRADES",
    "AccelColumns",
    "AttitudeColumns",
    "Config",
    "Filter",
    "GnssEntry",
    "GyroColumns",
    "ImuColumns",
    "ImuEntry",
    "ImuSettings",
    "InitialErrors",
    "InitialStd",
    "Noise",
    "Number",
    "OutageSchedule",
    "Outages",
    "Pair",
    "PerAxis",
    "PositionColumns",
    "Positive",
    "ReferenceEntry",
    "Section",
    "Spread",
    "Start",
    "StartPosition",
    "StdColumns",
    "TimeColumn",
    "TrackColumns",
    "Triple",
    "VelocityColumns",
    "parse",
    "validated",
]
