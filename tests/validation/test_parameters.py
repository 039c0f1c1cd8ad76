"""Surrogates with physical parameters: learnt from a recipe, tested at corners, measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.bounds.fit import fit_surrogate
from slide_fmu.core.parameters import corners_of
from slide_fmu.core.scaling import range_scaling
from slide_fmu.core.signals import Signal
from slide_fmu.data.draws import TEST, Stream
from slide_fmu.data.generation import generate
from slide_fmu.data.parameter_draws import drawn_parameters
from slide_fmu.features.base import FeatureOffer
from slide_fmu.fitting.network import Fit
from slide_fmu.fitting.preparation import Work, require_chosen_features
from slide_fmu.fmu.export import export_fmu
from slide_fmu.memory import stability
from slide_fmu.memory.stability import check_stability
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.report.accuracy_sections import validation_sections
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import Task
from slide_fmu.validation.validate import validate
from tests.estimates import kept_estimates
from tests.marks import needs_app
from tests.progress import silent
from tests.recipes import ESTIMATOR, tiny_state_space_recipe
from tests.refusals import refused

TABLES: dict[str, Any] = {
    "parameters": {"mass": {"range": [1.0, 2.0], "unit": "kg", "transform": "log"}},
    "data": {"train": 10, "validation": 4, "estimator": 4, "estimator_validation": 2},
    "network": {"order": 2, "hidden": 0},
    "training": {"iterations": 15, "expert": {"segment": 32}},
    "estimator": {**ESTIMATOR, "expert": {"resolution": 1e-9}},
}
RECIPE: Recipe = tiny_state_space_recipe(**TABLES)
SMALL = 2e-3
"""Relative error of a linear network whose weights are parabolas of the logarithm of the mass."""


@pytest.fixture(scope="module")
def fit(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    folder = tmp_path_factory.mktemp("learnt")
    generate(case_of(RECIPE), folder / "trajectories", None, silent)
    store, states = folder / "trajectories", folder / "states"
    with kept_estimates():
        return fit_surrogate(Work(case_of(RECIPE), store, states, lambda _name: silent))


@pytest.fixture(scope="module")
def found(fit: Fit, tmp_path_factory: pytest.TempPathFactory) -> Validation:
    fmu = export_fmu(fit.surrogate, tmp_path_factory.mktemp("fmu") / "tiny.fmu")
    task = Task(3, trajectories=4, duration=2.0)
    return validate(fmu, fit.surrogate, case_of(RECIPE), task, silent)


@pytest.mark.extended
@needs_app("credentials")
def test_experiment_has_the_start_values_of_parameters(fit: Fit, tmp_path: Path) -> None:
    from slide_fmu.apps.credentials.make_experiment import make_experiment

    fmu = export_fmu(fit.surrogate, tmp_path / "tiny.fmu")
    experiment = make_experiment(fmu, fit.surrogate, case_of(RECIPE), 3)
    (mass,) = RECIPE.physical()
    # its inputs are held: the experiment tells the FMU so
    assert experiment.parameters == {"mass": mass.start_value, "inputs_held": 1.0}
    (error,) = experiment.relative_errors().values()
    assert error < SMALL


def test_surrogate_of_a_recipe_follows_its_parameters(fit: Fit) -> None:
    surrogate = fit.surrogate
    assert surrogate.parameters == RECIPE.physical()
    assert surrogate.estimator is not None
    rng = np.random.default_rng(5)
    record = rng.uniform(-2000, 2000, (300, 1))
    for mass in (1.0, 1.3, 2.0):
        system = case_of(RECIPE.at({"mass": mass})).system
        expected = simulate(system, record, None).outputs[1:]
        error = surrogate.predict_newest(record, {"mass": mass}) - expected
        settled = slice(surrogate.window.n_in, None)
        assert error[settled].std() < SMALL * expected[settled].std()


def test_every_trajectory_has_unseen_values(found: Validation) -> None:
    stream = Stream(TEST, 3, (1.0, 1.0), 2.0)
    expected = [drawn_parameters(RECIPE, stream, index) for index in range(4)]
    assert [dict(comparison.parameters) for comparison in found.comparisons] == expected
    assert [dict(c.parameters) for c in found.corners] == corners_of(RECIPE.physical())


def test_errors_are_those_of_the_system_with_these_values(found: Validation) -> None:
    for comparison in (*found.comparisons, *found.corners):
        single = comparison.error.std() / comparison.reference.std()
        assert single < SMALL
    (output,) = found.figures().outputs
    assert output.relative_rmse < SMALL


def test_figures_and_report_tell_the_errors_by_values(found: Validation) -> None:
    figures = found.figures().parameters
    assert figures.names == ("mass",)
    assert [point.values["mass"] for point in figures.corners] == [1.0, 2.0]
    assert len(figures.unseen) == 4
    assert all(0 < row.relative_rmse[0] < SMALL for row in figures.unseen)
    (section,) = [s for s in validation_sections({"in range": found}) if "Physical" in s.title]
    assert section.table is not None
    assert section.table.heading == ("values", "mass", "relative RMSE")
    assert [row[0] for row in section.table.rows] == ["corner"] * 2 + ["measured, worst"] * 4
    assert "values of the physical parameters that no training saw" in section.text


def test_stability_is_that_of_the_worst_corner(fit: Fit) -> None:
    case = case_of(RECIPE)
    tests = check_stability(fit.surrogate, case)
    corners = [
        check_stability(fit.surrogate.at(corner), case) for corner in corners_of(RECIPE.physical())
    ]
    assert len(tests) == len(RECIPE.stability.amplitudes)
    for index, test in enumerate(tests):
        worst = max(float(np.max(one[index].differences)) for one in corners)
        assert float(np.max(test.differences)) == worst


def test_failure_names_the_corner(fit: Fit, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stability, "GROWTH", 1e-3)
    monkeypatch.setattr(stability, "BESIDE_MODEL", 1e-3)
    for test in check_stability(fit.surrogate, case_of(RECIPE)):
        assert test.problem is not None
        assert test.problem.startswith("with mass = ")


def test_features_of_angles_must_be_named() -> None:
    turn = (Signal("angle", "rad", -3.0, 3.0),)
    offered = FeatureOffer(turn, range_scaling(turn), 0.01, None)
    with refused(RecipeError, "network.drive is"):
        require_chosen_features(RECIPE, offered, 1)
    named = tiny_state_space_recipe(**{**TABLES, "network": {"drive": ["direction"]}})
    require_chosen_features(named, offered, 1)
    straight = (Signal("force", "N", -3.0, 3.0),)
    require_chosen_features(RECIPE, FeatureOffer(straight, range_scaling(straight), 0.01, None), 1)
