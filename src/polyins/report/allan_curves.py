"""Allan deviations of IMUs, the noise that was fitted to them, and what an array gains, over averaging time."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import numpy as np

from polyins.calibration.array_gain import ArrayGain, SensorGain
from polyins.calibration.imu_noise import AXES, AxisNoise, ImuNoise, Sensor
from polyins.calibration.noise_listing import NoiseFigures
from polyins.model.rig import DEG, HOUR, MGAL
from polyins.report.figure import Figure, Trace, panels, scatter
from polyins.report.palette import REFERENCE, imu_colours, transparent
from polyins.report.style import finish

ROWS: tuple[tuple[Sensor, str, float], ...] = (
    ("gyro", "gyro (deg/h)", DEG / HOUR),
    ("accel", "accelerometer (mGal)", MGAL),
)
TAU_TITLE = "averaging time (s)"
FEW = 4
"""IMUs whose intervals are drawn"""


def allan_figure(figures: NoiseFigures) -> Figure:
    """Draw the Allan deviation of each axis: measured with its 95 % interval, and dashed what was fitted."""
    figure = panels(2, 3, between_rows=0.06, between_columns=0.06)
    colours = imu_colours(len(figures.imus))
    for row, (sensor, _, unit) in enumerate(ROWS):
        for column in range(3):
            for one, colour in zip(figures.imus, colours, strict=True):
                axis, first = one.axes[sensor][column], row == column == 0
                banded = len(figures.imus) <= FEW
                figure.add(_traces(one, axis, (unit, colour), first=first, banded=banded), 3 * row + column)
    for k, below in enumerate(figure.axes("x")):
        title = {"title": {"text": TAU_TITLE}} if k >= 3 else {}
        below.update(type="log", exponentformat="power", **title)
    for k, beside in enumerate(figure.axes("y")):
        title = {"title": {"text": ROWS[k // 3][1]}} if k % 3 == 0 else {}
        beside.update(type="log", exponentformat="power", **title)
    figure.update_layout(
        annotations=[_heading(name, axis["domain"]) for name, axis in zip(AXES, figure.axes("x"), strict=False)]
    )
    return finish(figure, height=760)


def gain_figure(array: ArrayGain) -> Figure:
    """Draw how much less noise the mean has than one IMU, and sqrt(N)."""
    figure = Figure()
    for name, of, colour in (("gyros", array.gyro, "#0072B2"), ("accelerometers", array.accel, "#D55E00")):
        figure.data += _gains(name, of, colour)
    ends = [float(array.gyro.tau[0]), float(array.gyro.tau[-1])]
    line = {"color": REFERENCE, "dash": "dash", "width": 1.2}
    figure.data.append(scatter(x=ends, y=[array.imus**0.5] * 2, name="sqrt(N)", mode="lines", line=line))
    figure.update_layout(
        xaxis={"type": "log", "title": {"text": TAU_TITLE}, "exponentformat": "power"},
        yaxis={"title": {"text": "noise of one over that of the mean"}, "rangemode": "tozero"},
    )
    return finish(figure, height=400)


def _traces(one: ImuNoise, axis: AxisNoise, drawn: tuple[float, str], *, first: bool, banded: bool) -> Iterator[Trace]:
    unit, colour = drawn
    name, curve = escape(one.rest.name), axis.curve
    if banded:
        yield _band(curve.tau, curve.low / unit, curve.high / unit, (name, colour))
    yield scatter(
        x=curve.tau,
        y=curve.deviation / unit,
        name=name,
        legendgroup=name,
        showlegend=first,
        mode="lines+markers",
        marker={"size": 4},
        line={"color": colour, "width": 1.6},
        hovertemplate="%{y:.4g} at %{x:.3g} s",
    )
    yield scatter(
        x=curve.tau,
        y=np.sqrt(axis.noise.allan_variance(curve.tau)) / unit,
        name=f"{name}, fitted",
        legendgroup=name,
        showlegend=False,
        mode="lines",
        line={"color": colour, "width": 1.0, "dash": "dash"},
        hoverinfo="skip",
    )


def _band(tau: np.ndarray, low: np.ndarray, high: np.ndarray, drawn: tuple[str, str]) -> Trace:
    name, colour = drawn
    return scatter(
        x=np.concatenate([tau, tau[::-1]]),
        y=np.concatenate([high, low[::-1]]),
        legendgroup=name,
        showlegend=False,
        mode="lines",
        fill="toself",
        fillcolor=transparent(colour, 0.15),
        line={"width": 0},
        hoverinfo="skip",
    )


def _gains(name: str, of: SensorGain, colour: str) -> list[Trace]:
    line = {"color": colour, "width": 1.8}
    hover = "%{y:.2f} at %{x:.3g} s"
    curve = scatter(
        x=of.tau,
        y=of.gain,
        name=name,
        legendgroup=name,
        mode="lines+markers",
        marker={"size": 4},
        line=line,
        hovertemplate=hover,
    )
    return [_band(of.tau, of.low, of.high, (name, colour)), curve]


def _heading(title: str, domain: list[float]) -> dict[str, object]:
    place = {"x": sum(domain) / 2.0, "xref": "paper", "y": 1.0, "yref": "paper", "yanchor": "bottom", "yshift": 2}
    return {"text": title, "showarrow": False, "font": {"size": 16}, **place}
