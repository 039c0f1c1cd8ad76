"""A surrogate FMU runs on the inputs of measured records, beside what was measured then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from slide_fmu.core.noise_floor import SHORTEST_PIECE, noise_of_residuals
from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray, Trajectory
from slide_fmu.cosim.run import unpacked
from slide_fmu.data.draws import Draw
from slide_fmu.recipe.case import Case
from slide_fmu.records.free_run import free_run
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.stretches import unseen_stretches
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.comparison import Task, Validation
from slide_fmu.validation.known_truth import compare_with_truth


def validate_records(
    source: MeasuredRecords,
    fmu: Path,
    surrogate: Surrogate,
    case: Case,
    task: Task,
    progress: Progress,
    workers: int | None,
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
    recipe = case.recipe
    found = unseen_stretches(recipe, source)[: task.trajectories]
    comparisons = []
    progress(0, len(found))
    with unpacked(fmu) as files:
        for stretch in found:
            measured = stretch.trajectory
            drawn = Draw(stretch.file, 1.0, None, measured.inputs, stretch.lead)
            own, values = surrogate, stretch.parameters
            comparison = compare_with_truth(
                files, own, drawn, measured.outputs, np.empty(0), values
            )
            free = _free(own.at(values) if values else own, measured)
            scored = len(comparison.reference)
            free = None if free is None else free[-scored:]
            comparisons.append(replace(comparison, free=free))
            progress(len(comparisons), len(found))
    noise = rms_of_noise(source.noise_at_rest, [comparison.error for comparison in comparisons])
    return Validation(task, surrogate, recipe, tuple(comparisons), noise=noise)


def rms_of_noise(
    stretches: Sequence[FloatArray] | None, errors: Sequence[FloatArray]
) -> FloatArray | None:
    """Return the RMS of the noise of every output in its unit, (n_outputs,); None if not known.

    Stretches of noise alone tell it, whatever its colour. Without them it is that of white noise
    in the errors, if some are long enough. All arrays have the shape (N, n_outputs).
    """
    if stretches is not None:
        return np.asarray(np.std(np.concatenate(stretches), axis=0))
    long_enough = [error for error in errors if len(error) >= SHORTEST_PIECE]
    return noise_of_residuals(long_enough).floor if long_enough else None


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
