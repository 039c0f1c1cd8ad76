"""Preconditioned descent: it learns, repeats itself, and goes back where it failed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import pytest
import torch

from slide_fmu.fitting.state_space import preconditioned_descent as module
from slide_fmu.fitting.state_space.cell import CellShape
from slide_fmu.fitting.state_space.coordinates import widen
from slide_fmu.fitting.state_space.normal_equations import (
    NormalEquations,
    normal_equations,
    sum_of_squares,
)
from slide_fmu.fitting.state_space.preconditioned_descent import (
    KEPT,
    RATE,
    RECOVERY,
    Descent,
    advance_round,
)
from slide_fmu.fitting.state_space.segments import Segments
from tests.fitting.state_space.cells import (
    READ,
    TURNED,
    plain,
    random,
    random_theta,
    taught_segments,
)

SHAPE = plain(2, 1, 4, 1)
CIRCLE = 0.99
"""Outside of all poles here."""
TRAINING, VALIDATION = taught_segments(SHAPE, 1, 40), taught_segments(SHAPE, 2, 10)


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """A few steps on parts of the segments, with the damping that so few residuals need."""
    monkeypatch.setattr(module, "STEPS", 10)
    monkeypatch.setattr(module, "BATCH", 24)
    monkeypatch.setattr(module, "MATRIX_ROWS", 11)  # for SHAPE in 24 segments
    monkeypatch.setattr(module, "DAMPING", 0.5)


def validation(theta: torch.Tensor) -> float:
    return math.sqrt(sum_of_squares(SHAPE, theta, VALIDATION) / VALIDATION.targets.numel())


def start(distance: float = 0.03) -> Descent:
    """Some way off the parameters that made the targets."""
    theta = random_theta(SHAPE, 99) + distance * random(SHAPE.n_parameters)
    return Descent.begin(theta, validation(theta))


def rounds(
    state: Descent,
    count: int,
    seed: int = 0,
    error: Callable[[torch.Tensor], float] = validation,
    training: Segments = TRAINING,
) -> list[Descent]:
    states = [state]
    for _ in range(count):
        states.append(advance_round(states[-1], SHAPE, training, error, CIRCLE, seed))
    return states


def test_descent_learns() -> None:
    states = rounds(start(), 6)
    errors = [state.best_error for state in states]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.1 * errors[0]
    last = states[-1]
    assert validation(last.best) == last.best_error
    assert [row[0] for row in last.history] == [1, 2, 3, 4, 5, 6]
    assert min(row[2] for row in last.history) == last.best_error
    assert last.round == 6


@pytest.mark.extended
@pytest.mark.parametrize("shape", [READ, TURNED])
def test_gated_cells_learn_too(shape: CellShape) -> None:
    training, held_out = taught_segments(shape, 1, 40), taught_segments(shape, 2, 10)

    def error(theta: torch.Tensor) -> float:
        return math.sqrt(sum_of_squares(shape, theta, held_out) / held_out.targets.numel())

    theta = random_theta(shape, 99) + 0.03 * random(shape.n_parameters)
    state = begin = Descent.begin(theta, error(theta))
    for _ in range(6):
        state = advance_round(state, shape, training, error, CIRCLE, 0)
    assert state.best_error < 0.1 * begin.best_error


@dataclass
class Heard:
    """What a descent computes: matrices per residual with their segments, batches' segments."""

    matrices: list[torch.Tensor] = field(default_factory=list)
    segments: list[int] = field(default_factory=list)
    batches: list[int] = field(default_factory=list)


@pytest.fixture
def heard(monkeypatch: pytest.MonkeyPatch) -> Heard:
    found, gradient = Heard(), module._gradient

    def hear(shape: CellShape, theta: torch.Tensor, segments: Segments) -> NormalEquations:
        result = normal_equations(shape, theta, segments)
        found.segments.append(segments.count)
        found.matrices.append(result.matrix / segments.targets.numel())
        return result

    def count(
        shape: CellShape, theta: torch.Tensor, segments: Segments, radius: float
    ) -> tuple[float, torch.Tensor]:
        found.batches.append(segments.count)
        return gradient(shape, theta, segments, radius)

    monkeypatch.setattr(module, "normal_equations", hear)
    monkeypatch.setattr(module, "_gradient", count)
    return found


@pytest.mark.parametrize(("rows", "segments"), [(1, 3), (11, 24), (18, 39), (19, 40), (1000, 40)])
def test_matrix_has_rows_for_every_parameter(
    monkeypatch: pytest.MonkeyPatch, heard: Heard, rows: int, segments: int
) -> None:
    """34 parameters and 16 residuals in a segment; of few segments, all."""
    assert (SHAPE.n_parameters, TRAINING.targets[:, 0].numel()) == (34, 16)
    monkeypatch.setattr(module, "MATRIX_ROWS", rows)
    rounds(start(), 1)
    assert heard.segments == [segments]
    assert heard.batches == [24] * 10


def test_matrix_is_a_moving_average(heard: Heard) -> None:
    states = rounds(start(), 3)
    assert states[0].matrix is None
    expected = heard.matrices[0]
    for state, new in zip(states[1:], [None, *heard.matrices[1:]], strict=True):
        if new is not None:
            expected = KEPT * expected + (1 - KEPT) * new
        assert state.matrix is not None
        torch.testing.assert_close(state.matrix, expected)
    assert len(heard.matrices) == 3
    assert not torch.allclose(heard.matrices[1], heard.matrices[0])
    assert 0 < KEPT < 1


def test_steps_follow_the_averaged_matrix() -> None:
    """A huge matrix before leaves steps next to none."""
    begin = start()
    free = rounds(begin, 1)[-1]
    held = rounds(replace(begin, matrix=1e12 * torch.eye(SHAPE.n_parameters).double()), 1)[-1]
    assert float((held.theta - begin.theta).norm()) < 1e-6 * float(
        (free.theta - begin.theta).norm()
    )


@pytest.mark.parametrize(("rate", "after"), [(0.5, 0.5 * RECOVERY), (0.9, 1.0), (1.0, 1.0)])
def test_learning_rate_recovers_up_to_the_first_one(rate: float, after: float) -> None:
    """Relative to the first one, which it never exceeds."""
    found = rounds(replace(start(), rate=rate * RATE), 1)[-1]
    assert len(found.history) == 1
    assert found.rate == pytest.approx(after * RATE)
    assert RECOVERY > 1


def test_stretch_depends_on_state_and_seed_alone() -> None:
    state = rounds(start(), 1)[-1]
    torch.manual_seed(1)
    one = rounds(state, 1, seed=3)[-1]
    torch.manual_seed(2)
    again, other = rounds(state, 1, seed=3)[-1], rounds(state, 1, seed=4)[-1]
    assert torch.equal(one.theta, again.theta)
    assert torch.equal(one.momentum, again.momentum)
    assert one.history == again.history
    assert not torch.equal(one.theta, other.theta)
    later = rounds(replace(state, round=7), 1, seed=3)[-1]
    assert not torch.equal(one.theta, later.theta)  # every round draws anew
    # and none of them what a round of a neighbouring seed draws
    neighbour = rounds(replace(state, round=state.round + 1), 1, seed=2)[-1]
    assert not torch.equal(one.theta, neighbour.theta)


def test_segments_of_low_weight_teach_little() -> None:
    """Every other segment answers with the wrong sign: at full weight nothing is learnt."""
    wrong = TRAINING.every(2)
    wrong = replace(wrong, targets=-wrong.targets)
    begin = start()
    errors = [
        rounds(begin, 6, training=TRAINING.and_others(wrong, weight))[-1].best_error
        for weight in (1e-3, 1.0)
    ]
    assert errors[0] < 0.1 * begin.best_error
    assert errors[1] > 0.5 * begin.best_error


def test_training_error_does_not_depend_on_a_weight_that_all_segments_have() -> None:
    noisy = taught_segments(SHAPE, 1, 40, noise=0.1)
    light = replace(noisy, weights=0.1 * noisy.weights)
    one, other = (rounds(start(), 1, training=data)[-1].history[0] for data in (noisy, light))
    assert other[1] == pytest.approx(one[1])


@pytest.mark.parametrize("worse", [math.nan, math.inf, 1e3])
def test_failed_stretch_goes_back_to_the_best_at_half_the_rate(worse: float) -> None:
    before = rounds(start(), 2)[-1]
    after = rounds(before, 1, error=lambda theta: worse)[-1]
    assert torch.equal(after.theta, before.best)
    assert torch.equal(after.best, before.best)
    assert after.best_error == before.best_error
    assert not after.momentum.any()
    assert after.rate == 0.5 * before.rate == 0.5 * RATE
    assert after.history == before.history
    assert after.round == 3
    again = rounds(after, 1)[-1]
    assert again.rate == pytest.approx(RECOVERY * after.rate)


@pytest.mark.parametrize("rate", [1e30, RATE])
def test_start_that_does_not_validate_yet_is_no_licence_to_diverge(rate: float) -> None:
    """Finite steps go on, as those that pull poles inside; others go back to the start."""
    begin = replace(start(), rate=rate, best_error=math.inf)
    after = rounds(begin, 1, error=lambda theta: math.inf)[-1]
    assert bool(after.theta.isfinite().all())
    if rate == RATE:
        assert not torch.equal(after.theta, begin.theta)
        assert after.rate == RATE
        assert [row[2] for row in after.history] == [math.inf]
        assert math.isfinite(after.history[0][1])
    else:
        assert torch.equal(after.theta, begin.theta)
        assert after.rate == 0.5 * rate
        assert after.history == ()


def test_start_without_finite_matrix_is_a_failure() -> None:
    """Its segments overflow, whatever the validation says."""
    theta = random_theta(SHAPE)
    theta[: SHAPE.n_dynamic] *= 1e200
    after = rounds(Descent.begin(theta, 1.0), 1)[-1]
    assert torch.equal(after.theta, theta)
    assert after.rate == 0.5 * RATE
    assert after.history == ()
    assert after.matrix is None


def test_matrix_that_is_not_finite_does_not_spoil_the_one_before() -> None:
    before = rounds(start(), 1)[-1]
    theta = before.theta.clone()
    theta[: SHAPE.n_dynamic] *= 1e200
    after = rounds(replace(before, theta=theta), 1)[-1]
    assert after.matrix is before.matrix
    assert torch.equal(after.theta, before.best)
    assert len(rounds(after, 1)[-1].history) == 2


def test_a_little_worse_is_gone_on_from() -> None:
    before = rounds(start(), 2)[-1]
    after = rounds(before, 1, error=lambda theta: 1.2 * before.best_error)[-1]
    assert not torch.equal(after.theta, before.theta)
    assert torch.equal(after.best, before.best)
    assert after.best_error == before.best_error
    assert len(after.history) == 3


def test_units_that_act_on_nothing_yet_make_no_trouble() -> None:
    """Their arguments have no curvature at all, and they begin to act."""
    old, new = SHAPE, replace(SHAPE, n_units=7, n_states=4)
    theta = widen(old.split(start().theta), new, torch.Generator())

    def error(theta: torch.Tensor) -> float:
        return 5.0 if bool(theta.isfinite().all()) else math.inf

    wide = advance_round(Descent.begin(theta, 10.0), new, TRAINING, error, CIRCLE, 0)
    assert len(wide.history) == 1
    before, after = (new.split(t).e[: old.n_states, old.n_units :] for t in (theta, wide.best))
    assert not before.any()
    assert torch.all(after != 0)
