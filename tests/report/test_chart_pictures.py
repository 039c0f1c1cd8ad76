"""Charts that are drawn as pictures show all that the page shows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from slide_fmu.core.web.charts import Axis, Band, Chart, Line, Panel
from slide_fmu.report.chart_pictures import chart_figure, chart_picture
from slide_fmu.report.trajectory_charts import charts_side_by_side
from tests.validation.handmade import comparison, validation

ONE = comparison([[1.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [-7.0, 0.0]])
TWO = comparison([[0.0, 2.0], [0.0, 2.0]], kind=1)


def test_picture_side_by_side_has_the_panels_of_two_trajectories_with_whole_titles() -> None:
    figure = chart_figure(charts_side_by_side(validation(ONE, TWO), 0))
    figure.draw_without_rendering()
    assert len(figure.axes) == 6
    for ax, kind in zip(figure.axes[:2], ("sweep", "held_random"), strict=True):
        title = ax.title.get_window_extent()
        assert kind in ax.get_title() or "trajectory" in ax.get_title()
        assert figure.bbox.x0 <= title.x0 < title.x1 <= figure.bbox.x1


def test_legend_of_a_picture_names_lines_that_are_drawn() -> None:
    """The span of the first estimate may reach before all that is shown."""
    unknown = replace(TWO, true_error=np.full(TWO.true_error.shape, math.nan))
    named = []
    for one in (ONE, unknown):
        figure = chart_figure(charts_side_by_side(validation(one), 0))
        legend = figure.axes[-1].get_legend()
        assert legend is not None
        named.append({text.get_text() for text in legend.get_texts()})
    assert named == [{"|error|", "RMSE of 2 samples", "its estimate"}, {"|error|"}]


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
