"""The configuration as typed, validated models: what a polyins YAML file may say, with units and defaults.

A key whose unit is not SI carries it. An unknown key is an error that names the nearest known one.
"""

from polyins.config.checks import Checks
from polyins.config.columns import (
    AccelColumns,
    AttitudeColumns,
    FineTime,
    GyroColumns,
    HeadingColumn,
    ImuColumns,
    PositionColumns,
    RowChoice,
    RowsOf,
    StdColumns,
    TimeColumn,
    TrackColumns,
    VelocityColumns,
)
from polyins.config.fields import NotNegative, Number, Pair, PerAxis, Positive, PositiveSpread, Section, Spread, Triple
from polyins.config.file import Config, Filter, Standstill, parse, validated
from polyins.config.imu import NOISE_BY_NAME, NOISE_GRADES, ImuEntry, ImuSettings, InitialErrors, InitialStd, Noise
from polyins.config.positions import GeodeticPoint, GnssEntry, ReferenceEntry
from polyins.config.rolling import Rolling, SpinAxis, WheelEntry
from polyins.config.sensor_noise import KNOWN_IMUS
from polyins.config.sensors import HeadingEntry, HeightEntry, OdometerEntry, SensorColumns, SensorEntry
from polyins.config.timing import Outages, OutageSchedule, StartEntry, StartPosition

__all__ = [
    "KNOWN_IMUS",
    "NOISE_BY_NAME",
    "NOISE_GRADES",
    "AccelColumns",
    "AttitudeColumns",
    "Checks",
    "Config",
    "Filter",
    "FineTime",
    "GeodeticPoint",
    "GnssEntry",
    "GyroColumns",
    "HeadingColumn",
    "HeadingEntry",
    "HeightEntry",
    "ImuColumns",
    "ImuEntry",
    "ImuSettings",
    "InitialErrors",
    "InitialStd",
    "Noise",
    "NotNegative",
    "Number",
    "OdometerEntry",
    "OutageSchedule",
    "Outages",
    "Pair",
    "PerAxis",
    "PositionColumns",
    "Positive",
    "PositiveSpread",
    "ReferenceEntry",
    "Rolling",
    "RowChoice",
    "RowsOf",
    "Section",
    "SensorColumns",
    "SensorEntry",
    "SpinAxis",
    "Spread",
    "Standstill",
    "StartEntry",
    "StartPosition",
    "StdColumns",
    "TimeColumn",
    "TrackColumns",
    "Triple",
    "VelocityColumns",
    "WheelEntry",
    "parse",
    "validated",
]
