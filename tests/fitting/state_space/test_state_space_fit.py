"""The whole fit of state-space networks, on a map of two states that stands for a spring."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from slide_fmu.core.window import Window
from slide_fmu.fitting.checkpoint import read_checkpoint
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.state_space import ledger, preconditioned_descent
from slide_fmu.fitting.state_space.fit_data import fit_data
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
    SMALL,
    WINDOW,
    Fitted,
    fit,
    problem_of,
    relative_error,
    spring,
)
from tests.marks import first
from tests.refusals import refused

ROUNDING = 1e-5
"""Of the poles, whose cell is kept in float32."""


@pytest.fixture(scope="module")
def nonlinear(tmp_path_factory: pytest.TempPathFactory) -> Fitted:
    return fit(problem_of(tmp_path_factory.mktemp("nonlinear")), NONLINEAR)


@pytest.mark.parametrize("eigenvalues", [EIGENVALUES, None, EIGENVALUES[:0]])
def test_linear_system_is_found(tmp_path: Path, eigenvalues: Any) -> None:
    problem = problem_of(tmp_path, 0.0, eigenvalues=eigenvalues)
    found = fit(problem, {"order": 2, "hidden": 0})
    assert found.error < FORGOTTEN
    assert relative_error(found.network, spring(3, 2, 200)) < FORGOTTEN
    poles = np.linalg.eigvals(found.network.cell.a.astype(np.float64))
    assert sorted(poles, key=np.imag) == pytest.approx([POLE.conjugate(), POLE], abs=ROUNDING)
    assert found.network.is_affine


def test_system_without_any_error_is_found(tmp_path: Path) -> None:
    """A window that forgets all: the fit starts at the minimum, and no step helps."""
    problem = problem_of(tmp_path, 0.0, window=Window(0.1, 104, 4))
    found = fit(problem, {"order": 2, "hidden": 0})
    assert found.error < 1e-9
    assert len(found.history.step) == len(found.history.validation_error) > 0


def test_nonlinear_system_is_learnt(nonlinear: Fitted, tmp_path: Path) -> None:
    assert nonlinear.error < SMALL
    assert relative_error(nonlinear.network, spring(3, 2, 200, CUBIC)) < 3 * SMALL
    linear = fit(problem_of(tmp_path), {"order": 2, "hidden": 0})
    assert linear.error > 3 * nonlinear.error
    cell = nonlinear.network.cell
    assert (len(cell.a), len(cell.w)) == (2 + StateSpaceRecipe().padding, 8)
    assert (nonlinear.network.n_samples, nonlinear.network.n_out) == (32, 4)


def test_validation_error_is_that_of_the_numpy_network(nonlinear: Fitted, tmp_path: Path) -> None:
    problem = problem_of(tmp_path)
    data = fit_data(problem, StateSpaceRecipe(**NONLINEAR), QUICK)
    features = data.validation.features.numpy().swapaxes(0, 1).astype(np.float32)
    values = nonlinear.network.run(features)[0][:, WINDOW.n_truncated :]
    error = values - data.validation.targets.numpy().swapaxes(0, 1)
    assert np.sqrt(np.mean(error**2)) == pytest.approx(nonlinear.error, rel=1e-3)


@dataclass(frozen=True)
class Repeated:
    """A second fit of the same problem, its folder, and what its progress said."""

    fitted: Fitted
    folder: Path
    states: list[tuple[int, int, float]]


@pytest.fixture(scope="module")
def repeated(tmp_path_factory: pytest.TempPathFactory) -> Repeated:
    torch.manual_seed(99)
    states: list[tuple[int, int, float]] = []
    folder = tmp_path_factory.mktemp("again")
    found = fit(problem_of(folder), NONLINEAR, lambda *state: states.append(state))
    return Repeated(found, folder, states)


@pytest.mark.extended
def test_fit_depends_on_its_seed_alone(
    nonlinear: Fitted, repeated: Repeated, tmp_path: Path
) -> None:
    assert repeated.fitted.content == nonlinear.content
    assert repeated.fitted.history == nonlinear.history
    # without eigenvalues, of which the linear model is random too, the starts alone differ
    short = {"starts": 1, "iterations": 1}
    seeded = [
        fit(problem_of(tmp_path / str(seed), eigenvalues=None), NONLINEAR, seed=seed, **short)
        for seed in (0, 1)
    ]
    assert seeded[0].content != seeded[1].content


class Stop(Exception):
    pass


WIDE = {"network": {"order": 2, "hidden": 12}, "dense_limit": 100, "refinements": 3}


@pytest.mark.extended
@pytest.mark.parametrize("store_every", [0.0, 1e9])
@pytest.mark.parametrize(
    ("share", "wide"), [(0.0, False), (0.4, False), (0.95, False), (0.98, True)]
)
def test_broken_fit_goes_on_without_a_trace(
    nonlinear: Fitted,
    widened: Fitted,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    share: float,
    store_every: float,
    wide: bool,
) -> None:
    """Stopped after a share of the iterations, with and without a checkpoint just before."""
    monkeypatch.setattr(ledger, "STORE_EVERY", store_every)
    quicken(monkeypatch)
    settings = WIDE if wide else {"network": NONLINEAR}
    expected = widened if wide else nonlinear
    problem, stop_at = problem_of(tmp_path), 1 + round(share * expected.iterations)

    def stop(done: int, total: int, best: float) -> None:
        if done == stop_at:
            raise Stop

    with pytest.raises(Stop):
        fit(problem, progress=stop, **settings)
    numbers: list[int] = []
    found = fit(problem, progress=lambda *state: numbers.append(state[0]), **settings)
    assert found.content == expected.content
    assert found.history == expected.history
    assert numbers == sorted(numbers)
    assert numbers[-1] == expected.iterations
    assert numbers[0] == stop_at if store_every == 0 else numbers[0] < stop_at


def quicken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Short stretches."""
    monkeypatch.setattr(preconditioned_descent, "STEPS", 4)


@pytest.fixture(scope="module")
def wide_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Holds the checkpoint of the widened fit."""
    return tmp_path_factory.mktemp("widened")


@pytest.fixture(scope="module")
def widened(wide_folder: Path) -> Fitted:
    with pytest.MonkeyPatch.context() as patch:
        quicken(patch)
        return fit(problem_of(wide_folder), **WIDE)


def test_finished_fit_is_found_again_with_its_error(repeated: Repeated) -> None:
    states: list[tuple[int, int, float]] = []
    again = fit(problem_of(repeated.folder), NONLINEAR, lambda *state: states.append(state))
    assert again.content == repeated.fitted.content
    assert len({done for done, *_ in states}) == 1
    assert states[-1][2] == repeated.fitted.error


def test_progress_rises_and_the_best_error_falls(repeated: Repeated) -> None:
    done, total, best = zip(*repeated.states, strict=True)
    assert list(done) == sorted(done)
    assert all(a <= b for a, b in zip(done, total, strict=True))
    assert list(best) == sorted(best, reverse=True)
    assert best[-1] == repeated.fitted.error


@pytest.mark.extended
def test_beyond_the_dense_limit_the_network_is_widened(widened: Fitted, wide_folder: Path) -> None:
    cell = widened.network.cell
    assert (len(cell.a), len(cell.w)) == (4, 12)
    # from the best start of the same multi_start, which is not refined first
    fewest = max(h for h in range(12) if plain(4, 1, h, 1).n_parameters <= 50)
    runs = read_checkpoint(problem_of(wide_folder).checkpoint, torch.device("cpu"))
    kept = {name: run for name, run in runs.items() if name.startswith("kept")}
    assert kept.keys() == {f"kept {place}, 4 states, {fewest} units" for place in (0, 1)}
    assert "refined" not in runs
    assert widened.error < min(run["state"]["best_error"] for run in kept.values())
    assert len(widened.history.step) == 3
    assert np.any(cell.e[:2, fewest:])


@pytest.mark.extended
def test_widening_that_never_helps_keeps_the_smaller_network(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    quicken(monkeypatch)

    def wild(theta: torch.Tensor, error: float) -> Descent:
        return Descent(theta, torch.zeros_like(theta), theta, error, rate=1e30)

    monkeypatch.setattr(Descent, "begin", staticmethod(wild))
    found = fit(problem_of(tmp_path), **WIDE)
    assert found.error < 10 * SMALL
    assert not found.network.cell.e[:2, 8:].any()
    assert found.history.step == (0,)
    assert found.history.training_error[0] < 10 * SMALL


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize("hidden", first([3, 0]))
def test_fit_without_any_finite_error_is_refused(
    tmp_path: Path, value: float, hidden: int
) -> None:
    inputs, outputs = spring(2, 2, 200)
    outputs[1, 150] = value
    problem = problem_of(tmp_path, validation=(inputs, outputs))
    with refused(TrainingError, "training diverged: no start", "(training.starts)"):
        fit(problem, {"order": 2, "hidden": hidden}, starts=2, iterations=1)


def test_short_trajectories_and_high_orders_are_refused(tmp_path: Path) -> None:
    short = problem_of(tmp_path, training=spring(1, 6, 28))
    with refused(ValueError, "trajectories of 28 samples", "data.duration longer"):
        fit(short, NONLINEAR)
    most = r"network.order = 120; expected at most \d+ for 1 outputs over \d+ samples: lower it"
    with pytest.raises(ValueError, match=most):
        fit(problem_of(tmp_path), {"order": 120, "hidden": 0})


@pytest.mark.parametrize("records", first([torch.float32, torch.float64]))
def test_single_precision_fits_too(tmp_path: Path, records: torch.dtype) -> None:
    """Whatever the precision of the records: programs give either, recipes float64."""
    pairs = [tuple(v.to(records) for v in spring(seed, 4, 200, CUBIC)) for seed in (1, 2)]
    problem = problem_of(tmp_path, training=pairs[0], validation=pairs[1])
    found = fit(problem, NONLINEAR, precision="float32")
    assert found.error < 3 * SMALL
