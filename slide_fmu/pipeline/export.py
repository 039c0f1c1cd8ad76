"""This module exports a trained recipe, or an existing FMU again.

Each kind of source imports its packages when it is exported: an FMU is written again without the
packages of the training and of the figures.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from slide_fmu.core.progress import Stages
from slide_fmu.cosim.archive import BINARIES, hash_problems
from slide_fmu.fmu.export import (
    DESCRIPTION,
    DOCUMENTATION,
    EXTRA,
    Provenance,
    export_fmu,
    read_fmu,
    read_folder,
)
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.fmu.libraries.sources import FOLDER as SOURCES
from slide_fmu.fmu.libraries.sources import Sources
from slide_fmu.importer.errors import FmuError
from slide_fmu.surrogate.surrogate import Surrogate

NETWORK_FILES = (".onnx", ".pt", ".pt2", ".pth")
"""Endings of files that hold a network which was trained elsewhere."""

WRITTEN_ANEW = (BINARIES, f"{SOURCES}/", DESCRIPTION, "model.png", "terminalsAndIcons/")
"""Files of an FMU that no FMU written from it takes over."""


@dataclass(frozen=True)
class ExportRequest:
    """An ExportRequest names the source of an FMU; an option is None if it was not given.

    Attributes:
        source: recipe that was trained, or FMU.
        path: the FMU to write; the FMU of a recipe has a place in its run folder.
        fmi: version of the standard.
        sources: the C sources to write, if any.
        training_seed: seed of a trained recipe's training.
        data_seed: seed of its data.
        runs: folder that holds the work on recipes; ``runs`` if None.
    """

    source: Path
    path: Path | None
    fmi: FmiVersion
    sources: Sources
    training_seed: int | None
    data_seed: int | None
    runs: Path | None


@dataclass(frozen=True)
class ExportResult:
    """An ExportResult is the path of the written FMU, perhaps with a remark for its user."""

    path: Path
    remark: str | None = None


def export(request: ExportRequest, bar: Stages) -> ExportResult:
    """Write the FMU of a recipe, or of an FMU.

    Raises:
        FmuError: the source is no FMU of slide-fmu, or one of the files that stay was changed
            since it was written.
        RecipeError: the recipe cannot be used.
        StageError: the recipe was not trained, or ``run`` has measured and refused its surrogate.
        ValueError: an option is missing, or has no meaning for this source; or the source is a
            network that was trained elsewhere.
    """
    if request.source.suffix in NETWORK_FILES:
        raise ValueError(
            f"{request.source} is a network of torch or ONNX, which does not say what its signals "
            "are; expected a recipe or an FMU: in Python, slide_fmu.from_torch makes a surrogate "
            "of such a network, and slide_fmu.export_fmu writes its FMU"
        )
    if request.source.suffix == ".toml":
        return _export_recipe(request, bar)
    _refuse_options_of_recipes(request)
    if request.path is None:
        raise ValueError(
            f"export of {request.source} has no target; expected the FMU to write: give -o PATH"
        )
    return ExportResult(export_again(request.source, request.path, request.fmi, request.sources))


def _export_recipe(request: ExportRequest, bar: Stages) -> ExportResult:
    """Write the FMU of a trained recipe to a path, or to its place in the run folder if None.

    An FMU of the same surrogate that ``run`` has finished keeps its report and measured error. One
    that is damaged has lost them, which is remarked. One that ``run`` has measured and refused is
    refused here, too.
    """
    from slide_fmu.pipeline.apps import Release
    from slide_fmu.pipeline.documents import write_release
    from slide_fmu.pipeline.job import open_job, provenance
    from slide_fmu.pipeline.run_folder import RunFolder, StageError
    from slide_fmu.pipeline.stages import examine_stability
    from slide_fmu.recipe.reading import parse_open_recipe, read_recipe_text

    seeds, runs = (request.training_seed, request.data_seed), request.runs or Path("runs")
    read = parse_open_recipe(read_recipe_text(request.source), request.source)
    RunFolder.of(runs, read.guess.name).require_surrogate()  # before lengths are found
    job = open_job(request.source, runs, bar, *seeds)
    trained = job.folder.load_surrogate(job.recipe)
    surrogate, origin = trained.surrogate, provenance(job, trained)
    examine_stability(job, surrogate)
    finished = job.folder.fmu(job.recipe)
    path = request.path or finished
    remark = None
    try:
        if finished.exists() and _is_of(finished, surrogate, origin):
            return ExportResult(export_again(finished, path, request.fmi, request.sources))
    except FmuError as error:
        remark = (
            f"{error}. The FMU that is written now carries neither report nor measured error; "
            "slide-fmu run RECIPE makes them again"
        )
    refusal = job.folder.refusal(surrogate, job.recipe).read()
    if refusal is not None:
        raise StageError(f"slide-fmu run has measured and refused it: {refusal.decode('utf-8')}")
    release = Release(surrogate, job.case, origin)
    written = write_release(release, path, request.fmi, request.sources)
    return ExportResult(written, remark)


def _is_of(fmu: Path, surrogate: Surrogate, origin: Provenance) -> bool:
    """Tell whether an FMU holds this surrogate with the same provenance."""
    other, provenance = read_fmu(fmu)
    same = {key: value for key, value in (provenance or {}).items() if key in origin} == origin
    return same and other.to_bytes() == surrogate.to_bytes()


def export_again(source: Path, path: Path, fmi: FmiVersion, sources: Sources) -> Path:
    """Write the surrogate of an FMU as FMU of either standard, with this version's runtime.

    Its documentation and credentials stay as they are.

    Raises:
        FmuError: the source is no FMU of slide-fmu, or one of the files that stay was changed
            since it was written.
        ValueError: the path does not end in ``.fmu``.
    """
    surrogate, provenance = read_fmu(source)
    for problem in hash_problems(source, WRITTEN_ANEW):
        raise FmuError(f"{source}: {problem}")
    return export_fmu(
        surrogate,
        path,
        fmi=fmi,
        sources=sources,
        provenance=provenance,
        documentation=read_folder(source, DOCUMENTATION),
        extra=read_folder(source, EXTRA),
    )


def _refuse_options_of_recipes(request: ExportRequest) -> None:
    seeds = {"--seed": request.training_seed, "--data-seed": request.data_seed}
    options = {**seeds, "--runs": request.runs}
    given = [f"{name} {value}" for name, value in options.items() if value is not None]
    if given:
        raise ValueError(
            f"export of {request.source}: {' '.join(given)} was given; expected it for "
            "recipes only, not for FMUs: leave it out"
        )
