"""This module draws charts as PNG pictures, for readers without scripts, such as a model card.

Pictures are made small: line drawings have few colours, so they take a fifth of the bytes.
"""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from slide_fmu.core.units import labelled
from slide_fmu.core.web.charts import Band, Chart, Line, Panel

INKS = {
    "line": "#1f77b4",
    "truth": "#222222",
    "bad": "#d62728",
    "estimate": "#ff7f0e",
    "cursor": "#222222",
    "band": "#1f77b433",
    "shade": "#5c687522",
    "input-0": "#1f77b4",
    "input-1": "#ff7f0e",
    "input-2": "#2ca02c",
    "input-3": "#9467bd",
    "input-4": "#8c564b",
    "input-5": "#e377c2",
}
"""Colours on white paper, by their names in charts."""

WIDTH = 5.5
"""Width of a column in inches."""

HEIGHTS = {"tall": 2.8, "short": 1.8, "square": 4.5}
"""Height of panels in inches."""


COLOURS = 24
"""Colours of a picture: about ten lines and inks, with steps between them and white."""

MOST_NAMED = 8
"""Largest number of points that are named below a logarithmic axis."""

DPI = 96
"""Pixels per inch."""


def chart_picture(charts: Sequence[Chart]) -> bytes:
    """Draw charts side by side; all have panels of the same heights."""
    return png(chart_figure(charts))


def chart_figure(charts: Sequence[Chart]) -> Figure:
    """Return the figure of charts side by side."""
    heights = [HEIGHTS[panel.height] for panel in charts[0].panels]
    figure = Figure(figsize=(WIDTH * len(charts), sum(heights)), layout="constrained")
    axes = figure.subplots(
        len(heights), len(charts), sharex="col", squeeze=False, height_ratios=heights
    )
    for column, chart in enumerate(charts):
        for ax, panel in zip(axes[:, column], chart.panels, strict=True):
            _draw_panel(ax, panel, chart)
        text = f"\n{chart.text}" if chart.text else ""
        axes[0, column].set_title(f"{chart.title}{text}", fontsize=11)
        axes[-1, column].set_xlabel(labelled(chart.axis.label, chart.axis.unit))
    return figure


def _draw_panel(ax: Axes, panel: Panel, chart: Chart) -> None:
    for band in panel.bands:
        _draw_band(ax, band)
    for line in panel.lines:
        _draw_line(ax, line)
    for part in chart.parts:
        shade = ax.axvspan(*part, color=INKS["shade"], lw=0)
    if chart.parts and chart.shaded and panel is chart.panels[0]:
        shade.set_label(chart.shaded)
    for mark in chart.marks:
        ax.axvline(mark, color=INKS["cursor"], lw=0.8, ls=":")
    if chart.axis.log:
        ax.set_xscale("log")
        _name_points(ax, panel)
    if panel.log:
        ax.set_yscale("log")
    ax.set_ylabel(labelled(panel.title, panel.unit))
    if any(line.name for line in panel.lines):
        ax.legend(loc="best" if panel.log else "upper right", fontsize=8)


def _name_points(ax: Axes, panel: Panel) -> None:
    """Write the places of few points below a logarithmic axis, which has few round ones."""
    places = np.unique(np.concatenate([line.x for line in panel.lines]))
    if len(places) <= MOST_NAMED:
        ax.set_xticks(places, [f"{place:.3g}" for place in places])
        ax.set_xticks([], minor=True)


def _draw_band(ax: Axes, band: Band) -> None:
    ax.fill_between(band.x, band.low, band.high, color=INKS[band.colour], label=band.name, lw=0)


def _draw_line(ax: Axes, line: Line) -> None:
    """Draw a line; one without finite values is left out of the legend."""
    if not np.isfinite(line.y).any():
        return
    colour, points = INKS[line.colour], line.style == "points"
    look = "." if points else "--" if line.dashed else "-"
    (drawn,) = ax.plot(line.x, line.y, look, color=colour, label=line.name or None)
    if points:
        drawn.set_markersize(2 * line.width)
    else:
        drawn.set_linewidth(0.75 * line.width)
        drawn.set_drawstyle("steps-pre" if line.style == "steps" else "default")


def png(figure: Figure) -> bytes:
    """Store a figure as a PNG with a palette of a few colours."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    return with_palette(buffer.getvalue())


def with_palette(picture: bytes) -> bytes:
    """Store a PNG with a palette of a few colours, on white; one with a palette stays as it is.

    The size in pixels stays.
    """
    with Image.open(io.BytesIO(picture)) as image:
        if image.mode == "P":
            return picture
        few = _few_colours(image)
    buffer = io.BytesIO()
    few.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def _few_colours(image: Image.Image) -> Image.Image:
    """Return the picture with a palette, on white.

    The colours are chosen by maximum coverage and refined by k-means, so that a rare colour,
    such as a single thin line has, is not lost; pixels are not dithered.
    """
    opaque = Image.new("RGBA", image.size, "white")
    opaque.alpha_composite(image.convert("RGBA"))
    return opaque.convert("RGB").quantize(
        COLOURS, method=Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE
    )
