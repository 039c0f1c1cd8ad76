"""A comparison is one trajectory of an FMU, in each call of an importer, next to its truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from slide_fmu.core.measures import moving_rms
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import Draw
from slide_fmu.importer.file import UnpackedFmu
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.calls import CallAnswers, MeasuredMotion, answers, recorded, run_in_call
from slide_fmu.validation.input_courses import course_of
from slide_fmu.validation.row import Call
from slide_fmu.validation.trust import TrustOutputs


@dataclass(frozen=True, eq=False)
class Comparison:
    """A Comparison is one trajectory of an FMU and of its reference, with inputs that are known.

    Attributes:
        kind: index of the excitation in the recipe, or of the file of records.
        time: times in s of the samples that are scored, shape (N,).
        inputs: inputs that led to them, shape (N, n_inputs).
        reference: outputs of the reference, shape (N, n_outputs).
        surrogate: outputs of the surrogate FMU, same shape.
        estimate: its error estimates, same shape, or None.
        true_error: RMSE over the samples up to each one that the estimate is about, same shape;
            NaN where they go back before the first scored sample.
        step_seconds: wall time per step of surrogate and reference, shapes (steps,); the first
            is empty unless the FMU was timed on this trajectory (``with_step_times``), the
            second where the reference was measured, or went by finer steps.
        model: outputs of the model that made the data, shape (N, n_outputs), or None where the
            reference is the same model.
        failed: number of draws before this one that the system could not simulate.
        plain: the same trajectory in the plain call, where an importer sets u(t) before the step
            from t, which is all that it knows; None with a zero-order hold, and of itself. In
            ``surrogate``, inputs with a first-order hold are set to what they reach by the step's
            end, as in the reference.
        free: outputs of the network run freely from the state with which a record begins, shape
            (N, n_outputs): they have no error of the truncated window. None of simulated
            trajectories, and of networks without a state.
        parameters: values of the physical parameters, by name; empty without parameters.
        trust: bounds and domain of the FMU, or None.
        first_trusted: the first sample at which bound and domain count.
        motion: inputs as a function of time, and all true outputs, of which rows are made.
    """

    kind: int
    time: FloatArray
    inputs: FloatArray
    reference: FloatArray
    surrogate: FloatArray
    estimate: FloatArray | None
    true_error: FloatArray
    step_seconds: tuple[FloatArray, FloatArray]
    model: FloatArray | None
    failed: int = 0
    plain: Comparison | None = None
    free: FloatArray | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    trust: TrustOutputs | None = None
    first_trusted: int = 0
    motion: MeasuredMotion | None = None

    def where_trusted(self) -> Comparison | None:
        """Return the part in which the bound counts; None without a bound, or without samples."""
        if self.trust is None or self.first_trusted >= len(self.time):
            return None
        part = slice(self.first_trusted, None)
        trust = self.trust.part(part)
        # every array of a comparison has one row for each sample that is scored
        arrays = {k: v for k, v in vars(self).items() if isinstance(v, np.ndarray)}
        cut: Any = {name: values[part] for name, values in arrays.items()}
        return replace(self, **cut, trust=trust, first_trusted=0, plain=None)

    @property
    def error(self) -> FloatArray:
        """The error is the surrogate minus the reference, shape (N, n_outputs)."""
        return self.surrogate - self.reference


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
    step, span = surrogate.window.step, surrogate.estimated_samples
    first = max(drawn.burn_in + 1, surrogate.network.memory_length)
    filling = 0 if surrogate.bound is None else surrogate.bound.filling_length
    course = course_of(drawn, surrogate.inputs, step, surrogate.planned)
    motion = MeasuredMotion(course, truth, step, first * step, dict(parameters or {}))

    moving: tuple[Call, ...] = ("plain",) if surrogate.hold == "first_order" else ()
    signals = surrogate.inputs, surrogate.outputs
    by_call = {call: answers(fmu, *signals, motion, call, step) for call in ("known", *moving)}

    def compared(given: CallAnswers) -> Comparison:
        true_error = np.full_like(given.error, np.nan)
        if len(true_error) >= span:
            true_error[span - 1 :] = moving_rms(given.error, span)
        return Comparison(
            kind=drawn.kind,
            time=step * np.arange(first, len(truth), dtype=np.float64),
            inputs=drawn.inputs[first - 1 :],
            reference=given.truth,
            surrogate=given.outputs,
            estimate=given.estimates,
            true_error=true_error,
            step_seconds=(np.empty(0), seconds),
            model=None,
            parameters=motion.parameters,
            trust=_trust(given),
            first_trusted=max(0, filling - first),
            motion=replace(motion, answers=by_call),
        )

    plain = compared(by_call["plain"]) if moving else None
    return replace(compared(by_call["known"]), plain=plain)


def with_step_times(fmu: UnpackedFmu, surrogate: Surrogate, comparison: Comparison) -> Comparison:
    """Run an FMU once more on a comparison's motion, to time set, doStep and get by fmpy.

    Raises:
        CoSimulationError: the FMU reports an error.
    """
    motion, step = comparison.motion, surrogate.window.step
    assert motion is not None
    steps: tuple[Call, float, int] = ("known", step, motion.count(step))
    names, values = recorded(fmu, surrogate.outputs), motion.parameters
    run = run_in_call(fmu, surrogate.inputs, motion.course, names, steps, values, timed=True)
    return replace(comparison, step_seconds=(run.seconds, comparison.step_seconds[1]))


def _trust(given: CallAnswers) -> TrustOutputs | None:
    """Return bounds and domain; None of an FMU that lacks one of them."""
    bounds, novelty = given.bounds, given.novelty
    in_domain, trusted = given.in_domain, given.trusted
    if bounds is None or novelty is None or in_domain is None or trusted is None:
        return None
    return TrustOutputs(bounds, novelty, in_domain, trusted.astype(np.float64))
