"""Charts that are drawn as pictures show all that the page shows."""

from __future__ import annotations

import math

import numpy as np

from slide_fmu.core.web.charts import Axis, Band, Chart, Line, Panel
from slide_fmu.report.chart_pictures import chart_figure, chart_picture
from slide_fmu.report.step_chart import step_charts
from slide_fmu.validation.row import SMOOTH
from tests.report.made_rows import row


def test_picture_of_errors_has_whole_titles_and_names_its_points() -> None:
    steps = (0.5, 1.0, 2.0, 4.0, 8.0)
    rows = [row("sums of sines of 0.066 to 2.1 Hz", SMOOTH, 0.1, steps=count) for count in steps]
    figure = chart_figure(step_charts(rows))
    figure.draw_without_rendering()
    (ax,) = figure.axes
    title = ax.title.get_window_extent()
    assert figure.bbox.x0 <= title.x0 < title.x1 <= figure.bbox.x1
    named = [text.get_text() for text in ax.get_xticklabels()]
    assert named == ["2.5", "5", "10", "20", "40"]


def test_legend_of_a_picture_names_lines_that_are_drawn() -> None:
    x = np.arange(3.0)
    lines = [Line("drawn", x, x), Line("nowhere", x, np.full(3, math.nan))]
    (ax,) = chart_figure([Chart("title", [Panel("size", "m", lines)])]).axes
    legend = ax.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["drawn"]


def test_lines_points_bands_marks_and_shades_are_all_drawn() -> None:
    x = np.arange(1.0, 4.0)
    lines = [
        Line("whole", x, x, "truth", dashed=True),
        Line("held", x, x, style="steps"),
        Line("dots", x, x, "bad", "points"),
    ]
    panel = Panel("size", "m", lines, [Band("bound", x, 0 * x, x)], log=True)
    chart = Chart(
        "title", [panel], Axis("frequency", "Hz", log=True), "text", [(1, 2)], [3.0], "grey"
    )
    (ax,) = chart_figure([chart]).axes
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert (ax.get_ylabel(), ax.get_xlabel()) == ("size / m", "frequency / Hz")
    assert ax.get_title() == "title\ntext"
    dashed, held, dots, mark = ax.lines
    assert (dashed.get_linestyle(), held.get_drawstyle()) == ("--", "steps-pre")
    assert (dots.get_marker(), list(mark.get_xdata())) == (".", [3.0, 3.0])
    assert len(ax.collections) == len(ax.patches) == 1
    legend = ax.get_legend()
    assert legend is not None
    named = {text.get_text() for text in legend.get_texts()}
    assert named == {"whole", "held", "dots", "bound", "grey"}
    assert chart_picture([chart]).startswith(b"\x89PNG")
