"""The page of noise figures: one HTML file that needs no network."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from polyins.calibration.noise_listing import COLUMNS, NoiseFigures, configuration, rows, sentences, worst
from polyins.files import whole
from polyins.report.allan_curves import allan_figure, gain_figure
from polyins.report.figure import Figure, as_script
from polyins.report.page import SETTINGS, plotly_script, template
from polyins.version import __version__


def write_page(path: Path, title: str, figures: NoiseFigures) -> None:
    """Write the page of a recording's noise."""
    caption = "Overlapping Allan deviation with its 95 % interval where there are few IMUs; dashed: what was fitted."
    sections = [_section("allan", "Allan deviation", caption, allan_figure(figures))]
    if figures.array is not None:
        caption = "Allan deviation of one IMU, rms over all, over that of their mean."
        section = _section("gain", "What the array gains", caption, gain_figure(figures.array))
        sections.append({**section, "texts": sentences(figures.array)})
    text = template("noise.html.j2").render(
        title=title,
        version=__version__,
        plotly=plotly_script(),
        sections=sections,
        columns=COLUMNS,
        rows=rows(figures),
        findings=worst(figures.findings),
        configuration=configuration(figures),
    )
    with whole(path) as beside:
        beside.write_text(text, encoding="utf-8")


def _section(name: str, title: str, caption: str, figure: Figure) -> dict[str, Any]:
    plot = ", ".join(as_script(part) for part in (figure.data, figure.layout, SETTINGS))
    height = figure.layout["height"]
    return {"id": name, "title": title, "caption": caption, "height": height, "plot": plot, "texts": []}
