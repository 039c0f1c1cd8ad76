"""This module runs a surrogate FMU on the inputs of records and compares it with their outputs.

The truncated window of a surrogate causes errors, and so does a record that begins in mid-motion.
A free run of the network along the whole record has neither: it shows the error of the network
itself, next to that of the FMU.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from slide_fmu.core.noise_floor import SHORTEST_PIECE, noise_of_residuals
from slide_fmu.core.progress import Progress
from slide_fmu.core.signals import FloatArray, Trajectory
from slide_fmu.data.draws import Draw
from slide_fmu.importer.file import unpacked
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.case import Case
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.segments import unseen_blocks
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.comparison import compare_with_truth, with_step_times
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import Task

FIRST_SAMPLES = 50
"""Default number of first outputs from which the state at the start of a record is found."""


@dataclass(frozen=True, eq=False)
class FreeRun:
    """A free run of a network along a record, in the outputs' units.

    Attributes:
        outputs: at samples 1 .. N, shape (N, n_outputs).
        error: RMS error of each output after the first samples, shape (n_outputs,).
        first_samples: number of outputs from which the initial state was found; not scored.
        state: the initial state, shape (n_states,).
    """

    outputs: FloatArray
    error: FloatArray
    first_samples: int
    state: FloatArray


def free_run(
    surrogate: Surrogate,
    inputs: FloatArray,
    measured: FloatArray,
    first_samples: int = FIRST_SAMPLES,
) -> FreeRun | None:
    """Run the network of a surrogate along a record, never restarted; None if it has no state.

    Inputs have the shape (N, n_inputs), in their units; ``measured`` are the outputs at samples
    1 .. N, (N, n_outputs): the one of row k is reached under the input of row k. They are NaN
    where they are not known. Only the first samples of them are used, to find the initial state.

    Raises:
        ValueError: the record has no samples after the first ones, or the shapes do not fit.
    """
    if not isinstance(surrogate.network, StateSpace):
        return None
    if not 1 <= first_samples < len(inputs):
        raise ValueError(
            f"record of {len(inputs)} samples, the initial state from {first_samples} of them; "
            "expected at least one, and a longer record"
        )
    outputs, state = surrogate.run_from_outputs(inputs, measured[:first_samples])
    squares = np.square(outputs - measured)[first_samples:]
    return FreeRun(outputs, np.sqrt(np.nanmean(squares, axis=0)), first_samples, state)


def validate_records(
    source: MeasuredRecords,
    fmu: Path,
    surrogate: Surrogate,
    case: Case,
    task: Task,
    progress: Progress,
    workers: int | None,
) -> Validation:
    """Run an FMU on the blocks of records that were not learnt from.

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
    blocks = unseen_blocks(recipe, source)[: task.trajectories]
    comparisons = []
    progress(0, len(blocks))
    with unpacked(fmu) as files:
        for block in blocks:
            measured = block.trajectory
            drawn = Draw(block.file, 1.0, None, measured.inputs, block.lead)
            own, values = surrogate, block.parameters
            comparison = compare_with_truth(
                files, own, drawn, measured.outputs, np.empty(0), values
            )
            free = _free(own.at(values) if values else own, measured)
            scored = len(comparison.reference)
            free = None if free is None else free[-scored:]
            comparisons.append(replace(comparison, free=free))
            progress(len(comparisons), len(blocks))
        comparisons[:1] = [with_step_times(files, surrogate, one) for one in comparisons[:1]]
    noise = rms_of_noise(source.noise_at_rest, [comparison.error for comparison in comparisons])
    return Validation(
        task, surrogate, recipe, tuple(comparisons), noise=noise, between_known=False
    )


def rms_of_noise(
    pieces: Sequence[FloatArray] | None, errors: Sequence[FloatArray]
) -> FloatArray | None:
    """Return the RMS of the noise of every output in its unit, (n_outputs,); None if not known.

    ``pieces`` of noise alone give it, whatever its colour. Without them it is estimated as white
    noise in the errors, if some are long enough. All arrays have the shape (N, n_outputs).
    """
    if pieces is not None:
        return np.asarray(np.std(np.concatenate(pieces), axis=0))
    long_enough = [error for error in errors if len(error) >= SHORTEST_PIECE]
    return noise_of_residuals(long_enough).floor if long_enough else None


def _free(surrogate: Surrogate, measured: Trajectory) -> FloatArray | None:
    """Run the network freely along a record; its first outputs determine the initial state.

    These outputs lie in the lead, which is not scored. The result is None for networks without a
    state, and for records without outputs there.
    """
    first = max(1, min(surrogate.window.n_truncated, len(measured.inputs) - 1))
    if not np.isfinite(measured.outputs[1 : first + 1]).any():
        return None
    run = free_run(surrogate, measured.inputs, measured.outputs[1:], first)
    return None if run is None else run.outputs
