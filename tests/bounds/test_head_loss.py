"""The loss of an error bound's head, and the doubt about held inputs between samples."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

from slide_fmu.bounds import error_bound
from slide_fmu.bounds.error_bound import (
    DOUBT_MARGIN,
    MOST_DOUBT,
    _objective,
    doubt_of,
    fit_head,
    scaling_of_statistics,
)
from slide_fmu.bounds.judge import span_factors
from slide_fmu.bounds.observations import Observations
from slide_fmu.core.signals import Hold
from slide_fmu.fitting.history import History
from slide_fmu.fitting.windows import WindowData
from slide_fmu.fmu.export import read_fmu
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.error_bound import BoundRecipe
from tests.fmu.samples import CellShape, Shape, random_surrogate
from tests.progress import no_stages
from tests.refusals import refused

FMUS = Path(__file__).parents[2] / "fmus"


def test_factor_of_an_estimate_does_not_depend_on_trajectories_without_an_error() -> None:
    rng = np.random.default_rng(0)
    scales = np.exp(rng.normal(0, 1, (200, 1, 1))) * np.ones((1, 60, 1))
    errors = 0.5 * scales * np.exp(rng.normal(0, 0.1, (200, 1, 1)))
    (factor,) = span_factors(errors, scales, 3)
    assert factor == pytest.approx(0.5, rel=0.05)
    errors[:20] = 0.0
    (other,) = span_factors(errors, scales, 3)
    assert other == pytest.approx(factor, rel=0.05)


def test_loss_is_least_at_the_quantile_however_large_errors_are() -> None:
    rng = np.random.default_rng(3)
    objective = _objective(torch.zeros(1))
    exponents = torch.linspace(-12, 12, 4801)
    for size in (0.01, 1.0, 30.0):
        errors = size * np.exp(rng.normal(0, 1, 4001))
        targets = torch.as_tensor(errors, dtype=torch.float32)[:, None]
        losses = [float(objective.loss(one.expand(len(errors), 1), targets)) for one in exponents]
        best = 2.0 ** float(exponents[int(np.argmin(losses))])
        assert best == pytest.approx(np.quantile(errors, 0.95), rel=0.02)


@pytest.mark.parametrize("usual", [0.0, -3.0])
def test_loss_of_expected_errors_is_least_at_their_root_mean_square(usual: float) -> None:
    rng = np.random.default_rng(3)
    objective = _objective(torch.full((1,), usual))
    exponents = torch.linspace(-12, 12, 1201)
    for size in (0.01, 1.0, 30.0):
        relative = size * rng.normal(0, 1, 4001)
        targets = torch.as_tensor(np.abs(relative), dtype=torch.float32)[:, None]
        scale = torch.zeros(1)
        losses = [
            float(objective.loss(torch.stack([scale, one[None]], dim=1).expand(4001, 2), targets))
            for one in exponents
        ]
        best = 2.0 ** float(exponents[int(np.argmin(losses))] - usual)
        assert best == pytest.approx(np.sqrt(np.mean(relative**2)), rel=0.02)


def test_rare_huge_errors_do_not_decide_what_is_expected() -> None:
    """One of a thousand samples that is a million times as large counts by its logarithm."""
    targets = torch.ones(1000, 1)
    targets[0] = 1e6
    exponent = torch.zeros(1000, 2, requires_grad=True)
    _objective(torch.zeros(1)).loss(exponent, targets).backward()
    assert exponent.grad is not None
    slopes = exponent.grad[:, 1].abs()
    assert float(slopes[0]) > 100 * float(slopes[1:].max())
    assert float(slopes[0]) < 1000.0 * 0.1 / 1000  # the plain likelihood: 1e12 * 0.1 / 1000


def test_large_errors_do_not_decide_alone() -> None:
    """Where errors are a thousand times as large, a step of the exponent is worth as much.

    Where they are a thousandth of the usual one, it is worth little.
    """
    objective = _objective(torch.zeros(1))

    def slope(size: float) -> float:
        exponent = torch.tensor([[np.log2(size)]], dtype=torch.float32, requires_grad=True)
        objective.loss(exponent, torch.tensor([[1.5 * size]])).backward()
        assert exponent.grad is not None
        return abs(float(exponent.grad))

    assert slope(1000.0) == pytest.approx(slope(2.0), rel=0.03)
    assert slope(0.1) > 0.5 * slope(1.0)
    assert slope(0.001) < 0.03 * slope(1.0)


def test_statistics_that_are_roundings_are_not_scaled_up() -> None:
    rng = np.random.default_rng(1)
    noise = rng.normal(size=100)
    columns = [rng.normal(3, 2, 100), 1e-13 * noise, 1 + 1e-8 * noise, 100 + 0.01 * noise]
    statistics = np.stack(columns, axis=1)
    scaling = scaling_of_statistics(statistics)
    assert scaling.scale == pytest.approx([columns[0].std(), 1.0, 1.0, columns[3].std()])


def network_of(name: str) -> StateSpace:
    network = read_fmu(FMUS / name / f"{name}.fmu")[0].network
    assert isinstance(network, StateSpace)
    return network


@pytest.mark.parametrize(("name", "step"), [("linear", 1 / 64), ("linear_10ms", 0.01)])
def test_doubt_of_one_oscillation_follows_from_how_far_it_turns_in_a_sample(
    name: str, step: float
) -> None:
    """m = 1 kg, d = 8 N s/m, k = 1600 N/m: each difference of it has a factor of z - 1."""
    pole = np.exp(complex(-4.0, np.sqrt(1600.0 - 16.0)) * step)
    ratio = abs(pole - 1)
    assert doubt_of(network_of(name)) == pytest.approx(
        DOUBT_MARGIN * ratio / (1 - ratio), rel=0.15
    )


def test_released_bounds_have_the_doubt_of_their_companions() -> None:
    for name, most in (("duffing", True), ("duffing_10ms", False)):
        bound = read_fmu(FMUS / name / f"{name}.fmu")[0].bound
        assert bound is not None
        assert bound.doubt == pytest.approx(doubt_of(bound.companion), rel=0.01)
        assert (bound.doubt == MOST_DOUBT) == most


def test_doubt_has_a_most_and_is_zero_without_a_response() -> None:
    shape = Shape(n_inputs=2, n_outputs=2, cell=CellShape())
    network = random_surrogate(shape).network
    assert isinstance(network, StateSpace)
    assert 0 < doubt_of(network) <= MOST_DOUBT
    arrays = {name: np.zeros_like(part) for name, part in network.cell.arrays().items()}
    silent = StateSpace(
        network.cell.with_arrays(arrays),
        network.n_samples,
        network.n_out,
        network.features,
        network.roles,
        network.turned,
    )
    assert doubt_of(silent) == 0


@pytest.mark.parametrize(("hold", "doubt"), [("zero_order", 0.5), ("first_order", 0.0)])
def test_inputs_that_are_held_have_the_doubt_of_the_companion(
    hold: Hold, doubt: float, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Of moving inputs the FMU measures itself what is between samples."""
    surrogate: Any = random_surrogate(Shape(hold=hold, cell=CellShape()))
    companion: Any = object()
    parts: Any = [SimpleNamespace(kinds=None)] * 2
    known: dict[str, Any] = {}

    class Judge:
        history = "the head's"

        def error_bound(self, *given: Any) -> Any:
            names = "companion", "blocks", "estimator", "tolerances", "doubt", "moving"
            known.update(zip(names, given, strict=True))
            return "a bound"

    monkeypatch.setattr(error_bound, "observed", lambda *given: given)
    monkeypatch.setattr(error_bound, "require_finite", lambda *_: None)
    monkeypatch.setattr(error_bound, "fit_judge", lambda *_: Judge())
    monkeypatch.setattr(error_bound, "tolerances_of", lambda _, share: share)
    monkeypatch.setattr(error_bound, "doubt_of", lambda of: 0.5 if of is companion else None)
    recipe = BoundRecipe()
    found = error_bound.fit_bound(
        surrogate, companion, parts, recipe, tmp_path, torch.device("cpu"), no_stages
    )
    assert found == ("a bound", "the head's")
    assert known["doubt"] == doubt
    assert known["moving"] == (hold == "first_order")
    assert known["tolerances"] == recipe.false_alarms
    assert known["companion"] is companion


def test_statistic_that_moves_little_about_a_negative_mean_is_rounding_too() -> None:
    """The largest size decides, of whichever sign, and not the smallest."""
    noise = np.random.default_rng(1).normal(size=100)
    statistics = np.stack([-100 + 1e-6 * noise, 2e-6 * noise, 0.01 * noise], axis=1)
    scaling = scaling_of_statistics(statistics)
    assert scaling.scale == pytest.approx([1.0, statistics[:, 1].std(), statistics[:, 2].std()])
    np.testing.assert_allclose(scaling.offset, statistics.mean(axis=0))


SIZES = np.array([0.125, 2.0])
"""Of the errors of two outputs."""


def learnable(seed: int, trajectories: int) -> Observations:
    """Errors of two outputs that grow by a factor of 16 with the first statistic."""
    rng = np.random.default_rng(seed)
    statistics = rng.uniform(-1, 1, (trajectories, 40, 3))
    growing = SIZES * 2.0 ** (2 * statistics[:, :, :1])
    errors = np.abs(growing * rng.normal(size=(trajectories, 40, 2)))
    nothing = np.zeros((trajectories, 40, 0))
    return Observations(statistics, nothing, nothing, errors)


def head_of(
    learnt: list[Observations], folder: Path, span: float | None = None
) -> tuple[FeedForward, History]:
    expert = {"hidden": (6,), "steps": 300, "batch": 64, "learning_rate": 0.02}
    recipe = BoundRecipe.model_validate({"estimate_span": span, "expert": expert})
    cpu = torch.device("cpu")
    return fit_head(learnt, recipe, folder / "head.pt", cpu, lambda *_, **__: None)


def test_head_learns_where_errors_of_each_output_are_large(tmp_path: Path) -> None:
    """It gives the logarithms of the quantile of 95 %, and then of the RMS of the errors."""
    head, _ = head_of([learnable(1, 60)], tmp_path, span=0.5)
    at = np.zeros((3, 1, 3))
    at[:, 0, 0] = -0.8, 0.0, 0.8
    sizes = SIZES * 2.0 ** (2 * at[:, :, 0])
    expected = np.log2(np.concatenate([1.96 * sizes, sizes], axis=1))
    found = head.evaluate(at).reshape(3, 4).astype(float)
    np.testing.assert_allclose(found, expected, atol=0.35)


def test_head_without_a_span_has_scales_alone(tmp_path: Path) -> None:
    head, _ = head_of([learnable(1, 20)], tmp_path)
    assert head.evaluate(np.zeros((1, 1, 3))).shape[-1] == 2


def test_a_tenth_of_each_mix_of_trajectories_selects_the_weights(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Errors of all mixes are relative to those of the first."""
    seen: list[WindowData] = []

    class Stop(Exception):
        pass

    def train(module: Any, training: WindowData, validation: WindowData, *_: Any) -> Any:
        seen.extend([training, validation])
        raise Stop

    monkeypatch.setattr(error_bound, "train", train)
    first, further = learnable(1, 20), learnable(2, 4)
    with pytest.raises(Stop):
        head_of([first, further], tmp_path)
    assert [part.n_windows for part in seen] == [40 * (18 + 3), 40 * (2 + 1)]
    usual = np.quantile(first.errors.reshape(-1, 2), 0.95, axis=0)
    for part, kept in zip(seen, (slice(2, None), slice(0, 2)), strict=True):
        ends = slice(1, None) if kept.start == 2 else slice(0, 1)
        errors = np.concatenate(
            [first.errors[kept].reshape(-1, 2), further.errors[ends].reshape(-1, 2)]
        )
        inputs, targets = part.cut(torch.arange(part.n_windows))
        np.testing.assert_allclose(targets.numpy(), errors / usual, rtol=1e-5)
        assert inputs.shape[:2] == (len(errors), 1)


def test_surrogate_without_errors_is_refused_by_the_output(tmp_path: Path) -> None:
    exact = learnable(1, 20)
    exact.errors[:, :, 1] = 0.0
    with refused(ValueError, "no error in output 1 ", "remove the table [bound]"):
        head_of([exact], tmp_path)
