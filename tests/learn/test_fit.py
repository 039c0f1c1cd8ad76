"""The whole way from trajectories to a surrogate, short and real."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import torch
from recipes import ESTIMATOR, tiny_recipe

from slide_fmu.data.generation import generate
from slide_fmu.data.sampling import recipe_system
from slide_fmu.data.store import Split, read_split
from slide_fmu.errors import rms
from slide_fmu.learn.feed_forward import FeedForwardModule
from slide_fmu.learn.fit import Fit, fit_surrogate, range_scaling, require_symmetry, spread_scaling
from slide_fmu.recipe import Recipe
from slide_fmu.response import exact_matrix, learnt_matrix, matrix_figures
from slide_fmu.signals import Signal

SMALL_ERROR = 1e-3
"""Relative RMSE after two seconds of training; the released recipe reaches 1e-5."""

TORCH_IS_NUMPY = 2e-6
"""Of the output's range; the bound of the project for torch = numpy = C = FMU."""

LEARNING = tiny_recipe(
    data={"duration": 8.0, "train": 16, "estimator": 4, "estimator_validation": 2},
    training={
        "steps": 1500,
        "batch": 256,
        "learning_rate": 1e-2,
        "precision": "float64",
        "validate_every": 250,
    },
    estimator=ESTIMATOR,
)


def no_progress(stage: str):  # type: ignore[no-untyped-def]
    return lambda done, total, best: None


def fitted(recipe: Recipe, store: Path, checkpoints: Path) -> Fit:
    return fit_surrogate(recipe, recipe_system(recipe), store, checkpoints, no_progress)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Holds the trajectories, and checkpoints after the first fit."""
    path = tmp_path_factory.mktemp("fit")
    with ThreadPoolExecutor(1) as pool:
        generate(LEARNING, path / "store", pool, lambda done, total: None)
    return path


@pytest.fixture(scope="module")
def fit(folder: Path) -> Fit:
    return fitted(LEARNING, folder / "store", folder / "checkpoints")


def test_short_fit_reaches_a_small_error(fit: Fit, folder: Path) -> None:
    test = read_split(folder / "store", "estimator_validation")
    window = fit.surrogate.window
    for inputs, outputs in zip(test.inputs, test.outputs, strict=True):
        for predicted in (fit.surrogate.predict(inputs), fit.surrogate.predict_newest(inputs)):
            error = (predicted - outputs[1:])[window.n_in :]
            assert rms(error)[0] < SMALL_ERROR * rms(outputs)[0]


def test_learnt_matrix_is_the_exact_one(fit: Fit) -> None:
    exact = exact_matrix(recipe_system(LEARNING), fit.surrogate.window)
    figures = matrix_figures(learnt_matrix(fit.surrogate), exact)
    assert figures["max_deviation_relative"] < SMALL_ERROR
    assert figures["max_above_diagonal_relative"] < SMALL_ERROR


def test_torch_is_numpy(fit: Fit, folder: Path) -> None:
    """The best weights of the checkpoint, in float64, on unseen windows."""
    (checkpoint,) = (folder / "checkpoints").glob("surrogate-*.pt")
    surrogate, window = fit.surrogate, fit.surrogate.window
    module = FeedForwardModule(LEARNING.network, window.n_in, 1, window.n_out).double()
    module.load_state_dict(torch.load(checkpoint, weights_only=True)["best"])
    test = read_split(folder / "store", "estimator_validation")
    windows = test.inputs[0][window.input_indices(window.starts(len(test.inputs[0])))]
    with torch.no_grad():
        values = module(torch.from_numpy(surrogate.input_scaling.apply(windows))).numpy()
    expected = surrogate.output_scaling.invert(values[:, :, None])
    found = surrogate.predict_windows(windows)
    assert np.max(np.abs(found - expected)) < TORCH_IS_NUMPY * np.ptp(expected)


def test_surrogate_does_not_depend_on_its_estimator(fit: Fit, folder: Path) -> None:
    assert fit.surrogate.estimator is not None
    assert fit.histories.keys() == {"surrogate", "error estimator"}
    alone = LEARNING.model_copy(update={"estimator": None})
    other = fitted(alone, folder / "store", folder / "other")
    assert other.surrogate.estimator is None
    assert other.histories == {"surrogate": fit.histories["surrogate"]}
    inputs = read_split(folder / "store", "estimator_validation").inputs[0]
    assert np.array_equal(other.surrogate.predict(inputs), fit.surrogate.predict(inputs))


def test_finished_fit_is_found_again_and_another_recipe_is_not(fit: Fit, folder: Path) -> None:
    again = fitted(LEARNING, folder / "store", folder / "checkpoints")
    assert again.surrogate.to_bytes() == fit.surrogate.to_bytes()
    before = {path.name for path in (folder / "checkpoints").iterdir()}
    assert len(before) == 2
    other = LEARNING.model_copy(
        update={"training": LEARNING.training.model_copy(update={"seed": 1, "steps": 5})}
    )
    surrogate = fitted(other, folder / "store", folder / "checkpoints").surrogate
    assert surrogate.to_bytes() != fit.surrogate.to_bytes()
    assert len({path.name for path in (folder / "checkpoints").iterdir()} - before) == 2


@pytest.mark.parametrize("time_invariant", [True, False])
def test_both_forms_of_the_network_fit(folder: Path, tmp_path: Path, time_invariant: bool) -> None:
    changes = {"time_invariant": time_invariant, "hidden": (4,), "linear_skip": True}
    recipe = LEARNING.model_copy(
        update={
            "estimator": None,
            "network": LEARNING.network.model_copy(update=changes),
            "training": LEARNING.training.model_copy(update={"steps": 5, "flip_signs": True}),
        }
    )
    surrogate = fitted(recipe, folder / "store", tmp_path).surrogate
    assert surrogate.gives_blocks is not time_invariant
    assert surrogate.network.n_samples == (41 if time_invariant else 48)


def test_scalings() -> None:
    signals = (Signal("a", "N", -2.0, 6.0), Signal("b", "m", 0.0, 1.0))
    scaling = range_scaling(signals)
    assert scaling.apply(np.array([[-2.0, 0.0], [6.0, 1.0]])).tolist() == [[-1, -1], [1, 1]]
    outputs = np.random.default_rng(0).normal(5.0, [3.0, 0.5], (4, 500, 2))
    split = Split(outputs[:, 1:], outputs, np.zeros(4, np.int64))
    scaling = spread_scaling(signals, split)
    assert scaling.offset.tolist() == [2.0, 0.5]
    assert scaling.scale == pytest.approx([3.0, 0.5], rel=0.05)
    outputs[:, :, 1] = 0.25
    with pytest.raises(ValueError, match="output 'b' is constant in the training data"):
        spread_scaling(signals, split)


def test_signs_are_flipped_of_symmetric_signals_only() -> None:
    signals = (Signal("force", "N", -2.0, 2.0), Signal("position", "m", -1.5, 3.5))
    require_symmetry(signals[:1])
    with pytest.raises(ValueError, match=r"in a training, but the range of 'position' is -1.5"):
        require_symmetry(signals)
