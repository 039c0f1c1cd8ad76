"""What a recipe leaves open is found once, kept in the run folder, and released with the FMU."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from slide_fmu.core.result_cache import DamagedFileError
from slide_fmu.data.trajectories import TrajectoryError
from slide_fmu.memory import motions
from slide_fmu.pipeline import job as module
from slide_fmu.pipeline import stages
from slide_fmu.pipeline.export import ExportRequest, export
from slide_fmu.pipeline.job import Job, checked, open_job, provenance
from slide_fmu.pipeline.run_folder import StageError, TrainedSurrogate, recipe_of_provenance
from slide_fmu.pipeline.stages import check_window, generate_recipe, size_recipe, train_recipe
from slide_fmu.recipe.recipe import RecipeError
from tests.fmu.samples import sum_surrogate
from tests.memory.plain_systems import Lag
from tests.progress import no_stages
from tests.recipes import LINEAR_NETWORK, TINY, tiny_recipe
from tests.refusals import refused

OPEN = f"""
name = "lag"
description = "a lag of first order"
[system]
model = "tests.memory.plain_systems:Lag"
[window]
step = 0.05
[data]
seed = 7
train = 4
validation = 2
{LINEAR_NETWORK}
[training]
steps = 40
batch = 32
learning_rate = 3e-3
"""


@pytest.fixture(autouse=True)
def few_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motions, "MOTIONS", 4)


def opened(folder: Path, text: str = OPEN, **options: Any) -> Job:
    place = folder / "lag.toml"
    place.write_text(text, encoding="utf-8")
    return open_job(place, folder / "runs", no_stages, **options)


def note_searches(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    found: list[Any] = []
    find = module.find_lengths

    def note(*arguments: Any) -> Any:
        found.append(arguments)
        return find(*arguments)

    monkeypatch.setattr(module, "find_lengths", note)
    return found


def kept_lengths(job: Job) -> list[Path]:
    return list(job.folder.cache.glob("resolved-*.json"))


def test_lengths_are_found_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    searches = note_searches(monkeypatch)
    first = opened(tmp_path)
    assert first.open_keys == ()
    assert len(searches) == 1
    assert first.sizing is not None
    assert check_window(first) is first.sizing
    assert size_recipe(first).figures() == first.sizing.figures()
    again = opened(tmp_path, training_seed=3, data_seed=4)
    assert len(searches) == 1
    assert again.resolved == first.resolved
    assert again.sizing is None
    assert again.recipe.window == first.recipe.window
    opened(tmp_path, OPEN.replace("steps = 40", "steps = 41"))
    assert len(searches) == 1  # the training changes nothing about the lengths


@pytest.mark.parametrize("text", [OPEN, TINY])
def test_table_of_an_unknown_app_is_remarked_once(tmp_path: Path, text: str) -> None:
    remarks: list[str] = []
    job = opened(tmp_path, f"{text}\n[apps.pages]\n", tell=remarks.append)
    checked(checked(job))
    (remark,) = remarks
    assert "[apps.pages]" in remark


def test_branch_of_a_model_is_remarked_before_the_data_are_made(tmp_path: Path) -> None:
    lines = (
        'inputs = {"u": {"unit": "1", "range": [-1, 1]}}',
        'outputs = {"y": {"unit": "1", "range": [-1, 1]}}',
        "start = [0.0]",
        "f = lambda x, u, p: [u[0] - (2.0 if x[0] > 0 else 1.0) * x[0]]",
        "g = lambda x, u, p: [x[0]]",
    )
    (tmp_path / "branch.py").write_text("\n".join(lines), encoding="utf-8")
    model = f'kind = "function"\nmodel = "{tmp_path / "branch.py"}"\n'
    text = OPEN.replace('model = "tests.memory.plain_systems:Lag"', model)
    lengths = "step = 0.05\nn_in = 100\nn_out = 20", "[data]\nduration = 20.0\nburn_in = 5.0"
    text = text.replace("step = 0.05", lengths[0]).replace("[data]", lengths[1])
    remarks: list[str] = []
    checked(opened(tmp_path, text, tell=remarks.append))
    (remark,) = remarks
    assert "branch.py, line 4" in remark
    assert "np.where(rate > 0, a, b)" in remark


def test_lengths_are_found_again_for_another_recipe_or_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    searches = note_searches(monkeypatch)
    first = opened(tmp_path)
    longer = opened(tmp_path, OPEN.replace("[window]", "[window]\nremaining_amplitude = 1e-3"))
    assert len(searches) == 2
    assert longer.recipe.window.n_in > first.recipe.window.n_in
    opened(tmp_path)
    assert len(searches) == 2  # those of the first recipe are still there
    simulate = Lag.simulate
    monkeypatch.setattr(Lag, "simulate", lambda self, inputs: 2.0 * simulate(self, inputs))
    opened(tmp_path)
    assert len(searches) == 3


def test_lengths_are_found_again_where_a_bound_needs_longer_trajectories(tmp_path: Path) -> None:
    text = OPEN.replace(LINEAR_NETWORK, "[network]\norder = 1\nhidden = 0\n")
    text = text.partition("[training]")[0]
    tables = "", "[bound]\n", "[bound]\nestimate_span = 99.0\n"
    jobs = [opened(tmp_path, f"{text}\n{bound}") for bound in tables]
    plain, bounded, with_estimate = (job.recipe.data.duration for job in jobs)
    assert plain <= bounded < with_estimate
    assert len(kept_lengths(jobs[0])) == 3
    opened(tmp_path, f"{text}\n[bound.expert]\nsteps = 9\n")
    assert len(kept_lengths(jobs[0])) == 3  # the training of a bound changes nothing about them


def test_recipe_that_leaves_nothing_open_has_no_file(tmp_path: Path) -> None:
    job = opened(tmp_path, TINY)
    assert job.resolved == {}
    assert not job.folder.cache.exists()
    assert "resolved" not in provenance(job, TrainedSurrogate(sum_surrogate(), {}, {}))


def test_provenance_gives_the_resolved_recipe(tmp_path: Path) -> None:
    job = opened(tmp_path)
    released = json.loads(json.dumps(provenance(job, TrainedSurrogate(sum_surrogate(), {}, {}))))
    assert recipe_of_provenance(released, "lag.fmu") == job.recipe
    del released["resolved"]
    with refused(RecipeError, "leaves window.n_in", "to be found"):
        recipe_of_provenance(released, "lag.fmu")


def test_values_that_are_not_the_recipes_are_refused(tmp_path: Path) -> None:
    released = {"recipe": TINY, "resolved": {"window": {"n_in": 48}}}
    with refused(RecipeError, "for ['window"):
        recipe_of_provenance(released, "it.fmu")


def test_lengths_that_were_found_in_a_hurry_are_not_kept(tmp_path: Path) -> None:
    hurried = opened(tmp_path, patience=0.0)
    assert hurried.sizing is not None
    assert hurried.sizing.left_out is not None
    assert not kept_lengths(hurried)
    whole = opened(tmp_path)
    assert whole.sizing is not None
    assert whole.sizing.left_out is None
    assert kept_lengths(whole)


@pytest.mark.parametrize("damaged", [b"", b'{"values": {"window"', b"[]", b"{}"])
def test_damaged_file_of_what_was_found_is_named(tmp_path: Path, damaged: bytes) -> None:
    (place,) = kept_lengths(opened(tmp_path))
    place.write_bytes(damaged)
    with refused(DamagedFileError, f"{place.name} is damaged", "remove it"):
        opened(tmp_path)
    place.unlink()
    opened(tmp_path)
    assert place.exists()


def test_run_folder_that_is_a_file_is_refused_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "lag").write_text("no folder", encoding="utf-8")
    with refused(StageError, "expected a folder", "a file"):
        opened(tmp_path)


def test_export_of_an_untrained_recipe_is_refused_before_lengths_are_looked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    searches = note_searches(monkeypatch)
    place = tmp_path / "lag.toml"
    place.write_text(OPEN, encoding="utf-8")
    request = ExportRequest(place, None, 2, False, None, None, tmp_path / "runs")
    with refused(StageError, "no trained surrogate in", "lag; train it first"):
        export(request, no_stages)
    assert searches == []


GIVEN = OPEN.replace("step = 0.05", "step = 0.05\nn_in = 60\nn_out = 20").replace(
    "seed = 7", "seed = 7\nduration = 6.0\nburn_in = 3.0"
)
NO_NUMBER = GIVEN.split("[network]")[0].replace("train = 4\n", "")


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        (OPEN, RecipeError, "leaves window.n_in, window.n_out, data.duration, data.burn_in to be"),
        (NO_NUMBER, RecipeError, "leaves data.train to be found"),
        (GIVEN, TrajectoryError, "4 of 4 trajectories of split 'train' are missing"),
    ],
)
def test_training_without_data_is_refused_before_the_window_is_looked_at(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    text: str,
    error: type[Exception],
    words: str,
) -> None:
    searches = note_searches(monkeypatch)
    monkeypatch.setattr(stages, "size_recipe", lambda job: searches.append(job))
    with refused(error, words):
        train_recipe(opened(tmp_path, text, patience=None), 1)
    assert searches == []


def test_training_goes_on_with_lengths_and_data_that_are_kept(tmp_path: Path) -> None:
    generate_recipe(opened(tmp_path), 0, None)
    job = opened(tmp_path, patience=None)
    assert not job.folder.surrogate.exists()
    assert train_recipe(job, 1).parameters > 0
    assert job.folder.surrogate.exists()


@pytest.mark.parametrize(
    ("kind", "solver"),
    [("exudyn", {"exudyn"}), ("fmu", {"fmpy"}), ("function", set()), ("record", set())],
)
def test_versions_are_those_of_packages_that_were_used(kind: str, solver: set[str]) -> None:
    recipe = tiny_recipe()
    system = recipe.system.model_copy(update={"kind": kind})
    found = module.versions(recipe.model_copy(update={"system": system}))
    assert set(found) == {"python", "slide-fmu", "numpy", "scipy", "torch"} | solver
