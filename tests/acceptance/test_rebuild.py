"""A released FMU is built again without training; only what belongs to the version changes."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fmus.rebuild import measure, rebuild
from slide_fmu.core.version import WRITTEN_BY, __version__
from slide_fmu.fmu.export import EXTRA, export_fmu, read_fmu, read_folder, read_member
from slide_fmu.fmu.hashes import HASHES
from slide_fmu.pipeline.apps import app_problems, with_origins
from slide_fmu.pipeline.card_check import card_problems
from slide_fmu.pipeline.run import TIMES
from slide_fmu.pipeline.run_folder import StageError
from slide_fmu.recipe.reading import parse_recipe
from slide_fmu.report.row_tables import card_table
from slide_fmu.report.run_figures import released_figures
from slide_fmu.report.table import markdown
from tests.marks import needs_app
from tests.progress import no_stages
from tests.refusals import refused

ROOT = Path(__file__).parents[2]
LINEAR = ROOT / "fmus" / "linear" / "linear.fmu"
RECIPE = (ROOT / "training" / "linear.toml").read_text(encoding="utf-8")
SURROGATE, RELEASED = read_fmu(LINEAR)
PROVENANCE: dict[str, object] = with_origins(
    {**(RELEASED or {}), "recipe": RECIPE, WRITTEN_BY: __version__},
    parse_recipe(RECIPE, "linear.toml"),
    SURROGATE,
)
PAGE = b"<p>report</p>"
PAGES = {"index.html": PAGE}
EXPERIMENT = read_folder(LINEAR, EXTRA)
del EXPERIMENT[HASHES.removeprefix(f"{EXTRA}/")]
"""With it, nothing is simulated."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder like those of released FMUs."""
    surrogate, _ = read_fmu(LINEAR)
    export_fmu(
        surrogate,
        tmp_path / "linear.fmu",
        provenance=PROVENANCE,
        documentation=PAGES,
        extra=EXPERIMENT,
    )
    (tmp_path / "README.md").write_text("# an older card\n", encoding="utf-8")
    shutil.copy(LINEAR.with_name(TIMES), tmp_path)
    return tmp_path


def test_rebuild_keeps_surrogate_provenance_and_report(folder: Path) -> None:
    fmu = folder / "linear.fmu"
    assert rebuild(fmu) == fmu
    surrogate, provenance = read_fmu(fmu)
    assert surrogate.to_bytes() == read_fmu(LINEAR)[0].to_bytes()
    assert provenance == PROVENANCE
    assert read_member(fmu, "documentation/index.html") == PAGE


def test_rebuild_writes_the_card_from_the_figures(folder: Path) -> None:
    older = {**PROVENANCE, WRITTEN_BY: "0.1.0"}
    export_fmu(SURROGATE, folder / "linear.fmu", provenance=older, documentation=PAGES)
    fmu = rebuild(folder / "linear.fmu")
    provenance = read_fmu(fmu)[1] or {}
    assert provenance[WRITTEN_BY] == __version__
    card = (folder / "README.md").read_text(encoding="utf-8")
    measured = released_figures(provenance)
    assert measured is not None
    assert markdown(card_table(measured.rows)) in card
    assert card_problems(fmu, *read_fmu(fmu)) == []


def test_rebuild_twice_gives_the_same_bytes(folder: Path) -> None:
    rebuild(folder / "linear.fmu")
    once = {path.name: path.read_bytes() for path in folder.iterdir()}
    rebuild(folder / "linear.fmu")
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == once


@needs_app("credentials")
def test_rebuild_keeps_the_experiment_and_says_what_is_known(folder: Path) -> None:
    fmu = rebuild(folder / "linear.fmu")
    members = read_folder(fmu, EXTRA)
    del members[HASHES.removeprefix(f"{EXTRA}/")]
    assert members == EXPERIMENT
    assert list(app_problems(fmu, *read_fmu(fmu))) == []


@needs_app("credentials")
def test_rebuild_of_an_fmu_without_experiment_simulates_one(folder: Path) -> None:
    from slide_fmu.apps.credentials.experiment import read_experiment

    fmu = folder / "linear.fmu"
    export_fmu(read_fmu(fmu)[0], fmu, provenance=PROVENANCE, documentation=PAGES)
    rebuild(fmu)
    made, kept = read_experiment(fmu), read_experiment(LINEAR)
    assert made is not None
    assert kept is not None
    np.testing.assert_array_equal(made.inputs["force"], kept.inputs["force"])
    np.testing.assert_allclose(made.reference["position"], kept.reference["position"], rtol=1e-6)


def test_rebuild_of_an_fmu_that_was_not_measured_is_refused(tmp_path: Path) -> None:
    path = export_fmu(read_fmu(LINEAR)[0], tmp_path / "linear.fmu", provenance={"recipe": ""})
    with refused(StageError, "expected an FMU", "measured figures"):
        rebuild(path)


@pytest.mark.extended
def test_command_says_how_large_the_fmu_was_and_is(folder: Path) -> None:
    command = [sys.executable, str(ROOT / "fmus" / "rebuild.py"), str(folder / "linear.fmu")]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert f"{(folder / 'linear.fmu').stat().st_size} now" in result.stdout


def test_rebuild_takes_the_recipe_as_it_is_written_now(folder: Path) -> None:
    fmu = folder / "linear.fmu"
    older = {**PROVENANCE, "recipe": RECIPE.replace('description = "', 'description = "An older ')}
    export_fmu(read_fmu(fmu)[0], fmu, provenance=older, documentation=PAGES, extra=EXPERIMENT)
    rebuild(fmu)
    assert read_fmu(fmu)[1] == PROVENANCE


@needs_app("page")
def test_rebuild_gives_an_fmu_the_drawing_that_its_recipe_names_now(folder: Path) -> None:
    fmu = folder / "linear.fmu"
    older = {key: value for key, value in PROVENANCE.items() if key != "drawing"}
    export_fmu(SURROGATE, fmu, provenance=older, documentation=PAGES, extra=EXPERIMENT)
    rebuild(fmu)
    _, found = read_fmu(fmu)
    assert found is not None
    assert found["drawing"] == PROVENANCE["drawing"]


def test_rebuild_refuses_an_fmu_of_another_recipe(folder: Path) -> None:
    fmu = folder / "linear.fmu"
    other = {**PROVENANCE, "recipe": RECIPE.replace("n_out = 32", "n_out = 33")}
    export_fmu(read_fmu(fmu)[0], fmu, provenance=other, documentation=PAGES, extra=EXPERIMENT)
    before = fmu.read_bytes()
    with refused(StageError, "something else"):
        rebuild(fmu)
    assert fmu.read_bytes() == before


@pytest.mark.extended
def test_fmu_that_is_measured_again_gets_figures_report_card_and_picture_of_now(
    folder: Path,
) -> None:
    fmu = folder / "linear.fmu"
    stale = {**PROVENANCE, "measured": {"name": "linear"}}
    export_fmu(SURROGATE, fmu, provenance=stale, documentation=PAGES, extra=EXPERIMENT)
    assert measure(fmu, no_stages, trajectories=2) == fmu
    surrogate, found = read_fmu(fmu)
    assert surrogate.to_bytes() == SURROGATE.to_bytes()
    assert found is not None
    assert {**found, "measured": None} == {**PROVENANCE, "measured": None}
    (output,) = found["measured"]["validation"]["in range"]["outputs"]
    assert output["relative_rmse"] < 1e-5
    card = (folder / "README.md").read_text(encoding="utf-8")
    assert "| in range | 2 |" in card
    assert "slide-fmu validate linear.fmu --trajectories 2 --seed 20260000" in card
    page = read_member(fmu, "documentation/index.html")
    assert page is not None
    assert b"2 trajectories" in page
    assert (folder / "error_against_step.png").stat().st_size > 5_000
    assert list(app_problems(fmu, surrogate, found)) == []
