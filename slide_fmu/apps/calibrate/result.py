"""What a calibration found, as numbers and in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from slide_fmu.core.parameters import Parameter
from slide_fmu.core.units import behind

WHOLE = 0.9
"""An interval that covers more than this part of a range tells nothing."""

END = 1e-5
"""A value within this part of half a range from its end lies there."""

ALIKE, WIDE = 0.95, 0.1
"""Parameters that are correlated by more can hardly be told apart, where an interval covers more
than such a part of its range."""

POOR = 0.3
"""A relative RMSE above this one says that surrogate and record do not belong together."""


@dataclass(frozen=True, kw_only=True)
class ParameterFit:
    """This is a fitted parameter with its 95 % interval, as JSON files hold it."""

    name: str
    unit: str
    value: float
    interval: tuple[float, float]
    range: tuple[float, float]
    remark: str | None


@dataclass(frozen=True)
class FittedParameter:
    """A FittedParameter is one that was fitted.

    Attributes:
        parameter: its name, unit and range.
        value: the best value, in the parameter's unit.
        low, high: ends of its 95 % interval, in the same unit, within the range.
        share: part of the range, as transformed, that the interval covers.
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
        """One sentence for people where the value is not to be trusted as it is."""
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
    """An OutputFit tells how well an output is met, in its unit.

    Attributes:
        name, unit: those of the output.
        deviation: standard deviation of what was measured.
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
        """The RMSE at the fitted values over the standard deviation of what was measured."""
        return self.after / self.deviation if self.deviation > 0 else 0.0


@dataclass(frozen=True)
class OutputFigures(OutputFit):
    """These are the figures of a fit of an output, with its relative RMSE."""

    relative_rmse: float


@dataclass(frozen=True, kw_only=True)
class CalibrationFigures:
    """These are the figures of a calibration, as JSON files hold them."""

    fmu: str
    parameters: tuple[ParameterFit, ...]
    fixed: Mapping[str, float]
    outputs: tuple[OutputFigures, ...]
    correlation: tuple[tuple[float, ...], ...]
    samples: int
    correlation_time_s: float
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class Calibration:
    """A Calibration has the parameters of a surrogate that fit measured records best.

    Attributes:
        name: name of the surrogate.
        parameters: those that were fitted, in their order.
        fixed: values that were held, by name.
        outputs: how well the measured outputs are met.
        correlation: of the fitted parameters, a row for each.
        samples: number of samples that count.
        correlation_time: how long what drives the fit remembers, in s.
        remarks: one sentence each on what should be known about the result, for people.
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
        return {**{found.parameter.name: found.value for found in self.parameters}, **self.fixed}

    def figures(self) -> CalibrationFigures:
        """Return the figures."""
        return CalibrationFigures(
            fmu=self.name,
            parameters=tuple(found.figures() for found in self.parameters),
            fixed=self.fixed,
            outputs=tuple(
                OutputFigures(**vars(fit), relative_rmse=fit.relative) for fit in self.outputs
            ),
            correlation=self.correlation,
            samples=self.samples,
            correlation_time_s=self.correlation_time,
            remarks=self.remarks,
        )
