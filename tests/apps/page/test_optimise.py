"""*Optimise* searches the move to a chosen goal in the browser, as ``slide-fmu motion`` does."""

from __future__ import annotations

import re
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.apps.motion.solve import solve
from slide_fmu.apps.motion.task import MoveTask, read_task
from slide_fmu.apps.page.page import write_page
from slide_fmu.fmu.export import export_fmu, read_fmu
from tests.apps.page.conftest import FMUS
from tests.browser import Browser

NAME = "slider_crank_payload"
FMU = FMUS / NAME / f"{NAME}.fmu"

NARROW = 0.03
"""Factor on the last limit of a domain, with which only slower moves are inside."""

VERDICT = "document.querySelector('.verdict').textContent"
CATCH = "URL.createObjectURL = (blob) => { window.saved = blob.text(); return '#'; }; null"


def _click(chromium: Browser, element: str) -> None:
    chromium.evaluate(f"document.getElementById('{element}').click()")


def _allow(chromium: Browser, microns: float) -> None:
    """Choose the tolerance."""
    chromium.evaluate(
        f"(t => {{ t.value = '{microns}'; t.dispatchEvent(new Event('change')); }})"
        "(document.getElementById('tolerance'))"
    )


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(FMU, tmp_path_factory.mktemp("optimise") / "crank.html")


@pytest.mark.extended
def test_browser_finds_what_the_command_finds(
    chromium: Browser, page: Path, tmp_path: Path
) -> None:
    chromium.open(page, "#inputs=90")
    chromium.evaluate(CATCH)
    _click(chromium, "way-moves")
    chromium.until(f"{VERDICT} !== ''")
    said = str(chromium.evaluate(VERDICT))
    best, shaped, plain = (float(text) for text in re.findall(r"after ([\d.]+) s", said))
    assert best <= shaped <= plain, said
    assert "optimised" in said
    assert "shaper" in said
    assert "margin included" in said
    _click(chromium, "save-task")
    path = tmp_path / "task.toml"
    path.write_text(str(chromium.evaluate("window.saved")), encoding="utf-8")
    task = read_task(path)
    assert isinstance(task, MoveTask)
    figures = solve(FMU, task).figures()
    step = read_fmu(FMU)[0].window.step
    fastest = figures.baselines[0].settled_with_margin_s
    assert fastest is not None
    assert plain == pytest.approx(fastest, abs=1.01 * step)
    known = [move.settled_with_margin_s for move in (figures.move, *figures.baselines[1:])]
    least = min(time for time in known if time is not None)
    assert best <= least + 2.01 * step  # other moves are tried, as many of them
    assert chromium.complaints() == []


@pytest.mark.extended
def test_moves_that_leave_the_domain_are_no_answer_so_slower_ones_are_tried(
    chromium: Browser, tmp_path: Path
) -> None:
    """The domain is smaller than that of the released slider-crank, which knows fast moves."""
    released = FMUS / "slider_crank" / "slider_crank.fmu"
    surrogate, provenance = read_fmu(released)
    assert surrogate.bound is not None
    limits = surrogate.bound.limits * np.where(np.arange(14) == 13, NARROW, 1.0)
    narrow = replace(surrogate, bound=replace(surrogate.bound, limits=limits))
    with zipfile.ZipFile(released) as archive:  # the limits of moves follow from its experiment
        names = [name for name in archive.namelist() if name.startswith("extra/")]
        extra = {name.removeprefix("extra/"): archive.read(name) for name in names}
    fmu = export_fmu(narrow, tmp_path / "narrow.fmu", provenance=provenance, extra=extra)
    chromium.open(write_page(fmu, tmp_path / "bounded.html"), "#inputs=0")
    _click(chromium, "way-moves")
    chromium.until(f"{VERDICT} !== ''")
    doubt = str(chromium.evaluate("document.querySelector('.verdict').nextSibling.textContent"))
    assert doubt.startswith("The margin is the error bound of 95 %")
    assert "do not rely on it" not in doubt
    assert "all begin with 1.5 times the shortest time" in doubt


@pytest.mark.extended
def test_tolerance_below_the_margin_at_rest_is_refused(chromium: Browser, page: Path) -> None:
    chromium.open(page, "#inputs=90")
    _click(chromium, "way-moves")
    _allow(chromium, 0.001)
    _click(chromium, "optimise")
    said = str(chromium.evaluate("document.getElementById('problem').textContent"))
    assert "predictions may be off by" in said
    assert "more than the tolerance" in said


@pytest.mark.extended
def test_goal_that_is_changed_is_searched_for_when_people_ask(
    chromium: Browser, page: Path
) -> None:
    chromium.open(page, "#inputs=90")
    _click(chromium, "way-moves")
    chromium.until(f"{VERDICT} !== ''")
    before = chromium.evaluate(VERDICT)
    chromium.evaluate(
        "(r => { r.value = 60; r.dispatchEvent(new Event('input')); })"
        "(document.querySelector('#sliders input'))"
    )
    assert chromium.evaluate(VERDICT) == before
    _click(chromium, "optimise")
    chromium.until(f"{VERDICT} !== {str(before)!r}")
    assert chromium.evaluate("document.getElementById('problem').hidden")


def test_goal_at_the_start_is_refused(chromium: Browser, page: Path) -> None:
    chromium.open(page, "#inputs=90")
    _click(chromium, "way-moves")
    _click(chromium, "start-here")
    _click(chromium, "optimise")
    said = chromium.evaluate("document.getElementById('problem').textContent")
    assert "the goal is the start" in said
