"""Dataclasses hold the errors of an FMU against its reference, for ``report.json`` and the FMU.

Errors are in the outputs' units; relative errors are divided by the RMS of the reference about its
mean. None stands for a figure that was not measured. Lists of shares have a value per output.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import model_validator
from pydantic.dataclasses import dataclass as checked_dataclass

from slide_fmu.core.figures import optional, spread
from slide_fmu.core.signals import Hold


@dataclass(frozen=True, kw_only=True)
class Quantiles:
    """These are the median, the 10th and the 90th percentile of relative errors."""

    median: float
    p10: float
    p90: float


@dataclass(frozen=True, kw_only=True)
class OutputFigures:
    """These are the errors of one output.

    Attributes:
        p95_error: 95 % quantile of the absolute errors, as an importer runs the FMU.
        relative_rmse_of_trajectories: relative RMSE of the trajectories one by one.
        model_relative_rmse: error of the model that made the data, where the reference is another.
        plain_relative_rmse: error where an importer sets moving inputs to their present values.
        relative_noise_floor: RMS of the noise of the measured output, where it is known.
        free_relative_rmse: error of the network run freely along records.
    """

    name: str
    unit: str
    rms_reference_about_mean: float
    rmse: float
    relative_rmse: float
    max_error: float
    p95_error: float
    relative_rmse_of_trajectories: Quantiles
    model_relative_rmse: float | None = optional()
    plain_relative_rmse: float | None = optional()
    relative_noise_floor: float | None = optional()
    free_relative_rmse: float | None = optional()


@dataclass(frozen=True, kw_only=True)
class KindFigures:
    """These are the relative RMSEs on one kind of excitation, or one file, one per output."""

    name: str
    kind: str
    trajectories: int
    relative_rmse: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Deviation:
    """This is the deviation of error estimates from true errors.

    Attributes:
        name: the output; None of the norm of all outputs.
        mean, p95: mean and 95 % quantile of the relative deviation.
        constant_mean, constant_p95: the same figures of the best constant.
        too_small_share: share of errors that are much larger than their estimate.
        too_small_factor: 95 % quantile of error over estimate.
        rank_correlation: of estimates and errors; None where one of both is constant.
    """

    name: str | None = optional()
    mean: float
    p95: float
    constant_mean: float
    constant_p95: float
    too_small_share: float
    too_small_factor: float
    rank_correlation: float | None


@dataclass(frozen=True, kw_only=True)
class EstimateFigures:
    """These are the deviations of error estimates over a span of samples.

    Outputs without any error are left out; the norm is given where all outputs have one unit.
    """

    span_samples: int
    without_floor: tuple[Deviation, ...]
    euclidean: Deviation | None = optional()


@dataclass(frozen=True, kw_only=True)
class OutputBound:
    """These are the measures of the error bound of one output.

    Attributes:
        coverage: share of the samples whose error stays below the bound.
        coverage_of_worst_trajectories: the 5 % worst trajectories have less.
        width: mean bound over the quantile of the errors.
        skill: 1 minus the ratio of the pinball losses of the bound and of the best constant.
        rank_correlation: of bounds and errors; None where one of both is constant.
    """

    name: str
    coverage: float
    coverage_of_worst_trajectories: float
    width: float | None
    skill: float | None
    rank_correlation: float | None


@dataclass(frozen=True, kw_only=True)
class DomainFigures:
    """These are the shares of samples outside of the domain, and of trajectories often outside.

    Attributes:
        untrusted: share of samples at which ``trusted`` is false; None of an FMU without it.
    """

    flagged: float
    trajectories_flagged: float
    untrusted: float | None = optional()


@dataclass(frozen=True, kw_only=True)
class Harm:
    """This is the harm that errors do, as shares of samples.

    A sample is flagged where ``trusted`` is false; of an FMU without it, outside of the domain.

    Attributes:
        harmful: samples with an error far above the usual one.
        harmful_flagged: share of these that are flagged; None without any.
        harmless_flagged: the same share of the harmless samples.
        harmful_unnoticed: harmful ones, not flagged, whose bound does not cover the error.
    """

    harmful: float
    harmful_flagged: float | None
    harmless_flagged: float | None
    harmful_unnoticed: float


@dataclass(frozen=True, kw_only=True)
class KindBound(DomainFigures):
    """These are the measures of bound and domain on one kind of excitation."""

    name: str
    trajectories: int
    coverage: tuple[float, ...]
    lowest_coverage: tuple[float, ...]
    harm: Harm | None = optional()


@dataclass(frozen=True, kw_only=True)
class Covered:
    """This is the share of the samples that bounds cover."""

    coverage: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class ToleranceRow:
    """These are the tolerances of all outputs with which a share of samples is not trusted.

    Attributes:
        alarms: the share, of samples in range.
        tolerances: in the outputs' units; None where domain and ranges alone give more alarms.
    """

    alarms: float
    tolerances: tuple[float, ...] | None


@dataclass(frozen=True, kw_only=True)
class BoundFigures(DomainFigures):
    """These are the measures of error bound and domain.

    Attributes:
        tolerances: by the share of false alarms; only in range, of an FMU with ``trusted``.
        plain, known_to_step_end: coverage in both calls of an FMU whose inputs move.
        harm: where the usual error in range is known.
    """

    confidence: float
    outputs: tuple[OutputBound, ...]
    plain: Covered | None = optional()
    known_to_step_end: Covered | None = optional()
    harm: Harm | None = optional()
    excitations: tuple[KindBound, ...]
    tolerances: tuple[ToleranceRow, ...] = optional(())


@dataclass(frozen=True, kw_only=True)
class Timing:
    """These are median times of a step; the reference has none where it was measured."""

    fmu_step_us: float
    reference_step_us: float | None = optional()
    speedup: float | None = optional()


@checked_dataclass(frozen=True, kw_only=True)
class ParameterPoint:
    """These are the relative RMSEs, one per output, at values of the physical parameters."""

    values: Mapping[str, float] = spread()
    relative_rmse: tuple[float, ...]

    @model_validator(mode="before")
    @classmethod
    def _gathered(cls, given: Any) -> Any:
        """Gather the parameter values of a dump, which holds them and the errors in one table."""
        if not isinstance(given, dict):
            return given
        values = {key: value for key, value in given.items() if key != "relative_rmse"}
        return {"values": values, "relative_rmse": given.get("relative_rmse")}


@dataclass(frozen=True, kw_only=True)
class ParameterFigures:
    """These are the errors at unseen values of the physical parameters, and at their corners."""

    names: tuple[str, ...]
    unseen: tuple[ParameterPoint, ...]
    corners: tuple[ParameterPoint, ...]


@dataclass(frozen=True, kw_only=True)
class PlainOutput:
    """These are the errors of an output in the plain call.

    Errors whose name ends in ``_rmse`` are in the output's unit, all others are relative.

    Attributes:
        smooth: under sums of sines.
        smooth_worst: largest error of one such motion, relative to its own truth.
        smooth_covered: part of the samples under smooth inputs that the error bound covers.
        rough: under the recipe's kinds of excitation.
        known_to_step_end: with moving inputs that are known to the step's end.
        smooth_if_held: where inputs are held, the error if the user's inputs are smooth: the
            effect of the delay of half a step, and the FMU's own error.
    """

    name: str
    unit: str
    smooth: float | None
    smooth_worst: float | None = None
    smooth_rmse: float | None
    smooth_covered: float | None = None
    rough: float
    rough_rmse: float
    known_to_step_end: float | None
    smooth_if_held: float | None


@dataclass(frozen=True, kw_only=True)
class PlainCallFigures:
    """These are the errors of the plain call.

    Attributes:
        late_s: time in s by which smooth inputs are late; None where they are not.
        smooth_hz: band of the smooth inputs; None where they were not measured.
        sentence: the largest errors in words.
    """

    hold: Hold
    late_s: float | None
    outputs: tuple[PlainOutput, ...]
    smooth_hz: tuple[float, float] | None
    sentence: str

    def worst(self, key: PlainError) -> float | None:
        """Return the largest error of a name; None where no output has it."""
        return worst_of(getattr(output, key) for output in self.outputs)


PlainError = Literal[
    "smooth", "smooth_worst", "smooth_covered", "rough", "known_to_step_end", "smooth_if_held"
]
"""Names of the relative errors of the plain call."""


@dataclass(frozen=True, kw_only=True)
class RestOutput:
    """These are the errors of an output where inputs are constant."""

    name: str
    unit: str
    relative_rmse: float
    largest_error: float
    covered: float | None = optional()


@dataclass(frozen=True, kw_only=True)
class RestFigures:
    """These are the errors at points of the inputs, and where the reference failed."""

    points: int
    outputs: tuple[RestOutput, ...]
    failed: tuple[str, ...] = optional(())

    @property
    def worst(self) -> float:
        """The largest relative RMSE of the outputs."""
        return max(output.relative_rmse for output in self.outputs)


@dataclass(frozen=True, kw_only=True)
class BoxFigures:
    """These are the errors at constant inputs: at the corners of their ranges, and inside."""

    corners: RestFigures | None = optional()
    steady: RestFigures | None = optional()

    @property
    def groups(self) -> dict[str, RestFigures]:
        """Both groups of points by name, as far as they were measured."""
        both = {"corners": self.corners, "steady": self.steady}
        return {name: group for name, group in both.items() if group is not None}


@dataclass(frozen=True, kw_only=True)
class TryFigures:
    """These are the errors on one input as users set it, over its whole record.

    Attributes:
        kind: its kind in words.
        inputs: a text by which it can be repeated.
        over_bound: largest error over its bound of 95 % where the FMU says nothing.
        output, unit: the output with this error.
        relative_rmse: of this output; None where its reference rests.
        largest_error: of this output, in its unit.
        flagged: share of samples that the FMU reports.
        harmful, unnoticed: shares of samples, as in ``Harm``.
    """

    kind: str
    inputs: str
    over_bound: float
    output: str
    unit: str
    relative_rmse: float | None
    largest_error: float
    flagged: float
    harmful: float
    unnoticed: float


@dataclass(frozen=True, kw_only=True)
class SearchFigures:
    """These are the results of a search for unnoticed errors, from each start.

    Attributes:
        starts: number of unseen trajectories that the search began with.
        changes_tried: number of changes from each start.
        confidences: the usual confidence of bounds, and the highest.
        before, after: largest error over its bound in the domain, at the usual confidence.
        after_highest: the same after the search, at the highest confidence.
        broken, broken_at_highest: number of starts after which a bound is broken.
        flag: the variable that must be true where errors count.
        tries: errors on inputs as users set them, the worst first; empty if none was tried.
        failed_tries: number of inputs that the reference could not be simulated on.
    """

    starts: int
    changes_tried: int
    confidences: tuple[float, float]
    before: tuple[float, ...]
    after: tuple[float, ...]
    after_highest: tuple[float, ...]
    broken: int
    broken_at_highest: int
    flag: Literal["trusted", "in_domain"] = optional("in_domain")
    tries: tuple[TryFigures, ...] = optional(())
    failed_tries: int = optional(0)


@dataclass(frozen=True, kw_only=True)
class ResponseFigures:
    """These are deviations of a learnt response matrix from the exact one, and from causality."""

    largest_entry: float
    max_deviation_relative: float
    max_above_diagonal: float
    max_above_diagonal_relative: float


@dataclass(frozen=True, kw_only=True)
class ValidationFigures:
    """These are the figures of one validation.

    Attributes:
        failed: number of draws that the system could not simulate.
        left_out: errors of the system on trajectories beyond the range.
        amplitude: range of the factor on the excitation's amplitude.
        held_out: whether the kinds of excitation are those that the recipe holds out.
        plain_call, box: errors of the plain call and at constant inputs, of a validation in range.
    """

    fmu: str
    trajectories: int
    failed: int = optional(0)
    left_out: tuple[str, ...] = optional(())
    seed: int
    amplitude: tuple[float, float]
    held_out: bool = optional(False)
    outputs: tuple[OutputFigures, ...]
    excitations: tuple[KindFigures, ...]
    error_estimate: EstimateFigures | None
    error_bound: BoundFigures | None = optional()
    timing: Timing
    parameters: ParameterFigures | None = optional()
    plain_call: PlainCallFigures | None = optional()
    box: BoxFigures | None = optional()

    @property
    def worst(self) -> float:
        """The largest relative RMSE of the outputs."""
        return max(output.relative_rmse for output in self.outputs)

    @property
    def in_range(self) -> bool:
        """Tell whether trajectories are like those of the training and calibration."""
        return self.amplitude == (1.0, 1.0) and not self.held_out

    @property
    def moving(self) -> bool:
        """Tell whether the plain call has an error of its own, since inputs move."""
        return all(output.plain_relative_rmse is not None for output in self.outputs)


def worst_of(values: Iterable[float | None]) -> float | None:
    """Return the largest of the values that are known; None without any."""
    return max((value for value in values if value is not None), default=None)
