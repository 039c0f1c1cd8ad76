"""The machine as it is drawn: what is in the frame, and how large deflections are."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mbs_models.pictures.page_drawings import DEVIATION_SCALE, robot
from slide_fmu.apps.page.drawing import DrawingError, checked_drawing
from slide_fmu.apps.page.facts import names_of, page_facts
from slide_fmu.apps.page.page import write_page
from slide_fmu.core.figures import plain
from slide_fmu.fmu.export import read_fmu
from tests.apps.page.conftest import FMUS
from tests.browser import Browser
from tests.limits import HANGS
from tests.node import node
from tests.refusals import refused

ROBOT = FMUS / "robot_6r" / "robot_6r.fmu"
RUNNER = Path(__file__).parent / "run_drawing.mjs"


def _drawn(cases: Sequence[dict[str, Any]], folder: Path) -> list[dict[str, Any]]:
    surrogate, _ = read_fmu(ROBOT)
    drawing = checked_drawing(robot(), names_of(surrogate), "robot").plain()
    task = folder / "task.json"
    facts = plain(page_facts(surrogate))
    task.write_text(json.dumps({"drawing": drawing, "facts": facts, "cases": cases}))
    command = [node(), str(RUNNER), str(task)]
    result = subprocess.run(command, capture_output=True, text=True, check=False, timeout=HANGS)
    assert result.returncode == 0, result.stderr
    return list(json.loads(result.stdout))


def _case(row: Sequence[float], outputs: Sequence[float], magnification: float) -> dict[str, Any]:
    return {
        "row": list(row),
        "outputs": list(outputs),
        "parameters": [],
        "magnification": magnification,
    }


def test_tool_of_the_robot_stays_within_the_frame(tmp_path: Path) -> None:
    surrogate, rng = read_fmu(ROBOT)[0], np.random.default_rng(3)
    low, high = (
        np.array([getattr(s, side) for s in surrogate.inputs]) for side in ("low", "high")
    )
    rows = rng.uniform(low, high, (200, len(low)))
    deviations = rng.uniform(-0.01, 0.01, (200, 3))
    cases = [_case(*pair, 25.0) for pair in zip(rows.tolist(), deviations.tolist(), strict=True)]
    for found in _drawn(cases, tmp_path):
        (x, y, _), (left, right, bottom, top) = found["places"]["tool"], found["view"]
        assert left + 0.05 < x < right - 0.05
        assert bottom + 0.05 < y < top - 0.05


def test_deflection_is_drawn_larger_by_the_chosen_factor(tmp_path: Path) -> None:
    rest, one, many = _drawn(
        [_case([0.3] * 6, out, f) for out, f in (([0] * 3, 1), ([1e-3] * 3, 1), ([1e-3] * 3, 25))],
        tmp_path,
    )
    for name, share in (("tool", 1.0), ("socket_0", 0.0)):
        at_rest = np.array(rest["places"][name])
        moved = np.array(one["places"][name]) - at_rest
        assert np.linalg.norm(moved) == pytest.approx(share * 1e-3 * np.sqrt(3))
        np.testing.assert_allclose(
            np.array(many["places"][name]) - at_rest, 25 * moved, atol=1e-12
        )


def test_trail_of_an_unknown_point_is_refused() -> None:
    drawing = {**robot(), "trail": "nose"}
    with refused(DrawingError, "trail = 'nose'", "tool"):
        checked_drawing(drawing, names_of(read_fmu(ROBOT)[0]), "robot")


@pytest.mark.extended
def test_page_shows_the_factor_and_all_outputs_in_one_column(
    chromium: Browser, tmp_path: Path
) -> None:
    path = tmp_path / "robot.html"
    write_page(ROBOT, path, drawing="mbs_models.pictures.page_drawings:robot")
    chromium.resize(1400, 900)
    chromium.open(path)
    shown = chromium.evaluate("document.getElementById('magnify').value")
    assert shown == f"{DEVIATION_SCALE:g}"
    lefts = chromium.evaluate(
        "[...document.querySelectorAll('.output')].map((e) => e.getBoundingClientRect().left)"
    )
    assert len(lefts) == 3
    assert len(set(lefts)) == 1
    assert chromium.complaints() == []
