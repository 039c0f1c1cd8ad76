"""Dataclasses hold the errors of an FMU against its reference, for ``report.json`` and the FMU.

Errors are in the outputs' units; relative errors are divided by the RMS of the reference about its
mean. None stands for a figure that was not measured. Lists of shares have a value per output.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import model_validator
from pydantic.dataclasses import dataclass as checked_dataclass

from slide_fmu.core.figures import optional, spread
from slide_fmu.validation.row import Row


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
        usual_level: 95 % quantile of the absolute errors with known inputs. In range, it is what
            harmful errors are compared with.
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
    usual_level: float
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
class SolverSetting:
    """This is a model with one setting of its solver.

    Attributes:
        model: ``reference``, or ``model`` for the one that made the data where that is another.
        solver: name of what integrates it.
        setting: how finely, for people, as ``"rtol = 1e-06, atol = 1e-09"``.
        relative_error: RMS over the outputs of their relative RMSE against the finest reference.
        seconds: CPU time that a simulated second takes, in s.
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
        relative_error: of the FMU, as of ``SolverSetting``, with inputs known to the step's end.
        seconds: CPU time of the FMU in ``fmpy.simulate_fmu`` for a simulated second, in s.
        ratio: time of the loosened model over that of the FMU.
        can_be_loosened: whether there are other settings of the reference.
        complete: whether all of the search was done within the time for it.
    """

    finest: SolverSetting
    loosened: SolverSetting
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
class ResponseFigures:
    """These are deviations of a learnt response matrix from the exact one, and from causality."""

    largest_entry: float
    max_deviation_relative: float
    max_above_diagonal: float
    max_above_diagonal_relative: float


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
class ValidationFigures:
    """These are the figures of one validation.

    Attributes:
        failed: number of draws that the system could not simulate.
        left_out: errors of the system on trajectories beyond the range.
        amplitude: range of the factor on the excitation's amplitude.
        held_out: whether the kinds of excitation are those that the recipe holds out.
        timing: times of a step; None in an FMU, which is the same file after each run.
        tolerances: of error bounds, by the share of false alarms; in range alone.
        rows: of this validation where it was made alone; a run has the rows of all together.
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
    timing: Timing | None = optional()
    parameters: ParameterFigures | None = optional()
    tolerances: tuple[ToleranceRow, ...] = optional(())
    rows: tuple[Row, ...] = optional(())

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
