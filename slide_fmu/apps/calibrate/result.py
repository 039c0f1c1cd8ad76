"""A calibration has results as numbers, and remarks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from slide_fmu.core.parameters import Parameter
from slide_fmu.core.units import behind

WHOLE = 0.9
"""An interval that covers more than this fraction of a range gives no information."""

END = 1e-5
"""A value is at the end of its range if it is within this fraction of half the range from it."""

ALIKE, WIDE = 0.95, 0.1
"""Parameters with a larger correlation can hardly be distinguished, if an interval covers more
than the second fraction of its range."""

POOR = 0.3
"""A larger relative RMSE means that surrogate and record do not belong together."""


@dataclass(frozen=True, kw_only=True)
class ParameterFit:
    """A ParameterFit is a fitted parameter with its 95 % interval, for JSON files."""

    name: str
    unit: str
    value: float
    interval: tuple[float, float]
    range: tuple[float, float]
    remark: str | None


@dataclass(frozen=True)
class FittedParameter:
    """A FittedParameter is a parameter with its fitted value.

    Attributes:
        parameter: its name, unit and range.
        value: the best value, in the parameter's unit.
        low, high: ends of its 95 % interval, in the same unit, within the range.
        share: fraction of the transformed range that the interval covers.
        at_end: whether the best value is an end of the range.
    """

    parameter: Parameter
    value: float
    low: float
    high: float
    share: float
    at_end: bool

    @property
    def remark(self) -> str | None:
        """A sentence for the user if the value is not reliable."""
        name, unit = self.parameter.name, self.parameter.unit
        if self.share > WHOLE:
            return (
                f"{name} is not determined by the record: its 95 % interval covers "
                f"{100 * self.share:.0f} % of its range; record inputs to which the outputs "
                "answer differently for other values, or fix it"
            )
        if self.at_end:
            return (
                f"{name} lies at the end of its range, {self.value:.6g}{behind(unit)}: the "
                "record may "
                "ask for a value outside; learn a surrogate with a wider range"
            )
        return None

    def figures(self) -> ParameterFit:
        """Return the figures."""
        parameter = self.parameter
        return ParameterFit(
            name=parameter.name,
            unit=parameter.unit,
            value=self.value,
            interval=(self.low, self.high),
            range=(parameter.low, parameter.high),
            remark=self.remark,
        )


@dataclass(frozen=True)
class OutputFit:
    """An OutputFit describes how well an output is matched, in its unit.

    Attributes:
        name, unit: of the output.
        deviation: standard deviation of the measurements.
        before: RMSE at the parameters' start values.
        after: RMSE at the fitted values.
    """

    name: str
    unit: str
    deviation: float
    before: float
    after: float

    @property
    def relative(self) -> float:
        """The RMSE at the fitted values over the standard deviation of the measurements."""
        return self.after / self.deviation if self.deviation > 0 else 0.0


@dataclass(frozen=True)
class CalibratedOutputFigures(OutputFit):
    """CalibratedOutputFigures are the figures of a fitted output, with its relative RMSE."""

    relative_rmse: float


@dataclass(frozen=True, kw_only=True)
class CalibrationFigures:
    """CalibrationFigures are the figures of a calibration, for JSON files."""

    fmu: str
    parameters: tuple[ParameterFit, ...]
    fixed: Mapping[str, float]
    outputs: tuple[CalibratedOutputFigures, ...]
    correlation: tuple[tuple[float, ...], ...]
    samples: int
    correlation_time_s: float
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class Calibration:
    """A Calibration has the parameters of a surrogate that fit measured records best.

    Attributes:
        name: name of the surrogate.
        parameters: the fitted parameters, in their order.
        fixed: values of fixed parameters, by name.
        outputs: how well the measured outputs are matched.
        correlation: of the fitted parameters, a row for each.
        samples: number of samples that count.
        correlation_time: correlation time of the scores of the fit, in s.
        remarks: sentences on the result for the user.
    """

    name: str
    parameters: tuple[FittedParameter, ...]
    fixed: dict[str, float]
    outputs: tuple[OutputFit, ...]
    correlation: tuple[tuple[float, ...], ...]
    samples: int
    correlation_time: float
    remarks: tuple[str, ...]

    @property
    def values(self) -> dict[str, float]:
        """Return the values of all parameters by name, as ``Surrogate.predict`` takes them."""
        return {**{fit.parameter.name: fit.value for fit in self.parameters}, **self.fixed}

    def figures(self) -> CalibrationFigures:
        """Return the figures."""
        return CalibrationFigures(
            fmu=self.name,
            parameters=tuple(fitted.figures() for fitted in self.parameters),
            fixed=self.fixed,
            outputs=tuple(
                CalibratedOutputFigures(**vars(fit), relative_rmse=fit.relative)
                for fit in self.outputs
            ),
            correlation=self.correlation,
            samples=self.samples,
            correlation_time_s=self.correlation_time,
            remarks=self.remarks,
        )
