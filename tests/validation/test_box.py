"""The error of an FMU at constant inputs is measured at the corners of their ranges and inside."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from slide_fmu.core.window import Window
from slide_fmu.fmu.export import export_fmu
from slide_fmu.recipe.case import case_of
from slide_fmu.report.importer_sections import box_sections
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.box import box_figures
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import Task
from slide_fmu.validation.validate import validate
from tests.fmu.samples import sum_surrogate
from tests.libraries import build_libraries
from tests.progress import silent
from tests.recipes import tiny_recipe, whole_recipe

SAMPLES = 8
RECIPE = tiny_recipe(data={"burn_in": 0.5, "duration": 2.0})


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Validation]:
    """The sum of the last inputs in place of an oscillator."""
    build_libraries()
    system = case_of(RECIPE).system
    surrogate = dataclasses.replace(
        sum_surrogate(SAMPLES),
        name="tiny",
        window=Window(RECIPE.window.step, SAMPLES, 1),
        inputs=system.inputs,
        outputs=system.outputs,
    )
    fmu = export_fmu(surrogate, tmp_path_factory.mktemp("fmu") / "tiny.fmu")
    return fmu, validate(fmu, surrogate, case_of(RECIPE), Task(3, trajectories=1), silent)


def test_error_at_corners_is_that_of_the_rest_under_constant_inputs(
    found: tuple[Path, Validation],
) -> None:
    fmu, validation = found
    figures = box_figures(fmu, validation, case_of(validation.recipe), silent)
    assert figures is not None
    (signal,), system = validation.surrogate.inputs, case_of(RECIPE).system
    errors = []
    for end in (signal.low, signal.high):
        constant = np.full((400, 1), end)
        rest = simulate(system, constant, system.random_state(np.random.default_rng(0), [0.0]))
        answer = validation.surrogate.predict_newest(constant)[-1]
        errors.append(float((answer - rest.outputs[-1])[0]))
    reference = validation.comparisons[0].reference
    size = np.sqrt(np.mean((reference - reference.mean()) ** 2))
    output = figures.corners.outputs[0]
    assert figures.corners.points == 2
    assert output.largest_error == pytest.approx(np.max(np.abs(errors)), rel=1e-3)
    expected = np.sqrt(np.mean(np.square(errors))) / size
    assert output.relative_rmse == pytest.approx(expected, rel=1e-3)
    assert figures.steady.points == 8
    assert figures.steady.outputs[0].relative_rmse < output.relative_rmse


def test_report_has_a_row_for_corners_and_one_for_points_inside(
    found: tuple[Path, Validation],
) -> None:
    figures = box_figures(*found, case_of(found[1].recipe), silent)
    assert figures is not None
    (section,) = box_sections(figures)
    assert section.table is not None
    assert [row[0] for row in section.table.rows] == [
        "constant, at the corners of the inputs (2 points)",
        "constant, inside of their ranges (8 points)",
    ]


def test_planned_motions_and_drives_have_no_such_figures(found: tuple[Path, Validation]) -> None:
    fmu, validation = found
    moves = {"kind": "point_to_point", "weight": 1.0}
    driven = whole_recipe(
        {**RECIPE.model_dump(), "data": {**RECIPE.data.model_dump(), "excitation": [moves]}}
    )
    assert (
        box_figures(
            fmu,
            dataclasses.replace(validation, recipe=driven),
            case_of(dataclasses.replace(validation, recipe=driven).recipe),
            silent,
        )
        is None
    )
