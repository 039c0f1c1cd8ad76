"""The runs of a state-space fit: linear starts, poles, training errors, progress, sizes tried."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from slide_fmu.core.window import Window
from slide_fmu.fitting.checkpoint import read_checkpoint
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space import multi_start as multi_start_module
from slide_fmu.fitting.state_space import preconditioned_descent, sizes
from slide_fmu.fitting.state_space.fit_data import fit_data
from slide_fmu.fitting.state_space.multi_start import LINEAR_ITERATIONS, MultiStart
from slide_fmu.fitting.state_space.penalties import PolePenalty
from slide_fmu.fitting.state_space.preconditioned_descent import Descent
from slide_fmu.recipe.learning import StateSpaceRecipe
from tests.fitting.state_space.cells import plain
from tests.fitting.state_space.springs import (
    CUBIC,
    EIGENVALUES,
    FORGOTTEN,
    NONLINEAR,
    POLE,
    QUICK,
    WINDOW,
    Fitted,
    fit,
    problem_of,
    spring,
)
from tests.refusals import refused

SINGLE = 1e-3
"""Of errors of a network that is kept in float32, relative to themselves."""
TWO_PAIRS = np.array([-3 + 4j, -5 + 9j])
"""Eigenvalues in 1/s of four states."""


def runs(problem: Problem) -> set[str]:
    """Names of the runs that a fit consisted of."""
    return set(read_checkpoint(problem.checkpoint, torch.device("cpu")))


def short_records(folder: Path) -> Problem:
    """Three samples of the past and of the future show two states."""
    window, records = Window(0.1, 5, 1), [spring(seed, 20, 8) for seed in (1, 2)]
    return problem_of(
        folder, window=window, training=records[0], validation=records[1], eigenvalues=TWO_PAIRS
    )


@pytest.mark.parametrize("order", [4, "auto"])
def test_order_that_records_do_not_show_starts_from_eigenvalues_alone(
    tmp_path: Path, order: Any
) -> None:
    problem = short_records(tmp_path)
    found = fit(problem, {"order": order, "hidden": 0})
    assert len(found.network.cell.a) == 4
    assert runs(problem) == {"linear, 4 states, from eigenvalues", "refined"}


def test_order_below_the_excited_band_starts_from_the_lowest_eigenvalues(tmp_path: Path) -> None:
    problem = short_records(tmp_path)
    found = fit(problem, {"order": 2, "hidden": 0})
    assert len(found.network.cell.a) == 2
    sources = ("eigenvalues", "subspaces")
    assert runs(problem) == {f"linear, 2 states, from {s}" for s in sources} | {"refined"}


def test_pairs_that_an_order_does_not_have_are_not_turned(tmp_path: Path) -> None:
    """Refused before anything is fitted."""
    problem = problem_of(tmp_path, names=("inputs", "changes"))
    table = StateSpaceRecipe(units="gated", schedule=("inputs",), order=3, hidden=2)
    data = fit_data(problem, table, QUICK)
    turned = replace(data, network=table.model_copy(update={"turned_pairs": 2}))
    multi_start = MultiStart(turned, lambda *state: None)
    message = r"^network\.turned_pairs = 2 with an order of 3; expected two states for each pair"
    with pytest.raises(ValueError, match=message):
        multi_start.linear(3)
    with refused(ValueError, "network.turned_pairs = 2", "2 with 1"):
        multi_start.shape(4, 2)


def test_static_features_that_also_drive_are_no_second_input(tmp_path: Path) -> None:
    """Twice the same input has no response of its own."""
    problem = problem_of(tmp_path, 0.0, names=("inputs", "changes"), eigenvalues=None)
    training, found = QUICK, []
    for static in (("inputs",), ("inputs", "changes"), ("changes",)):
        table = StateSpaceRecipe(drive=("changes", "inputs"), static=static, order=2, hidden=0)
        data = fit_data(problem, table, training)
        multi_start = MultiStart(data, lambda *state: None)
        found.append(torch.from_numpy(multi_start._subspace.directions))
    assert torch.equal(found[1], found[0])
    assert torch.equal(found[2], found[0])


def test_order_that_neither_shows_is_refused(tmp_path: Path) -> None:
    problem = short_records(tmp_path)
    with refused(ValueError, "network.order = 3", "expected at most 2", "3 samples"):
        fit(problem, {"order": 3, "hidden": 0})


@pytest.mark.parametrize(
    ("eigenvalues", "slowest"), [(EIGENVALUES, abs(POLE)), (None, 0.0), (EIGENVALUES[:0], 0.0)]
)
def test_penalty_knows_the_slowest_pole_of_the_system(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, eigenvalues: Any, slowest: float
) -> None:
    reported, of = set(), PolePenalty.of

    def heard(window: Window, slowest: float, residuals: int) -> PolePenalty:
        reported.add((window, slowest))
        return of(window, slowest, residuals)

    monkeypatch.setattr(PolePenalty, "of", staticmethod(heard))
    fit(problem_of(tmp_path, 0.0, eigenvalues=eigenvalues), {"order": 2, "hidden": 0})
    ((window, value),) = reported
    assert window == WINDOW
    assert value == pytest.approx(slowest)


def weighted_error(problem: Problem, network: dict[str, Any], found: Fitted) -> float:
    """RMS error of the network on all segments, each as often as its weight squared."""
    data = fit_data(problem, StateSpaceRecipe(**network), QUICK).whole
    values, _ = found.network.run(data.features.numpy().swapaxes(0, 1).astype(np.float32))
    squares = (values[:, data.burn_in :] - data.targets.numpy().swapaxes(0, 1)) ** 2
    weights = data.weights.numpy() ** 2
    return float(np.sqrt(np.sum(weights * squares.mean((1, 2))) / np.sum(weights)))


def told_error(found: Fitted) -> float:
    """The training error beside the best validation error."""
    history = found.history
    return history.training_error[int(np.argmin(history.validation_error))]


@pytest.mark.parametrize("network", [NONLINEAR, {"order": 2, "hidden": 0}])
def test_training_error_counts_segments_by_their_weights(
    tmp_path: Path, network: dict[str, Any]
) -> None:
    problem = problem_of(tmp_path, beyond=spring(4, 6, 160, CUBIC, 2.0))
    found = fit(problem, network, starts=1, iterations=3)
    assert told_error(found) == pytest.approx(weighted_error(problem, network, found), rel=SINGLE)


@pytest.mark.extended
def test_training_error_of_a_start_that_nothing_improves_counts_likewise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def wild(theta: torch.Tensor, error: float) -> Descent:
        return Descent(theta, torch.zeros_like(theta), theta, error, rate=1e30)

    monkeypatch.setattr(Descent, "begin", staticmethod(wild))
    monkeypatch.setattr(preconditioned_descent, "STEPS", 4)
    network = {"order": 2, "hidden": 12}
    problem = problem_of(tmp_path, beyond=spring(4, 6, 160, CUBIC, 2.0))
    found = fit(problem, network, dense_limit=100, stretches=2)
    assert found.history.step == (0,)
    assert told_error(found) == pytest.approx(weighted_error(problem, network, found), rel=SINGLE)


def test_finished_linear_fit_tells_its_error(tmp_path: Path) -> None:
    problem, network, reported = problem_of(tmp_path), {"order": 2, "hidden": 0}, []
    fit(problem, network)
    found = fit(problem, network, lambda done, total, best=None: reported.append(best))
    assert reported[-1] == found.error


def linear_of(problem: Problem, network: dict[str, Any]) -> tuple[list[bool], float]:
    """Whether the runs of a linear model saw the starts' part or all data, and its error."""
    table, training = StateSpaceRecipe(**network), QUICK
    data = fit_data(problem, table, training)
    multi_start = MultiStart(data, lambda *state: None)
    fitted, descend = [], multi_start.run

    def heard(name: str, shape: Any, theta: torch.Tensor, segments: Any, count: int) -> Any:
        fitted.append(segments)
        return descend(name, shape, theta, segments, count)

    multi_start.run = heard  # type: ignore[method-assign]
    error = multi_start.linear(2).error
    assert len(fitted) == 2
    assert all(segments is data.whole or segments is data.part for segments in fitted)
    return [segments is data.part for segments in fitted], error


@pytest.mark.extended
def test_linear_models_of_very_many_data_are_fitted_to_the_starts_part(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    network = {"order": 2, "hidden": 0}
    problem = problem_of(tmp_path, 0.0)
    data = fit_data(problem, StateSpaceRecipe(**network), QUICK)
    count = data.whole.targets.numel()
    for most, in_part in ((count, False), (count - 1, True)):
        monkeypatch.setattr(multi_start_module, "MOST_OF_LINEAR", most)
        fresh = replace(problem, checkpoint=tmp_path / f"{most}.pt")
        found, error = linear_of(fresh, network)
        assert found == [in_part] * 2
        assert error < FORGOTTEN


@pytest.mark.extended
@pytest.mark.parametrize(("limit", "last"), [(3000, 12), (100, 3)])
def test_planned_are_the_iterations_of_the_runs_to_come(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit: int, last: int
) -> None:
    """After the linear models: starts, the kept ones, and one of both refinements."""
    monkeypatch.setattr(preconditioned_descent, "STEPS", 2)
    problem, states = problem_of(tmp_path), list[tuple[int, int]]()
    fit(
        problem,
        {"order": 2, "hidden": 12},
        lambda done, total, best=None: states.append((done, total)),
        dense_limit=limit,
        refinements=3,
    )
    course = read_checkpoint(problem.checkpoint, torch.device("cpu"))
    done = {name: run["iterations"] for name, run in course.items()}
    assert {total for _, total in states[:-1]} == {2 * LINEAR_ITERATIONS + 3 * 6 + 2 * 6 + last}
    assert states[-1] == (sum(done.values()), sum(done.values()))
    assert done["refined" if last == 12 else "widened to 12"] <= last
    assert ("refined" in done) != ("widened to 12" in done)


@pytest.mark.extended
def test_search_keeps_to_the_dense_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sizes, "FIRST_UNITS", 12)
    monkeypatch.setattr(sizes, "MOST_UNITS", 24)
    monkeypatch.setattr(preconditioned_descent, "STEPS", 2)
    problem = problem_of(tmp_path)
    found = fit(problem, {"order": 2}, dense_limit=100, stretches=1)
    assert len(found.network.cell.w) == 12  # 24 units start as the same few
    starts = [re.fullmatch(r"start \d, 2 states, (\d+) units", name) for name in runs(problem)]
    units = {int(start[1]) for start in starts if start is not None}
    assert len(units) == 1
    assert plain(4, 1, units.pop(), 1).n_parameters <= 50
    assert "widened to 12" in runs(problem)
