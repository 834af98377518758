"""The report: one HTML file with every figure of one or more runs, which needs no network."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from polyins.evaluation.documents import CompareDocument
from polyins.files import whole
from polyins.report.drift_curves import drift_figure
from polyins.report.error_curves import attitude_figure, position_figure, velocity_figure
from polyins.report.figure import Figure, as_script
from polyins.report.imu_errors import imu_error_figure
from polyins.report.innovations import innovation_figure, other_kinds
from polyins.report.outage_bars import outage_figure
from polyins.report.scene import Scene
from polyins.report.tables import facts, figures_table, findings_by_text, verdicts
from polyins.report.trajectory import trajectory_figure
from polyins.version import __version__

BANDS = "Bands are three times the standard deviation that the filter states."

SECTIONS: tuple[tuple[str, str, str, Callable[[Scene], Figure | None]], ...] = (
    ("trajectory", "Trajectory", "Metres from the start; drag to zoom, double-click to return.", trajectory_figure),
    ("outages", "Outages", "The greatest horizontal error inside each GNSS outage.", outage_figure),
    (
        "drift",
        "Drift over distance",
        "The greatest horizontal error so far over the distance so far. The dots are what the mean rate is taken of.",
        drift_figure,
    ),
    ("position", "Position errors", BANDS, position_figure),
    ("velocity", "Velocity errors", BANDS, velocity_figure),
    ("attitude", "Attitude errors", BANDS, attitude_figure),
    ("imus", "Estimated IMU errors", "A click in the legend hides an IMU.", imu_error_figure),
    (
        "innovations",
        "Innovations",
        "Predicted minus measured position of the antenna at each fix that the filter was shown, and three times the "
        "standard deviation that it expected. What lies beyond the range is drawn at its edge.",
        innovation_figure,
    ),
)
INNOVATIONS = "Predicted minus measured, and three times the standard deviation that the filter expected."
OVER_TIME = ("position", "velocity", "attitude", "imus", "innovations")
WIDE = ("imus",)
"""figures that scroll sideways on a narrow screen"""
NO_BUTTONS = ("sendChartToCloud", "select2d", "lasso2d")
"""what would send the figure to a server, or has no use here"""
SETTINGS = {"displaylogo": False, "responsive": True, "modeBarButtonsToRemove": NO_BUTTONS}


def write_report(path: Path, scene: Scene, comparison: CompareDocument | None = None) -> None:
    """Write the report of a scene to `path`; with the `compare` document the table shows its figures and ratios."""
    recording = scene.recording
    text = template("report.html.j2").render(
        title=recording.name,
        version=__version__,
        facts=facts(scene),
        table=figures_table(scene, comparison),
        findings=findings_by_text(scene),
        verdicts=verdicts(scene),
        sections=_sections(scene),
        config=recording.config_text,
        plotly=plotly_script(),
        pooled=next((run.name for run in scene.runs if comparison and "each" in comparison["methods"][run.name]), None),
    )
    with whole(path) as beside:
        beside.write_text(text, encoding="utf-8")


def _sections(scene: Scene) -> list[dict[str, Any]]:
    drawn = [(name, title, caption, draw(scene)) for name, title, caption, draw in SECTIONS]
    for kind in other_kinds(scene):
        figure = innovation_figure(scene, kind)
        drawn.append((f"innovations-{kind.replace(' ', '-')}", f"Innovations of {kind}", INNOVATIONS, figure))
    shaded = _what_is_shaded(scene)
    return [
        {
            "id": name,
            "title": title,
            "caption": f"{caption} {shaded}" if name in OVER_TIME or caption is INNOVATIONS else caption,
            "height": figure.layout["height"],
            "plot": ", ".join(as_script(part) for part in (figure.data, figure.layout, SETTINGS)),
            "wide": name in WIDE,
        }
        for name, title, caption, figure in drawn
        if figure is not None
    ]


def _what_is_shaded(scene: Scene) -> str:
    silent = dict.fromkeys(shade.name for shade in scene.shades if shade.name)
    outages = "Outages are shaded." if scene.outages else ""
    gaps = f"Gray: no data from {', '.join(silent)}." if silent else ""
    return f"{outages} {gaps}".strip()


def plotly_script() -> str:
    """Return plotly.js, which a page that needs no network carries with it."""
    # the package is not imported for the sake of one of its files
    package = find_spec("plotly")
    assert package
    assert package.origin
    return (Path(package.origin).parent / "package_data" / "plotly.min.js").read_text(encoding="utf-8")


def template(name: str) -> Any:
    """Return a template of this folder."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("polyins", "report")
    return Environment(loader=loader, autoescape=True, undefined=StrictUndefined).get_template(name)
