"""An FMU carries the beginning of an unseen trajectory, run by it and its reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from slide_fmu.apps.credentials.experiment import Experiment
from slide_fmu.apps.credentials.tables import rounded
from slide_fmu.core.signals import FloatArray, within_ranges
from slide_fmu.cosim.bound_check import bound_names
from slide_fmu.cosim.run import run_fmu, unpacked
from slide_fmu.data.draws import TEST, Draw, Stream, drawn_outputs, first_that_runs
from slide_fmu.data.recorded import unseen_stretches
from slide_fmu.fmu.description.variables import (
    BOUND_FILLED,
    IN_DOMAIN,
    NOVELTY,
    WINDOW_FILLED,
)
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.records.either import either
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System

COMPARED = 300
"""So many samples of the reference stand beside those of the FMU: files stay small."""


class _Truth(NamedTuple):
    """This says what is known of a trajectory.

    Its inputs (N, n_inputs), of which a burn-in does not count, the outputs (N + 1, n_outputs) of
    the reference, and the values of physical parameters.
    """

    inputs: FloatArray
    burn_in: int
    outputs: FloatArray
    parameters: Mapping[str, float]


def make_experiment(fmu: Path, surrogate: Surrogate, case: Case, seed: int) -> Experiment:
    """Run an FMU and its reference on the beginning of the first unseen trajectory of a seed.

    Inputs have the digits that a file keeps. Physical parameters have their start values; of
    specimens, those of the file.

    Args:
        fmu: the FMU, whose library is run.
        surrogate: what it carries.
        case: what it was made from; records must be the same.
        seed: that of the validation.

    Raises:
        CoSimulationError: the FMU cannot be run.
        LoadError, RecipeError: the reference, or the records, cannot be used.
        SimulationError: the reference could not be simulated on any draw.
    """
    truth = either(
        case.source,
        lambda _: _simulated(surrogate, case.recipe, case.reference, seed),
        lambda records: _measured(surrogate, case.recipe, records),
    )
    first = _first(surrogate, truth.burn_in)
    set_before = truth.inputs
    if forecasts(surrogate):  # inputs[k] is reached at t_k+1: so it is set before the step from it
        set_before = np.concatenate([truth.inputs[:1], truth.inputs[:-1]])
    inputs = {signal.name: set_before[:, i] for i, signal in enumerate(surrogate.inputs)}
    outputs = [signal.name for signal in surrogate.outputs]
    names = [*outputs, WINDOW_FILLED]
    if surrogate.bound is not None:
        names += [*bound_names(surrogate), NOVELTY, IN_DOMAIN, BOUND_FILLED]
    with unpacked(fmu) as files:
        run = run_fmu(files, inputs, names, truth.parameters, surrogate.window.step)
    return Experiment(
        surrogate.window.step,
        inputs,
        dict(zip(names, run.values.T, strict=True)),
        dict(zip(outputs, truth.outputs[first:].T, strict=True)),
        truth.parameters,
    )


def forecasts(surrogate: Surrogate) -> bool:
    """Tell whether the FMU, as it starts, forecasts how its inputs go on within a step."""
    return surrogate.hold == "first_order" and not surrogate.inputs_at_step_end


def _first(surrogate: Surrogate, burn_in: int) -> int:
    """Return the first sample at which the FMU can be compared with its reference."""
    return max(burn_in + 1, surrogate.network.memory_length)


def _simulated(surrogate: Surrogate, recipe: Recipe, system: System, seed: int) -> _Truth:
    """Simulate the reference system on the first draw that it does not fail on.

    Its parameters have their start values too.
    """
    starts = {parameter.name: parameter.start_value for parameter in surrogate.parameters}
    duration = recipe.validation.duration or recipe.data.duration
    stream = Stream(TEST, seed, (1.0, 1.0), duration)

    def run(drawn: Draw) -> _Truth:
        kept = _beginning(system, drawn, _first(surrogate, drawn.burn_in) + COMPARED)
        return _Truth(kept.inputs, kept.burn_in, drawn_outputs(system, kept), starts)

    return first_that_runs(recipe, system, stream, 0, run)


def _beginning(system: System, drawn: Draw, count: int) -> Draw:
    """Return so many first samples of a draw, whose inputs have the digits that a file keeps.

    Inputs that bend do so here too; what they are between samples stands in no file.
    """
    inputs = rounded(drawn.inputs[:count])
    inputs = within_ranges(system.inputs, inputs)  # an end may have more digits than a file
    between = drawn.between
    if between is not None:
        parts = len(between) // len(drawn.inputs)
        between = between[: parts * len(inputs)].copy()
        between[parts - 1 :: parts] = inputs
    return replace(drawn, inputs=inputs, between=between)


def _measured(surrogate: Surrogate, recipe: Recipe, source: MeasuredRecords) -> _Truth:
    """Take the beginning of the first block of the records that nothing was learnt from."""
    stretch = unseen_stretches(recipe, source)[0]
    steps = _first(surrogate, stretch.lead) + COMPARED
    inputs = rounded(stretch.trajectory.inputs[:steps])
    outputs = stretch.trajectory.outputs[: len(inputs) + 1]
    return _Truth(inputs, stretch.lead, outputs, stretch.parameters or {})
