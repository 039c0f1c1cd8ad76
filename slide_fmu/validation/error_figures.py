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
from slide_fmu.validation.trust_figures import BoundFigures


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
class LoopFigures:
    """These say how much larger an output's error becomes at an input, round a loop.

    Attributes:
        output, input: names of the signals.
        partner: the partner, in words.
        gain: relative error at the input over the relative error at the output, where it is
            largest.
        hz: frequency in Hz at which it is so large.
    """

    output: str
    input: str
    partner: str
    gain: float
    hz: float


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
    Of planned motions, the estimates are those with known inputs, and ``plain`` has those of the
    plain call.
    """

    span_samples: int
    without_floor: tuple[Deviation, ...]
    euclidean: Deviation | None = optional()
    plain: tuple[Deviation, ...] = optional(())


@dataclass(frozen=True, kw_only=True)
class Solved:
    """This is a model with one setting of its solver.

    Attributes:
        model: ``reference``, or ``model`` for the one that made the data where that is another.
        solver: name of what integrates it.
        setting: how finely, for people, as ``"rtol = 1e-06, atol = 1e-09"``.
        relative_error: RMS over the outputs of their relative RMSE against the finest reference.
        seconds: time that a simulated second takes, in s.
    """

    model: str
    solver: str
    setting: str
    relative_error: float
    seconds: float


@dataclass(frozen=True, kw_only=True)
class SpeedFigures:
    """These compare the time of an FMU with that of a model of equal accuracy.

    Attributes:
        finest: the reference as it is, which is the truth here.
        loosened: the fastest setting whose error is at most that of the FMU; the finest one where
            none was found.
        relative_error: of the FMU, as of ``Solved``, with inputs known to the step's end.
        seconds: time of set, doStep and get of the FMU through fmpy for a simulated second, in s.
        ratio: time of the loosened model over that of the FMU.
        can_be_loosened: whether there are other settings of the reference.
        complete: whether all of the search was done within the time for it.
    """

    finest: Solved
    loosened: Solved
    relative_error: float
    seconds: float
    ratio: float
    can_be_loosened: bool
    complete: bool


@dataclass(frozen=True, kw_only=True)
class Timing:
    """These are times of a step, of the FMU with all that it says of its error.

    Attributes:
        fmu_step_us: median of the FMU.
        reference_step_us: of the reference as it is; None where it was measured.
        speed: the comparison at equal accuracy; None where it was not made.
    """

    fmu_step_us: float
    reference_step_us: float | None = optional()
    speed: SpeedFigures | None = optional()


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
