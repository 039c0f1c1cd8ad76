"""A surrogate is made in Python from a reference system, with its measured error."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slide_fmu.cli.python_calls import RunResult, whole_way
from slide_fmu.cli.script_guard import simulating_processes
from slide_fmu.core.extras import require_training
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import Signal, cosines_of
from slide_fmu.recipe.automatic import Tables
from slide_fmu.recipe.default_excitation import default_excitation
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.recipe.writing import tables_text
from slide_fmu.systems.base import Bending, System

if TYPE_CHECKING:  # it needs the packages of the training
    from slide_fmu.pipeline.job import Job, Tell

NO_SYSTEM = (
    "slide.learn of {name!r}: system = {found}; expected a reference system, or the table system "
    "of a recipe as a dictionary: make one of functions by slide.FunctionSystem(f, g, inputs=..., "
    "outputs=..., start=..., step=...), or by slide.RecordSystem(simulate, inputs=..., "
    "outputs=..., step=...); of a class, take an object of it"
)


def learn(
    system: System | Mapping[str, Any],
    name: str,
    *,
    runs: str | Path = "runs",
    workers: int | None = None,
    threads: int = 1,
    overwrite: bool = False,
    **tables: Any,
) -> RunResult:
    """Learn a surrogate of a reference system and measure it, as ``slide-fmu run`` does.

    Results of an earlier call with the same values are used again. Progress is shown on standard
    error.

    Args:
        system: any reference system, with its signals and step; or the recipe's table ``system``
            as a dictionary, for example ``{"kind": "fmu", "model": "pump.fmu"}``.
        name: name of the FMU and of the run folder, a C identifier.
        runs: folder that contains the run folder.
        workers: processes that simulate. If None, one per core, provided the system can be sent to
            other processes and these do not run the call again; otherwise, or if 0, only this
            process. In a script, the call must be under ``if __name__ == "__main__":`` for several
            processes.
        threads: threads of the training.
        overwrite: whether data that were made from other values are made again.
        tables: the other tables of a recipe as dictionaries, such as ``data={"train": 40}`` and
            ``window={"n_in": 300}``; missing keys have the recipe's defaults.

    Returns:
        The surrogate, with its FMU, report and measured error.

    Raises:
        RecipeError: the system is neither of the two, or a table is not valid in a recipe; one
            line per mistake.
        QualityError: an output has a larger error than the recipe allows; FMU and report exist.
        ValueError: workers were requested, but would run the user's script again.
        ModuleNotFoundError: the extra ``train`` is not installed.
        LoadError: the system cannot be loaded. Further errors are as for
            ``slide_fmu.pipeline.run.run_recipe``: ShortWindowError, SimulationError, StoreError,
            TrainingError, UnstableSurrogateError.
    """
    require_training()
    from slide_fmu.core.search_path import make_importable
    from slide_fmu.pipeline.job import job_of_text

    text = tables_text(_recipe_tables(system, name, tables))
    make_importable(Path.cwd())

    def opened(bar: Stages, tell: Tell) -> Job:
        own = system if isinstance(system, System) else None
        job = job_of_text(text, f"slide.learn of {name!r}", Path(runs), bar, given=own)
        return replace(job, command=f"slide.learn(system, {name!r})", tell=tell)

    return whole_way(opened, simulating_processes(system, workers), threads, overwrite)


def _recipe_tables(
    system: System | Mapping[str, Any], name: str, tables: Mapping[str, Any]
) -> Tables:
    """Return all tables of the recipe; a Python object gets the recipe's name.

    Raises:
        RecipeError: the system is neither a reference system nor a table.
    """
    if not isinstance(system, System | Mapping):
        raise RecipeError(NO_SYSTEM.format(name=name, found=_described(system)))
    found: Tables = {"name": name, "description": f"{name}, learnt from Python", **tables}
    found.setdefault("data", {})
    if not isinstance(system, System):
        return {**found, "system": dict(system)}
    window = {"step": system.step, **found.get("window", {})}
    found["data"] = _with_excitation(found["data"], system, window["step"])
    return {**found, "system": {"kind": "object", "model": name}, "window": window}


def _with_excitation(data: Any, system: System, step: Any) -> Any:
    """Return the table ``data`` with the excitation that the inputs of the system need.

    An excitation that is given stays. Only the object itself knows whether its inputs move, or are
    angles; no table of the recipe has this.
    """
    from slide_fmu.propose.proposal import MOVING, SUBSTEPS, kind_of_inputs

    if not isinstance(data, Mapping) or "excitation" in data:
        return data
    signals = getattr(system, "inputs", None)
    sound = isinstance(signals, tuple) and all(isinstance(signal, Signal) for signal in signals)
    number = isinstance(step, float | int) and 0 < step < math.inf
    if not (sound and signals and number):
        return data  # signals and step have their own checks
    widths, kind = [signal.high - signal.low for signal in signals], kind_of_inputs(system)
    bends = kind in MOVING and isinstance(system, Bending)
    substeps = {"substeps": SUBSTEPS} if bends else {}
    jumps = data.get("jumps") is True
    mix = default_excitation(step, kind, widths, bool(cosines_of(signals)), jumps)
    return {**substeps, **data, "excitation": mix}


def _described(system: object) -> str:
    """Describe in one short line what was given in place of a system."""
    text = f"{type(system).__name__} {getattr(system, '__name__', None) or repr(system)}"
    return text if len(text) <= 80 else f"{text[:77]}..."
