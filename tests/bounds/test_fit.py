"""The whole way from trajectories to a surrogate, short and real."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Never

import numpy as np
import pytest
import torch

from slide_fmu.bounds.fit import fit_surrogate
from slide_fmu.core.measures import rms
from slide_fmu.core.scaling import range_scaling
from slide_fmu.core.signals import Signal
from slide_fmu.data.generation import generate
from slide_fmu.data.trajectories import Split
from slide_fmu.fitting.network import FITS, Fit
from slide_fmu.fitting.preparation import (
    Work,
    eigenvalues_at_rest,
    require_symmetry,
    standard_deviation_scaling,
)
from slide_fmu.fitting.problem import Problem
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.learning import StateSpaceRecipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.validation.response import exact_matrix, learnt_matrix, response_figures
from tests.progress import no_stages, silent
from tests.recipes import (
    ESTIMATOR,
    recipe_of_model,
    tiny_recipe,
    tiny_state_space_recipe,
    with_expert,
)
from tests.refusals import refused
from tests.trajectories import read_split

SMALL_ERROR = 1e-3
"""Relative RMSE after two seconds of training; the released recipe reaches 1e-5."""

TORCH_IS_NUMPY = 2e-6
"""Of the output's range; the bound of the project for torch = numpy = C = FMU."""

SINGLE = 2.0**-24
"""Relative rounding of float32, in which networks see features."""

LEARNING = tiny_recipe(
    data={"duration": 8.0, "train": 16, "estimator": 4, "estimator_validation": 2},
    training={
        "steps": 1500,
        "batch": 256,
        "learning_rate": 1e-2,
        "expert": {"precision": "float64", "validate_every": 250},
    },
    estimator=ESTIMATOR,
)


JUMPING = """
inputs = {"force": {"unit": "N", "range": [-1.0, 1.0]}}
outputs = {"position": {"unit": "m", "range": [-0.01, 0.01]}}
hold = "first_order"
start = [0.0, 0.0]
f = lambda x, u, p: [x[1], u[0] - 1600 * x[0] - 40 * x[1]]
g = lambda x, u, p: [x[0]]
"""
"""A model with an input that moves."""


def fitted(recipe: Recipe, trajectories: Path, checkpoints: Path) -> Fit:
    return fit_surrogate(Work(case_of(recipe), trajectories, checkpoints, no_stages))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Holds the trajectories, and checkpoints after the first fit."""
    path = tmp_path_factory.mktemp("fit")
    with ThreadPoolExecutor(1) as pool:
        generate(case_of(LEARNING), path / "trajectories", pool, silent)
    return path


@pytest.fixture(scope="module")
def fit(folder: Path) -> Fit:
    return fitted(LEARNING, folder / "trajectories", folder / "checkpoints")


@pytest.mark.extended
def test_short_fit_reaches_a_small_error(fit: Fit, folder: Path) -> None:
    test = read_split(LEARNING, folder / "trajectories", "estimator_validation")
    window = fit.surrogate.window
    for inputs, outputs in zip(test.inputs, test.outputs, strict=True):
        for predicted in (fit.surrogate.predict(inputs), fit.surrogate.predict_newest(inputs)):
            error = (predicted - outputs[1:])[window.n_in :]
            assert rms(error)[0] < SMALL_ERROR * rms(outputs)[0]


def test_learnt_matrix_is_the_exact_one(fit: Fit) -> None:
    exact = exact_matrix(case_of(LEARNING).system, fit.surrogate.window)
    figures = response_figures(learnt_matrix(fit.surrogate), exact)
    assert figures.max_deviation_relative < SMALL_ERROR
    assert figures.max_above_diagonal_relative < SMALL_ERROR


def test_surrogate_does_not_depend_on_its_estimator(fit: Fit, folder: Path) -> None:
    assert fit.histories.keys() == {"surrogate", "error estimator"}
    # after so few steps it says less than a constant
    assert fit.surrogate.estimator is None
    remark = fit.histories["error estimator"].remark
    assert remark is not None
    assert remark.startswith("the FMU has no error estimate, since it would say no more than a")
    alone = LEARNING.model_copy(update={"estimator": None})
    other = fitted(alone, folder / "trajectories", folder / "other")
    assert other.surrogate.estimator is None
    assert other.histories == {"surrogate": fit.histories["surrogate"]}
    inputs = read_split(LEARNING, folder / "trajectories", "estimator_validation").inputs[0]
    assert np.array_equal(other.surrogate.predict(inputs), fit.surrogate.predict(inputs))


def test_surrogate_whose_errors_do_not_matter_gets_no_estimator_and_a_remark(
    fit: Fit, folder: Path
) -> None:
    assert LEARNING.estimator is not None
    coarse = LEARNING.estimator.expert.model_copy(update={"resolution": 10.0})
    estimator = LEARNING.estimator.model_copy(update={"expert": coarse})
    recipe = LEARNING.model_copy(update={"estimator": estimator})
    exact = fitted(recipe, folder / "trajectories", folder / "checkpoints")
    assert exact.surrogate.to_bytes() == fit.surrogate.to_bytes()
    assert exact.histories.keys() == {"surrogate"}
    remark = exact.histories["surrogate"].remark
    assert remark is not None
    assert "has no error estimate, since the largest relative error of the surrogate is" in remark


def test_finished_fit_is_found_again_and_another_recipe_is_not(fit: Fit, folder: Path) -> None:
    again = fitted(LEARNING, folder / "trajectories", folder / "checkpoints")
    assert again.surrogate.to_bytes() == fit.surrogate.to_bytes()
    before = {path.name for path in (folder / "checkpoints").glob("*.pt")}
    assert len(before) == 2
    other = LEARNING.model_copy(
        update={"training": LEARNING.training.model_copy(update={"seed": 1, "steps": 5})}
    )
    surrogate = fitted(other, folder / "trajectories", folder / "checkpoints").surrogate
    assert surrogate.to_bytes() != fit.surrogate.to_bytes()
    assert len({path.name for path in (folder / "checkpoints").glob("*.pt")} - before) == 2


@pytest.mark.parametrize("time_invariant", [True, False])
def test_both_forms_of_the_network_fit(folder: Path, tmp_path: Path, time_invariant: bool) -> None:
    changes = {"time_invariant": time_invariant, "hidden": (4,), "linear_skip": True}
    recipe = LEARNING.model_copy(
        update={
            "estimator": None,
            "network": LEARNING.network.model_copy(update=changes),
            "training": with_expert(LEARNING.training, flip_signs=True, steps=5),
        }
    )
    surrogate = fitted(recipe, folder / "trajectories", tmp_path).surrogate
    assert (surrogate.network.n_values == 1) is time_invariant
    assert surrogate.network.n_samples == (41 if time_invariant else 48)


def test_scalings_are_those_of_ranges_and_standard_deviations() -> None:
    signals = (Signal("a", "N", -2.0, 6.0), Signal("b", "m", 0.0, 1.0))
    scaling = range_scaling(signals)
    assert scaling.apply(np.array([[-2.0, 0.0], [6.0, 1.0]])).tolist() == [[-1, -1], [1, 1]]
    outputs = np.random.default_rng(0).normal(5.0, [3.0, 0.5], (4, 500, 2))
    split = Split(outputs[:, 1:], outputs, np.zeros(4, np.int64))
    scaling = standard_deviation_scaling(signals, split)
    assert scaling.offset.tolist() == [2.0, 0.5]
    assert scaling.scale == pytest.approx([3.0, 0.5], rel=0.05)
    outputs[:, :, 1] = 0.25
    with refused(ValueError, "'b' is constant", "training data"):
        standard_deviation_scaling(signals, split)


def test_signs_are_flipped_of_symmetric_signals_only() -> None:
    signals = (Signal("force", "N", -2.0, 2.0), Signal("position", "m", -1.5, 3.5))
    require_symmetry(signals[:1])
    with refused(ValueError, "'position' is -1", "of 'position'"):
        require_symmetry(signals)


def state_space_recipe(**training: Any) -> Recipe:
    """The recipe of the same data with a small state-space network."""
    return tiny_state_space_recipe(
        data=LEARNING.data.model_dump(mode="json"),
        network={"hidden": 3, "padding": 1},
        training={
            "starts": 2, "iterations": 4, **training,
            "expert": {
                "segment": 128, "part": 4, "start_iterations": 3, "kept": 1, "kept_iterations": 3,
            },
        },
    )  # fmt: skip


STATE_SPACE = state_space_recipe()


@pytest.fixture(scope="module")
def state_space(folder: Path) -> Fit:
    return fitted(STATE_SPACE, folder / "trajectories", folder / "state_space")


def test_state_space_network_reaches_a_small_error(state_space: Fit, folder: Path) -> None:
    test = read_split(LEARNING, folder / "trajectories", "estimator_validation")
    surrogate = state_space.surrogate
    for inputs, outputs in zip(test.inputs, test.outputs, strict=True):
        for predicted in (surrogate.predict(inputs), surrogate.predict_newest(inputs)):
            error = (predicted - outputs[1:])[surrogate.window.n_in :]
            assert rms(error)[0] < SMALL_ERROR * rms(outputs)[0]


def test_order_comes_from_the_eigenvalues_of_the_system(state_space: Fit) -> None:
    (value,) = eigenvalues_at_rest(case_of(STATE_SPACE).system)
    # m = 1 kg, d = 40 N s/m, k = 1600 N/m
    assert complex(value) == pytest.approx(complex(-20, np.sqrt(1200)), rel=1e-4)
    network = state_space.surrogate.network
    assert isinstance(network, StateSpace)
    assert network.cell.w.shape == (3, 2 + 1 + 1 + 1)
    assert (network.n_samples, network.n_out) == (48, 8)


@pytest.mark.extended
def test_same_seed_gives_the_same_bytes_and_another_seed_others(
    state_space: Fit, folder: Path, tmp_path: Path
) -> None:
    content = state_space.surrogate.to_bytes()
    torch.manual_seed(99)
    again = fitted(STATE_SPACE, folder / "trajectories", tmp_path)
    assert again.surrogate.to_bytes() == content
    assert again.histories == state_space.histories
    other = fitted(state_space_recipe(seed=1), folder / "trajectories", tmp_path)
    assert other.surrogate.to_bytes() != content
    assert len(list(tmp_path.glob("*.pt"))) == 2


@pytest.mark.extended
def test_trajectories_beyond_the_range_reach_the_fit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Scaled as the others, so that their inputs leave [-1, 1]; checkpoints depend on them."""

    class Reached(Exception):
        pass

    def reached(problem: Problem, *rest: object) -> Never:
        raise Reached(problem)

    monkeypatch.setitem(FITS, StateSpaceRecipe, reached)
    problems = []
    for beyond in (0, 2, 3):
        counts = {"train": 2, "beyond": beyond, "beyond_factor": (1.5, 2.0)}
        recipe, store = tiny_state_space_recipe(data=counts), tmp_path / str(beyond)
        with ThreadPoolExecutor(1) as pool:
            generate(case_of(recipe), store, pool, silent)
        with pytest.raises(Reached) as caught:
            fitted(recipe, store, tmp_path)
        problems.append(caught.value.args[0])
    without, two, three = problems
    assert without.beyond is None
    assert len({problem.checkpoint for problem in problems}) == 3
    inputs, outputs = three.beyond
    assert inputs.shape == (3, without.training[0].shape[1], 1)
    assert outputs.shape == (3, inputs.shape[1] + 1, 1)
    assert torch.equal(inputs[:2], two.beyond[0])
    assert torch.equal(three.training[1], without.training[1])
    largest = inputs.abs().amax((1, 2))
    assert 1.2 < float(largest.min()) <= float(largest.max()) <= 2.0
    signal = case_of(STATE_SPACE).system.inputs[0]
    split = read_split(recipe, tmp_path / "3", "beyond")
    assert np.allclose(signal.high * inputs.numpy(), split.inputs, rtol=SINGLE, atol=0)


def test_fit_tells_its_cpu_time_which_a_fit_that_is_found_again_keeps(
    fit: Fit, folder: Path
) -> None:
    seconds = fit.histories["surrogate"].cpu_seconds
    assert seconds is not None
    assert seconds > 0
    again = fitted(LEARNING, folder / "trajectories", folder / "checkpoints")
    kept = again.histories["surrogate"].cpu_seconds
    assert kept is not None
    assert seconds <= kept < seconds + 5


@pytest.mark.parametrize("jumps", [False, True])
def test_surrogate_says_whether_inputs_jumped_in_the_training(tmp_path: Path, jumps: bool) -> None:
    kind = {"kind": "steps", "weight": 1.0, "duration": (0.05, 0.5)}
    recipe = recipe_of_model(
        tmp_path / "model.py",
        data={"train": 2, "jumps": jumps, "substeps": 4, "excitation": [kind]},
    )
    (tmp_path / "model.py").write_text(JUMPING, encoding="utf-8")
    with ThreadPoolExecutor(1) as pool:
        generate(case_of(recipe), tmp_path / "trajectories", pool, silent)
    forecast = fitted(
        recipe, tmp_path / "trajectories", tmp_path / "checkpoints"
    ).surrogate.forecast
    assert forecast is not None
    assert forecast.jumps == jumps
