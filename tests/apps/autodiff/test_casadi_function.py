"""A surrogate in CasADi has the derivatives of the runtime, and ipopt solves problems with it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slide_fmu as slide
from slide_fmu.fmu.native import NativeError, NativeSurrogate
from tests.fmu.samples import sum_surrogate
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
QUIET = {
    "ipopt.hessian_approximation": "limited-memory",
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "print_time": 0,
}


@pytest.fixture(scope="module")
def casadi() -> Any:
    return pytest.importorskip("casadi", reason="needs the extra 'casadi'")


def released(name: str) -> slide.Surrogate:
    return slide.load(ROOT / "fmus" / name / f"{name}.fmu")


def test_function_of_the_crank_gives_the_outputs_of_the_runtime(casadi: Any) -> None:
    crank = released("slider_crank")
    angle = np.linspace(0, 3, 40)
    record = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    found = slide.casadi_function(crank, 40)(record).full()
    np.testing.assert_array_equal(found, NativeSurrogate(crank).predict(record))


def test_jacobian_of_the_crank_is_that_of_the_runtime(casadi: Any) -> None:
    crank, samples = released("slider_crank"), 20
    function = slide.casadi_function(crank, samples)
    symbol = casadi.MX.sym("record", samples, 2)
    jacobian = casadi.Function("j", [symbol], [casadi.jacobian(function(symbol), symbol)])
    angle = np.linspace(0, 3, samples)
    record = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    found = jacobian(record).full()
    outputs = len(crank.outputs)
    weights = np.eye(samples * outputs).reshape(-1, outputs, samples).transpose(0, 2, 1)
    records = np.broadcast_to(record, (len(weights), samples, 2))
    slopes = NativeSurrogate(crank).vjp(records, weights)
    # CasADi counts the entries of a matrix column by column
    expected = slopes.transpose(0, 2, 1).reshape(found.shape)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    assert np.abs(expected).max() > 0


def test_ipopt_moves_the_duffing_from_rest_to_rest(casadi: Any) -> None:
    """The smoothest force that leaves at most 1 mm after 1.2 s: the runtime confirms it."""
    duffing, goal, end, samples, tolerance = released("duffing"), 600.0, 40, 120, 1e-3
    function = slide.casadi_function(duffing, samples)
    force = casadi.MX.sym("force", end)
    outputs = function(casadi.vertcat(force, goal * np.ones(samples - end)))
    rest = float(duffing.predict_newest(np.array([[goal]]))[0, 0])
    changes = casadi.vertcat(force, goal) - casadi.vertcat(0, force)
    problem = {
        "x": force,
        "f": casadi.sumsqr(changes / goal),
        "g": (outputs[end:] - rest) / tolerance,
    }
    solver = casadi.nlpsol("solver", "ipopt", problem, {**QUIET, "ipopt.tol": 1e-4})
    start = np.linspace(0, goal, end)
    found = solver(x0=start, lbx=-1000, ubx=1000, lbg=-1, ubg=1)
    assert solver.stats()["return_status"] == "Solve_Succeeded"

    def left(forces: np.ndarray[Any, Any]) -> float:
        record = np.concatenate([forces, np.full(samples - end, goal)])[:, None]
        return float(np.abs(duffing.predict_newest(record)[end:, 0] - rest).max())

    assert left(start) > 5 * tolerance
    assert left(found["x"].full()[:, 0]) < 1.01 * tolerance


def test_function_of_layers_or_without_samples_is_refused(casadi: Any) -> None:
    with refused(NativeError, "FeedForward", "expected one of the family", "family 'state_sp"):
        slide.casadi_function(sum_surrogate(), 10)
    for samples in (0, 1.5, "20"):
        with pytest.raises(ValueError, match=f"samples: {samples!r}; expected a whole number"):
            slide.casadi_function(released("duffing"), samples)  # type: ignore[arg-type]


def test_without_the_package_the_error_names_the_extra() -> None:
    program = (
        "import sys; sys.modules['casadi'] = None; import slide_fmu as slide\n"
        "slide.casadi_function(slide.load('fmus/duffing/duffing.fmu'), 5)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True
    )
    assert "pip install 'slide-fmu[casadi]'" in done.stderr
