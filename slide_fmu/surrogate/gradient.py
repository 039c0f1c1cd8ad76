"""Gradients of a surrogate's outputs are computed for whole input windows, in batches.

They serve trajectory optimisation: derivatives of windows by all their inputs, in reverse mode and
float64, with numpy only. An FMU gives the derivative by the newest inputs only
(``fmu/runtime/derivative/derivative.h``). For calibration there are derivatives of sequences
by the physical parameters, in forward mode.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.parameters import checked_values
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import checked_batch
from slide_fmu.features.base import PullBack
from slide_fmu.network.bytes import family_of
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.network.state_space.parameter_slopes import parameter_slopes
from slide_fmu.surrogate.surrogate import Surrogate


def gradient(surrogate: Surrogate, windows: NDArray[Any], weights: NDArray[Any]) -> FloatArray:
    """Compute the gradient of a weighted sum of the outputs (vector-Jacobian product).

    Args:
        surrogate: of any family, with any features.
        windows: physical inputs, shape (B, n_in, n_inputs), oldest sample first.
        weights: weights of the outputs of ``Surrogate.predict_windows``, shape (B, n_out,
            n_outputs).

    Returns:
        Derivative of sum(weights * outputs) of each window by its inputs, shape
        (B, n_in, n_inputs); in weight times output unit per input unit.

    Raises:
        ValueError: wrong shapes, or values that are not finite.
    """
    window = surrogate.window
    checked = _checked("weights", weights, (window.n_out, len(surrogate.outputs)))
    pull_back = _pull_back(surrogate, windows)
    if len(checked) != len(windows):
        raise ValueError(f"weights of {len(checked)} windows; expected those of {len(windows)}")
    return pull_back(checked)


def jacobian(surrogate: Surrogate, windows: NDArray[Any]) -> FloatArray:
    """Compute all derivatives of the outputs of windows by their inputs.

    Args:
        surrogate: as for ``gradient``.
        windows: inputs in their units, shape (B, n_in, n_inputs).

    Returns:
        Derivative of output sample i, channel j of a window by input sample k, channel l of it,
        shape (B, n_out, n_outputs, n_in, n_inputs); in output unit per input unit.

    Raises:
        ValueError: as for ``gradient``.
    """
    pull_back = _pull_back(surrogate, windows)
    n_out, n_outputs = surrogate.window.n_out, len(surrogate.outputs)
    result = np.empty((len(windows), n_out, n_outputs, *np.shape(windows)[1:]))
    for i, j in np.ndindex(n_out, n_outputs):
        weights = np.zeros((len(windows), n_out, n_outputs))
        weights[:, i, j] = 1.0
        result[:, i, j] = pull_back(weights)
    return result


def parameter_jacobian(
    surrogate: Surrogate,
    inputs: NDArray[Any],
    parameters: Mapping[str, float] | None = None,
) -> FloatArray:
    """Compute the derivatives of ``Surrogate.predict`` by the physical parameters.

    Args:
        surrogate: a surrogate with parameters.
        inputs: physical inputs of a sequence, shape (N, n_inputs).
        parameters: parameter values by name at which to differentiate, as for ``Surrogate.at``.

    Returns:
        Derivatives of the outputs at samples 1 .. N by each parameter, shape
        (N, n_outputs, n_parameters); in output unit per parameter unit.

    Raises:
        ValueError: the surrogate has no parameters, or as for ``Surrogate.predict``.
    """
    network, scale = surrogate.network, surrogate.output_scaling.scale
    if not isinstance(network, StateSpace) or not surrogate.parameters:
        raise ValueError(
            f"surrogate {surrogate.name!r} has no physical parameters; expected one that was "
            "learnt with some: there is nothing to differentiate by"
        )
    values, n_out = checked_values(surrogate.parameters, parameters or {}), surrogate.window.n_out

    def slopes(windows: FloatArray) -> FloatArray:
        scaled = surrogate.input_scaling.apply(windows)
        features = network.features.along(scaled).astype(np.float64)
        return parameter_slopes(network, features, values, n_out) * scale[:, None]

    return surrogate.in_blocks(inputs, slopes)


def _pull_back(surrogate: Surrogate, windows: NDArray[Any]) -> PullBack:
    """Map weights (B, n_out, n_outputs) to the gradient (B, n_in, n_inputs)."""
    window, network = surrogate.window, surrogate.network
    checked = _checked("windows", windows, (window.n_in, len(surrogate.inputs)))
    if len(checked) == 0:
        return lambda _weights: np.zeros(checked.shape)
    scaled = surrogate.input_scaling.apply(checked)
    of_features = network.features.pull_back(scaled)
    features = network.features.along(scaled).astype(np.float64)
    of_values = family_of(network).pull_back(network, features, window.n_out)

    def pull_back(weights: FloatArray) -> FloatArray:
        of_scaled = of_features(of_values(weights * surrogate.output_scaling.scale))
        return np.asarray(of_scaled / surrogate.input_scaling.scale)

    return pull_back


def _checked(name: str, values: NDArray[Any], shape: tuple[int, int]) -> FloatArray:
    array = checked_batch(name, values, shape)
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{name}: a value is not finite; expected numbers")
    return array
