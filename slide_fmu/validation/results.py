"""The results of a validation are its compared trajectories, and the figures made from them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.core.measures import FEWEST, relative_rmse, rms, size_about
from slide_fmu.core.signals import FloatArray
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.error_figures import (
    Deviation,
    EstimateFigures,
    KindFigures,
    OutputFigures,
    ParameterFigures,
    ParameterPoint,
    Quantiles,
    SpeedFigures,
    Timing,
    ToleranceRow,
    ValidationFigures,
)
from slide_fmu.validation.task import Task
from slide_fmu.validation.trust import deviation_of, tolerance_rows


@dataclass(frozen=True, eq=False)
class Validation:
    """A validation is all compared trajectories of one task.

    Attributes:
        task, surrogate, recipe: the task, the validated surrogate, and its recipe.
        comparisons: the trajectories; with physical parameters, each has unseen values of them.
        corners: one more trajectory at each corner of the parameters' box, which the other
            figures do not count; empty without parameters.
        left_out: errors of the system on trajectories beyond the range, which are left out.
        speed: the comparison of times at equal accuracy, where it was made.
        noise: RMS of the noise of the measured outputs, (n_outputs,); None of a simulated
            reference, or where it is not known.
        between_known: whether it is known what inputs do between samples; of records it is not.
    """

    task: Task
    surrogate: Surrogate
    recipe: Recipe
    comparisons: tuple[Comparison, ...]
    corners: tuple[Comparison, ...] = ()
    left_out: tuple[str, ...] = ()
    noise: FloatArray | None = None
    speed: SpeedFigures | None = None
    between_known: bool = True

    @property
    def in_range(self) -> bool:
        """Tell whether trajectories are like those of the training and calibration."""
        return self.task.amplitude == (1.0, 1.0) and not self.task.held_out

    @property
    def each(self) -> int:
        """The number of motions of each kind of further inputs: as many as of each in range."""
        return min(FEWEST, max(1, len(self.comparisons) // len(self.recipe.mix())))

    @property
    def trusted(self) -> tuple[Comparison, ...]:
        """The trajectories where the bound counts; empty without a bound."""
        return _where_trusted(self.used)

    @property
    def used(self) -> tuple[Comparison, ...]:
        """The trajectories as an importer runs them, for which bounds and estimates are made.

        It sets u(t) before the step from t, unless the inputs are planned motions.
        """
        return tuple(
            c if self.surrogate.planned or c.plain is None else c.plain for c in self.comparisons
        )

    def usual_error(self) -> FloatArray:
        """Return the 95 % quantile of the absolute errors with known inputs, (n_outputs,).

        In range, it is the usual level to which all errors are compared.
        """
        _, error = _joined(self.comparisons)
        return np.asarray(np.quantile(np.abs(error), 0.95, axis=0))

    @property
    def mean(self) -> FloatArray:
        """The mean of the reference over all trajectories, (n_outputs,).

        Errors are relative to the RMS of the reference about it: an output far from 0, as a
        temperature in K, would flatter the surrogate otherwise.
        """
        return np.asarray(np.concatenate([c.reference for c in self.comparisons]).mean(axis=0))

    def relative(self, error: FloatArray, reference: FloatArray) -> FloatArray:
        """Return the RMSE over the RMS of the reference about ``mean``, shape (n_outputs,).

        Both arguments have the shape (n, n_outputs), of all trajectories or of some. A reference
        that is constant throughout counts as tiny, so that the figure stays finite.
        """
        return relative_rmse(error, size_about(reference, self.mean))

    def figures(self) -> ValidationFigures:
        """Return the figures, as ``report.json`` holds their dump."""
        return ValidationFigures(
            fmu=self.surrogate.name,
            trajectories=len(self.comparisons),
            failed=sum(comparison.failed for comparison in self.comparisons),
            left_out=self.left_out,
            seed=self.task.seed,
            amplitude=self.task.amplitude,
            held_out=self.task.held_out,
            outputs=tuple(self._output(index) for index in range(len(self.surrogate.outputs))),
            excitations=tuple(self._excitations()),
            error_estimate=self._estimate(),
            timing=self._timing(),
            parameters=self._of_parameters(),
            tolerances=self._tolerances(),
        )

    def _of_parameters(self) -> ParameterFigures | None:
        """Return the errors by values of the physical parameters, where there are some."""
        names = tuple(parameter.name for parameter in self.surrogate.parameters)
        if not names:
            return None
        unseen, corners = (
            tuple(
                ParameterPoint(
                    values={name: c.parameters[name] for name in names},
                    relative_rmse=self._relative_rmse([c]),
                )
                for c in chosen
            )
            for chosen in (self.comparisons, self.corners)
        )
        return ParameterFigures(names=names, unseen=unseen, corners=corners)

    def _relative_rmse(self, chosen: Sequence[Comparison]) -> tuple[float, ...]:
        """Return the relative RMSE of each output over some trajectories."""
        reference, error = _joined(chosen)
        return tuple(self.relative(error, reference).tolist())

    def _output(self, index: int) -> OutputFigures:
        signal = self.surrogate.outputs[index]
        reference, error = _joined(self.comparisons)
        single = [self._relative_rmse([c])[index] for c in self.comparisons]
        plain = [None if c.plain is None else c.plain.surrogate for c in self.comparisons]

        def relative_of(others: Sequence[FloatArray | None]) -> float | None:
            """Give the relative RMSE of other outputs or of another run, if there are any."""
            pairs = zip(others, self.comparisons, strict=True)
            errors = [other - c.reference for other, c in pairs if other is not None]
            if not errors:
                return None
            return float(self.relative(np.concatenate(errors), reference)[index])

        return OutputFigures(
            name=signal.name,
            unit=signal.unit,
            rms_reference_about_mean=float(rms(reference - self.mean)[index]),
            rmse=float(rms(error)[index]),
            relative_rmse=float(self.relative(error, reference)[index]),
            max_error=float(np.max(np.abs(error[:, index]))),
            usual_level=float(self.usual_error()[index]),
            relative_rmse_of_trajectories=_quantiles(single),
            model_relative_rmse=relative_of([c.model for c in self.comparisons]),
            plain_relative_rmse=relative_of(plain),
            relative_noise_floor=self._noise_floor(index, reference),
            free_relative_rmse=relative_of([c.free for c in self.comparisons]),
        )

    def _noise_floor(self, index: int, reference: FloatArray) -> float | None:
        """Return the RMS of the noise of records over the RMS of the output, where it is known."""
        size = size_about(reference, self.mean)
        return None if self.noise is None else float(self.noise[index]) / float(size[index])

    def _excitations(self) -> Iterator[KindFigures]:
        for index, motion in enumerate(rules_of(self.recipe).motions(self.recipe)):
            chosen = [c for c in self.comparisons if c.kind == index]
            if chosen:
                yield KindFigures(
                    name=motion.name,
                    kind=motion.kind,
                    trajectories=len(chosen),
                    relative_rmse=self._relative_rmse(chosen),
                )

    def _estimate(self) -> EstimateFigures | None:
        if not self.surrogate.estimates_errors:
            return None
        signals, (estimates, errors) = self.surrogate.outputs, _estimated(self.used)
        outputs = self._deviations(estimates, errors)
        planned = self.comparisons if self.surrogate.planned else ()
        others = [c.plain for c in planned if c.plain is not None]
        euclidean = None
        if len(signals) > 1 and len({signal.unit for signal in signals}) == 1 and outputs:
            norms = (np.linalg.norm(values, axis=1) for values in (estimates, errors))
            euclidean = deviation_of(*norms)
        return EstimateFigures(
            span_samples=self.surrogate.estimated_samples,
            without_floor=outputs,
            euclidean=euclidean,
            plain=self._deviations(*_estimated(others)) if others else (),
        )

    def _deviations(self, estimates: FloatArray, errors: FloatArray) -> tuple[Deviation, ...]:
        """Return how far estimates are off the true errors, (N, n_outputs) each, by output."""
        return tuple(
            deviation_of(estimates[:, index], errors[:, index], signal.name)
            for index, signal in enumerate(self.surrogate.outputs)
            if np.any(errors[:, index] > 0)  # relative to no error at all, nothing deviates
        )

    def _tolerances(self) -> tuple[ToleranceRow, ...]:
        """Return tolerances by false alarms, which only samples in range can show."""
        bound, surrogate = self.surrogate.bound, self.surrogate
        if bound is None or not self.in_range:
            return ()
        bounds, outside = [], []
        for c in self.trusted:
            if c.trust is not None:
                bounds.append(c.trust.bounds)
                strayed = c.trust.in_domain == 0
                if surrogate.output_ranges is not None:
                    strayed = strayed | ~surrogate.outputs_in_range(c.surrogate)
                outside.append(strayed)
        if not bounds:
            return ()
        every = np.concatenate(bounds), np.concatenate(outside)
        return tolerance_rows(*every, surrogate.error_tolerances)

    def _timing(self) -> Timing:
        """Return times per step; with measured records only the FMU has one.

        The FMU's is the median of its steps. The reference is timed by whole trajectories, which
        other programs may slow down: the fastest one counts.
        """
        times = [np.concatenate([c.step_seconds[i] for c in self.comparisons]) for i in (0, 1)]
        fmu = float(np.median(times[0]))
        if not len(times[1]):
            return Timing(fmu_step_us=1e6 * fmu)
        reference = float(np.min(times[1]))
        return Timing(fmu_step_us=1e6 * fmu, reference_step_us=1e6 * reference, speed=self.speed)


def _where_trusted(comparisons: Sequence[Comparison]) -> tuple[Comparison, ...]:
    """Return the parts in which bounds count, of comparisons that have some."""
    parts = [comparison.where_trusted() for comparison in comparisons]
    return tuple(one for one in parts if one is not None)


def _estimated(comparisons: Sequence[Comparison]) -> tuple[FloatArray, FloatArray]:
    """Return all scored estimates, and the true errors, (N, n_outputs) each."""
    chosen = [c for c in comparisons if c.estimate is not None]
    errors = np.concatenate([c.true_error for c in chosen])
    estimates = np.concatenate([c.estimate for c in chosen if c.estimate is not None])
    scored = ~np.isnan(errors).any(axis=1)
    return estimates[scored], errors[scored]


def _joined(comparisons: Sequence[Comparison]) -> tuple[FloatArray, FloatArray]:
    """Return reference and error of all samples of comparisons, shape (n, n_outputs) each."""
    reference = np.concatenate([c.reference for c in comparisons])
    return reference, np.concatenate([c.error for c in comparisons])


def _quantiles(values: Sequence[float]) -> Quantiles:
    median, low, high = np.quantile(values, [0.5, 0.1, 0.9])
    return Quantiles(median=float(median), p10=float(low), p90=float(high))
