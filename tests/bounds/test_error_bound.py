"""The error bound of a small Duffing oscillator, on trajectories that nothing has seen."""

from __future__ import annotations

import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from crepes import ConformalRegressor

from slide_fmu.bounds import error_bound
from slide_fmu.bounds import fit as fit_module
from slide_fmu.bounds.companion import COMPANION
from slide_fmu.bounds.error_bound import BOUND, fit_bound
from slide_fmu.bounds.estimate_use import useless_estimate
from slide_fmu.bounds.fit import fit_surrogate
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import TEST, Stream, draw, simulate_draw
from slide_fmu.data.generation import generate
from slide_fmu.data.trajectories import Split
from slide_fmu.fitting.network import SURROGATE, Fit
from slide_fmu.fitting.preparation import Work
from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.error_bound import BoundRecipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.error_bound import CONFIDENCES, ErrorBound
from slide_fmu.surrogate.surrogate import Surrogate
from tests.bounds.learnt_soon import LEARNT_SOON
from tests.fmu.samples import CellShape, Shape
from tests.progress import no_stages, silent
from tests.recipes import tiny_state_space_recipe, whole_recipe
from tests.refusals import refused
from tests.trajectories import read_split

pytestmark = pytest.mark.extended

RECIPE = tiny_state_space_recipe(
    system={
        "model": "mbs_models.oscillators:DuffingOscillator",
        "parameters": {"damping": 40.0, "substeps": 6},
    },
    data={"train": 6, "duration": 2.5, "bound": 40, "calibration": 100},
    **LEARNT_SOON,
)
SHAPE = Shape(n_in=6, n_out=2, n_inputs=2, n_outputs=2, cell=CellShape())
CALIBRATED = RECIPE.count("calibration")
FRESH = 60
"""Trajectories that nothing has seen."""


def bound_of(*, estimate_span: float | None = None, steps: int | None = None) -> BoundRecipe:
    """Return the recipe's bound with an estimate, or with other steps of its training."""
    assert RECIPE.bound is not None
    expert = RECIPE.bound.expert
    if steps is not None:
        expert = expert.model_copy(update={"steps": steps})
    span = RECIPE.bound.estimate_span if estimate_span is None else estimate_span
    return RECIPE.bound.model_copy(update={"expert": expert, "estimate_span": span})


def fitted(recipe: Recipe, folder: Path) -> Fit:
    trajectories = folder / "trajectories"
    with ThreadPoolExecutor(1) as pool:
        generate(case_of(recipe), trajectories, pool, silent)
    return fit_surrogate(Work(case_of(recipe), trajectories, folder / "checkpoints", no_stages))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("bound")


@pytest.fixture(scope="module")
def fit(folder: Path) -> Fit:
    return fitted(RECIPE, folder)


@dataclass(frozen=True, eq=False)
class Unseen:
    """Errors and inputs of fresh trajectories where window and bound are filled."""

    inputs: FloatArray
    errors: FloatArray
    filled: slice


@pytest.fixture(scope="module")
def unseen(fit: Fit) -> Unseen:
    surrogate, system = fit.surrogate, case_of(RECIPE).system
    stream = Stream(TEST, 91, (1.0, 1.0), RECIPE.data.duration)
    runs = [simulate_draw(system, draw(RECIPE, system, stream, i)) for i in range(FRESH)]
    inputs, outputs = (np.stack([getattr(run, name) for run in runs]) for name in NAMES)
    return errors_of(surrogate, inputs, outputs)


NAMES = "inputs", "outputs"


def errors_of(surrogate: Surrogate, inputs: FloatArray, outputs: FloatArray) -> Unseen:
    errors = np.abs(surrogate.predict_newest_batch(inputs) - outputs[:, 1:])
    assert surrogate.bound is not None
    filled = slice(max(surrogate.window.n_in, surrogate.bound.filling_length), None)
    return Unseen(inputs, errors[:, filled], filled)


def bounds_of(surrogate: Surrogate, unseen: Unseen, confidence: float) -> FloatArray:
    found = [surrogate.trust(inputs).bounds(confidence) for inputs in unseen.inputs]
    return np.stack(found)[:, unseen.filled]


def test_training_that_goes_on_from_a_bounded_surrogate_keeps_network_and_companion_apart(
    fit: Fit, folder: Path, tmp_path: Path
) -> None:
    """Each begins with its own weights: after two iterations, both are better than they were."""
    training = RECIPE.training.model_copy(update={"iterations": 2})
    recipe = RECIPE.model_copy(update={"training": training, "bound": bound_of(steps=100)})
    work = Work(case_of(recipe), folder / "trajectories", tmp_path, no_stages, fit.surrogate)
    again = fit_surrogate(work)
    for stage in (SURROGATE, COMPANION):
        errors = [min(found.histories[stage].validation_error) for found in (again, fit)]
        assert errors[0] <= errors[1]
    before, after = fit.surrogate.bound, again.surrogate.bound
    assert before is not None
    assert after is not None
    assert len(after.companion.cell.w) == len(before.companion.cell.w) == 9
    assert len(again.surrogate.network.cell.w) == 6


def test_bounds_of_calibration_by_single_samples_are_those_of_split_conformal_prediction(
    fit: Fit, unseen: Unseen, folder: Path, tmp_path: Path
) -> None:
    """Trajectories that end with their first filled sample are one observation each, as crepes
    takes them: what floor and disagreement leave of the errors, in metres, and the head's
    scales."""
    surrogate = fit.surrogate
    assert isinstance(surrogate.bound, ErrorBound)
    assert RECIPE.bound is not None
    last = max(surrogate.window.n_in, surrogate.bound.filling_length)
    learnt, calibration = (
        read_split(RECIPE, folder / "trajectories", name) for name in ("bound", "calibration")
    )
    single = Split(
        calibration.inputs[:, : last + 1], calibration.outputs[:, : last + 2], calibration.kinds
    )
    heard: list[float | None] = []
    bound, _ = fit_bound(
        surrogate,
        surrogate.bound.companion,
        [learnt, single],
        bound_of(steps=50),
        tmp_path / "head.pt",
        torch.device("cpu"),
        lambda name: lambda done, total, error=None: heard.append(error),
    )
    assert set(heard) == {None}  # its loss is no relative error
    bounded = replace(surrogate, bound=bound)

    def at_the_end(inputs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Scales and disagreements, (n_trajectories,) each."""
        every = [bounded.trust(one).local for one in inputs]
        newest = [[local.scales[-1, 0], local.disagreement[-1, 0]] for local in every]
        scales, apart = np.array(newest).T * surrogate.output_scaling.scale
        return scales, bound.shares * apart

    assert bound.floors is not None
    (floor,) = bound.floors * surrogate.output_scaling.scale
    errors = (surrogate.predict_newest_batch(single.inputs) - single.outputs[:, 1:])[:, -1, 0]
    usual = 0.15 * np.quantile(abs(errors), 0.95), 0.45 * np.median(abs(errors))
    np.testing.assert_allclose(floor, min(usual))
    scales, apart = at_the_end(single.inputs)
    left = np.where(abs(errors) <= apart, 0.0, np.sqrt(np.maximum(errors**2 - floor**2, 0.0)))
    assert 0 < (left == 0).mean() < 0.9
    oracle = ConformalRegressor().fit(left, sigmas=scales)
    others = unseen.inputs[:, : last + 1]
    scales, apart = at_the_end(others)
    for confidence in CONFIDENCES:
        zeros = np.zeros(len(others))
        intervals = oracle.predict_int(zeros, sigmas=scales, confidence=confidence)
        expected = np.maximum(np.hypot(intervals[:, 1], floor), apart)
        bounds = [bounded.trust(one).bounds(confidence)[-1, 0] for one in others]
        inside = np.array([bounded.trust(one).novelty[-1] <= 1 for one in others])
        assert inside.sum() > 0.9 * FRESH
        # errors far below the outputs, found in batches of another size, differ by rounding
        np.testing.assert_allclose(np.array(bounds)[inside], expected[inside], rtol=1e-3)


def test_companion_has_the_size_and_the_training_that_the_recipe_says(fit: Fit) -> None:
    assert isinstance(fit.surrogate.bound, ErrorBound)
    networks = fit.surrogate.network, fit.surrogate.bound.companion
    assert [network.cell.e.shape[1] for network in networks] == [6, 9]
    assert [len(fit.histories[name].step) for name in ("surrogate", COMPANION)] == [10, 14]
    assert fit.recipe.network == RECIPE.network.model_copy(update={"drive": ("inputs",)})


@pytest.mark.parametrize("confidence", CONFIDENCES)
def test_bound_covers_what_it_promises(
    fit: Fit, unseen: Unseen, folder: Path, confidence: float
) -> None:
    """But for what chance does: to the trajectories here, and to those of the calibration."""
    surrogate = fit.surrogate
    split = read_split(RECIPE, folder / "trajectories", "calibration")
    known = errors_of(surrogate, split.inputs, split.outputs)
    spread = (known.errors <= bounds_of(surrogate, known, confidence)).mean(axis=(1, 2)).std()
    shares = (unseen.errors <= bounds_of(surrogate, unseen, confidence)).mean(axis=(1, 2))
    slack = 3 * spread * np.sqrt(1 / FRESH + 1 / CALIBRATED)
    promised = confidence * (CALIBRATED + 1) / CALIBRATED
    assert slack < 0.02
    assert promised - slack < shares.mean() < promised + slack


def test_bound_is_better_than_the_best_constant(fit: Fit, unseen: Unseen) -> None:
    bounds = bounds_of(fit.surrogate, unseen, 0.95)
    constant = np.quantile(unseen.errors, 0.95)

    def loss(bound: FloatArray) -> float:
        below = unseen.errors - bound
        return float(np.maximum(0.95 * below, -0.05 * below).mean())

    assert loss(bounds) < 0.8 * loss(np.full(bounds.shape, constant))


def test_usual_inputs_are_in_the_domain_and_others_are_not(fit: Fit, unseen: Unseen) -> None:
    surrogate = fit.surrogate
    novelty = np.stack([surrogate.trust(inputs).novelty for inputs in unseen.inputs])
    assert (novelty[:, unseen.filled] > 1).mean() < 0.01
    time = RECIPE.window.step * np.arange(256)
    high = max(abs(surrogate.inputs[0].low), surrogate.inputs[0].high)
    shaken = 2.5 * high * np.sign(np.sin(25 * time))[:, None]
    assert (surrogate.trust(shaken).novelty[100:] > 1).all()


def test_false_alarms_of_the_calibration_are_those_of_the_recipe(
    fit: Fit, unseen: Unseen, folder: Path
) -> None:
    """A twentieth of them may come from the domain; fresh trajectories have about the same."""
    assert RECIPE.bound is not None
    surrogate, rate = replace(fit.surrogate, output_ranges=None), RECIPE.bound.false_alarms
    split = read_split(RECIPE, folder / "trajectories", "calibration")
    for inputs, slack in ((split.inputs, 0.001), (unseen.inputs, 0.02)):
        trusted = np.stack([surrogate.trust(one).trusted()[unseen.filled] for one in inputs])
        inside = np.stack([surrogate.trust(one).in_domain[unseen.filled] for one in inputs])
        assert abs(np.mean(~trusted) - rate) < slack
        assert np.mean(~inside) < rate / 20 + slack
        assert not (trusted & ~inside).any()


def test_head_learns_no_logarithm_below_a_thousandth_of_its_training(fit: Fit) -> None:
    """An input that rests at the middle of its range is as known as one that hardly moves."""
    surrogate = fit.surrogate
    bound = surrogate.bound
    assert bound is not None
    assert bound.quietest is not None
    assert (bound.quietest > -60).all()
    still = np.full((256, 1), surrogate.input_scaling.offset[0])
    statistics = bound.statistics(
        surrogate.input_scaling.apply(still)[None],
        surrogate.output_scaling.apply(surrogate.predict_newest(still))[None],
    )[0]
    assert statistics.min() < -60
    usual = np.quantile(surrogate.trust(still).bounds()[100:], 0.5, axis=0)
    assert (usual < surrogate.error_tolerances).all()


def test_further_kinds_make_bounds_larger_where_errors_are_and_move_no_edge(
    fit: Fit, folder: Path
) -> None:
    """The networks, the calibration and the domain know nothing of them."""
    jumps = {"kind": "binary", "weight": 1.0, "duration": (0.02, 0.06)}
    values = RECIPE.model_dump()
    # the head alone learns from these; so hard that it errs much more
    expert = {**values["bound"]["expert"], "hidden": (12,)}
    table = {**values["bound"], "expert": expert, "excitation": (jumps,)}
    recipe = whole_recipe({**values, "bound": table})
    assert recipe.count("further") == RECIPE.count("bound") // 2
    assert RECIPE.count("further") == 0
    taught = fitted(recipe, folder).surrogate
    assert isinstance(taught.bound, ErrorBound)
    assert isinstance(fit.surrogate.bound, ErrorBound)
    assert np.array_equal(taught.bound.limits, fit.surrogate.bound.limits)
    others, system = recipe.with_further_kinds(), case_of(recipe).system
    stream = Stream(TEST, 92, (1.0, 1.0), recipe.data.duration)
    runs = [simulate_draw(system, draw(others, system, stream, i)) for i in range(40)]
    inputs = np.stack([run.inputs for run in runs])
    assert len(np.unique(np.abs(inputs))) == 1  # they are drawn, not those of the data
    predicted = taught.predict_newest_batch(inputs)
    assert np.array_equal(predicted, fit.surrogate.predict_newest_batch(inputs))
    errors = np.abs(predicted - np.stack([run.outputs[1:] for run in runs]))
    covered = [
        np.mean(
            [
                (error <= one.trust(u).bounds(0.95))[one.window.n_in :].mean()
                for u, error in zip(inputs, errors, strict=True)
            ]
        )
        for one in (fit.surrogate, taught)
    ]
    assert covered[1] > 0.8  # no share is promised: the calibration does not know these kinds
    assert covered[0] < covered[1] - 0.1


def test_companion_has_learnt_from_other_trajectories(fit: Fit, unseen: Unseen) -> None:
    surrogate = fit.surrogate
    assert isinstance(surrogate.bound, ErrorBound)
    companion = surrogate.bound.companion
    assert fit.histories.keys() == {"surrogate", COMPANION, BOUND}
    scaled = surrogate.input_scaling.apply(unseen.inputs)
    values = surrogate.output_scaling.invert(companion.stream(scaled).astype(float))
    own = surrogate.predict_newest_batch(unseen.inputs)
    apart = np.abs(values - own)[:, unseen.filled].mean()
    assert 0.2 * unseen.errors.mean() < apart < 20 * unseen.errors.mean()


def test_same_recipe_gives_the_same_bytes_and_another_seed_others(
    fit: Fit, folder: Path, tmp_path: Path
) -> None:
    again = fitted(RECIPE, folder)
    assert again.surrogate.to_bytes() == fit.surrogate.to_bytes()
    assert RECIPE.bound is not None
    other = RECIPE.model_copy(update={"bound": bound_of(steps=20)})
    surrogate = fitted(other, folder).surrogate
    assert surrogate.bound is not None
    assert surrogate.to_bytes() != fit.surrogate.to_bytes()


def test_companion_learns_from_the_trajectories_of_the_surrogate_or_from_others(
    fit: Fit, folder: Path, unseen: Unseen
) -> None:
    """Few trajectories calibrate no bound of 99 %; what is covered stays what was promised."""
    values = RECIPE.model_dump()
    values["bound"]["expert"]["companion"] = {"iterations": 8}
    for companion in ("train", 6):
        values["data"] |= {"companion": companion, "bound": 30, "calibration": 60}
        other = fitted(whole_recipe(values), folder)
        bound = other.surrogate.bound
        assert bound is not None
        assert bound.companion.cell.e.shape == fit.surrogate.network.cell.e.shape
        assert not np.array_equal(bound.companion.cell.e, fit.surrogate.network.cell.e)
        assert bound.confidences == (0.9, 0.95)
        high = {v.name: v.high for v in fmu_variables(other.surrogate)}["confidence"]
        assert high == 0.95
        with refused(ValueError, "expected 0.9 to", "0.9 to 0"):
            other.surrogate.trust(unseen.inputs[0]).bounds(0.99)
        bounds = bounds_of(other.surrogate, unseen, 0.95)
        assert 0.9 < np.mean(unseen.errors <= bounds) < 0.995


def test_surrogate_does_not_depend_on_its_bound(fit: Fit, folder: Path) -> None:
    alone = fitted(RECIPE.model_copy(update={"bound": None}), folder).surrogate
    assert alone.bound is None
    inputs = np.random.default_rng(0).uniform(-1, 1, (80, 1))
    assert np.array_equal(alone.predict(inputs), fit.surrogate.predict(inputs))


def test_estimate_of_the_bound_is_about_the_error_of_its_span(
    fit: Fit, folder: Path, unseen: Unseen
) -> None:
    recipe = RECIPE.model_copy(update={"bound": bound_of(estimate_span=0.4)})
    work = Work(case_of(recipe), folder / "trajectories", folder / "checkpoints", no_stages)
    other = fit_surrogate(work).surrogate
    assert not fit.surrogate.estimates_errors
    assert np.array_equal(
        other.predict_newest_batch(unseen.inputs),
        fit.surrogate.predict_newest_batch(unseen.inputs),
    )
    span = other.estimated_samples
    found, true = [], []
    for inputs, errors in zip(unseen.inputs, unseen.errors, strict=True):
        means = np.lib.stride_tricks.sliding_window_view(errors**2, span, axis=0).mean(axis=-1)
        true.append(np.sqrt(means))
        found.append(other.estimate_error(inputs)[-len(means) :])
    ratios = np.log(np.concatenate(found) / np.concatenate(true))
    constant = np.log(np.concatenate(true))
    assert abs(np.median(ratios)) < 0.2
    assert np.abs(ratios).mean() < 0.8 * np.abs(constant - np.median(constant)).mean()


def test_estimate_that_says_no_more_than_a_constant_is_left_out_with_a_remark(
    fit: Fit, folder: Path, unseen: Unseen, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its head does not learn RMS errors here; the bound is the same without what they were."""
    recipe = RECIPE.model_copy(update={"bound": bound_of(estimate_span=0.4, steps=60)})
    monkeypatch.setattr(error_bound, "WEIGHT_OF_RMS", 0.0)
    other = fitted(recipe, folder)
    assert not other.surrogate.estimates_errors
    remark = other.histories[BOUND].remark
    assert remark is not None
    assert re.search(
        r"no error estimate.* on 100 trajectories .* is \d+(\.\d+)? % off on average for "
        r"position, the best constant \d+(\.\d+)? %$",
        remark,
    )
    monkeypatch.setattr(fit_module, "useless_estimate", lambda *given: None)
    kept = fitted(recipe, folder).surrogate
    assert kept.estimates_errors
    calibration = read_split(RECIPE, folder / "trajectories", "calibration")
    assert useless_estimate(kept, calibration) == remark
    bounds = [bounds_of(one, unseen, 0.9) for one in (other.surrogate, kept)]
    np.testing.assert_allclose(*bounds, rtol=1e-6)


def test_networks_that_do_not_stay_bounded_are_named_with_the_part_of_the_data(
    fit: Fit, folder: Path, tmp_path: Path
) -> None:
    assert isinstance(fit.surrogate.bound, ErrorBound)
    assert RECIPE.bound is not None
    learnt, calibration = (
        read_split(RECIPE, folder / "trajectories", name) for name in ("bound", "calibration")
    )
    wild = learnt.inputs.copy()
    wild[1, -1] = 1e300
    with pytest.raises(
        ValueError, match=rf"not finite on 1 of {len(wild)} .* of bound\.expert\.further; "
    ):
        fit_bound(
            fit.surrogate,
            fit.surrogate.bound.companion,
            [learnt, calibration, Split(wild, learnt.outputs, learnt.kinds)],
            RECIPE.bound,
            tmp_path / "head.pt",
            torch.device("cpu"),
            lambda name: silent,
        )
