"""Charts in headless Chromium: what people see, read and zoom."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.web.charts import Axis, Chart, Line, Panel
from slide_fmu.report.html_report import Report, ReportSection
from tests.browser import Browser

CANVAS = "document.querySelectorAll('canvas.chart')[{}]"
WHOLE_IS_HIDDEN = "document.querySelectorAll('.whole')[{}].hidden"
VALUES = "[...document.querySelectorAll('.chart-card')[{}].querySelectorAll('.value')]"
SCREEN = (1000, 1400)

X = np.linspace(0.0, 10.0, 101)
SQUARE = Chart(
    "a square",
    [
        Panel("size", "m", [Line("x squared", X, X**2)]),
        Panel("root", "m", [Line("x", X, X, style="steps")], height="short"),
    ],
    parts=[(2.0, 3.0)],
    shaded="not known",
)
POWER = Chart(
    "a power",
    [Panel("size", "N", [Line("power", X[1:], X[1:] ** 3)], log=True)],
    Axis("frequency", "Hz", log=True),
)
CORNER = Chart(
    "numbers in the corner",
    [Panel("input", "N", [Line("force", X + 1000.0, 1000 * np.sign(X - 5.0))], height="short")],
)
LOOP = Chart("a loop", [Panel("y", "m", [Line("loop", np.sin(X), np.cos(X))], height="square")])


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    sections = [ReportSection("Charts", "Four.", charts=[SQUARE, POWER, LOOP, CORNER])]
    return Report("charts", "All of them.", {}, sections).write(tmp_path_factory.mktemp("charts"))


@pytest.fixture
def shown(chromium: Browser, page: Path) -> Browser:
    chromium.resize(*SCREEN)
    chromium.open(page)
    assert chromium.evaluate("document.documentElement.dataset.ready") == "yes"
    return chromium


def _places(browser: Browser, index: int, *parts: float) -> list[tuple[float, float]]:
    """Return places on a canvas, parts of its width, on the screen."""
    left, top, width, height = browser.evaluate(
        "(r => [r.left, r.top, r.width, r.height])"
        f"({CANVAS.format(index)}.getBoundingClientRect())"
    )
    # a plot has 52 pixels on its left and 8 on its right for the axis
    return [(left + 52 + part * (width - 60), top + height / 2) for part in parts]


def _mouse(browser: Browser, kind: str, place: tuple[float, float], buttons: int) -> None:
    where = {"x": place[0], "y": place[1], "button": "left" if buttons else "none"}
    browser.call("Input.dispatchMouseEvent", type=kind, buttons=buttons, clickCount=1, **where)


def _drag(browser: Browser, begin: tuple[float, float], end: tuple[float, float]) -> None:
    _mouse(browser, "mousePressed", begin, 1)
    _mouse(browser, "mouseMoved", end, 1)
    browser.call(
        "Input.dispatchMouseEvent", type="mouseReleased", x=end[0], y=end[1], button="left"
    )


def _picture(browser: Browser, index: int) -> str:
    return str(browser.evaluate(f"{CANVAS.format(index)}.toDataURL()"))


@pytest.mark.extended
def test_pointer_reads_the_values_of_all_panels_at_its_place(shown: Browser) -> None:
    (place,) = _places(shown, 0, 0.3)
    _mouse(shown, "mouseMoved", place, 0)
    texts = shown.evaluate(f"{VALUES.format(0)}.map(e => e.textContent)")
    assert texts == ["9.00 m", "3.00 m"]


@pytest.mark.extended
def test_loop_has_no_value_at_a_place_of_its_axis(shown: Browser) -> None:
    (place,) = _places(shown, 3, 0.5)
    _mouse(shown, "mouseMoved", place, 0)
    assert shown.evaluate(f"{VALUES.format(2)}.map(e => e.textContent)") == [""]


@pytest.mark.parametrize(("chart", "canvas"), [(0, 1), (1, 2)], ids=["time", "logarithmic"])
def test_dragging_shows_a_part_and_the_button_the_whole_again(
    shown: Browser, chart: int, canvas: int
) -> None:
    before = _picture(shown, canvas)
    assert shown.evaluate(WHOLE_IS_HIDDEN.format(chart))
    _drag(shown, *_places(shown, canvas, 0.4, 0.6))
    assert not shown.evaluate(WHOLE_IS_HIDDEN.format(chart))
    (middle,) = _places(shown, canvas, 0.5)
    _mouse(shown, "mouseMoved", (middle[0], middle[1] - 400), 0)
    assert _picture(shown, canvas) != before
    shown.evaluate(f"document.querySelectorAll('.whole')[{chart}].click()")
    assert shown.evaluate(WHOLE_IS_HIDDEN.format(chart))
    assert _picture(shown, canvas) == before


def test_zoomed_plot_shows_values_of_its_part_alone(shown: Browser) -> None:
    _drag(shown, *_places(shown, 0, 0.4, 0.6))
    begin, end = _places(shown, 0, 0.0, 1.0)
    found = []
    for place in (begin, end):
        _mouse(shown, "mouseMoved", place, 0)
        text = shown.evaluate(f"{VALUES.format(0)}[1].textContent")
        found.append(float(str(text).split()[0]))
    assert found == pytest.approx([4.0, 6.0], abs=0.05)


def test_keys_alone_read_and_zoom(shown: Browser) -> None:
    shown.evaluate(f"{CANVAS.format(0)}.focus()")
    shown.press("ArrowRight")
    assert shown.evaluate(f"{VALUES.format(0)}[1].textContent") == "5.20 m"
    shown.press("+")
    assert not shown.evaluate(WHOLE_IS_HIDDEN.format(0))
    shown.press("0")
    assert shown.evaluate(WHOLE_IS_HIDDEN.format(0))


def test_legend_names_the_shaded_parts_of_a_chart_that_has_some(shown: Browser) -> None:
    swatches = "[...document.querySelectorAll('.chart-card .swatch.shade')]"
    assert shown.evaluate(f"{swatches}.map(e => e.parentElement.textContent)") == ["not known"]
    colour = f"getComputedStyle({swatches}[0]).backgroundColor"
    light = shown.evaluate(colour)
    shown.resize(*SCREEN, dark=True)
    assert shown.evaluate(colour) != light


def test_colours_follow_the_system_and_the_switch(shown: Browser, page: Path) -> None:
    light = _picture(shown, 0)
    shown.resize(*SCREEN, dark=True)
    shown.open(page)
    dark = _picture(shown, 0)
    assert dark != light
    shown.evaluate("document.getElementById('theme').click()")
    assert _picture(shown, 0) == light


def test_charts_ask_for_nothing_and_complain_of_nothing(shown: Browser) -> None:
    assert shown.complaints() == []


def test_damaged_charts_are_told(chromium: Browser, page: Path, tmp_path: Path) -> None:
    text = page.read_text(encoding="utf-8")
    begin = text.index('id="blob-charts">') + len('id="blob-charts">')
    damaged = tmp_path / "damaged.html"
    damaged.write_text(text[:begin] + "H4sI" + "A" * 40 + text[begin + 44 :], encoding="utf-8")
    chromium.open(damaged)
    assert chromium.evaluate("document.documentElement.dataset.ready") == "no"
    said = chromium.evaluate("document.getElementById('problem').textContent")
    assert "The charts cannot be drawn here" in str(said)
    chromium.events.clear()


WATCH = """
window.labels = new Map();
const kept = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
  const width = this.measureText(text).width;
  const from = { left: x, right: x - width, center: x - width / 2 }[this.textAlign];
  const top = this.textBaseline === "top" ? y : y - 5.5;
  window.labels.set(`${this.canvas.dataset.label ??= Math.random()} ${x} ${y}`, {
    canvas: this.canvas, text, from, to: from + width, top });
  kept.call(this, text, x, y);
};
"""
"""Keeps the labels that are drawn from now on, with their places."""

MEETING = """
[...window.labels.values()].flatMap((one, i, all) => all.slice(i + 1)
  .filter((other) => one.canvas === other.canvas && one.from < other.to - 1 &&
    other.from < one.to - 1 && Math.abs(one.top - other.top) < 14)
  .map((other) => [one.text, other.text]))
"""
"""Labels of 11 pixels with less than 3 pixels between one and the other below it."""


@pytest.mark.parametrize("width", [400, 1400])
def test_numbers_of_the_axes_do_not_meet(shown: Browser, width: int) -> None:
    """The first time and the lowest value of these charts stand in the same corner."""
    shown.evaluate(WATCH)
    shown.resize(width, 900)
    shown.until("window.labels.size > 20")
    assert shown.evaluate(MEETING) == []
