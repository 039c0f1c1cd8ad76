"""Reports of released FMUs, opened in a browser: light and dark, on phones and on screens."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from slide_fmu.cli.app import app
from tests.browser import Browser

pytestmark = pytest.mark.extended

FMUS = Path(__file__).parents[2] / "fmus"
MOST_BYTES = 3_000_000
SIZES = [(400, 900), (1200, 900), (1400, 900)]

REPORTS = [
    ("duffing", 3),
    pytest.param(("robot_6r", 2), marks=pytest.mark.extended),
]

OVERLAPS = """
[...document.querySelectorAll('h1, h2, h3, p, table, canvas, figure, iframe, button, .bars')]
  .map(e => [e, e.getBoundingClientRect()])
  .filter(([e, r]) => r.width > 1 && r.height > 1 && !e.classList.contains('spoken'))
  .flatMap(([a, r], i, all) => all.slice(i + 1)
    .filter(([b, s]) => !a.contains(b) && !b.contains(a)
      && Math.min(r.right, s.right) - Math.max(r.left, s.left) > 1
      && Math.min(r.bottom, s.bottom) - Math.max(r.top, s.top) > 1)
    .map(([b]) => [a, b].map(e => `${e.tagName} ${e.textContent.slice(0, 30)}`)))
"""
"""Pairs of elements that lie on each other, but for those inside of each other."""

WIDER = """
[...document.querySelectorAll('h1, h2, h3, p, figure, iframe, .bars, .table')]
  .filter(e => e.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
  .map(e => e.textContent.slice(0, 40))
"""


@pytest.fixture(scope="module", params=REPORTS, ids=lambda value: str(value))
def report(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    name, count = request.param
    folder = tmp_path_factory.mktemp(name)
    words = ["validate", str(FMUS / name / f"{name}.fmu"), "--trajectories", str(count)]
    result = CliRunner().invoke(app, [*words, "--report", str(folder)])
    assert result.exit_code == 0, result.output
    return folder / "report.html"


def test_report_with_its_page_is_smaller_than_3_mb(report: Path) -> None:
    print(f"{report.stat().st_size} bytes")
    assert report.stat().st_size < MOST_BYTES


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_report_fits_phones_and_screens_dark_and_light(
    chromium: Browser, report: Path, tmp_path: Path, width: int, height: int
) -> None:
    colours = []
    for dark in (False, True):
        chromium.resize(width, height, dark)
        chromium.open(report)
        assert chromium.evaluate("document.documentElement.dataset.ready") == "yes"
        chromium.evaluate("document.getElementById('unfold').click()")
        assert chromium.evaluate("document.documentElement.scrollWidth") <= width
        assert chromium.evaluate(OVERLAPS) == []
        assert chromium.evaluate(WIDER) == []
        colours.append(chromium.evaluate("getComputedStyle(document.body).backgroundColor"))
        path = tmp_path / f"{width}-{dark}.png"
        chromium.screenshot(path)
        print(path)
    assert colours[0] != colours[1]
    assert chromium.complaints() == []


def test_every_chart_of_a_report_is_drawn(chromium: Browser, report: Path) -> None:
    chromium.resize(1400, 900)
    chromium.open(report)
    chromium.evaluate("document.getElementById('unfold').click()")
    empty = chromium.evaluate(
        "[...document.querySelectorAll('canvas.chart')].filter(c => !c.getContext('2d')"
        ".getImageData(0, 0, c.width, c.height).data.some(v => v !== 0)).length"
    )
    assert empty == 0
    assert chromium.evaluate("document.querySelectorAll('canvas.chart').length") > 20


def test_folded_section_opens_where_the_address_names_it(chromium: Browser, report: Path) -> None:
    chromium.resize(1400, 900)
    chromium.open(report)
    last = "[...document.querySelectorAll('.folded')].at(-1)"
    assert not chromium.evaluate(f"{last}.firstElementChild.open")
    chromium.evaluate(f"location.hash = {last}.id")
    chromium.until(f"{last}.firstElementChild.open")


def test_surrogate_runs_in_the_last_section(chromium: Browser, report: Path) -> None:
    inside = "document.getElementById('inside').contentDocument"
    chromium.resize(1400, 900)
    chromium.open(report)
    chromium.until(f"{inside}?.documentElement?.dataset.ready === 'yes'")
    chromium.until(f"parseFloat({inside}.getElementById('clock').textContent) > 0.2")
    height = f"{inside}.body.scrollHeight"
    chromium.until(f"document.getElementById('inside').clientHeight >= {height}")
    chromium.evaluate("document.getElementById('theme').click()")
    outer, inner = (
        chromium.evaluate(f"getComputedStyle({body}).backgroundColor")
        for body in ("document.body", f"{inside}.body")
    )
    assert outer == inner


def test_report_counts_as_loaded_when_its_charts_are_drawn(
    chromium: Browser, report: Path
) -> None:
    """Plain screenshots and prints are taken then."""
    count = "window.addEventListener('load', () => (window.drawn = [...document.querySelectorAll("
    count += "'canvas.chart')].filter((c) => c.width !== 300).length))"
    chromium.call("Page.addScriptToEvaluateOnNewDocument", source=count)
    chromium.open(report)
    chromium.until("window.drawn !== undefined")
    assert chromium.evaluate("window.drawn") >= 3
