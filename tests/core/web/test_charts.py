"""Charts as plain values: what a page is given to draw."""

from __future__ import annotations

import json

import numpy as np

from slide_fmu.core.web.charts import (
    X_DIGITS,
    Axis,
    Band,
    Chart,
    Columns,
    Line,
    Panel,
    plain_chart,
)

TIME = np.array([0.0, 0.1, 0.2])


def _chart(values: np.ndarray) -> Chart:
    lines = [Line("a", TIME, values), Line("b", TIME, TIME, style="points", width=3.0)]
    band = Band("room", TIME, values - 1, values + 1)
    panel = Panel("size", "m", lines, [band], log=True, include=(0.5,))
    return Chart("one", [panel], Axis("time", "s"), parts=[(0.0, 0.1)], marks=[0.2])


def test_described_chart_names_its_columns_by_their_places() -> None:
    columns = Columns()
    found = plain_chart(_chart(np.array([1.0, 2.0, 3.0])), columns)
    (panel,) = found["panels"]
    line, points = panel["lines"]
    assert columns.values[line["x"]] == [0.0, 0.1, 0.2]
    assert columns.values[line["y"]] == [1.0, 2.0, 3.0]
    assert columns.values[panel["bands"][0]["low"]] == [0.0, 1.0, 2.0]
    assert (points["style"], points["width"], line["width"]) == ("points", 3.0, 1.6)
    assert (found["parts"], found["marks"]) == ([[0.0, 0.1]], [0.2])
    assert found["axis"] == {"label": "time", "unit": "s", "log": False}


def test_equal_columns_are_kept_once() -> None:
    columns = Columns()
    chart = _chart(np.array([1.0, 2.0, 3.0]))
    plain_chart(chart, columns)
    count = len(columns.values)
    plain_chart(chart, columns)
    assert count == len(columns.values) == 5  # time as place and as value, values, the band


def test_values_that_are_not_finite_become_gaps_in_valid_json() -> None:
    columns = Columns()
    plain_chart(_chart(np.array([np.nan, np.inf, 1.0])), columns)
    assert [None, None, 1.0] in columns.values
    json.dumps(columns.values, allow_nan=False)


def test_values_have_five_digits_and_places_more() -> None:
    columns = Columns()
    columns.place(np.array([1 / 3, 1e-9 / 3, 123456789.0]))
    columns.place(np.array([1 / 3]), X_DIGITS)
    assert columns.values == [[0.33333, 3.3333e-10, 123460000.0], [0.3333333]]
