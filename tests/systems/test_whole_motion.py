"""A function over a whole motion by one call of scipy gives what it gives sample by sample."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slide_fmu.systems.errors import SimulationError
from slide_fmu.systems.function import whole_motion
from slide_fmu.systems.function.integration import Solver
from slide_fmu.systems.function.system import FunctionSystem
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate
from slide_fmu.systems.specification import Specification

STEP = 0.1
MODEL = """
inputs = {{"u": {{"unit": "N", "range": [-9, 9]}}}}
outputs = {{"y": {{"unit": "m", "range": [-9, 9]}}, "z": {{"unit": "m", "range": [-9, 9]}}}}
hold = "{hold}"
start = [0.0, 0.0]

def f({arguments}):
    return [x[1], u[0] {rate} - 20 * x[0] - x[1] - 3 * x[0] ** 3]

def g({arguments}):
    return [x[0], u[0] {rate}]
"""
INPUTS = 3 * np.sin(0.4 * np.arange(80.0))[:, None] + 1.0
TIGHT = Solver("DOP853", 1e-9, 1e-12)


def system_of(folder: Path, hold: str, rates: bool) -> FunctionSystem:
    arguments, rate = ("x, u, p, du", "+ 0.3 * du[0]") if rates else ("x, u, p", "")
    text = MODEL.format(hold=hold, arguments=arguments, rate=rate)
    (folder / "model.py").write_text(text, encoding="utf-8")
    system = load_system(Specification(str(folder / "model.py"), {}, STEP, "function"))
    assert isinstance(system, FunctionSystem)
    return system


@pytest.mark.parametrize(
    ("hold", "rates"), [("zero_order", False), ("first_order", False), ("first_order", True)]
)
@pytest.mark.parametrize("method", ["RK45", "DOP853", "LSODA"])
def test_whole_motion_gives_what_single_samples_give(
    tmp_path: Path, hold: str, rates: bool, method: str
) -> None:
    system = system_of(tmp_path, hold, rates)
    truth = simulate(system.with_solver(TIGHT), INPUTS).outputs
    whole = system.over_motions(Solver(method, 1e-8, 1e-10))
    found = simulate(whole, INPUTS).outputs
    # steps of the solver end where it likes, not where the inputs jump or turn
    np.testing.assert_allclose(found, truth, atol=2e-3 * np.ptp(truth))
    loose = simulate(system.over_motions(Solver(method, 1e-2, 1e-5)), INPUTS).outputs
    assert np.abs(found - truth).max() < np.abs(loose - truth).max()


def test_motion_that_calls_too_often_is_given_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(whole_motion, "MOST_CALLS", 1)
    system = system_of(tmp_path, "first_order", False)
    with pytest.raises(SimulationError, match="gives up: more than 81 calls of f"):
        simulate(system.over_motions(TIGHT), INPUTS)
