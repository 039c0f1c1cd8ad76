"""``slide-fmu compare``: real small runs, which go on where they were stopped."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slide_fmu.apps.compare import compare as comparing
from slide_fmu.apps.compare.baselines.base import Budget
from slide_fmu.apps.compare.baselines.own_network import OwnNetwork
from slide_fmu.apps.compare.compare import KeptComparison, Terms, compare_recipe
from slide_fmu.apps.compare.model_figures import ComparisonFigures, ModelFigures
from slide_fmu.core.figures import plain
from slide_fmu.core.measures import rms
from slide_fmu.core.result_cache import DamagedFileError
from slide_fmu.data.draws import TEST, Stream
from slide_fmu.data.unseen import UnseenMotion, unseen_motions
from slide_fmu.fitting.checkpoint import CpuTime
from slide_fmu.fitting.errors import TrainingError
from slide_fmu.fitting.state_space.multi_start import MultiStart
from slide_fmu.pipeline.job import Job, open_job
from tests import own_records
from tests.apps.compare.lessons import needs_sysidentpy
from tests.libraries import build_libraries
from tests.own_records import write_record
from tests.refusals import refused

MODEL = ModelFigures(title="FIR", linear=True, structure="9 lags", cpu_seconds=1.0)
MOTION = UnseenMotion(np.ones((3, 1)), np.zeros((4, 1)), 1, 0)


def never() -> None:
    """Stand for what is not looked for again."""
    raise AssertionError


def test_what_was_found_is_not_looked_for_again(tmp_path: Path) -> None:
    kept = KeptComparison(tmp_path)
    kept.figures("fir", "key", lambda: MODEL)
    kept.motions("key", lambda: [MOTION])
    assert kept.figures("fir", "key", never) == MODEL  # type: ignore[arg-type]
    (again,) = kept.motions("key", never)  # type: ignore[arg-type]
    assert np.array_equal(again.inputs, MOTION.inputs)


@pytest.mark.parametrize("part", [0.0, 0.5, 0.95])
def test_damaged_files_of_a_comparison_are_named(tmp_path: Path, part: float) -> None:
    kept = KeptComparison(tmp_path)
    kept.figures("fir", "key", lambda: MODEL)
    kept.motions("key", lambda: [MOTION])
    for path in tmp_path.iterdir():
        whole = path.read_bytes()
        path.write_bytes(whole[: int(part * len(whole))])
    with refused(DamagedFileError, ".json is damaged", "remove it"):
        kept.figures("fir", "key", lambda: MODEL)
    with refused(DamagedFileError, ".npz is damaged", "remove it"):
        kept.motions("key", lambda: [MOTION])


pytestmark = pytest.mark.extended

RECIPE = """
name = "NAME"
description = "an oscillator"

[system]
model = "mbs_models.oscillators:MODEL"
parameters = { substeps = 12, damping = 16.0 }

[window]
step = 0.03
n_in = 48
n_out = 16

[data]
seed = 9
duration = 6.0
burn_in = 1.0
train = 8
validation = 2

[[data.excitation]]
kind = "held_random"
weight = 1.0

[validation]
trajectories = 3

[network]
order = 2
hidden = 6

[training]
expert.part = 1
starts = 1
expert.start_iterations = 10
expert.kept = 1
expert.kept_iterations = 10
iterations = 20
"""
TERMS = Terms(budget=2.0, seed=77, trajectories=3, workers=1)
LINEAR = ("FIR", "ARX", "linear state space")


class CountedBudget(Budget):
    """A CountedBudget is spent by what a test counts: CPU time differs on a machine with load."""

    spent = 0.0


@pytest.fixture(scope="module", autouse=True)
def own_time() -> Iterator[None]:
    """Own trainings count as long as the budget: on a slow machine they would be longer."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(CpuTime, "keep", lambda _: TERMS.budget)
        yield


def job_of(folder: Path, name: str, model: str) -> Job:
    """A job of the small recipe, its work beside it."""
    path = folder / f"{name}.toml"
    path.write_text(RECIPE.replace("NAME", name).replace("MODEL", model), encoding="utf-8")
    return open_job(path, folder / "runs", lambda _: lambda *_: None)


@pytest.fixture(scope="module")
def duffing(tmp_path_factory: pytest.TempPathFactory) -> tuple[Job, ComparisonFigures, Path]:
    """A finished comparison of the Duffing oscillator."""
    build_libraries()
    job = job_of(tmp_path_factory.mktemp("duffing"), "duffing", "DuffingOscillator")
    return (job, *compare_recipe(job, TERMS))


def by_title(figures: ComparisonFigures) -> dict[str, ModelFigures]:
    return {model.title: model for model in figures.models}


def error(model: ModelFigures) -> float:
    return float(model.outputs[0].rmse_over_deviation)


@needs_sysidentpy
def test_nonlinear_network_beats_linear_models_of_the_duffing_oscillator(
    duffing: tuple[Job, ComparisonFigures, Path],
) -> None:
    models = by_title(duffing[1])
    own = models["own: state space"]
    assert own.structure == "4 states, 6 units"
    assert error(own) < 0.05
    for title in LINEAR:
        assert error(models[title]) > 3 * error(own), title
        assert models[title].linear
    assert duffing[1].remark is None


@needs_sysidentpy
def test_every_model_has_its_figures(duffing: tuple[Job, ComparisonFigures, Path]) -> None:
    _, figures, page = duffing
    assert len(figures.models) == 7
    for model in figures.models:
        assert model.failed is None
        assert model.parameters > 0
        assert model.step_us > 0
        assert model.time_ratio > 0
        assert model.cpu_seconds < 3 * figures.budget_s, model.title
    models = by_title(figures)
    for title in ("GRU", "feed-forward network"):
        assert models[title].cpu_seconds == pytest.approx(figures.budget_s, rel=0.1)
        assert models[title].validation_error <= models[title].error_half_way
    assert models["GRU"].cut
    assert models["feed-forward network"].cut
    assert models["own: state space"].time_ratio == pytest.approx(1, rel=0.5)
    assert "own: state space" in page.read_text(encoding="utf-8")
    assert json.loads(page.with_suffix(".json").read_text(encoding="utf-8")) == plain(figures)


@needs_sysidentpy
def test_own_error_is_that_of_the_surrogate_on_the_unseen_motions(
    duffing: tuple[Job, ComparisonFigures, Path],
) -> None:
    job, figures, _ = duffing
    surrogate = job.folder.load_surrogate(job.recipe).surrogate
    stream = Stream(TEST, TERMS.seed, (1.0, 1.0), job.recipe.data.duration)
    parts = []
    for motion in unseen_motions(job.recipe, job.case.system, stream, 3, lambda *_: None):
        first = 34  # the burn-in of 33 samples, and one; the network looks back 33
        truth = motion.outputs[first:]
        parts.append((surrogate.predict_newest(motion.inputs)[first - 1 :] - truth, truth))
    errors, truth = (np.concatenate(part) for part in zip(*parts, strict=True))
    expected = rms(errors) / truth.std(axis=0)
    assert error(figures.models[0]) == pytest.approx(float(expected[0]), rel=1e-6)


@needs_sysidentpy
def test_comparison_that_was_killed_goes_on_with_the_next_model(
    duffing: tuple[Job, ComparisonFigures, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    job, figures, _ = duffing
    (gru,) = (job.folder.path / "compare").glob("gru-*.json")
    gru.unlink()
    fitted = []

    def fit(candidate: Any, *arguments: Any) -> ModelFigures:
        fitted.append(candidate.title)
        raise KeyboardInterrupt

    monkeypatch.setattr(comparing, "_measured", fit)
    with pytest.raises(KeyboardInterrupt):
        compare_recipe(job, TERMS)
    assert fitted == ["GRU"]
    monkeypatch.undo()
    monkeypatch.setattr(comparing, "unseen_motions", lambda *_: pytest.fail("simulated again"))
    again, _ = compare_recipe(job, TERMS)
    kept = ("FIR", "ARX", "NARX", "linear state space", "feed-forward network")
    assert all(by_title(again)[title] == by_title(figures)[title] for title in kept)


@needs_sysidentpy
def test_other_terms_find_all_models_anew(
    duffing: tuple[Job, ComparisonFigures, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    fitted = []

    def fit(candidate: Any, *arguments: Any) -> ModelFigures:
        fitted.append((candidate.title, arguments[2]))
        raise KeyboardInterrupt

    monkeypatch.setattr(comparing, "_measured", fit)
    for terms in (Terms(7.0, 77, 3), Terms(None, 77, 2), Terms(TERMS.budget, 78, 3)):
        with pytest.raises(KeyboardInterrupt):
            compare_recipe(duffing[0], terms)
    assert fitted == [("FIR", 7.0), ("FIR", 2.0), ("FIR", 2.0)]


@needs_sysidentpy
def test_own_network_keeps_a_budget_that_is_shorter_than_its_training(
    duffing: tuple[Job, ComparisonFigures, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    job, figures, _ = duffing
    surrogate, seconds = job.folder.load_surrogate(job.recipe).surrogate, figures.models[0]
    own = OwnNetwork(job.case, job.folder.trajectories, surrogate, seconds.cpu_seconds)
    assert own.can_be_fitted
    budget = CountedBudget(0.5 * own.seconds)
    refine = MultiStart.refine

    def counted(*arguments: Any, **names: Any) -> Any:
        budget.spent += budget.seconds / 8
        return refine(*arguments, **names)

    monkeypatch.setattr(MultiStart, "refine", counted)
    found = own.fit(budget, lambda *_: None)
    assert found.cut
    assert found.course.steps == 7  # an eighth is left, and the longest one took as much
    assert found.baseline.parameters == surrogate.network.count_parameters()
    assert 0 < found.course.error < 0.2


@needs_sysidentpy
def test_linear_model_of_a_linear_system_is_remarked(tmp_path: Path) -> None:
    build_libraries()
    figures, page = compare_recipe(job_of(tmp_path, "linear", "LinearOscillator"), TERMS)
    models = by_title(figures)
    assert error(models["ARX"]) < 1e-9
    assert models["ARX"].structure == "2 lags"
    # NARX may choose the same terms; networks round to single precision
    others = [model for model in figures.models if model.title not in ("ARX", "NARX")]
    assert all(error(model) > error(models["ARX"]) for model in others)
    assert "a linear model would do: ARX" in figures.remark
    assert figures.remark in page.read_text(encoding="utf-8")


def test_missing_extra_is_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "sysidentpy", None)
    job = job_of(tmp_path, "missing", "LinearOscillator")
    with refused(RuntimeError, "slide-fmu[compare]"):
        compare_recipe(job, TERMS)
    assert not job.folder.path.exists()


def test_model_that_cannot_be_trained_says_why() -> None:
    def fails(*_: object) -> None:
        raise TrainingError("training diverged")

    candidate = comparing.BaselineCandidate("GRU", False, fails)  # type: ignore[arg-type]
    found = comparing._measured(candidate, None, None, 1.0, lambda _: lambda *_: None)  # type: ignore[arg-type]
    assert found.failed == "training diverged"
    assert found.title == "GRU"


@pytest.mark.parametrize("budget", [0.0, -1.0, float("nan"), float("inf")])
def test_budget_that_is_no_time_is_refused(budget: float) -> None:
    with refused(ValueError, "expected a positive", "finite CPU"):
        Terms(budget, 1)


def test_budget_counts_cpu_time_from_its_begin() -> None:
    budget = Budget(5.0)
    sum(range(300_000))
    assert 0 < budget.spent < 5
    assert budget.left == pytest.approx(5 - budget.spent, abs=0.05)


@needs_sysidentpy
def test_models_of_a_record_are_measured_on_its_part_that_nothing_learnt_from(
    tmp_path: Path,
) -> None:
    build_libraries()
    write_record(tmp_path / "bench.csv", 3000)
    path = tmp_path / "bench.toml"
    text = own_records.RECIPE.replace('"bench.csv"', f'"{tmp_path / "bench.csv"}"')
    text = text.replace("iterations = 10", "iterations = 10\nstarts = 2")
    path.write_text(text, encoding="utf-8")
    job = open_job(path, tmp_path / "runs", lambda _: lambda *_: None)
    figures, _ = compare_recipe(job, Terms(budget=TERMS.budget, seed=77, workers=1))
    assert figures.trajectories == 2  # blocks, of which the last one ends the record
    models = by_title(figures)
    assert error(models["own: state space"]) < 0.1 < error(models["ARX"])
    assert {model.failed for model in figures.models} == {None}
