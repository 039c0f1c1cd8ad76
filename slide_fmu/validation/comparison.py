"""A comparison holds one trajectory of an FMU and of its reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.validation.calls import MeasuredMotion
from slide_fmu.validation.trust import TrustOutputs


@dataclass(frozen=True, eq=False)
class FmuAnswer:
    """An FmuAnswer holds the results of an FMU along a trajectory, at N scored samples.

    Attributes:
        outputs: shape (N, n_outputs).
        estimate: its error estimates, same shape, or None.
        true_error: as of ``Comparison``.
        trust: its bounds and its domain, or None.
    """

    outputs: FloatArray
    estimate: FloatArray | None
    true_error: FloatArray
    trust: TrustOutputs | None


@dataclass(frozen=True, eq=False)
class Comparison:
    """A comparison is one trajectory of both FMUs.

    Attributes:
        kind: index of the excitation in the recipe, or of the file of records.
        time: times in s of the samples that are scored, shape (N,).
        inputs: inputs that led to them, shape (N, n_inputs).
        reference: outputs of the reference, shape (N, n_outputs).
        surrogate: outputs of the surrogate FMU, same shape.
        estimate: its error estimates, same shape, or None.
        true_error: RMSE over the samples up to each one that the estimate is about, same shape;
            NaN where they go back before the first scored sample.
        step_seconds: wall time per step of surrogate and reference, shapes (steps,); the second
            is empty where the reference was measured, or went by finer steps.
        model: outputs of the model that made the data, shape (N, n_outputs), or None where the
            reference is the same model.
        failed: number of draws before this one that the system could not simulate.
        plain: outputs of the surrogate FMU as it is, shape (N, n_outputs), where an importer sets
            u(t) before the step from t, which is all that it knows; None with a zero-order hold.
            In ``surrogate``, inputs with a first-order hold are set to what they reach by the
            step's end, as in the reference.
        free: outputs of the network run freely from the state with which a record begins, shape
            (N, n_outputs): they have no error of the truncated window. None of simulated
            trajectories, and of networks without a state.
        parameters: values of the physical parameters, by name; empty without parameters.
        trust: bounds and domain of the FMU, or None.
        first_trusted: the first sample at which bound and domain count.
        plain_answer: with a first-order hold, all results of the FMU in the run of ``plain``.
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
    plain: FloatArray | None = None
    free: FloatArray | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    trust: TrustOutputs | None = None
    first_trusted: int = 0
    plain_answer: FmuAnswer | None = None
    motion: MeasuredMotion | None = None

    def in_plain_call(self) -> Comparison | None:
        """Return the comparison of an importer that sets u(t); None with a zero-order hold."""
        answer = self.plain_answer
        if answer is None:
            return None
        return replace(
            self,
            surrogate=answer.outputs,
            estimate=answer.estimate,
            true_error=answer.true_error,
            trust=answer.trust,
            plain=None,
            plain_answer=None,
        )

    def where_trusted(self) -> Comparison | None:
        """Return the part in which the bound counts; None without a bound, or without samples."""
        if self.trust is None or self.first_trusted >= len(self.time):
            return None
        part = slice(self.first_trusted, None)
        trust = self.trust.part(part)
        # every array of a comparison has one row for each sample that is scored
        arrays = {k: v for k, v in vars(self).items() if isinstance(v, np.ndarray)}
        cut: Any = {name: values[part] for name, values in arrays.items()}
        return replace(self, **cut, trust=trust, first_trusted=0, plain_answer=None)

    @property
    def error(self) -> FloatArray:
        """The error is the surrogate minus the reference, shape (N, n_outputs)."""
        return self.surrogate - self.reference
