"""A surrogate FMU runs on the inputs of measured records, beside what was measured then."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray, Trajectory
from slide_fmu.cosim.run import unpacked
from slide_fmu.data.draws import Draw
from slide_fmu.data.recorded import unseen_stretches
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.beside import beside
from slide_fmu.validation.comparison import Task, Validation
from slide_fmu.validation.free_run import free_run


def validate_records(
    fmu: Path,
    surrogate: Surrogate,
    recipe: Recipe,
    source: MeasuredRecords,
    task: Task,
    progress: Progress,
) -> Validation:
    """Run an FMU on the blocks of records that nothing was learnt from.

    Raises:
        CoSimulationError: the FMU reports an error.
        ValueError: the task asks for what records cannot show.
    """
    if task.amplitude != (1.0, 1.0) or task.duration is not None:
        raise ValueError(
            f"amplitude = {task.amplitude}, duration = {task.duration} s; expected neither for "
            "records: nothing beyond what was measured is known. Leave them out"
        )
    found = unseen_stretches(recipe, source)[: task.trajectories]
    comparisons = []
    progress(0, len(found))
    with unpacked(fmu) as files:
        for stretch in found:
            measured = stretch.trajectory
            drawn = Draw(stretch.file, 1.0, None, measured.inputs, stretch.lead)
            own, values = surrogate, stretch.parameters
            comparison = beside(files, own, drawn, measured.outputs, np.empty(0), values)
            free = _free(own.at(values) if values else own, measured)
            scored = len(comparison.reference)
            free = None if free is None else free[-scored:]
            comparisons.append(replace(comparison, free=free))
            progress(len(comparisons), len(found))
    return Validation(task, surrogate, recipe, tuple(comparisons), records=source)


def _free(surrogate: Surrogate, measured: Trajectory) -> FloatArray | None:
    """Run the network freely along a record, whose first outputs tell its state there.

    They lie in the lead, which is not scored. Networks without a state have no such run, nor has a
    record without outputs there.
    """
    first = max(1, min(surrogate.window.n_truncated, len(measured.inputs) - 1))
    if not np.isfinite(measured.outputs[1 : first + 1]).any():
        return None
    found = free_run(surrogate, measured.inputs, measured.outputs[1:], first)
    return None if found is None else found.outputs
