"""Numbers of trajectories are found once, from a learning curve, and released with the FMU."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import torch

from slide_fmu.core.progress import Progress, Stages
from slide_fmu.core.result_cache import DamagedFileError
from slide_fmu.data import pool
from slide_fmu.data.workplace import Workplace
from slide_fmu.excitation.loop import LoopRecipe
from slide_fmu.fitting import checkpoint, learning_curve
from slide_fmu.fitting.history import Curve, CurvePoint
from slide_fmu.fitting.problem import Physical, Problem
from slide_fmu.fitting.state_space.fit_data import FitData, fit_data
from slide_fmu.pipeline import numbers
from slide_fmu.pipeline.job import Job, open_job, provenance
from slide_fmu.pipeline.numbers import _curve_file, known_numbers
from slide_fmu.pipeline.run_folder import TrainedSurrogate, recipe_of_provenance
from slide_fmu.pipeline.stages import choose_numbers, generate_data, train_surrogate
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.specification import Specification
from tests.data.test_generation import Inline
from tests.data.test_trajectories import LAG
from tests.fmu.samples import sum_surrogate
from tests.progress import no_stages, silent
from tests.recipes import TINY, tiny_state_space_recipe
from tests.refusals import refused
from tests.trajectories import read_split

OPEN = TINY[: TINY.index("[network]")].replace("train = 4\nvalidation = 2\n", "") + (
    "[network]\norder = 2\nhidden = 2\n\n[training]\niterations = 3\nstarts = 1\n"
)
"""The tiny recipe with a state-space network, and no numbers of trajectories."""
FEW = 2


@pytest.fixture(autouse=True)
def few_trajectories(monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def inline(workers: int | None = None) -> Iterator[Executor]:
        yield Inline()

    monkeypatch.setattr(pool, "process_pool", inline)
    monkeypatch.setattr(numbers, "FIRST", FEW)
    monkeypatch.setattr(numbers, "VALIDATION", FEW)
    monkeypatch.setattr(numbers, "MOST", 4 * FEW)
    monkeypatch.setattr(numbers, "CHEAP", -1.0)


def opened(folder: Path, text: str = OPEN, bar: Stages = no_stages) -> Job:
    place = folder / "tiny.toml"
    place.write_text(text, encoding="utf-8")
    return open_job(place, folder / "runs", bar)


def with_data(line: str) -> str:
    return OPEN.replace("seed = 7\n", f"seed = 7\n{line}\n")


def pays(monkeypatch: pytest.MonkeyPatch, part: float) -> None:
    """Let a doubling pay if the error falls below this part: 0 for never, 9 for always."""
    monkeypatch.setattr(numbers, "PAYS", part)


def curve_of(job: Job) -> Curve:
    return numbers.kept_curve(job.case, job.folder)


def without_times(curve: Curve) -> list[tuple[int, float]]:
    return [(point.trajectories, point.validation_error) for point in curve.points]


@pytest.mark.extended
@pytest.mark.parametrize(("part", "train"), [(0.0, 2 * FEW), (9.0, 4 * FEW)])
def test_curve_ends_where_a_doubling_does_not_pay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, part: float, train: int
) -> None:
    pays(monkeypatch, part)
    job = choose_numbers(opened(tmp_path), Workplace())
    curve = curve_of(job)
    assert [p.trajectories for p in curve.points] == [FEW, 2 * FEW, 4 * FEW][: train // FEW]
    assert curve.ended is not None
    assert ("does not pay" in curve.ended) == (part == 0)
    assert (job.recipe.count("train"), job.recipe.count("validation")) == (train, FEW)
    assert job.open_keys == ()
    assert generate_data(job, Workplace()).learning_curve == curve
    assert len(read_split(job.recipe, job.folder.trajectories, "train").inputs) == train


@pytest.mark.parametrize(
    ("errors", "train"),
    [
        ([1.0], 32),
        ([1.0, 0.99], 64),  # the last doubling did not pay, and 32 are few
        ([1.0, 0.5, 0.49], 64),
        ([1.0, 0.5, 0.3], 128),
        ([1.0, 0.5, 0.25, 0.24], 128),
    ],
)
def test_half_are_learnt_from_where_the_last_doubling_did_not_pay(
    errors: list[float], train: int
) -> None:
    points = [CurvePoint(32 * 2**k, error, 0.0, 1.0) for k, error in enumerate(errors)]
    assert numbers._learnt_from(points) == train


@pytest.mark.extended
def test_curve_is_found_for_a_recipe_whose_bound_is_attacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its trajectories are made without the bound, which comes when all numbers are known."""
    pays(monkeypatch, 0.0)
    text = OPEN.replace("duration = 2.0", "duration = 3.0")
    text += "\n[bound]\n\n[validation]\nadversarial = 2\n"
    job = choose_numbers(opened(tmp_path, text), Workplace())
    assert job.recipe.count("train") == 2 * FEW


@pytest.mark.extended
def test_numbers_are_found_once_and_a_released_fmu_knows_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pays(monkeypatch, 0.0)
    job = choose_numbers(opened(tmp_path), Workplace())
    assert (
        recipe_of_provenance(provenance(job, TrainedSurrogate(sum_surrogate(), {}, {})), "it")
        == job.recipe
    )
    monkeypatch.setattr(pool, "process_pool", None)  # nothing may be made again
    again = opened(tmp_path)
    assert again.recipe == job.recipe
    assert again.resolved == job.resolved == {"data": {"train": 2 * FEW, "validation": FEW}}
    other = opened(tmp_path, OPEN.replace("damping = 40.0", "damping = 41.0"))
    assert known_numbers(other.case, other.open_keys, other.folder) is None


@pytest.mark.extended
def test_curve_follows_physical_parameters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its networks are ones with parameters, and other ranges are another curve."""
    pays(monkeypatch, 0.0)
    seen: list[Physical | None] = []

    def noting(problem: Problem, *others: Any) -> FitData:
        seen.append(problem.physical)
        return fit_data(problem, *others)

    monkeypatch.setattr(learning_curve, "fit_data", noting)
    text = OPEN + "\n[parameters.mass]\nrange = [1.0, 3.0]\n"
    job = choose_numbers(opened(tmp_path, text), Workplace())
    assert job.recipe.count("train") == 2 * FEW
    shapes = [physical.training.shape for physical in seen if physical is not None]
    assert shapes == [(FEW, 1), (2 * FEW, 1)]
    wider = opened(tmp_path, text.replace("3.0]", "3.5]"))
    assert known_numbers(wider.case, wider.open_keys, wider.folder) is None


def test_curve_of_other_loops_is_another_one(tmp_path: Path) -> None:
    loop = LoopRecipe(output="position", input="force", weight=0.5, mass=(1.0, 2.0))
    job = opened(tmp_path, OPEN)
    case, curve = job.case, Curve((CurvePoint(2, 0.1, 0.2, 1.0),))
    _curve_file(case, job.folder).write_json(curve)
    assert numbers.kept_curve(case, job.folder) == curve
    looped = case.with_recipe(case.recipe.model_copy(update={"loop": (loop,)}))
    assert numbers.kept_curve(looped, job.folder) == Curve()


def test_curve_belongs_to_the_version_of_trainings_but_not_to_the_threads_of_its_reader(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job, curve = opened(tmp_path), Curve((CurvePoint(2, 0.1, 0.2, 1.0),))
    _curve_file(job.case, job.folder).write_json(curve)
    monkeypatch.setattr(torch, "get_num_threads", lambda: 99)
    assert curve_of(job) == curve
    monkeypatch.setattr(checkpoint, "TRAINING_VERSION", checkpoint.TRAINING_VERSION + 1)
    assert curve_of(job) == Curve()


class Killed(Exception):
    pass


@pytest.mark.extended
@pytest.mark.parametrize("stage", ["data of curve point 2", "fit of curve point 2"])
def test_killed_curve_goes_on_without_a_trace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stage: str
) -> None:
    pays(monkeypatch, 9.0)
    unbroken = choose_numbers(opened(_made(tmp_path / "a")), Workplace())

    def bar(name: str) -> Progress:
        return _killing() if name.startswith(stage) else silent

    place = _made(tmp_path / "b")
    with pytest.raises(Killed):
        choose_numbers(opened(place, bar=bar), Workplace())
    assert len(curve_of(opened(place)).points) == 1
    broken = choose_numbers(opened(place), Workplace())
    assert without_times(curve_of(broken)) == without_times(curve_of(unbroken))
    assert broken.recipe == unbroken.recipe


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


def _killing() -> Callable[..., None]:
    def progress(done: int, total: int, error: float | None = None) -> None:
        if done >= 1:
            raise Killed

    return progress


@pytest.mark.parametrize(("train", "validation"), [(4, FEW), (40, 10)])
def test_given_number_needs_no_curve(tmp_path: Path, train: int, validation: int) -> None:
    job = opened(tmp_path, with_data(f"train = {train}"))
    assert (job.recipe.count("train"), job.recipe.count("validation")) == (train, validation)
    assert not job.folder.cache.exists()


@pytest.mark.parametrize(("train", "learnt", "judged"), [(6, 128, 16), (160, 160, 20)])
def test_estimator_gets_numbers_too(tmp_path: Path, train: int, learnt: int, judged: int) -> None:
    job = opened(tmp_path, with_data(f"train = {train}") + "[estimator]\n")
    counts = {name: job.recipe.count(name) for name in ("estimator", "estimator_validation")}
    assert counts == {"estimator": learnt, "estimator_validation": judged}


BOUNDED = with_data("train = 6").replace("duration = 2.0", "duration = 3.0") + (
    "[bound.expert]\nlong_span = 0.3\n"
)


def bounded_text() -> str:
    """A recipe of which only the numbers of the bound are open."""
    return BOUNDED.replace("train = 6\n", 'train = 6\ncompanion = "auto"\nbound = "auto"\n')


@pytest.mark.parametrize(
    ("cost", "kinds", "expected"),
    [
        (0.01, 1, (6, 200, 100)),  # 306 of them take 3 s
        (0.01, 14, (6, 280, 504)),  # 36 of each kind calibrate the bound
        (0.1, 14, ("train", 214, 385)),  # 790 would take 79 s
        (0.4, 1, ("train", 100, 100)),  # 306 would take 122 s
        (0.5, 1, ("train", 80, 100)),
        (5.0, 14, ("train", 30, 100)),
        (60.0, 14, ("train", 30, 60)),
    ],
)
def test_dear_simulations_are_fewer_for_the_bound(
    cost: float, kinds: int, expected: tuple[int | str, int, int]
) -> None:
    assert numbers.numbers_of_bound(6, cost, kinds) == expected


def test_calibration_with_few_trajectories_of_each_kind_is_said() -> None:
    kinds = [
        {"kind": "held_random", "weight": 1.0},
        {"kind": "rest", "weight": 9, "duration": (1, 2)},
    ]
    many, few = (
        tiny_state_space_recipe(
            bound={"expert": {"long_span": 0.2}}, data={"calibration": count, "excitation": kinds}
        )
        for count in (72, 71)
    )
    assert numbers.too_few_of_a_kind(many) is None
    said = numbers.too_few_of_a_kind(few)
    assert said is not None
    assert "by 71 trajectories, 35 of each of 2 kinds" in said
    assert "less than 92 %, which takes 36 of each (data.calibration = 72)" in said


def test_numbers_of_a_bound_follow_from_the_time_of_a_simulation_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(numbers, "simulation_time", lambda recipe: (1.0, None, ()))
    job = opened(tmp_path, bounded_text())
    with refused(RecipeError, "data.bound to be found"):
        job.open_recipe.resolved()
    job = choose_numbers(job, Workplace())
    assert job.resolved == {"data": {"companion": "train", "bound": 30, "validation": FEW}}
    assert job.recipe.count("companion") == 0
    # another, faster day
    monkeypatch.setattr(numbers, "simulation_time", lambda recipe: (0.0, None, ()))
    assert opened(tmp_path, bounded_text()).resolved == job.resolved
    other = opened(tmp_path, bounded_text().replace("damping = 40.0", "damping = 41.0"))
    assert other.open_keys


def test_nothing_is_trained_before_numbers_are_found(tmp_path: Path) -> None:
    job = opened(tmp_path)
    with refused(RecipeError, "leaves data.train", "to be found"):
        generate_data(job, Workplace())
    with refused(RecipeError, "leaves data.train", "to be found"):
        train_surrogate(job)


def test_cheap_trajectories_are_the_most_that_are_tried_without_a_curve(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(numbers, "CHEAP", 20.0)
    monkeypatch.setattr(numbers, "simulation_time", lambda recipe: (0.5, None, ()))
    job = choose_numbers(opened(tmp_path), Workplace())
    assert job.resolved == {"data": {"train": 4 * FEW, "validation": FEW}}
    assert curve_of(job) == Curve()
    assert opened(tmp_path).resolved == job.resolved


@pytest.mark.parametrize(
    ("changes", "expected"),
    [({}, 1), ({"network": {"order": 4}}, None), ({"network": {"units": "cubic"}}, None)],
)
def test_fits_that_begin_at_known_states_have_no_curve(
    tmp_path: Path, changes: dict[str, Any], expected: int | None
) -> None:
    """These are fits of functions, unless the recipe forbids the network to have their states."""
    place = tmp_path / "lag.py"
    place.write_text(LAG, encoding="utf-8")
    model = Specification(str(place), {}, 0.1, "function")
    recipe, function = tiny_state_space_recipe(**changes), load_system(model)
    assert numbers.states_at_start(recipe, function) == expected
    assert numbers.states_at_start(recipe, case_of(recipe).source) is None
    assert numbers.without_curve(10.0, expected) == (64 if expected else None)


def test_damaged_file_of_a_curve_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numbers, "simulation_time", lambda recipe: (1.0, None, ()))
    job = opened(tmp_path)
    numbers.trajectory_time(job.case, job.folder, no_stages)
    file = _curve_file(job.case, job.folder)
    file.write_json(Curve())
    file.path.write_text('{"recipe": {', encoding="utf-8")
    with refused(DamagedFileError, f"{file.path.name} is damaged", "remove it"):
        opened(tmp_path)
