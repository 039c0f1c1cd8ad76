"""Build released FMUs again without training: ``python fmus/rebuild.py fmus/duffing/duffing.fmu``.

Each FMU is replaced by one with the same surrogate, provenance, measured figures and report, and
with the runtime of this version; its card and credentials, which follow from these, are written
again too. Its recipe is that of ``training`` as it is now, which must say the same. The experiment
that it carries stays; where it carries none, or with ``--experiment``, its reference is simulated
for some seconds.
With ``--measure``, the same surrogate is measured beside its reference again, and gets figures,
report, card and pictures of this version; how it was trained is not known then, and not shown.
To train again, too: ``make release NAME=duffing``.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import shutil
import tempfile
from pathlib import Path
from typing import Any

from slide_fmu.cli.console import progress_bars
from slide_fmu.core.figures import read_figures
from slide_fmu.core.files import write_whole
from slide_fmu.core.progress import Stages
from slide_fmu.fmu.export import export_fmu, read_fmu, read_member
from slide_fmu.pipeline.apps import Release, with_origins
from slide_fmu.pipeline.documents import documents, write_release
from slide_fmu.pipeline.job import checked, open_job
from slide_fmu.pipeline.measurement import tasks
from slide_fmu.pipeline.run import (
    MECHANISM_PICTURE,
    PICTURE,
    TIMES,
    StageResults,
    measure_trained,
)
from slide_fmu.pipeline.run_folder import StageError, TrainedSurrogate, recipe_of_provenance
from slide_fmu.pipeline.stages import check_window
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.reading import parse_recipe
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.report.fmu_description import FmuDescription
from slide_fmu.report.model_card import model_card
from slide_fmu.report.run_figures import released_figures
from slide_fmu.validation.error_figures import Timing
from slide_fmu.validation.row import SEARCH, Row
from slide_fmu.validation.task import IN_RANGE, UNSEEN_SEED
from slide_fmu.validation.validate import require_same_origin

TRAINING = Path(__file__).parents[1] / "training"
PAGE, CARD = "index.html", "README.md"
MADE_ANEW = ("measured", "drawing")
"""Parts of the provenance that measuring makes anew."""


def rebuild(fmu: Path, new_experiment: bool = False) -> Path:
    """Write a released FMU again in its place, with the model card beside it.

    Surrogate, provenance, measured figures and report stay as they are. Model description and
    libraries are those of this version, the drawing is that which the recipe names now. The card
    (``README.md``) and the credentials are written from the figures; times on the card are those
    of the file beside it.

    Args:
        fmu: the released FMU.
        new_experiment: whether the experiment that it carries is made anew.

    Raises:
        CredentialError: the experiment that it carries is damaged: make it anew.
        FmuError: the file is no FMU of slide-fmu, or damaged.
        StageError: it carries no measured figures or no report, its recipe says something else
            now.
        OSError: a file cannot be read or written.
    """
    surrogate, found = read_fmu(fmu)
    measured = released_figures(found)
    page = read_member(fmu, f"documentation/{PAGE}")
    if measured is None or page is None:
        raise StageError(
            f"{fmu} carries no {'report' if measured else 'measured figures'}; expected an FMU "
            "that slide-fmu run has finished: run its recipe"
        )
    provenance = {**(found or {}), "recipe": _recipe_now(found or {}, surrogate.name)}
    recipe = recipe_of_provenance(provenance, str(fmu))
    case = case_of(recipe)
    provenance = with_origins(provenance, recipe, surrogate)
    drawn = MECHANISM_PICTURE if fmu.with_name(MECHANISM_PICTURE).exists() else None
    picture = PICTURE if fmu.with_name(PICTURE).exists() else None
    described = FmuDescription.of(surrogate, provenance)
    times = json.loads(fmu.with_name(TIMES).read_text(encoding="utf-8"))
    text = model_card(described, picture, drawn, read_figures(Timing, times))
    seed = measured.validation[IN_RANGE].seed
    release = Release(
        surrogate, case, provenance, documents(page, model_card(described)), seed=seed
    )
    with tempfile.TemporaryDirectory() as folder:
        run = export_fmu(surrogate, Path(folder) / fmu.name)
        former = None if new_experiment else fmu
        write_release(dataclasses.replace(release, fmu=run, former=former), fmu)
    write_whole(fmu.with_name(CARD), text.encode("utf-8"))
    return fmu


def measure(fmu: Path, bar: Stages, trajectories: int | None = None, search: bool = False) -> Path:
    """Measure a released FMU again, and write it in its place, with card and pictures beside it.

    Surrogate and provenance stay as they are. So does what a search for unnoticed errors found,
    since it follows from the surrogate and takes long. All else is made as ``slide-fmu run`` does.

    Args:
        fmu: the released FMU.
        bar: opens the progress of a stage.
        trajectories: how many are simulated of each kind; those of the recipe if None.
        search: whether the search is done again, if the recipe asks for it.

    Raises:
        FmuError: the file is no FMU of slide-fmu, or damaged.
        StageError: its recipe says something else now, or its records have changed.
        Exception: as of ``slide_fmu.pipeline.run.measure_trained``.
    """
    surrogate, found = read_fmu(fmu)
    kept = {key: value for key, value in (found or {}).items() if key not in MADE_ANEW}
    origin = {**kept, "recipe": _recipe_now(found or {}, surrogate.name)}
    with tempfile.TemporaryDirectory() as runs:
        recipe = Path(runs, f"{surrogate.name}.toml")
        recipe.write_text(origin["recipe"], encoding="utf-8")
        job = checked(open_job(recipe, Path(runs), bar))
        require_same_origin(job.case.source, origin, str(fmu))
        job.folder.path.mkdir()
        drawn = fmu.with_name(MECHANISM_PICTURE)
        if drawn.exists():
            shutil.copy(drawn, job.folder.path)
        trained = TrainedSurrogate(surrogate, {}, origin["versions"])
        wanted = tasks(job.recipe, UNSEEN_SEED, trajectories)
        known = None if search else _known_search(found or {})
        results = StageResults(trained, origin, check_window(job))
        made = measure_trained(job, results, wanted, None, known)
        for name in (PICTURE, MECHANISM_PICTURE, TIMES):
            if (job.folder.path / name).exists():
                shutil.copy(job.folder.path / name, fmu.with_name(name))
        shutil.copy(job.folder.path / "card.md", fmu.with_name(CARD))
        write_whole(fmu, made.fmu.read_bytes())
    return fmu


def _known_search(provenance: dict[str, Any]) -> list[Row]:
    """Return the rows of a search in an FMU; none where its figures are of another form."""
    try:
        measured = released_figures(provenance)
    except ValueError:
        return []
    return [] if measured is None else [row for row in measured.rows if row.group == SEARCH]


def _recipe_now(provenance: dict[str, Any], name: str) -> str:
    """Return the text of the recipe in ``training``, if it says what the released one says."""
    place = TRAINING / f"{name}.toml"
    text = place.read_text(encoding="utf-8")
    released, now = recipe_of_provenance(provenance, name), parse_recipe(text, place)
    if _learnt(released) != _learnt(now):
        raise StageError(f"{place} says something else than the released FMU: release it again")
    return text


def _learnt(recipe: Recipe) -> dict[str, Any]:
    """Return what a recipe says, but for words and pictures: nothing is learnt by them.

    Of the FMU with which a training began, the folder plays no part.
    """
    values = recipe.model_dump(mode="json", exclude={"description", "equations", "apps"})
    del values["system"]["picture"]
    if values["training"].get("start"):
        values["training"]["start"] = Path(values["training"]["start"]).name
    return values


def main() -> None:
    """Run the command line: build the named FMUs again and print how large they were and are."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("fmus", nargs="+", type=Path, help="released FMUs")
    parser.add_argument(
        "--experiment", action="store_true", help="simulate the reference of the experiments anew"
    )
    parser.add_argument(
        "--measure", action="store_true", help="measure them again: figures, reports, cards"
    )
    parser.add_argument(
        "--search", action="store_true", help="with --measure: search for unnoticed errors again"
    )
    given = parser.parse_args()
    for path in given.fmus:
        before = path.stat().st_size
        if given.measure:
            with progress_bars() as bar:
                measure(path, bar, search=given.search)
        else:
            rebuild(path, given.experiment)
        after = path.stat().st_size
        print(f"{path}: {before} bytes before, {after} now, {100 * after / before:.0f} %")


if __name__ == "__main__":
    main()
