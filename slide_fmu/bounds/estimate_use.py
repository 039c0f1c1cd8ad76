"""An error estimate is kept only if it predicts errors better than the best constant.

Bounds and estimates are fitted with inputs known to the end of each step. What forecasts of the
inputs add in the plain call, the FMU measures itself.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.measures import best_constant, moving_rms
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.trajectories import Split
from slide_fmu.surrogate.surrogate import Surrogate


def known_predictions(surrogate: Surrogate, split: Split) -> FloatArray:
    """Predict the outputs at samples 1 .. N, (n_trajectories, N, n_outputs), of a split.

    Inputs are known. Every trajectory has its own parameters.
    """
    if split.parameters is None:
        return surrogate.predict_newest_batch(split.inputs)
    names = [parameter.name for parameter in surrogate.parameters]
    rows = [dict(zip(names, row, strict=True)) for row in split.parameters.tolist()]
    pairs = zip(split.inputs, rows, strict=True)
    return np.stack([surrogate.predict_newest(inputs, given) for inputs, given in pairs])


MOST_JUDGED = 150
"""Largest number of trajectories that an estimate is judged on."""


def useless_estimate(surrogate: Surrogate, split: Split) -> str | None:
    """Say why the error estimate of a surrogate is omitted; None if it is useful.

    It is judged on trajectories in range that the surrogate was not trained on, and that do not
    serve for the FMU's figures. It is omitted if, for one of the outputs, its mean relative
    deviation from the true errors, over all spans in ``MOST_JUDGED`` trajectories of the
    split at most, is not below that of the best constant.
    """
    split = _some_of(split, MOST_JUDGED)
    span = surrogate.estimated_samples
    first = surrogate.window.memory_length
    if surrogate.estimator is None:
        assert surrogate.bound is not None
        first = max(first, surrogate.bound.estimate_length - span)
    given = known_predictions(surrogate, split)
    errors = (given - split.outputs[:, 1:])[:, first:]
    if errors.shape[1] < span:
        return None
    true = np.concatenate([moving_rms(one, span) for one in errors])
    last = errors.shape[1] - span + 1
    estimates = _estimates(surrogate, split, given)[:, -last:].reshape(-1, errors.shape[2])
    for index, signal in enumerate(surrogate.outputs):
        known = true[:, index] > 0
        if not known.any():
            continue
        error, estimate = true[known, index], estimates[known, index]
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


def _some_of(split: Split, most: int) -> Split:
    """Return trajectories from all over a split; those of a record file stand together in it."""
    count = len(split.inputs)
    chosen = np.linspace(0, count - 1, min(most, count)).round().astype(np.int64)
    return split.chosen(chosen)


def _estimates(surrogate: Surrogate, split: Split, given: FloatArray) -> FloatArray:
    """Return the estimates that belong to these outputs, both (n_trajectories, N, n_outputs)."""
    if surrogate.estimator is not None:
        return np.stack([surrogate.estimate_error(inputs) for inputs in split.inputs])
    assert surrogate.bound is not None
    scaled = surrogate.input_scaling.apply(split.inputs)
    predicted = surrogate.output_scaling.apply(given)
    return surrogate.bound.estimates(scaled, predicted) * surrogate.output_scaling.scale
