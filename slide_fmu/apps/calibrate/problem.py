"""The least-squares problem of a calibration has residuals and derivatives by parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.apps.calibrate.measurements import Measurements
from slide_fmu.core.parameters import Parameter
from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.gradient import parameter_jacobian
from slide_fmu.surrogate.surrogate import Surrogate

TINY = 1e-30
"""An imaginary part too small to change real numbers; that of the result is the derivative."""


@dataclass(frozen=True, eq=False)
class CalibrationProblem:
    """A CalibrationProblem compares a surrogate with measurements; the noise is not part of it.

    The free parameters are z, their transforms scaled to -1 .. 1 over their ranges: in z the
    response is most nearly linear, and intervals about a fit are most nearly symmetric.

    Attributes:
        surrogate: a surrogate with parameters.
        measurements: the measurements.
        free: the parameters to fit, at least one.
        fixed: values of others by name, in their units.
    """

    surrogate: Surrogate
    measurements: Measurements
    free: tuple[Parameter, ...]
    fixed: dict[str, float]

    def values(self, z: FloatArray) -> dict[str, float]:
        """Return all parameters that are not at their start values, by name, in their units."""
        free = {p.name: float(p.unscaled(at)) for p, at in zip(self.free, z, strict=True)}
        return {**self.fixed, **free}

    def residuals(self, z: FloatArray) -> FloatArray:
        """Return predicted minus measured outputs, shape (T, n_outputs); 0 without measurement.

        The predictions are those of the FMU, step by step.
        """
        surrogate, values = self.surrogate.at(self.values(z)), self.measurements
        predicted = [surrogate.predict_newest(u)[values.lead :] for u in values.inputs]
        off = np.concatenate(predicted) - values.scored
        return np.where(np.isfinite(values.scored), off, 0.0)

    def slopes(self, z: FloatArray) -> FloatArray:
        """Return the derivatives of ``residuals`` by z, shape (T, n_outputs, n_free)."""
        at, values = self.values(z), self.measurements
        names = [parameter.name for parameter in self.surrogate.parameters]
        columns = [names.index(parameter.name) for parameter in self.free]
        jacobians = [
            parameter_jacobian(self.surrogate, u, at)[values.lead :] for u in values.inputs
        ]
        by_value = np.concatenate(jacobians)[..., columns]
        known = np.isfinite(values.scored)[..., None]
        return np.where(known, by_value * self._per_z(z), 0.0)

    def _per_z(self, z: FloatArray) -> FloatArray:
        """Return the derivative of each free parameter by its z, shape (n_free,)."""
        moved = [p.unscaled(at + 1j * TINY) for p, at in zip(self.free, z, strict=True)]
        return np.imag(moved) / TINY

    def rmse(self, residuals: FloatArray) -> FloatArray:
        """Return the root mean square of residuals where something was measured, (n_outputs,)."""
        counts = np.maximum(np.isfinite(self.measurements.scored).sum(axis=0), 1)
        return np.asarray(np.sqrt((residuals**2).sum(axis=0) / counts))
