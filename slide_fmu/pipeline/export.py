"""Whatever can become an FMU, as FMU: a trained recipe, an FMU again, a torch module."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from slide_fmu.core.progress import Stages
from slide_fmu.pipeline.form import Form, Written, export_again
from slide_fmu.python_fmu.torch_files import is_module

RUNS = Path("runs")
"""Where trained recipes lie if nothing else is said."""


@dataclass(frozen=True)
class Request:
    """What is to become an FMU, and what was said about it; None: nothing was said.

    Attributes:
        source: recipe that was trained, FMU, or torch module.
        path: the FMU to write; a recipe's has a place of its own in its run folder.
        form: which FMU is written.
        python: whether an FMU that needs Python was asked for.
        description: TOML file about a torch module.
        training_seed: of a trained recipe.
        data_seed: of a trained recipe.
        runs: folder that holds the work on recipes.
    """

    source: Path
    path: Path | None = None
    form: Form = field(default_factory=Form)
    python: bool = False
    description: Path | None = None
    training_seed: int | None = None
    data_seed: int | None = None
    runs: Path | None = None


def export(request: Request, bar: Stages) -> Written:
    """Write the FMU of a recipe, of an FMU, or of a torch module.

    Each kind imports what it needs: an FMU is written again without the packages of the training.

    Args:
        request: what is to become an FMU.
        bar: opens the progress of a stage.

    Raises:
        FmuError: the source is no FMU of slide-fmu.
        ModuleError: the module or its description cannot be used.
        RecipeError: the recipe cannot be used.
        StageError: the recipe was not trained.
        ValueError: an option is missing, or means nothing for this source.
    """
    if request.python or is_module(request.source):
        return _export_module(request)
    if request.source.suffix == ".toml":
        return _export_recipe(request, bar)
    _refuse_options_of_modules(request)
    _refuse_options_of_recipes(request)
    if request.path is None:
        raise ValueError("export of an FMU: where to? give the FMU to write with -o PATH")
    return export_again(request.source, request.path, request.form)


def _export_module(request: Request) -> Written:
    from slide_fmu.pipeline.modules import export_torch, require_module_export

    require_module_export(request.source, request.python, request.form)
    _refuse_options_of_recipes(request)
    return Written(export_torch(request.source, request.description, request.path))


def _export_recipe(request: Request, bar: Stages) -> Written:
    from slide_fmu.pipeline.job import open_job
    from slide_fmu.pipeline.trained import export_recipe

    _refuse_options_of_modules(request)
    runs = request.runs or RUNS
    job = open_job(request.source, runs, bar, request.training_seed, request.data_seed)
    return export_recipe(job, request.path, request.form)


def _refuse_options_of_recipes(request: Request) -> None:
    seeds = {"--seed": request.training_seed, "--data-seed": request.data_seed}
    _refuse(request.source, "trained recipes", {**seeds, "--runs": request.runs})


def _refuse_options_of_modules(request: Request) -> None:
    _refuse(request.source, "torch modules", {"--description": request.description})


def _refuse(source: Path, others: str, options: Mapping[str, object]) -> None:
    """Refuse options that are about sources of another kind."""
    given = [f"{name} {value}" for name, value in options.items() if value is not None]
    if given:
        raise ValueError(
            f"export of {source}: {' '.join(given)} is for {others}, this is none; leave it out"
        )
