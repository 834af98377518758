"""Noise figures as a JSON document, as rows of a table, and as the lines of a configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from polyins.calibration.array_gain import AT_S, ArrayGain, SensorGain
from polyins.calibration.imu_noise import AXES, SENSORS, USUAL_GRADE, AxisNoise, ImuNoise, Sensor, coefficients
from polyins.calibration.noise_model import Coefficient
from polyins.formats.documents import plain
from polyins.model.findings import Finding
from polyins.model.rig import DEG, HOUR, MGAL
from polyins.version import __version__

ROOT_HOUR = HOUR**0.5


@dataclass(frozen=True)
class Quantity:
    """One of the three coefficients: its name in SI and as datasheets have it."""

    si: str
    datasheet: str
    unit: str
    """of the datasheet"""
    per_unit: float
    """how much of SI it is"""


QUANTITIES: dict[Sensor, tuple[Quantity, Quantity, Quantity]] = {
    "gyro": (
        Quantity("angle_random_walk_rad_sqrt_s", "angle_random_walk_deg_sqrt_h", "deg/sqrt(h)", DEG / ROOT_HOUR),
        Quantity("bias_instability_rad_s", "bias_instability_deg_h", "deg/h", DEG / HOUR),
        Quantity(
            "rate_random_walk_rad_s_sqrt_s", "rate_random_walk_deg_h_sqrt_h", "deg/h/sqrt(h)", DEG / HOUR / ROOT_HOUR
        ),
    ),
    "accel": (
        Quantity("velocity_random_walk_m_s_sqrt_s", "velocity_random_walk_m_s_sqrt_h", "m/s/sqrt(h)", 1.0 / ROOT_HOUR),
        Quantity("bias_instability_m_s2", "bias_instability_mgal", "mGal", MGAL),
        Quantity(
            "acceleration_random_walk_m_s2_sqrt_s",
            "acceleration_random_walk_mgal_sqrt_h",
            "mGal/sqrt(h)",
            MGAL / ROOT_HOUR,
        ),
    ),
}
RATE_UNITS: dict[Sensor, str] = {"gyro": "rad_s", "accel": "m_s2"}
COLUMNS = ["IMU, axis", "random walk", "bias instability", "rate random walk"]


@dataclass(frozen=True)
class NoiseFigures:
    """What a recording says of the noise of its IMUs."""

    imus: tuple[ImuNoise, ...]
    array: ArrayGain | None
    """None: one IMU, or several that were not at rest together"""
    findings: tuple[Finding, ...]


def document(figures: NoiseFigures) -> dict[str, Any]:
    """Return the document that `polyins allan --json` prints."""
    found: dict[str, Any] = plain(
        {
            "polyins": __version__,
            "imus": {one.rest.name: _imu(one) for one in figures.imus},
            "array": None if figures.array is None else _array(figures.array),
            "configuration": configuration(figures),
            "findings": [finding.document() for finding in figures.findings],
        }
    )
    return found


def _imu(one: ImuNoise) -> dict[str, Any]:
    rest = one.rest
    return {
        "rate_hz": 1.0 / rest.interval,
        "recorded_s": rest.recorded_s,
        "rest_s": rest.used_s,
        "stretches_s": [[stretch.begin, stretch.end] for stretch in rest.stretches],
        **{
            sensor: {axis: _axis(of, sensor) for axis, of in zip(AXES, one.axes[sensor], strict=True)}
            for sensor in SENSORS
        },
        "noise": one.configuration(),
    }


def _axis(axis: AxisNoise, sensor: Sensor) -> dict[str, Any]:
    each = list(zip(QUANTITIES[sensor], coefficients(axis.noise), strict=True))
    curve, unit = axis.curve, RATE_UNITS[sensor]
    return {
        **{figure.si: _coefficient(one, 1.0) for figure, one in each},
        "datasheet": {figure.datasheet: _coefficient(one, figure.per_unit) for figure, one in each},
        "fitted_up_to_hz": axis.noise.up_to_hz,
        "excess_variance": axis.noise.excess,
        "lines_hz": list(axis.noise.lines_hz[:5]),
        "allan": {
            "tau_s": curve.tau,
            f"deviation_{unit}": curve.deviation,
            f"low_{unit}": curve.low,
            f"high_{unit}": curve.high,
        },
    }


def _coefficient(one: Coefficient, unit: float) -> dict[str, float | None]:
    return {"value": None if one.value is None else one.value / unit, "low": one.low / unit, "high": one.high / unit}


def _array(array: ArrayGain) -> dict[str, Any]:
    return {
        "imus": array.imus,
        "sqrt_n": array.imus**0.5,
        "rest_s": array.rest_s,
        "gyro": _gain(array.gyro, "rad_s"),
        "accel": _gain(array.accel, "m_s2"),
    }


def _gain(sensor: SensorGain, unit: str) -> dict[str, Any]:
    row = sensor.at(AT_S)
    return {
        "tau_s": sensor.tau[row],
        "gain": sensor.gain[row],
        "low": sensor.low[row],
        "high": sensor.high[row],
        "common_share": sensor.common_share[row],
        "curve": {
            "tau_s": sensor.tau,
            "gain": sensor.gain,
            "low": sensor.low,
            "high": sensor.high,
            "common_share": sensor.common_share,
            f"single_rms_{unit}": sensor.single,
            f"mean_{unit}": sensor.mean,
        },
    }


def rows(figures: NoiseFigures) -> list[list[str]]:
    """Return a table's rows, each as long as `COLUMNS`: estimates with their 95 % interval, in datasheet units."""
    return [
        [f"{one.rest.name}  {sensor} {axis}", *_cells(sensor, of)]
        for one in figures.imus
        for sensor in SENSORS
        for axis, of in zip(AXES, one.axes[sensor], strict=True)
    ]


def _cells(sensor: Sensor, axis: AxisNoise) -> list[str]:
    return [_cell(one, figure) for figure, one in zip(QUANTITIES[sensor], coefficients(axis.noise), strict=True)]


def _cell(one: Coefficient, figure: Quantity) -> str:
    low, high = one.low / figure.per_unit, one.high / figure.per_unit
    if one.value is None:
        return f"at most {high:.3g} {figure.unit}"
    return f"{one.value / figure.per_unit:.3g} ({low:.3g} to {high:.3g}) {figure.unit}"


def sentences(array: ArrayGain) -> list[str]:
    """Say what an array gains."""
    found = []
    for name, of in (("gyros", array.gyro), ("accelerometers", array.accel)):
        parts = [
            f"{of.gain[row]:.2f} ({of.low[row]:.2f} to {of.high[row]:.2f}) times at {of.tau[row]:.2g} s, where"
            f" {100 * of.common_share[row]:.0f} % of the variance is common"
            for row in dict.fromkeys([of.at(AT_S), len(of.tau) - 1])
        ]
        begin = f"the mean of {array.imus} {name} has less noise than one of them"
        found.append(f"{begin}: {'; '.join(parts)}; sqrt(N) = {array.imus**0.5:.2f}")
    return found


def configuration(figures: NoiseFigures) -> str:
    """Return the lines of a configuration to paste: the noise of each IMU, in the order of `imus`."""
    lines = ["imus:"]
    for one in figures.imus:
        lines += [f"  - name: {one.rest.name}", "    noise:", f"      grade: {USUAL_GRADE}  # what is not said below"]
        for key, value in one.configuration().items():
            lines.append(
                f"      {key}: {value:g}" if value is not None else f"      # {key}: not told by this recording"
            )
    return "\n".join(lines) + "\n"


def worst(figures: Sequence[Finding]) -> list[str]:
    """Return findings as sentences, what is more than a note first."""
    return [one.sentence for one in sorted(figures, key=lambda one: ("serious", "doubt", "note").index(one.severity))]
