"""The states of a system are found among what it shows, and a network is fitted from them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from slide_fmu.core.signals import FloatArray
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space import fit as fits
from slide_fmu.fitting.state_space import from_states
from slide_fmu.fitting.state_space.fit_data import FitData, fit_data
from slide_fmu.fitting.state_space.from_states import FitFromStates
from slide_fmu.fitting.state_space.known_states import Known, KnownStates, known_states
from slide_fmu.fitting.state_space.multi_start import MultiStart
from slide_fmu.recipe.learning import LeastSquaresExpert, LeastSquaresRecipe, StateSpaceRecipe
from tests.fitting.state_space.springs import fit, problem_of, relative_error
from tests.progress import silent

SAMPLES, MOTIONS = 260, 8
GAP = 0.3
"""Play of the spring, whose deflections reach about 1.2."""


def moved(inputs: FloatArray, delayed: bool = False) -> FloatArray:
    """States of a mass on a spring with play from rest, (motions, N + 1, 2).

    ``delayed``: the force of the sample before acts, too.
    """
    states = np.zeros((len(inputs), inputs.shape[1] + 1, 2))
    position = velocity = before = np.zeros(len(inputs))
    for k, force in enumerate(inputs[:, :, 0].T):
        acting = 0.5 * (force + before) if delayed else force
        pull = np.sign(position) * np.maximum(np.abs(position) - GAP, 0.0)
        velocity = 0.5 * velocity - 0.6 * pull - 0.1 * position + 0.5 * acting
        position = position + 0.5 * velocity
        states[:, k + 1, 0], states[:, k + 1, 1], before = position, velocity, force
    return states


def problem(
    folder: Path, outputs: Any = lambda x: x[..., :1], delayed: bool = False, more: Any = None
) -> Problem:
    """A fit to that mass, with its states; ``more`` are further states of theirs."""
    pairs, states = {}, []
    for number, name in enumerate(("training", "validation")):
        rng = np.random.default_rng(number)
        inputs = np.float32(rng.uniform(-1, 1, (MOTIONS, SAMPLES, 1))).astype(np.float64)
        inputs *= np.linspace(0.5, 1.0, MOTIONS)[:, None, None]
        x = moved(inputs, delayed)
        pairs[name] = torch.from_numpy(inputs), torch.from_numpy(outputs(x).copy())
        states.append(x if more is None else np.concatenate([x, more(x)], axis=2))
    return problem_of(folder, **pairs, eigenvalues=None, states=(states[0], states[1]))


def data_of(problem: Problem, **network: Any) -> FitData:
    return fit_data(problem, StateSpaceRecipe(**network), LeastSquaresRecipe())


def found_in(problem: Problem, **network: Any) -> KnownStates:
    known = known_states(data_of(problem, **network))
    assert known is not None
    return known


def test_states_of_the_system_are_those_of_the_network(tmp_path: Path) -> None:
    known = found_in(problem(tmp_path))
    assert (known.own, known.moving, known.count) == (2, 2, 2)
    flat = known.training.states.flatten(0, 1)
    assert flat.std(0).tolist() == pytest.approx([1.0, 1.0], rel=1e-3)
    read = known.training.states @ known.c.T + known.d0
    torch.testing.assert_close(read, known.training.targets, rtol=0, atol=1e-9)


def test_output_that_is_bent_is_a_state_too(tmp_path: Path) -> None:
    """And no state follows from it: the network shows it alone."""
    known = found_in(problem(tmp_path, lambda x: np.tanh(3 * x[..., :1])))
    assert (known.own, known.moving, known.count) == (2, 3, 3)
    assert not known.a[:, 2].any()
    assert known.c[0, :2].tolist() == pytest.approx([0, 0], abs=1e-9)


def test_input_of_the_step_before_is_a_state_where_it_acts(tmp_path: Path) -> None:
    known = found_in(problem(tmp_path, delayed=True))
    assert (known.own, known.moving, known.count) == (2, 2, 3)
    before = known.training.states[:, 1:, 2] - known.training.states[:, 1:, 2].mean()
    force = known.training.features[..., 0]
    torch.testing.assert_close(before / before.std(), (force - force.mean()) / force.std())


def test_state_that_stands_still_is_left_out(tmp_path: Path) -> None:
    assert found_in(problem(tmp_path, more=lambda x: np.full_like(x[..., :1], 7.0))).count == 2


@pytest.mark.parametrize(
    "network",
    [
        {"order": 3, "padding": 0},
        {"units": "cubic"},
        {"bias": False},
        {"substeps": 2},
    ],
)
def test_network_that_cannot_have_them_has_none(tmp_path: Path, network: Any) -> None:
    assert known_states(data_of(problem(tmp_path), **network)) is None


def test_there_are_none_where_the_system_shows_none(tmp_path: Path) -> None:
    assert known_states(data_of(replace(problem(tmp_path), states=None))) is None
    broken = problem(tmp_path, more=lambda x: np.full_like(x[..., :1], np.nan))
    assert known_states(data_of(broken)) is None


def test_fit_whose_segments_have_weights_of_their_own_has_none(tmp_path: Path) -> None:
    even = LeastSquaresRecipe(expert=LeastSquaresExpert(even_out=True))
    assert known_states(fit_data(problem(tmp_path), StateSpaceRecipe(), even)) is None


def test_spans_begin_at_true_states(tmp_path: Path) -> None:
    known = found_in(problem(tmp_path)).training
    spans = known.spans(known.states, 20, 400, 0)
    assert spans.initial is not None
    assert (spans.burn_in, spans.count, len(spans.targets)) == (0, 400, 20)
    first = (known.states[:, :-20] - spans.initial[0]).abs().amax(2).flatten().argmin()
    of, at = divmod(int(first), known.states.shape[1] - 20)
    torch.testing.assert_close(spans.targets[:, 0], known.states[of, at + 1 : at + 21])
    torch.testing.assert_close(spans.features[:, 0], known.features[of, at : at + 20])


def test_large_motions_are_chosen_more_often_than_they_are_met() -> None:
    """One of 50 motions is five times as large: a tenth of the spans are its, at least."""
    states = torch.from_numpy(np.random.default_rng(0).normal(size=(50, 201, 2)))
    states[7] *= 5.0
    known = Known(torch.zeros(50, 200, 1).double(), states, states[..., :1])
    spans = known.spans(states, 20, 400, 0)
    large = spans.targets.abs().amax((0, 2)) > 6.0
    assert 0.1 < large.double().mean() < 0.5


def test_spring_with_play_is_learnt_from_its_states(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is more accurate than from zero state with the same sizes."""
    quick = {"hidden": 8}
    known = fit(problem(tmp_path), quick)
    assert (len(known.network.cell.a), len(known.network.cell.w)) == (2, 8)
    assert (known.table.order, known.table.padding) == (2, 0)
    monkeypatch.setattr(fits, "known_states", lambda data: None)
    sizes = {**quick, "order": 2, "padding": 0}
    from_zero = fit(replace(problem(tmp_path), checkpoint=tmp_path / "other.pt"), sizes)
    assert known.error < min(3e-3, from_zero.error)
    inputs = np.float32(np.random.default_rng(9).uniform(-1, 1, (2, 200, 1))).astype(np.float64)
    records = torch.from_numpy(inputs), torch.from_numpy(moved(inputs)[..., :1])
    assert relative_error(known.network, records) < 3 * known.error


def test_poor_network_of_known_states_is_no_better_than_one_that_is_searched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The search is made then, and the better of both is taken, with both explanations."""
    monkeypatch.setattr(from_states, "OF_STATES", 1)
    monkeypatch.setattr(from_states, "OF_OUTPUTS", 1)
    found = fit(problem(tmp_path), {"hidden": 4})
    assert len(found.network.cell.a) > 2
    assert "known states" in found.history.explanations[0]


def test_motions_with_two_responses_to_the_same_inputs_do_not_judge(tmp_path: Path) -> None:
    """A spring that may snap through stays on its side under small inputs.

    The window knows nothing of the side. Large inputs, from which the network learns, change it.
    """

    def sides(starts: FloatArray, amplitude: float) -> tuple[Any, Any, FloatArray]:
        count, rng = len(starts), np.random.default_rng(round(10 * amplitude))
        inputs = amplitude * rng.uniform(-1, 1, (count, SAMPLES, 1))
        inputs = np.float32(inputs).astype(np.float64)
        x = np.zeros((count, SAMPLES + 1, 1))
        x[:, 0, 0] = starts
        for k in range(SAMPLES):
            x[:, k + 1] = np.tanh(1.25 * x[:, k] + 0.05) + 0.5 * inputs[:, k]
        return torch.from_numpy(inputs), torch.from_numpy(x.copy()), x

    both = sides(np.zeros(20), 1.0), sides(np.resize([-0.7, 0.7, 0.7, 0.7], 8), 0.1)
    case = problem_of(
        tmp_path,
        training=both[0][:2],
        validation=both[1][:2],
        eigenvalues=None,
        states=(both[0][2], both[1][2]),
    )
    data = data_of(case, hidden=4)
    known = known_states(data)
    assert known is not None
    found = FitFromStates(MultiStart(data, silent), known).sized()
    assert found.remark is not None
    assert found.remark.startswith("in 2 of 8 motions")
    assert found.data.validation.count == 6
    assert found.candidate.error < 0.05
