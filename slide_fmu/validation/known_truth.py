"""This module runs an FMU on inputs whose true outputs are known, and compares both."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from slide_fmu.core.measures import moving_rms
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.run import UnpackedFmu, run_fmu
from slide_fmu.data.draws import Draw
from slide_fmu.fmu.description.variables import AT_STEP_END, HELD, IN_DOMAIN, NOVELTY, TRUSTED
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.calls import MeasuredMotion
from slide_fmu.validation.comparison import Comparison, FmuAnswer
from slide_fmu.validation.input_courses import course_of
from slide_fmu.validation.trust import TrustOutputs


def compare_with_truth(
    fmu: UnpackedFmu,
    surrogate: Surrogate,
    drawn: Draw,
    truth: FloatArray,
    seconds: FloatArray,
    parameters: Mapping[str, float] | None = None,
) -> Comparison:
    """Run an FMU on inputs whose true outputs are known.

    Args:
        drawn: the inputs, (N, n_inputs); their burn-in is not scored.
        truth: outputs, (N + 1, n_outputs).
        seconds: wall time in s of each step that made them; empty where they were measured.
        parameters: values of the FMU's physical parameters, by name; its start values if None.

    Raises:
        CoSimulationError: the FMU reports an error.
    """
    names = [signal.name for signal in surrogate.outputs]
    inputs = {s.name: drawn.inputs[:, i] for i, s in enumerate(surrogate.inputs)}
    step, span = surrogate.window.step, surrogate.estimated_samples
    estimates = [f"{n}_error_estimate" for n in names] if surrogate.estimates_errors else []
    bounds = [] if surrogate.bound is None else [f"{n}_error_bound" for n in names]
    domain = [NOVELTY, IN_DOMAIN, TRUSTED] if bounds else []
    filling = 0 if surrogate.bound is None else surrogate.bound.filling_length
    known = dict(parameters or {})
    at_end = {AT_STEP_END if AT_STEP_END in fmu.references else HELD: 1.0}
    every = [*names, *estimates, *bounds, *domain]
    own = run_fmu(fmu, inputs, every, {**known, **at_end}, step)
    first = max(drawn.burn_in + 1, surrogate.network.memory_length)

    def answer(values: FloatArray) -> FmuAnswer:
        ends = np.cumsum([len(names), len(estimates), len(bounds)])
        predicted, estimated, bounded, about = np.split(values[first:], ends, 1)
        error = predicted - truth[first:]
        true_error = np.full_like(error, np.nan)
        if len(error) >= span:
            true_error[span - 1 :] = moving_rms(error, span)
        trust = TrustOutputs(bounded, *about.T) if bounds else None
        return FmuAnswer(predicted, estimated if estimates else None, true_error, trust)

    at_once = answer(own.values)
    now = _now(drawn, surrogate)
    plain = None if now is None else answer(run_fmu(fmu, now, every, known, step).values)
    return Comparison(
        drawn.kind,
        step * np.arange(first, len(truth), dtype=np.float64),
        drawn.inputs[first - 1 :],
        truth[first:],
        at_once.outputs,
        at_once.estimate,
        at_once.true_error,
        (own.seconds, seconds),
        None,
        plain=None if plain is None else plain.outputs,
        parameters=known,
        trust=at_once.trust,
        first_trusted=max(0, filling - first),
        plain_answer=plain,
        motion=MeasuredMotion(
            course_of(drawn, surrogate.inputs, step, surrogate.planned),
            truth,
            step,
            first * step,
            known,
        ),
    )


def _now(drawn: Draw, surrogate: Surrogate) -> dict[str, FloatArray] | None:
    """Return the inputs of an importer that sets u(t) before each step; None with zero-order hold.

    ``drawn.inputs[k]`` is reached at t_k+1, so it is set before the step from there.
    """
    if surrogate.hold == "zero_order":
        return None
    now = np.concatenate([drawn.inputs[:1], drawn.inputs[:-1]])
    return {signal.name: now[:, i] for i, signal in enumerate(surrogate.inputs)}
