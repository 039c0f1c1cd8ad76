"""This module measures the error of the plain call, which knows inputs at communication points.

The plain call is ``fmpy.simulate_fmu(fmu, input=table, output_interval=step)``; other importers do
the same. Under the
recipe's own kinds of excitation the inputs of the reference move between communication points as
their hold says; under smooth inputs the reference advances by its own fine step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from slide_fmu.core.measures import percent, rms
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.cosim.run import run_fmu, unpacked
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.excitation.mix import moving_by_themselves
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.error_figures import PlainCallFigures, PlainError, PlainOutput
from slide_fmu.validation.results import Validation

SAMPLES = 16
"""A smooth input has at least this many samples in a period."""
DECADES = 1.5
"""Its slowest sine is this many decades below the fastest one."""
TRAJECTORIES, PERIODS, SINES = 6, 4, 3
"""Number of smooth trajectories, periods of the slowest sine in each, and sines in an input."""
MOST_SAMPLES = 1000
"""Largest number of samples on which the error of holding inputs is measured."""
FILLED = 0.9
"""A smooth input fills this part of its declared range at most."""
SEED = 0x5A007
"""Entropy of the sines; no training uses it."""
OWN_PART = 0.1
"""The FMU's own error is named if it is a larger part of the error under held inputs."""
TEXT = (
    "Relative RMSE of `fmpy.simulate_fmu(fmu, input=table, output_interval=STEP)`, which sets "
    "before each step what the "
    "inputs are then."
)


class _Smooth(NamedTuple):
    """Errors, truth and bounds under smooth inputs, (n, n_outputs) each, and their band in Hz.

    Bounds are NaN where the FMU has none.
    """

    error: FloatArray
    truth: FloatArray
    bound: FloatArray
    hz: tuple[float, float]


def plain_call_figures(fmu: Path, validation: Validation, case: Case) -> PlainCallFigures | None:
    """Measure the plain call of an FMU; None where nothing is known between the samples.

    Args:
        fmu: the FMU, whose library is run.
        validation: its validation in range.
        case: what it was made from.

    If inputs are held, the figures have ``smooth_if_held`` in the place of ``smooth``. A model
    that itself holds its inputs over the same step is an exception, since nothing is late there.
    Smooth inputs are not measured for planned motions, which are smooth in the recipe, nor for
    references without a finer step.

    Raises:
        CoSimulationError: the FMU reports an error.
    """
    return plain_call_against(case.source, fmu, validation, case)


@asked_of_sources
def plain_call_against(
    system: System, fmu: Path, validation: Validation, case: Case
) -> PlainCallFigures | None:
    """Measure the plain call of an FMU against the reference of the system that made its data."""
    surrogate = validation.surrogate
    late = surrogate.hold == "zero_order" and case.finer_steps > 1
    turning = any(signal.angle is not None for signal in surrogate.inputs)
    smooth, refusal = None, None
    if not (surrogate.planned or turning):
        try:
            smooth = _under_smooth_inputs(fmu, surrogate, case)
        except (LoadError, SimulationError) as error:
            refusal = str(error)
    found = PlainCallFigures(
        hold=surrogate.hold,
        late_s=surrogate.window.step / 2 if late else None,
        outputs=tuple(_outputs(validation, smooth, late)),
        smooth_hz=None if smooth is None else smooth.hz,
        sentence="",
    )
    return replace(found, sentence=_sentence(found, refusal))


def _outputs(validation: Validation, smooth: _Smooth | None, late: bool) -> list[PlainOutput]:
    """Return the figures of all outputs; held smooth inputs may be late."""
    comparisons, held = validation.comparisons, validation.surrogate.hold == "zero_order"
    truth = np.concatenate([c.reference for c in comparisons])
    plain = [c.surrogate if c.plain is None else c.plain for c in comparisons]
    rough = np.concatenate(plain) - truth
    known = np.concatenate([c.error for c in comparisons])
    rows = []
    for index, signal in enumerate(validation.surrogate.outputs):
        smooth_rmse = smooth_relative = covered = worst = None
        if smooth is not None:
            within = np.abs(smooth.error[:, index]) <= smooth.bound[:, index]
            covered = float(np.mean(within)) if validation.surrogate.bound is not None else None
            smooth_rmse = float(rms(smooth.error)[index])
            smooth_relative = float(_relative(smooth.error, smooth.truth)[index])
            motions = zip(
                *(np.split(part, TRAJECTORIES) for part in (smooth.error, smooth.truth)),
                strict=True,
            )
            worst = max(float(_relative(*motion)[index]) for motion in motions)
        rows.append(
            PlainOutput(
                name=signal.name,
                unit=signal.unit,
                smooth=None if late else smooth_relative,
                smooth_worst=None if late else worst,
                smooth_rmse=None if late else smooth_rmse,
                smooth_covered=None if late else covered,
                rough=float(validation.relative(rough, truth)[index]),
                rough_rmse=float(rms(rough)[index]),
                known_to_step_end=(
                    None if held else float(validation.relative(known, truth)[index])
                ),
                smooth_if_held=smooth_relative if late else None,
            )
        )
    return rows


def _relative(error: FloatArray, truth: FloatArray) -> FloatArray:
    """Return the RMSE over the RMS of the truth about its mean, (n_outputs,)."""
    size = np.maximum(rms(truth - truth.mean(axis=0)), np.finfo(np.float64).tiny)
    return np.asarray(rms(error) / size)


def _sentence(found: PlainCallFigures, refusal: str | None) -> str:
    """Say the largest errors of the plain call in one sentence."""

    def up_to(key: PlainError) -> str:
        worst = found.worst(key)
        return "" if worst is None else percent(worst)

    rough = up_to("rough")
    if refusal is not None:
        return f"smooth inputs were not measured: {refusal}"
    if found.smooth_hz is None:
        if found.hold == "zero_order":
            return f"the plain call has errors of up to {rough} under the kinds of the training"
        return (
            f"the plain call has errors of up to {rough}, since what inputs do within a step is "
            f"forecast; with inputs known to the step's end it is "
            f"{up_to('known_to_step_end')}"
        )
    low, high = found.smooth_hz
    error = (
        f"{up_to('smooth_if_held' if found.late_s else 'smooth')} at {low:.2g} to {high:.2g} Hz"
    )
    if found.late_s:
        return late_words(found, error)
    return (
        f"the plain call has errors of up to {error} under smooth inputs, and of up to {rough} "
        "under the kinds of the training"
    )


def band_of(recipe: Recipe) -> tuple[float, float]:
    """Return the lowest and the highest frequency of smooth inputs in Hz.

    They have at least ``SAMPLES`` samples in a period and lie in the band in which the excitation
    is as wide as they are.
    """
    high = 1.0 / (SAMPLES * recipe.window.step)
    kinds = moving_by_themselves(recipe.data.excitation)
    wide = [kind for kind in kinds if getattr(kind, "amplitude", (1, 1))[1] >= FILLED / SINES]
    tops = [getattr(kind, "angular_frequency", (0, 0))[1] for kind in wide or kinds]
    if max(tops) > 0:
        high = min(high, max(tops) / (2 * np.pi))
    return high / 10**DECADES, high


def smooth_inputs(
    signals: Sequence[Signal], times: FloatArray, hz: tuple[float, float], index: int
) -> FloatArray:
    """Draw sums of sines within the declared ranges, (N, n_inputs), at times in s, (N,).

    The same index gives the same functions of time, whatever the times are.
    """
    rng = np.random.default_rng([SEED, index])
    columns = []
    for signal in signals:
        places = (np.arange(SINES) + rng.uniform(size=SINES)) / SINES  # slow, middle and fast
        frequency = 2 * np.pi * hz[0] * (hz[1] / hz[0]) ** places
        sines = np.sin(times[:, None] * frequency + rng.uniform(-np.pi, np.pi, SINES)).mean(axis=1)
        middle, half_range = (signal.high + signal.low) / 2, (signal.high - signal.low) / 2
        columns.append(middle + FILLED * half_range * sines)
    return np.stack(columns, axis=1)


def _under_smooth_inputs(fmu: Path, surrogate: Surrogate, case: Case) -> _Smooth:
    """Run the FMU and the model at its own fine step under the same smooth inputs.

    Raises:
        LoadError: the reference has no finer step.
        SimulationError: it could not be simulated.
    """
    recipe, times = case.recipe, case.finer_steps
    hz, step, system = band_of(recipe), recipe.window.step, case.reference_as_it_runs()
    burn_in = round(recipe.data.burn_in / step)
    first = max(burn_in + 1, surrogate.network.memory_length)
    count = first + min(round(PERIODS / hz[0] / step), round(recipe.data.duration / step))
    names = [signal.name for signal in surrogate.outputs]
    bounds = [] if surrogate.bound is None else [f"{name}_error_bound" for name in names]
    errors, truths, bound = [], [], []
    with unpacked(fmu) as files:
        for index in range(TRAJECTORIES):
            truth = _truth(system, hz, (count, times), index)[first:]
            rows = smooth_inputs(
                surrogate.inputs, step * np.arange(count, dtype=np.float64), hz, index
            )
            inputs = {signal.name: rows[:, i] for i, signal in enumerate(surrogate.inputs)}
            values = run_fmu(files, inputs, [*names, *bounds], None, step).values[first:]
            errors.append(values[:, : len(names)] - truth)
            bound.append(values[:, len(names) :] if bounds else np.full_like(truth, np.nan))
            truths.append(truth)
    return _Smooth(np.concatenate(errors), np.concatenate(truths), np.concatenate(bound), hz)


def cost_of_holding(case: Case) -> str | None:
    """Say by how much a smooth input is late where a recipe holds its inputs over a step.

    Only the model is needed: it is simulated under held inputs, and at its own fine step.

    Returns:
        A sentence; None where inputs move or turn, where the model itself holds them over that
        step, or there is no finer step.

    Raises:
        SimulationError: the model could not be simulated.
    """
    recipe, held = case.recipe, case.system
    if any(s.hold != "zero_order" or s.angle is not None for s in held.inputs):
        return None
    try:
        times = case.finer_steps
        if times == 1:  # it would be compared with itself
            return None
        fine = case.reference_as_it_runs()
    except LoadError:  # its class has a step of its own
        return None
    hz, step = band_of(recipe), recipe.window.step
    first = round(recipe.data.burn_in / step) + 1
    count = first + min(round(PERIODS / hz[0] / step), MOST_SAMPLES)
    rows = smooth_inputs(held.inputs, step * np.arange(count, dtype=np.float64), hz, 0)
    truth = _truth(fine, hz, (count, times), 0)[first:]
    error = percent(float(_relative(simulate(held, rows).outputs[first:] - truth, truth).max()))
    return (
        f"inputs are held over a step of {step:g} s, so a smooth one is late by {step / 2:g} s: "
        f"{error} at {hz[0]:.2g} to {hz[1]:.2g} Hz; if yours are smooth, write hold = "
        '"first_order" for them'
    )


def _truth(
    system: System, hz: tuple[float, float], counts: tuple[int, int], index: int
) -> FloatArray:
    """Return the outputs of the model at the FMU's samples, (count + 1, n_outputs).

    Moving inputs are set to their values at the end of a fine step, held ones to their values in
    its middle; a model that names its own step gets their values at its begin.
    """
    count, times = counts
    moving = system.inputs[0].hold == "first_order"
    within = 1.0 if moving else 0.0 if system.own_step is not None else 0.5
    at = system.step * (np.arange(count * times, dtype=np.float64) + within)
    return simulate(system, smooth_inputs(system.inputs, at, hz, index)).outputs[::times]


def late_words(found: PlainCallFigures, error: str) -> str:
    """Say by how much a held smooth input is late, and how large the error of the FMU then is.

    Args:
        found: the figures of the plain call.
        error: the largest ``smooth_if_held`` in words. The FMU's own error is part of it.
    """
    late = f"a smooth input is late by {found.late_s:g} s"
    held, own = found.worst("smooth_if_held"), found.worst("rough")
    if held is not None and own is not None and own > OWN_PART * held:
        return f"{late}; under it, the FMU has an error of {error}, its own error included"
    return f"{late}: {error}"
