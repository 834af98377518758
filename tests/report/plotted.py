"""Figures as Plotly's own objects, which refuse what plotly.js would not understand."""

from plotly.graph_objects import Figure as Checked

from polyins.report.figure import Figure


def plotted(figure: Figure) -> Checked:
    return Checked({"data": figure.data, "layout": figure.layout})
