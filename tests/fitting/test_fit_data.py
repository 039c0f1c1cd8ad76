"""What a fit makes of its trajectories: refusals, precision, and names of checkpoints."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, Never

import numpy as np
import pytest
import torch

from slide_fmu.bounds.fit import fit_surrogate
from slide_fmu.core.signals import Signal
from slide_fmu.data.generation import generate
from slide_fmu.data.trajectories import Split, Trajectories
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting import checkpoint
from slide_fmu.fitting import preparation as module
from slide_fmu.fitting.network import FITS
from slide_fmu.fitting.preparation import STILL, Work, require_motion
from slide_fmu.fitting.problem import Problem
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from tests.progress import no_stages, silent
from tests.recipes import ESTIMATOR, tiny_recipe, tiny_state_space_recipe, with_expert
from tests.trajectories import read_split

FEED_FORWARD = tiny_recipe(
    data={"estimator": 2, "estimator_validation": 1}, training={"steps": 2}, estimator=ESTIMATOR
)
STATE_SPACE = tiny_state_space_recipe(data=FEED_FORWARD.data.model_dump(mode="json"))


@pytest.fixture(scope="module")
def trajectories(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("data") / "trajectories"
    with ThreadPoolExecutor(1) as pool:
        generate(case_of(FEED_FORWARD), path, pool, silent)
    return path


class Reached(Exception):
    """The fit has come as far as its problem."""


def problem_of(recipe: Recipe, trajectories: Path) -> Problem:
    """The problem that a fit hands to its network family."""

    def reached(problem: Problem, *rest: object) -> Never:
        raise Reached(problem)

    with pytest.MonkeyPatch.context() as patch:
        for table in FITS:
            patch.setitem(FITS, table, reached)
        with pytest.raises(Reached) as caught:
            fit_surrogate(Work(case_of(recipe), trajectories, trajectories, no_stages))
    found: Problem = caught.value.args[0]
    return found


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_state_space_problems_are_double_whatever_the_precision(
    trajectories: Path, precision: str
) -> None:
    """Their sums are long; other families see windows."""
    state_space = tiny_state_space_recipe(
        data=STATE_SPACE.data.model_dump(mode="json"),
        training={"expert": {"precision": precision}},
    )
    feed_forward = FEED_FORWARD.model_copy(
        update={"training": with_expert(FEED_FORWARD.training, precision=precision)}
    )
    expected = [torch.float64, getattr(torch, precision)]
    for recipe, dtype in zip((state_space, feed_forward), expected, strict=True):
        problem = problem_of(recipe, trajectories)
        records = (*problem.training, *problem.validation)
        assert {values.dtype for values in records} == {dtype}


def with_network(recipe: Recipe, **changes: Any) -> Recipe:
    return recipe.model_copy(update={"network": recipe.network.model_copy(update=changes)})


DIFFERENCES = ("inputs", "changes", "second_changes")


@pytest.mark.parametrize(
    "recipe",
    [
        with_network(FEED_FORWARD, features=DIFFERENCES),
        with_network(STATE_SPACE, drive=DIFFERENCES),
    ],
    ids=["feed_forward", "state_space"],
)
def test_features_are_those_of_the_network_normalised_by_the_training_data(
    trajectories: Path, recipe: Recipe
) -> None:
    problem = problem_of(recipe, trajectories)
    features, signal = problem.features, case_of(recipe).system.inputs[0]
    assert features.chosen == (0, 1, 2)
    for (seen, _), name in ((problem.training, "train"), (problem.validation, "validation")):
        scaled = read_split(recipe, trajectories, name).inputs / signal.high
        assert np.array_equal(seen.numpy(), features.along(scaled))
    spread = problem.training[0].double().flatten(0, 1).std(0, correction=0)
    assert spread[1:].tolist() == pytest.approx([1.0, 1.0], rel=1e-5)
    assert features.scaling.scale[0] == 1


def test_signs_of_features_that_do_not_follow_are_not_flipped(
    trajectories: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = FEED_FORWARD

    def refused(features: FeatureMap) -> None:
        raise Reached(features)

    monkeypatch.setattr(module, "require_odd", refused)
    problem_of(recipe, trajectories)
    training = with_expert(recipe.training, flip_signs=True)
    flipping = recipe.model_copy(update={"training": training})
    with pytest.raises(Reached) as caught:
        fit_surrogate(Work(case_of(flipping), trajectories, trajectories, no_stages))
    assert isinstance(caught.value.args[0], FeatureMap)


def test_eigenvalues_are_those_of_state_space_recipes_alone(
    trajectories: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Systems that cannot be linearized, or grow, may have a feed-forward network."""
    found = problem_of(STATE_SPACE, trajectories).eigenvalues
    assert found is not None
    assert complex(found[0]) == pytest.approx(complex(-20, np.sqrt(1200)), rel=1e-4)

    def never(system: object) -> None:
        raise AssertionError("nobody needs them")

    monkeypatch.setattr(module, "eigenvalues_at_rest", never)
    assert problem_of(FEED_FORWARD, trajectories).eigenvalues is None
    with pytest.raises(AssertionError, match="nobody"):
        problem_of(STATE_SPACE, trajectories)


def test_checkpoints_belong_to_the_eigenvalues(
    trajectories: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = problem_of(STATE_SPACE, trajectories).checkpoint
    assert problem_of(STATE_SPACE, trajectories).checkpoint == before
    monkeypatch.setattr(module, "eigenvalues_at_rest", lambda system: np.array([-20 + 1j]))
    assert problem_of(STATE_SPACE, trajectories).checkpoint != before


@pytest.mark.parametrize("decisive", ["version", "torch", "threads"])
def test_checkpoints_belong_to_the_version_of_the_code_torch_and_threads(
    trajectories: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, decisive: str
) -> None:
    """Of the surrogate and of the estimator, both."""

    def names() -> set[str]:
        fit_surrogate(Work(case_of(FEED_FORWARD), trajectories, tmp_path, no_stages))
        return {path.name for path in tmp_path.glob("*.pt")}

    before = names()
    assert names() == before
    assert len(before) == 2
    if decisive == "version":
        monkeypatch.setattr(checkpoint, "TRAINING_VERSION", checkpoint.TRAINING_VERSION + 1)
    elif decisive == "torch":
        monkeypatch.setattr(torch, "__version__", "0.1")
    else:
        monkeypatch.setattr(torch, "get_num_threads", lambda: 99)
    new = names() - before
    assert sorted(name.split("-")[0] for name in new) == ["estimator", "surrogate"]


SIGNALS = (Signal("a", "N", -2.0, 6.0), Signal("b", "m", 0.0, 4.0))


def noise(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (4, 500, 2))


def test_signals_that_move_pass() -> None:
    require_motion(SIGNALS, noise())
    # a little more than rounding, and one that is held along each trajectory
    require_motion(SIGNALS, 3.0 + noise() * [1.0, 4 * STILL * 4.0])
    held = noise()
    held[:, :, 1] = np.arange(4)[:, None]
    require_motion(SIGNALS, held)


@pytest.mark.parametrize("remaining", [0.0, 1e-12, 0.5 * STILL * 4.0])
@pytest.mark.parametrize("level", [0.0, 3.1])
def test_signal_that_is_constant_up_to_rounding_is_refused(remaining: float, level: float) -> None:
    still = noise()
    still[:, :, 1] = level + remaining * still[:, :, 1]
    with pytest.raises(ValueError, match="constant") as caught:
        require_motion(SIGNALS, still)
    assert str(caught.value) == (
        "'b' is constant in the training data; expected it to move within 0.0 .. 4.0 m: check "
        "data.excitation and the signal's range"
    )


@pytest.mark.parametrize(
    "recipe", [FEED_FORWARD, STATE_SPACE], ids=["feed_forward", "state_space"]
)
@pytest.mark.parametrize(("part", "name"), [("inputs", "force"), ("outputs", "position")])
def test_fit_refuses_what_never_moves(
    trajectories: Path, monkeypatch: pytest.MonkeyPatch, recipe: Recipe, part: str, name: str
) -> None:
    read = Trajectories.read

    def still(of: Trajectories, name: str, count: int | None = None) -> Split:
        split = read(of, name, count)
        change: dict[str, Any] = {part: np.full_like(getattr(split, part), 0.1)}
        return replace(split, **change) if name == "train" else split

    monkeypatch.setattr(Trajectories, "read", still)
    with pytest.raises(ValueError, match=rf"^'{name}' is constant in the training data; expected"):
        fit_surrogate(Work(case_of(recipe), trajectories, trajectories, no_stages))
