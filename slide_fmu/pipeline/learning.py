"""The whole way from Python: a reference system in, a surrogate with its measured error out."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from slide_fmu.core.extras import require_training
from slide_fmu.core.signals import Signal
from slide_fmu.fmu.export import load
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.fmu.libraries.sources import Sources
from slide_fmu.pipeline.defaults import UNSEEN_SEED
from slide_fmu.pipeline.display import messages, shown
from slide_fmu.pipeline.export import export_again
from slide_fmu.pipeline.script import unguarded_place
from slide_fmu.recipe.default_excitation import default_excitation
from slide_fmu.recipe.measured import KIND
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.recipe.writing import tables_text
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems import given
from slide_fmu.systems.base import Bending, System

ALONE = (
    "simulating in this process alone: worker processes would run this script again ({place}). "
    'Put the call under if __name__ == "__main__": for several'
)
AGAIN = (
    "slide.{call} with workers = {workers} stands in {place}, outside of "
    'if __name__ == "__main__":; expected it under that line, since worker processes run all the '
    "rest of the script again: put it there, or say workers = 0, which simulates in this process "
    "alone"
)
NOT_DEFINED_HERE = (
    "simulating in this process alone: the system has parts that this session defines itself. Put "
    "its functions or classes into a module for several worker processes"
)
NO_SYSTEM = (
    "slide.learn of {name!r}: system = {found}; expected a reference system, or the table system "
    "of a recipe as a dictionary: make one of functions by slide.FunctionSystem(f, g, inputs=..., "
    "outputs=..., start=..., step=...), or by slide.RecordSystem(simulate, inputs=..., "
    "outputs=..., step=...); of a class, take an object of it"
)


@dataclass(frozen=True, eq=False)
class Learnt:
    """A Learnt is what ``learn`` has made of a reference system.

    Attributes:
        surrogate: the trained surrogate, with its error estimator if the recipe has one.
        fmu: path of the FMU, which carries the report.
        report: path of the report, a page of HTML.
        figures: the figures of the report as plain values.
    """

    surrogate: Surrogate = field(repr=False)
    fmu: Path
    report: Path
    figures: dict[str, Any] = field(repr=False)

    @property
    def errors(self) -> dict[str, float]:
        """Return relative RMSEs on unseen trajectories in range by the names of the outputs."""
        found = self.figures["validation"]["in range"]["outputs"]
        return {output["name"]: float(output["relative_rmse"]) for output in found}

    def export(self, path: str | Path, fmi: FmiVersion = 2, sources: Sources = False) -> Path:
        """Write the FMU with its report elsewhere, for a version of FMI, perhaps with C sources.

        Raises:
            ValueError: the path does not end in ``.fmu``.
        """
        return export_again(self.fmu, Path(path), fmi, sources)

    def _repr_html_(self) -> str:
        """Show the errors in a notebook."""
        rows = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{100 * error:.3g} %</td></tr>"
            for name, error in self.errors.items()
        )
        return f"<table><tr><th>output</th><th>relative RMSE</th></tr>{rows}</table>"


def learn(
    system: System | Mapping[str, Any],
    name: str,
    *,
    runs: str | Path = "runs",
    workers: int | None = None,
    threads: int = 1,
    overwrite: bool = False,
    **tables: Any,
) -> Learnt:
    """Learn a surrogate of a reference system and measure it, as ``slide-fmu run`` does.

    What is there from an earlier call of the same values is not made again. Progress is shown on
    standard error.

    Args:
        system: any reference system, with its signals and step; or the recipe's table ``system``
            as a dictionary, for example ``{"kind": "fmu", "model": "pump.fmu"}``.
        name: names the FMU and the folder of the run, a C identifier.
        runs: folder that holds the folder of the run.
        workers: processes that simulate; one per core if None where the system can go to others
            and the call is not run again by them, else, or if 0, this process alone. In a script
            the call stands under ``if __name__ == "__main__":`` for several.
        threads: threads of the training.
        overwrite: whether data that were made from other values are made again.
        tables: the other tables of a recipe as dictionaries, such as ``data={"train": 40}`` and
            ``window={"n_in": 300}``; what is not given has the recipe's default.

    Returns:
        The surrogate, with its FMU, report and measured error.

    Raises:
        RecipeError: the system is neither of both, or a table is no table of a recipe; there is
            one line per mistake.
        QualityError: an output errs by more than the recipe requires; FMU and report are there.
        ValueError: there shall be workers, which would run the user's script again.
        ModuleNotFoundError: the extra ``train`` is not installed.
        LoadError: the system cannot be loaded. So are the other errors those of
            ``slide_fmu.pipeline.run.run_recipe``: ShortWindowError, SimulationError, StoreError,
            TrainingError, UnstableSurrogateError.
    """
    require_training()
    from slide_fmu.pipeline.importable import make_importable
    from slide_fmu.pipeline.job import job_of_text
    from slide_fmu.pipeline.quality import require_quality
    from slide_fmu.pipeline.run import run_recipe

    text = tables_text(_recipe_tables(system, name, tables))
    make_importable(Path.cwd())
    console = messages()
    workers, remark = simulating_processes(system, workers)
    if remark is not None:
        console.print(f"remark: {remark}")
    with shown(console) as bar:
        job = job_of_text(text, f"slide.learn of {name!r}", Path(runs), bar)
        job = replace(job, command=f"slide.learn(system, {name!r})", tell=console.print)
        finished = run_recipe(job, UNSEEN_SEED, None, workers, threads, overwrite)
    require_quality(job.recipe, finished.figures)
    return Learnt(load(finished.fmu), finished.fmu, finished.page, finished.figures)


def _recipe_tables(
    system: System | Mapping[str, Any], name: str, tables: Mapping[str, Any]
) -> dict[str, Any]:
    """Return all tables of the recipe; an object is given under the recipe's name.

    Raises:
        RecipeError: the system is neither a reference system nor a table.
    """
    if not isinstance(system, System | Mapping):
        raise RecipeError(NO_SYSTEM.format(name=name, found=_told(system)))
    found: dict[str, Any] = {"name": name, "description": f"{name}, learnt from Python", **tables}
    found.setdefault("data", {})
    if not isinstance(system, System):
        return {**found, "system": dict(system)}
    given.give(name, system)
    window = {"step": system.step, **found.get("window", {})}
    found["data"] = _with_excitation(found["data"], system, window["step"])
    return {**found, "system": {"kind": "object", "model": name}, "window": window}


def _with_excitation(data: Any, system: System, step: Any) -> Any:
    """Return the table ``data`` with what the inputs of the system ask for, unless it says it.

    No table of the recipe tells of an object whether its inputs move, or are angles.
    """
    from slide_fmu.pipeline.proposal import MOVING, SUBSTEPS, kind_of_inputs

    if not isinstance(data, Mapping) or "excitation" in data:
        return data
    signals = getattr(system, "inputs", None)
    sound = isinstance(signals, tuple) and all(isinstance(signal, Signal) for signal in signals)
    number = isinstance(step, float | int) and 0 < step < math.inf
    if not (sound and signals and number):
        return data  # mistakes in signals and step are told by checks of their own
    widths, kind = [signal.high - signal.low for signal in signals], kind_of_inputs(system)
    bends = kind in MOVING and isinstance(system, Bending)
    substeps = {"substeps": SUBSTEPS} if bends else {}
    return {**substeps, **data, "excitation": default_excitation(step, kind, widths)}


def _told(system: object) -> str:
    """Say what somebody gave who has no system, in one short line."""
    text = f"{type(system).__name__} {getattr(system, '__name__', None) or repr(system)}"
    return text if len(text) <= 80 else f"{text[:77]}..."


def simulating_processes(
    system: System | Mapping[str, Any], workers: int | None, call: str = "learn"
) -> tuple[int | None, str | None]:
    """Return how many processes simulate, and what to say about that.

    The call is the public function by which the user came here.

    Raises:
        ValueError: there shall be some, which would run the user's script again.
    """
    if isinstance(system, Mapping) and system.get("kind") == KIND:
        return 0, None  # records are not simulated
    if isinstance(system, System) and not given.crosses(system):
        return 0, None if workers == 0 else NOT_DEFINED_HERE
    place = unguarded_place()
    if place is None or workers == 0:
        return workers, None
    if workers is None:
        return 0, ALONE.format(place=place)
    raise ValueError(AGAIN.format(call=call, workers=workers, place=place))
