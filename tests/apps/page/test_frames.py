"""What a page in motion does in a frame: it draws the machine, and measures no layout."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.apps.page.page import write_page
from tests.apps.page.conftest import FMUS
from tests.browser import Browser

OSCILLATOR = "mbs_models.pictures.page_drawings:oscillator"

WATCH = """
new Promise((done) => {
  const found = { machine: 0, plot: 0, measured: 0 };
  const clear = CanvasRenderingContext2D.prototype.clearRect;
  CanvasRenderingContext2D.prototype.clearRect = function (...box) {
    found[this.canvas.id === "drawing-canvas" ? "machine" : "plot"] += 1;
    clear.apply(this, box);
  };
  for (const name of ["clientWidth", "clientHeight"]) {
    const { get } = Object.getOwnPropertyDescriptor(Element.prototype, name);
    Object.defineProperty(Element.prototype, name, {
      get() {
        found.measured += 1;
        return get.call(this);
      },
    });
  }
  for (const [owner, name] of [
    [Element.prototype, "getBoundingClientRect"],
    [window, "getComputedStyle"],
  ]) {
    const measure = owner[name];
    owner[name] = function (...given) {
      found.measured += 1;
      return measure.apply(this, given);
    };
  }
  setTimeout(() => done(found), 2000);
})
"""

PLOTS = 3
"""Canvases of the page but for the machine: the output, its errors, and the inputs."""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("frames") / "duffing.html"
    return write_page(FMUS / "duffing" / "duffing.fmu", path, drawing=OSCILLATOR)


@pytest.mark.extended
def test_page_in_motion_measures_no_layout_and_redraws_plots_15_times_a_second(
    chromium: Browser, page: Path
) -> None:
    chromium.resize(1400, 900)
    chromium.open(page)
    chromium.until("parseFloat(document.getElementById('clock').textContent) > 0.3")
    found = chromium.evaluate(WATCH)
    assert found["machine"] > 0
    assert 0 < found["plot"] <= PLOTS * 2 * 18  # 15 a second, and frames come early or late
    assert found["measured"] == 0
