"""What `try` would say of a proposed recipe is said at once, or heeded."""

from __future__ import annotations

from pathlib import Path

import pytest

from slide_fmu.memory.bandwidth import ProposedStep
from slide_fmu.memory.step_remark import TOO_COARSE
from slide_fmu.propose import first_look
from slide_fmu.propose.proposal import InitOptions, propose
from slide_fmu.recipe.reading import parse_open_recipe
from tests.progress import silent

OSCILLATOR = '''
"""A mass on a spring."""

inputs = {"push": {"unit": "N", "range": [-1.0, 1.0]}}
outputs = {"place": "m"}
parameters = {"damping": 0.4}
start = [0.0, 0.0]


def f(x, u, p):
    return [x[1], u[0] - 4.0 * x[0] - p.damping * x[1]]


def g(x, u, p):
    return [x[0]]
'''
FRINGES = '''
"""A slow mirror, whose light changes from bright to dark many times."""

import math

inputs = {"drive": {"unit": "V", "range": [-1.0, 1.0]}}
outputs = {"light": "1", "place": "m"}
start = [0.0]


def f(x, u, p):
    return [(u[0] - x[0]) / 0.3]


def g(x, u, p):
    return [math.sin(60.0 * x[0]), x[0]]
'''


def written(folder: Path, text: str) -> str:
    path = folder / "model.py"
    path.write_text(text)
    return str(path)


@pytest.mark.usefixtures("brief")
@pytest.mark.parametrize("damping", [0.4, 0.0])
def test_undamped_model_is_proposed_but_its_refusal_is_announced(
    tmp_path: Path, damping: float
) -> None:
    path = written(tmp_path, OSCILLATOR.replace("0.4}", f"{damping}}}"))
    found = propose(InitOptions(path, step=0.1), silent)
    refusals = [remark for remark in found.remarks if "try will refuse the recipe" in remark]
    assert parse_open_recipe(found.text, "proposal").guess.window.step == 0.1
    assert len(refusals) == (damping == 0.0)
    assert all("give the system damping" in remark for remark in refusals)


@pytest.mark.extended
@pytest.mark.usefixtures("brief")
def test_step_is_made_finer_until_try_agrees(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path, FRINGES)
    given = propose(InitOptions(path, step=0.2), silent)
    assert any(TOO_COARSE in remark for remark in given.remarks)
    assert parse_open_recipe(given.text, "proposal").guess.window.step == 0.2
    seen = ProposedStep(0.2, 0.5)
    monkeypatch.setattr(first_look, "proposed_step", lambda *_: seen)
    found = propose(InitOptions(path, jumps=False), silent)  # jumps show still less
    (alone,) = found.remarks  # its functions take one state alone
    assert "for each motion alone" in alone
    assert parse_open_recipe(found.text, "proposal").guess.window.step == 0.1
    assert "At 0.2 s, samples do not show what is between them." in " ".join(
        found.text.replace("#", "").split()
    )
