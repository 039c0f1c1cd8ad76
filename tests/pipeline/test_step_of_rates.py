"""The step of a model whose outputs follow the rates of its inputs is that of its fastest mode."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from slide_fmu.core.progress import quiet
from slide_fmu.propose.first_look import FirstLookSettings, look
from slide_fmu.systems.declared import SignalTable
from slide_fmu.systems.errors import LoadError
from slide_fmu.systems.specification import Specification
from tests.refusals import refused

MODEL = """
inputs = {"base": {"unit": "m", "range": [-0.1, 0.1]}}
outputs = {"force": "N"}
hold = "first_order"
start = [0.0, 0.0]
K, M, D = 4e4, 10.0, 400.0


def force(x, u, p, du):
    return K * (x[0] - u[0]) + D * (x[1] - du[0])


def f(x, u, p, du):
    return [x[1], -force(x, u, p, du) / M]


def g(x, u, p, du):
    return [force(x, u, p, du)]
"""
FORCE = {"force": SignalTable(range=(-2000.0, 2000.0))}
FASTEST = math.sqrt(4e4 / 10.0) / (2 * math.pi)


def looked(path: Path, text: str) -> tuple[float, str]:
    path.write_text(text, encoding="utf-8")
    specification = Specification(str(path), kind="function", outputs=FORCE)
    found = look(FirstLookSettings(specification, "", None), quiet)
    return found.step, found.origin


@pytest.mark.extended
def test_step_follows_from_the_fastest_mode(tmp_path: Path) -> None:
    step, origin = looked(tmp_path / "corner.py", MODEL)
    assert 0.5 < step * 10 * FASTEST <= 1.0
    assert f"The fastest mode at rest has {FASTEST:.3g} Hz" in origin


@pytest.mark.extended
def test_step_of_a_model_without_modes_is_asked_for(tmp_path: Path) -> None:
    text = MODEL.replace("return [x[1], -force(x, u, p, du) / M]", "return [0 * x[0], 0 * x[1]]")
    with refused(LoadError, "give --step SECONDS"):
        looked(tmp_path / "still.py", text)
