"""A first recipe is proposed for a model, or for a small model that is written for it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from slide_fmu.core.file_kinds import record_formats
from slide_fmu.core.files import write_whole
from slide_fmu.core.progress import Stages
from slide_fmu.propose.draft_signals import require_models
from slide_fmu.propose.proposal import (
    InitOptions,
    Proposal,
    RefusedProposalError,
    propose,
    propose_unsimulated,
)
from slide_fmu.propose.template import write_template
from slide_fmu.recipe.recipe import RecipeError


def write_first_recipe(
    options: InitOptions, place: Path, force: bool, bar: Stages, tell: Callable[[str], object]
) -> Proposal:
    """Write the proposed recipe of a model to a place.

    Where there is no such model, and its kind has a template, a small one is written.

    Args:
        options: the options of the user.
        place: the file of the recipe.
        force: whether a file that is there is replaced.
        bar: opens the progress of a stage.
        tell: takes a line on a model that was written.

    Raises:
        ValueError: the place is that of a source or is taken, or the models cannot be used.
            Where data can be read, a recipe is written whose comments say what to change.
    """
    models = [options.model, *options.further]
    require_models(models)
    further = [str(file) for file in (options.chain, options.inputs_file) if file is not None]
    _require_other(place, [*models, *further])
    if not force:
        _require_free(place)  # before the model is simulated
    try:
        proposal = propose_unsimulated(options)
    except RefusedProposalError as error:
        write_whole(place, error.text.encode("utf-8"))
        raise RecipeError(f"{error}\nrecipe {place} says in comments what to change") from error
    if proposal is not None and options.inputs_file is not None:
        raise ValueError(
            f"--inputs {str(options.inputs_file)!r} with the record {options.model!r}; expected a "
            "model that is simulated: a record holds the inputs that judge, so leave it out"
        )
    if proposal is None:
        _require_one(models, options.time, options.read)
        written = write_template(options.model, options.kind)
        if written is not None:
            tell(f"model   {written}")
        proposal = propose(replace(options, model=written or options.model), bar("motions"))
    write_whole(place, proposal.text.encode("utf-8"))
    return proposal


def _require_one(models: list[str], time: str | None, read: Mapping[str, object]) -> None:
    """Refuse several models, and what is for files of records alone: times, ways to read them."""
    if len(models) > 1 or time is not None or read:
        given = "".join(f", --read {key}={value}" for key, value in read.items())
        raise ValueError(
            f"models {models}, --time {time}{given}; expected one model without --time and "
            f"--read, or records ({record_formats()}) alone"
        )


def _require_other(place: Path, sources: Iterable[str]) -> None:
    """Refuse to write the recipe in the place of a file that it is made from."""
    for source in sources:
        for name in (source, source.rpartition(":")[0]):
            if name and Path(name).resolve() == place.resolve():
                raise ValueError(
                    f"-o {str(place)!r} is the model's own file; expected another one for the "
                    "recipe, such as NAME.toml; nothing was written"
                )


def _require_free(place: Path) -> None:
    if place.exists():
        raise ValueError(f"{place} exists already; choose another with -o, or add --force")
