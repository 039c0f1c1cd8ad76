"""The physical parameters of a surrogate are fitted to measured records."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from slide_fmu.apps.calibrate.measurements import Arrays, Measurements
from slide_fmu.apps.calibrate.problem import CalibrationProblem
from slide_fmu.apps.calibrate.remarks import remarks_about
from slide_fmu.apps.calibrate.result import END, Calibration, FittedParameter, OutputFit
from slide_fmu.apps.calibrate.search import best_fit, noise_of
from slide_fmu.apps.calibrate.uncertainty import Uncertainty, uncertainty_of
from slide_fmu.core.parameters import Parameter, checked_values
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.export import Provenance, load, read_fmu
from slide_fmu.report.run_figures import released_figures
from slide_fmu.surrogate.surrogate import Surrogate


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
    found, known = _loaded(surrogate)
    own_error, held = known if own_error is None else own_error, dict(fixed or {})
    free = free_parameters(found, held)
    measured = Measurements.of(found, inputs, outputs, len(free))
    problem = CalibrationProblem(found, measured, free, held)
    errors = _checked_errors(found, own_error)
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
    found = load(surrogate)
    if not zipfile.is_zipfile(surrogate):
        return found, None
    return found, released_error(read_fmu(Path(surrogate))[1], found)


def released_error(provenance: Provenance | None, surrogate: Surrogate) -> list[float] | None:
    """Return the relative RMSE of each output that ``slide-fmu run`` wrote into an FMU, if any."""
    names = [signal.name for signal in surrogate.outputs]
    try:
        measured = released_figures(provenance)
        outputs = [] if measured is None else measured.validation["in range"].outputs
        found = {output.name: output.relative_rmse for output in outputs}
        return [found[name] for name in names]
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
