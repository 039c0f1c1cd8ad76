"""An FMU carries the beginning of an unseen trajectory, run by it and by its reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from slide_fmu.apps.credentials.experiment import Experiment
from slide_fmu.apps.credentials.tables import rounded
from slide_fmu.core.signals import FloatArray, Signal, within_ranges
from slide_fmu.cosim.bound_check import bound_names
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.data.draws import TEST, Draw, Stream, drawn_outputs, first_that_runs
from slide_fmu.data.unseen import UnseenMotion, known_or_simulated
from slide_fmu.excitation.kinds import moving_by_themselves
from slide_fmu.fmu.description.variables import HELD, TRUST, WINDOW_FILLED
from slide_fmu.importer.file import unpacked
from slide_fmu.recipe.case import Case
from slide_fmu.surrogate.description import SurrogateDescription
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System

COMPARED = 300
"""Number of samples of the reference in an experiment: files stay small."""


def make_experiment(fmu: Path, surrogate: Surrogate, case: Case, seed: int) -> Experiment:
    """Run an FMU and its reference on the beginning of the first unseen trajectory of a seed.

    Inputs have as many digits as a file keeps. Physical parameters have their start values; for
    specimens, the values of the file.

    Args:
        fmu: the FMU, whose library is run.
        surrogate: the surrogate of the FMU.
        case: the case that it was made from; records must be the same.
        seed: the seed of the validation.

    Raises:
        CoSimulationError: the FMU cannot be run.
        LoadError, RecipeError: the reference, or the records, cannot be used.
        SimulationError: the reference could not be simulated on any draw.
    """
    simulate = partial(_simulated, surrogate, case, seed)
    truth = known_or_simulated(case.source, case.recipe, simulate)[0]
    first = _first(surrogate, truth.burn_in)
    rows = _as_written(surrogate.inputs, truth.inputs[: first + COMPARED])
    set_before = rows
    if SurrogateDescription.of(surrogate).forecasts_inputs:  # inputs[k] is the value at t_k+1
        set_before = np.concatenate([rows[:1], rows[:-1]])
    inputs = {signal.name: set_before[:, i] for i, signal in enumerate(surrogate.inputs)}
    parameters = dict(truth.parameters)
    if surrogate.hold == "zero_order":  # those of the training, which are no samples of a curve
        parameters[HELD] = 1.0
    outputs = [signal.name for signal in surrogate.outputs]
    names = [*outputs, WINDOW_FILLED]
    if surrogate.bound is not None:
        names += [*bound_names(surrogate), *TRUST]
    with unpacked(fmu) as files:
        run = run_fmu(files, inputs, names, parameters, surrogate.window.step)
    return Experiment(
        surrogate.window.step,
        inputs,
        dict(zip(names, run.values.T, strict=True)),
        dict(zip(outputs, truth.outputs[first : len(rows) + 1].T, strict=True)),
        parameters,
    )


def _first(surrogate: Surrogate, burn_in: int) -> int:
    """Return the first sample at which the FMU can be compared with its reference."""
    return max(burn_in + 1, surrogate.network.memory_length)


def _simulated(surrogate: Surrogate, case: Case, seed: int) -> list[UnseenMotion]:
    """Simulate the reference system on the first draw without a failure.

    The inputs are of the most common kind of all inputs, since a rare one may be a rest.
    Parameters of the system have their start values too.
    """
    kinds = moving_by_themselves(case.recipe.data.excitation)
    common = max(kinds, key=lambda kind: kind.weight)
    recipe, system = case.recipe.with_kinds((common,)), case.reference
    starts = {parameter.name: parameter.start_value for parameter in surrogate.parameters}
    duration = recipe.measured_duration()
    stream = Stream(TEST, seed, (1.0, 1.0), duration)

    def run(drawn: Draw) -> UnseenMotion:
        kept = _beginning(system, drawn, _first(surrogate, drawn.burn_in) + COMPARED)
        outputs = drawn_outputs(system, kept)
        return UnseenMotion(kept.inputs, outputs, kept.burn_in, kept.kind, starts)

    return [first_that_runs(recipe, system, stream, 0, run)]


def _as_written(signals: Sequence[Signal], inputs: FloatArray) -> FloatArray:
    """Return inputs, (N, n_inputs), with the digits of a file; ends of ranges may have more."""
    low, high = (np.array([getattr(signal, end) for signal in signals]) for end in ("low", "high"))
    return np.where((inputs == low) | (inputs == high), inputs, rounded(inputs))


def _beginning(system: System, drawn: Draw, count: int) -> Draw:
    """Return the first ``count`` samples of a draw, with inputs rounded to a file's digits.

    Inputs that are curved or jump between samples do so here too, but a file has no values in
    between.
    """
    inputs = rounded(drawn.inputs[:count])
    inputs = within_ranges(system.inputs, inputs)  # an end may have more digits than a file
    between = drawn.between
    if between is not None:
        parts = len(between) // len(drawn.inputs)
        between = between[: parts * len(inputs)].copy()
        between[parts - 1 :: parts] = inputs
    jumps = None if drawn.jumps is None else drawn.jumps[:count]
    return replace(drawn, inputs=inputs, between=between, jumps=jumps)
