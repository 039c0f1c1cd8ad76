"""The page about motions shows what its task gives."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from slide_fmu.apps.motion import MoveTask, read_task
from slide_fmu.apps.motion.solve import solve

ROOT = Path(__file__).parents[3]


@pytest.mark.extended
def test_headline_of_the_page_is_what_the_reference_model_gives() -> None:
    """An optimisation may end a sample later on another processor, whose sums round elsewhere."""
    task = read_task(ROOT / "docs/tutorials/turned_payload.toml")
    assert isinstance(task, MoveTask)
    fmu = ROOT / "fmus/slider_crank_payload/slider_crank_payload.fmu"
    true = solve(fmu, task, verify=True).figures().reference
    assert true is not None
    plain = true.baselines[0]
    shaper = min(true.baselines[1:], key=lambda move: move.settled_s or float("inf"))
    page = (ROOT / "docs/motion.md").read_text("utf-8")
    for move in (plain, shaper):
        assert f"| {move.settled_s:.2f} s | {1e3 * move.residual:.3g} mm |" in page
    row = re.search(r"\| optimised \| ([\d.]+) s \| ([\d.]+) mm \|", page)
    assert row is not None
    assert true.move.settled_s == pytest.approx(float(row[1]), abs=0.035)
    assert 1e3 * true.move.residual == pytest.approx(float(row[2]), rel=0.2)
    assert 1e3 * true.move.residual < 0.5
