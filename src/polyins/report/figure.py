"""A figure as plotly.js takes it: plain dictionaries, since to check each takes longer than all else."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Trace = dict[str, Any]

TYPES = {"float32": "f4", "float64": "f8", "int32": "i4"}
"""of arrays, as plotly.js calls them"""


@dataclass
class Figure:
    """Traces and layout; what they may hold is in Plotly's reference."""

    data: list[Trace] = field(default_factory=list)
    layout: dict[str, Any] = field(default_factory=lambda: {"xaxis": {}, "yaxis": {}})

    def update_layout(self, **parts: Any) -> None:
        """Set parts of the layout; what they do not name stays."""
        _merge(self.layout, parts)

    def axes(self, letter: str) -> list[dict[str, Any]]:
        """Return the x or y axes, row by row."""
        return [axis for name, axis in self.layout.items() if name.startswith(f"{letter}axis")]

    def add(self, traces: Iterable[Trace], panel: int) -> None:
        """Draw traces in a panel, counted from 0 row by row."""
        self.data += [{**trace, "xaxis": axis_name("x", panel), "yaxis": axis_name("y", panel)} for trace in traces]


def scatter(**parts: Any) -> Trace:
    """Return a trace of lines or markers."""
    return {"type": "scatter", **parts}


def panels(rows: int, columns: int, between_rows: float, between_columns: float) -> Figure:
    """Return an empty figure of panels that share the x axis; distances are shares of the whole."""
    height = (1.0 - between_rows * (rows - 1)) / rows
    width = (1.0 - between_columns * (columns - 1)) / columns
    figure = Figure(layout={})
    for panel in range(rows * columns):
        row, column = divmod(panel, columns)
        left, bottom = column * (width + between_columns), (rows - 1 - row) * (height + between_rows)
        number = panel + 1 if panel else ""
        figure.layout[f"xaxis{number}"] = {
            "anchor": axis_name("y", panel),
            "domain": [left, min(1.0, left + width)],
            "showticklabels": row == rows - 1,
            **({"matches": "x"} if panel else {}),
        }
        figure.layout[f"yaxis{number}"] = {
            "anchor": axis_name("x", panel),
            "domain": [bottom, min(1.0, bottom + height)],
        }
    return figure


def axis_name(letter: str, panel: int) -> str:
    """Return how traces name an axis."""
    return f"{letter}{panel + 1}" if panel else letter


def as_script(part: Sequence[Any] | dict[str, Any]) -> str:
    """Return traces or a layout as JavaScript that may stand inside a script element."""
    text = json.dumps(part, default=_typed_array, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")


def _typed_array(values: Any) -> dict[str, str] | list[float]:
    if not isinstance(values, np.ndarray):
        raise TypeError(f"{type(values).__name__} in a figure")
    if not values.size:
        return []
    return {"dtype": TYPES[values.dtype.name], "bdata": base64.b64encode(values.tobytes()).decode()}


def _merge(into: dict[str, Any], parts: dict[str, Any]) -> None:
    for key, value in parts.items():
        if isinstance(value, dict) and isinstance(into.get(key), dict):
            _merge(into[key], value)
        else:
            into[key] = value
