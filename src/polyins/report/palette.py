"""Colours that people with any colour vision tell apart (Okabe and Ito 2008), one for each method."""

from __future__ import annotations

from collections.abc import Sequence

METHOD_COLOURS = {
    "single": "#CC79A7",
    "imu-fusion": "#E69F00",
    "nav-fusion": "#009E73",
    "enav-fusion": "#0072B2",
    "enav-fusion-shared-mechanization": "#D55E00",
    "wheel-ins": "#CC79A7",
    "body-ins": "#E69F00",
    "dual-wheel-ins": "#56B4E9",
    "body-wheel-ins": "#009E73",
    "triple-ins": "#0072B2",
    "multi-wheel-ins": "#D55E00",
}
OTHER = "#666666"
REFERENCE = "#1F2430"
FIXES = "#9AA3B2"
REJECTED = "#C0272D"
OUTAGE = "rgba(235, 190, 40, 0.20)"
SILENCE = "rgba(110, 120, 140, 0.22)"
OUTAGE_TRACK = "rgba(235, 190, 40, 0.65)"
FEW_IMUS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#1F2430", "#8C7A00")
DASHES = ("solid", "dash", "dot", "dashdot", "longdash")


def method_styles(names: Sequence[str]) -> list[tuple[str, str]]:
    """Return colour and dash of each run; runs of one method (`wheel-ins/IMU2`) share the colour and differ in dash."""
    styles: list[tuple[str, str]] = []
    for name in names:
        colour = METHOD_COLOURS.get(name.split("/")[0], OTHER)
        earlier = sum(colour == other for other, _ in styles)
        styles.append((colour, DASHES[earlier % len(DASHES)]))
    return styles


def imu_colours(count: int) -> list[str]:
    """Return one colour for each IMU: distinct ones for few, steps of an even scale from dark to light for many."""
    if count <= len(FEW_IMUS):
        return list(FEW_IMUS[:count])
    from plotly.colors import sample_colorscale

    return list(sample_colorscale("Viridis", [0.92 * k / (count - 1) for k in range(count)]))


def transparent(colour: str, opacity: float) -> str:
    """Return `#RRGGBB` as CSS's rgba()."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red}, {green}, {blue}, {opacity})"
