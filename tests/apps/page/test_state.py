"""What is set in a page stands in its address: a copied link shows the same."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.apps.page.page import write_page
from tests.apps.page.conftest import FMUS
from tests.browser import Browser

CRANK = FMUS / "slider_crank_payload" / "slider_crank_payload.fmu"
DRAWING = "mbs_models.pictures.page_drawings:slider_crank"

CHANGE = """
for (const [id, name, value] of [
  ["slider-slider_mass", "input", 1.4],
  ["pace", "change", "0.5"], ["magnify", "change", "25"],
]) {
  const control = document.getElementById(id);
  control.value = value;
  control.dispatchEvent(new Event(name));
}
document.getElementById("theme").click();
const angle = document.querySelector("#sliders input");
angle.value = 75;
angle.dispatchEvent(new Event("input"));
"""

SHOWN = """
["slider-slider_mass", "pace", "magnify"].map(
  (id) => Number(document.getElementById(id).value)
).concat([
  document.querySelector("#sliders input").valueAsNumber,
  document.getElementById("wander").checked,
  document.documentElement.dataset.theme,
])
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(CRANK, tmp_path_factory.mktemp("state") / "crank.html", drawing=DRAWING)


@pytest.mark.extended
def test_copied_link_shows_the_same(chromium: Browser, page: Path) -> None:
    chromium.resize(1400, 900)
    chromium.open(page)
    chromium.evaluate(CHANGE)
    before = chromium.evaluate(SHOWN)
    assert before == [pytest.approx(1.4), 0.5, 25, 75, False, "dark"]
    chromium.until("location.hash.includes('inputs=75') && location.hash.includes('theme=dark')")
    link = str(chromium.evaluate("location.hash"))
    chromium.open(page, link)
    assert chromium.evaluate(SHOWN) == pytest.approx(before)
    assert chromium.complaints() == []


@pytest.mark.extended
def test_link_opens_the_stored_trajectory_at_its_time(chromium: Browser, page: Path) -> None:
    chromium.open(page, "#way=stored&time=1.5")
    assert chromium.evaluate("document.body.dataset.way") == "stored"
    chromium.until("document.getElementById('clock').textContent.startsWith('1.5')")


@pytest.mark.parametrize(
    "link", ["#inputs=a,b", "#inputs=1,2,3&pace=7&deflection=x", "#way=there&time=x"]
)
def test_link_that_does_not_fit_shows_the_page_as_it_begins(
    chromium: Browser, page: Path, link: str
) -> None:
    chromium.open(page, link)
    assert chromium.evaluate("document.documentElement.dataset.ready") == "yes"
    assert chromium.evaluate("document.body.dataset.way") == "live"
    assert chromium.evaluate("document.getElementById('problem').hidden")
    assert chromium.complaints() == []
