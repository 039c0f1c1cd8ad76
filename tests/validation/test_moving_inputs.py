"""An FMU with moving inputs and its reference: with known inputs, and in the plain call."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slide_fmu.core.window import Window
from slide_fmu.data.draws import TEST, Stream, draw
from slide_fmu.fmu.export import export_fmu
from slide_fmu.recipe.case import case_of
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import Task
from slide_fmu.validation.validate import validate
from tests.fmu.moving_inputs import MovingOracle, forecasting
from tests.fmu.samples import sum_surrogate
from tests.libraries import build_libraries
from tests.progress import silent
from tests.recipes import tiny_recipe
from tests.validation.tiny_validation import accuracy_section

SAMPLES = 8
RECIPE = tiny_recipe(
    system={"model": "mbs_models.oscillators.oscillators:DuffingBaseMotion", "parameters": {}},
    data={"burn_in": 0.0, "duration": 1.0},
)


def surrogate_of(at_step_end: bool) -> Surrogate:
    """The sum of the last inputs."""
    system = case_of(RECIPE).system
    summing = replace(
        sum_surrogate(SAMPLES, "first_order"),
        name="tiny",
        window=Window(RECIPE.window.step, SAMPLES, 1),
        inputs=system.inputs,
        outputs=system.outputs,
    )
    return forecasting(summing, at_step_end)


@pytest.fixture(scope="module", params=[False, True], ids=["now", "step_end"])
def found(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Validation:
    build_libraries()
    surrogate = surrogate_of(request.param)
    fmu = export_fmu(surrogate, tmp_path_factory.mktemp("fmu") / "tiny.fmu")
    return validate(fmu, surrogate, case_of(RECIPE), Task(3, trajectories=1), silent)


def test_both_calls_are_measured_against_the_truth_at_the_same_times(found: Validation) -> None:
    """The true motion under inputs that are reached by the ends of steps."""
    one, system = found.comparisons[0], case_of(RECIPE).system
    drawn = draw(RECIPE, system, Stream(TEST, 3, (1.0, 1.0), RECIPE.data.duration), 0)
    true = simulate(system, drawn.inputs, drawn.initial).outputs[SAMPLES:]
    assert one.reference == pytest.approx(true, abs=1e-12)
    known = found.surrogate.predict_newest(drawn.inputs)[SAMPLES - 1 :]
    np.testing.assert_allclose(one.surrogate, known, rtol=1e-5, atol=1e-6)
    now = np.concatenate([drawn.inputs[:1], drawn.inputs[:-1]])
    if found.surrogate.inputs_at_step_end:
        expected = found.surrogate.predict_newest(now)
    else:
        moving, step = MovingOracle(found.surrogate), RECIPE.window.step
        expected = np.array([moving.step(step, row).results()[0] for row in now])
    assert one.plain is not None
    np.testing.assert_allclose(one.plain.surrogate, expected[SAMPLES - 1 :], rtol=1e-5, atol=1e-6)


def test_report_says_which_error_is_which(found: Validation) -> None:
    percent = f"{100 * found.figures().outputs[0].plain_relative_rmse:.3g} %"
    section = accuracy_section(found)
    assert section.table is not None
    assert section.table.heading[-1] == "relative RMSE, plain call"
    assert section.table.rows[0][-1] == percent
    said = "answers one step late" if found.surrogate.inputs_at_step_end else "forecasts what"
    assert said in section.text
