"""The physical parameters of a surrogate are fitted to measured records.

The best fit is searched from several starts; outputs are weighted by their residuals. Remarks tell
the user what to know about the result.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from slide_fmu.apps.calibrate.measurements import Arrays, Measurements
from slide_fmu.apps.calibrate.result import (
    ALIKE,
    END,
    POOR,
    WIDE,
    Calibration,
    FittedParameter,
    OutputFit,
)
from slide_fmu.apps.calibrate.uncertainty import Uncertainty, uncertainty_of
from slide_fmu.core.measures import TINY, percent
from slide_fmu.core.parameters import Parameter, checked_values
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import Provenance, load, read_fmu
from slide_fmu.report.run_figures import released_figures
from slide_fmu.surrogate.gradient import parameter_jacobian
from slide_fmu.surrogate.surrogate import Surrogate

IMAGINARY_STEP = 1e-30
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
        moved = [p.unscaled(at + 1j * IMAGINARY_STEP) for p, at in zip(self.free, z, strict=True)]
        return np.imag(moved) / IMAGINARY_STEP

    def rmse(self, residuals: FloatArray) -> FloatArray:
        """Return the root mean square of residuals where something was measured, (n_outputs,)."""
        counts = np.maximum(np.isfinite(self.measurements.scored).sum(axis=0), 1)
        return np.asarray(np.sqrt((residuals**2).sum(axis=0) / counts))


LEAST_NOISE = 1e-6
"""Residuals below this fraction of an output's standard deviation are rounding of float32."""

KEPT = 3
"""Number of the tried points that are refined."""

ROUNDS = 3
"""Number of rounds that compute the weights of outputs from their residuals; they converge
fast."""

MOST_EVALUATIONS = 60


def best_fit(problem: CalibrationProblem, seed: int) -> FloatArray:
    """Find the parameters z within their ranges, shape (n_free,), that fit best.

    Every output is weighted by its noise, which is estimated from its residuals (iteratively
    reweighted least squares; scipy's trust region within bounds).

    Args:
        problem: the problem to solve.
        seed: seed of the Sobol points that are tried first, with the start values.
    """
    noise = np.maximum(problem.measurements.deviations, TINY)
    tried = _tried(problem, seed)
    costs = [float(np.sum((problem.residuals(z) / noise) ** 2)) for z in tried]
    best = [tried[index] for index in np.argsort(costs, kind="stable")[:KEPT]]
    refined = [_refined(problem, z, noise) for z in best]
    z, _ = min(refined, key=lambda point_and_cost: point_and_cost[1])
    for _ in range(ROUNDS - 1):
        z, _ = _refined(problem, z, noise_of(problem, problem.residuals(z)))
    return z


def noise_of(problem: CalibrationProblem, residuals: FloatArray) -> FloatArray:
    """Estimate the standard deviation of each output's noise from residuals, (n_outputs,)."""
    counts = np.isfinite(problem.measurements.scored).sum(axis=0)
    n_free = len(problem.free)
    share = np.sqrt(np.maximum(counts, 1) / np.maximum(counts - n_free, 1))
    floor = LEAST_NOISE * problem.measurements.deviations
    smallest = TINY  # outputs that were not measured are all 0
    return np.asarray(np.maximum(share * problem.rmse(residuals), np.maximum(floor, smallest)))


def _tried(problem: CalibrationProblem, seed: int) -> list[FloatArray]:
    """Return the start values and Sobol points, more of them for more parameters."""
    n_free = len(problem.free)
    points = qmc.Sobol(n_free, rng=np.random.default_rng(seed)).random_base2(min(3 + n_free, 6))
    start = np.array([p.scaled(np.float64(p.start_value)) for p in problem.free])
    return [start, *(2 * points - 1)]


def _refined(
    problem: CalibrationProblem, z: FloatArray, noise: FloatArray
) -> tuple[FloatArray, float]:
    """Refine a point; return it and its sum of squares."""
    fit = least_squares(
        lambda at: (problem.residuals(at) / noise).ravel(),
        np.clip(z, -1, 1),
        jac=lambda at: (problem.slopes(at) / noise[:, None]).reshape(-1, len(z)),
        bounds=(-1.0, 1.0),
        max_nfev=MOST_EVALUATIONS,
    )
    return np.asarray(fit.x), float(fit.cost)


def calibrate(
    surrogate: Surrogate | str | Path,
    inputs: Arrays,
    outputs: Arrays,
    *,
    fixed: Mapping[str, float] | None = None,
    own_error: Sequence[float] | None = None,
    seed: int = 0,
) -> Calibration:
    """Fit the physical parameters of a surrogate to measured records, with their uncertainty.

    Outputs are weighted by their noise, which is estimated from the residuals of the fit. The
    first samples of a record, ``Window.n_truncated`` of them, do not count, since the inputs
    before are unknown. The 95 % intervals hold for noise of any colour, and include the
    surrogate's own error.

    Args:
        surrogate: a surrogate with parameters, or its FMU or surrogate file.
        inputs: inputs of one record, shape (N, n_inputs), in the inputs' units and with the
            window's step; or a list of them for several records.
        outputs: measured outputs, shape (N, n_outputs), or a list of them: ``outputs[k]`` belongs
            to the value of ``Surrogate.predict`` at sample k. NaN where nothing was measured.
        fixed: values of parameters by name that are not fitted.
        own_error: relative RMSE of the surrogate, one number for each output, as a validation
            measures it (1 is 100 %). If None, the error that ``slide-fmu run`` wrote into the FMU
            is used; if it is not known, it does not count, and a remark says so.
        seed: seed of the points at which the search begins.

    Returns:
        The fitted values, their intervals, and how well they fit.

    Raises:
        FmuError, PayloadError: as for ``load``, if a path is given.
        ValueError: the surrogate has no parameters or all are fixed, shapes do not fit, a value is
            not finite or out of its range, or too few samples count.
    """
    own, known = _loaded(surrogate)
    own_error, held = known if own_error is None else own_error, dict(fixed or {})
    free = free_parameters(own, held)
    measured = Measurements.of(own, inputs, outputs, len(free))
    problem = CalibrationProblem(own, measured, free, held)
    errors = _checked_errors(own, own_error)
    z = best_fit(problem, seed)
    residuals = problem.residuals(z)
    noise = noise_of(problem, residuals)
    counts = np.isfinite(measured.scored).sum(axis=0)
    in_noise = np.sum(counts * (errors * measured.deviations / noise) ** 2)
    scaled = residuals / noise, problem.slopes(z) / noise[:, None]
    uncertainty = uncertainty_of(*scaled, float(in_noise))
    parameters = tuple(
        _fitted(p, *numbers) for p, *numbers in zip(free, z, uncertainty.half_widths, strict=True)
    )
    return _result(problem, parameters, residuals, uncertainty, own_error is not None)


def _loaded(surrogate: Surrogate | str | Path) -> tuple[Surrogate, list[float] | None]:
    """Return a surrogate, and its relative RMSE if it comes from an FMU that has it."""
    if isinstance(surrogate, Surrogate):
        return surrogate, None
    loaded = load(surrogate)
    if not zipfile.is_zipfile(surrogate):
        return loaded, None
    return loaded, released_error(read_fmu(Path(surrogate))[1], loaded)


def released_error(provenance: Provenance | None, surrogate: Surrogate) -> list[float] | None:
    """Return the relative RMSE of each output that ``slide-fmu run`` wrote into an FMU, if any."""
    names = [signal.name for signal in surrogate.outputs]
    try:
        measured = released_figures(provenance)
        outputs = [] if measured is None else measured.validation["in range"].outputs
        errors = {output.name: output.relative_rmse for output in outputs}
        return [errors[name] for name in names]
    except (KeyError, ValueError):  # figures of another program, or another version
        return None


def free_parameters(surrogate: Surrogate, fixed: Mapping[str, float]) -> tuple[Parameter, ...]:
    """Return the parameters of a surrogate that are not fixed.

    Raises:
        ValueError: there are none, or a fixed parameter is unknown or out of its range.
    """
    if not surrogate.parameters:
        raise ValueError(
            f"surrogate {surrogate.name!r} has no physical parameters; expected some to fit: "
            "learn it with a table parameters in its recipe"
        )
    checked_values(surrogate.parameters, fixed)
    free = tuple(p for p in surrogate.parameters if p.name not in fixed)
    if not free:
        raise ValueError(
            f"all parameters {list(fixed)} are fixed; expected one that is fitted: fix fewer"
        )
    return free


def _checked_errors(surrogate: Surrogate, own_error: Sequence[float] | None) -> FloatArray:
    count = len(surrogate.outputs)
    errors = np.zeros(count) if own_error is None else np.asarray(own_error, dtype=np.float64)
    if errors.shape != (count,) or not (np.isfinite(errors).all() and (errors >= 0).all()):
        raise ValueError(
            f"own_error = {own_error}; expected {count} numbers that are not negative, one for "
            "each output"
        )
    return errors


def _fitted(parameter: Parameter, z: float, half: float) -> FittedParameter:
    low, high = max(z - half, -1.0), min(z + half, 1.0)
    value, first, last = (
        float(np.clip(parameter.unscaled(at), parameter.low, parameter.high))
        for at in (z, low, high)
    )
    at_end = abs(z) > 1 - END
    return FittedParameter(parameter, value, first, last, float(0.5 * (high - low)), bool(at_end))


def _result(
    problem: CalibrationProblem,
    parameters: tuple[FittedParameter, ...],
    residuals: FloatArray,
    uncertainty: Uncertainty,
    error_known: bool,
) -> Calibration:
    surrogate, measured = problem.surrogate, problem.measurements
    starts = np.array([p.scaled(np.float64(p.start_value)) for p in problem.free])
    before, after = problem.rmse(problem.residuals(starts)), problem.rmse(residuals)
    fits = tuple(
        OutputFit(signal.name, signal.unit, *map(float, numbers))
        for signal, known, *numbers in zip(
            surrogate.outputs, measured.measured, measured.deviations, before, after, strict=True
        )
        if known
    )
    return Calibration(
        surrogate.name,
        parameters,
        problem.fixed,
        fits,
        tuple(tuple(row) for row in uncertainty.correlation.tolist()),
        len(measured.scored),
        uncertainty.correlation_time * surrogate.window.step,
        remarks_about(problem, parameters, fits, uncertainty, error_known),
    )


MOST_OUTSIDE = 0.01
"""Largest share of samples of a record outside the ranges of the training."""


def remarks_about(
    problem: CalibrationProblem,
    parameters: tuple[FittedParameter, ...],
    fits: tuple[OutputFit, ...],
    uncertainty: Uncertainty,
    error_known: bool,
) -> tuple[str, ...]:
    """Describe what is not determined, does not fit, or is not known, one sentence each."""
    remarks = [p.remark for p in parameters if p.remark is not None]
    remarks += [*_left_out(problem.measurements), *_alike(parameters, uncertainty)]
    remarks += [
        f"{fit.name} is met to {percent(fit.relative)} only: the surrogate does not follow "
        "this record; check units, columns, signs and the pairing of samples"
        for fit in fits
        if fit.relative > POOR
    ]
    if uncertainty.short:
        time = uncertainty.correlation_time * problem.surrogate.window.step
        remarks.append(
            f"residuals remember {time:.3g} s, and the record is only a few times as long: the "
            "intervals may be too narrow; record longer"
        )
    outside = _outside(problem)
    if outside > MOST_OUTSIDE:
        remarks.append(
            f"{percent(outside)} of the samples follow inputs outside the ranges of the "
            "training, where the surrogate may be wrong: the intervals do not include that"
        )
    if not error_known:
        remarks.append(
            "the surrogate's own error is not known: the intervals count noise alone; take an FMU "
            "that slide-fmu run has measured"
        )
    return tuple(remarks)


def _left_out(measurements: Measurements) -> list[str]:
    """Describe the parts of the records that do not count."""
    remarks, short = [], measurements.left_out
    if short:
        remarks.append(
            f"{len(short)} of {len(short) + len(measurements.inputs)} records or parts of "
            f"them, with {sum(short)} samples, are no longer than the {measurements.lead} samples "
            "that do not count, since the inputs before are unknown: they are left out; record "
            "longer at one go"
        )
    missing = ~np.isfinite(measurements.scored[:, measurements.measured])
    if missing.any():
        remarks.append(
            f"{int(missing.sum())} of {missing.size} measured outputs are missing and do not count"
        )
    return remarks


def _alike(parameters: tuple[FittedParameter, ...], uncertainty: Uncertainty) -> list[str]:
    """Name parameters that can hardly be distinguished."""
    names = [fit.parameter.name for fit in parameters]
    first, second = np.nonzero(np.triu(np.abs(uncertainty.correlation), 1) > ALIKE)
    return [
        f"{names[i]} and {names[j]} can hardly be distinguished by this record (correlation "
        f"{uncertainty.correlation[i, j]:.3f}): fix one of them, or record other inputs"
        for i, j in zip(first, second, strict=True)
        if max(parameters[i].share, parameters[j].share) > WIDE
    ]


def _outside(problem: CalibrationProblem) -> float:
    """Return the share of counting samples that follow inputs outside their ranges."""
    lead, records = problem.measurements.lead, problem.measurements.inputs
    known = np.concatenate([problem.surrogate.inputs_in_range(u)[lead:] for u in records])
    return float(1 - known.mean())
