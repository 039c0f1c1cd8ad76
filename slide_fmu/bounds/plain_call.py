"""In the plain call an importer sets inputs to their values at the start of a step.

If inputs move linearly, the FMU forecasts them within the step. The forecast has an error of its
own, and an error bound must cover the error that the importer gets: so the FMU itself is run in
this way.

An error estimate is kept only if it predicts these errors better than the best constant.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from slide_fmu.core.measures import best_constant, moving_rms
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.run import UnpackedFmu, run_fmu, unpacked
from slide_fmu.data.stored_split import Split
from slide_fmu.fmu.export import export_fmu
from slide_fmu.surrogate.surrogate import Surrogate


def plain_predictions(surrogate: Surrogate, splits: Sequence[Split]) -> list[FloatArray]:
    """Predict the outputs at samples 1 .. N, (n_trajectories, N, n_outputs), of each split.

    Every trajectory has its own parameters. If inputs are held, they are known.

    Raises:
        CoSimulationError: the FMU reports an error.
    """
    if surrogate.hold == "zero_order":
        return [_known(surrogate, split) for split in splits]
    alone = dataclasses.replace(surrogate, estimator=None, bound=None)
    with TemporaryDirectory(prefix="slide_fmu_plain_") as folder:
        path = export_fmu(alone, Path(folder) / f"{surrogate.name}.fmu")
        with unpacked(path) as fmu:
            return [_plain(surrogate, fmu, split) for split in splits]


def used_predictions(surrogate: Surrogate, split: Split) -> FloatArray:
    """Predict the outputs as importers mostly run the FMU: planned motions are known ahead.

    Arguments, errors and shape of the result are as for ``plain_predictions``, of one split.
    """
    if surrogate.planned:
        return _known(surrogate, split)
    (found,) = plain_predictions(surrogate, [split])
    return found


def _plain(surrogate: Surrogate, fmu: UnpackedFmu, split: Split) -> FloatArray:
    names, found = [signal.name for signal in surrogate.outputs], []
    for inputs, parameters in zip(split.inputs, _parameters(surrogate, split), strict=True):
        # inputs[k] is the value at the end of step k, so it is set before the next step
        now = np.concatenate([inputs[:1], inputs[:-1]])
        given = {signal.name: now[:, i] for i, signal in enumerate(surrogate.inputs)}
        found.append(run_fmu(fmu, given, names, parameters, surrogate.window.step).values[1:])
    return np.stack(found)


def _known(surrogate: Surrogate, split: Split) -> FloatArray:
    if split.parameters is None:
        return surrogate.predict_newest_batch(split.inputs)
    pairs = zip(split.inputs, _parameters(surrogate, split), strict=True)
    return np.stack([surrogate.predict_newest(inputs, given) for inputs, given in pairs])


def _parameters(surrogate: Surrogate, split: Split) -> list[dict[str, float]]:
    """Return the physical parameters of each trajectory by name; empty if there are none."""
    if split.parameters is None:
        return [{} for _ in split.inputs]
    names = [parameter.name for parameter in surrogate.parameters]
    return [dict(zip(names, row, strict=True)) for row in split.parameters.tolist()]


def useless_estimate(surrogate: Surrogate, split: Split) -> str | None:
    """Say why the error estimate of a surrogate is omitted; None if it is useful.

    It is judged on trajectories in range that the surrogate was not trained on, and that do not
    serve for the FMU's figures. It is omitted if, for one of the outputs, its mean relative
    deviation from the true errors, over all spans in the split, is not below that of the best
    constant.
    """
    span = surrogate.estimated_samples
    first = surrogate.window.memory_length
    if surrogate.estimator is None:
        assert surrogate.bound is not None
        first = max(first, surrogate.bound.estimate_length - span)
    given = used_predictions(surrogate, split)
    errors = (given - split.outputs[:, 1:])[:, first:]
    if errors.shape[1] < span:
        return None
    true = np.concatenate([moving_rms(one, span) for one in errors])
    last = errors.shape[1] - span + 1
    found = _estimates(surrogate, split, given)[:, -last:].reshape(-1, errors.shape[2])
    for index, signal in enumerate(surrogate.outputs):
        known = true[:, index] > 0
        if not known.any():
            continue
        error, estimate = true[known, index], found[known, index]
        own, constant = (
            float(np.mean(np.abs(value - error) / error))
            for value in (estimate, best_constant(error))
        )
        if not own < constant:
            return (
                "the FMU has no error estimate, since it would say no more than a constant: on "
                f"{len(split.inputs)} trajectories that nothing has learnt from it is "
                f"{100 * own:.3g} % off on average for {signal.name}, the best constant "
                f"{100 * constant:.3g} %"
            )
    return None


def _estimates(surrogate: Surrogate, split: Split, given: FloatArray) -> FloatArray:
    """Return the estimates of the FMU in the call (``used_predictions``) that gave these outputs.

    Both have the shape (n_trajectories, N, n_outputs).
    """
    if surrogate.estimator is not None:
        return np.stack([surrogate.estimate_error(inputs) for inputs in split.inputs])
    assert surrogate.bound is not None
    scaled = surrogate.input_scaling.apply(split.inputs)
    predicted = surrogate.output_scaling.apply(given)
    return surrogate.bound.estimates(scaled, predicted) * surrogate.output_scaling.scale
