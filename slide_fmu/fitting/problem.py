"""A problem has the data that a network family is trained on.

Inputs and outputs of motions go through four forms. A ``Split`` has them in their
units. ``FeatureData`` has them scaled, as features of a network. ``WindowData`` cut windows out of
them on the fly, at every phase, for networks without a state. ``Segments`` are long parts of them
in parallel, for networks with a state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import torch
from numpy.typing import NDArray

from slide_fmu.core.parameter_basis import ParameterBasis
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.history import History
from slide_fmu.network.base import Network
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.learning import NetworkTable

Which = Literal["training", "validation", "beyond"]
"""The trajectories of a problem: for training, for validation, and beyond the inputs' range."""

FeatureData = tuple[torch.Tensor, torch.Tensor]
"""Features (n_trajectories, N, n_features) and outputs (n_trajectories, N + 1, n_outputs), both in
scaled units."""

Sized = Callable[[NetworkTable], None]
"""Is called with the recipe's table of a network, with its sizes."""


def _nobody_waits(table: NetworkTable) -> None:
    """Let nobody know the sizes of a network."""


def features_and_outputs(
    features: FeatureMap, inputs: FloatArray, outputs: FloatArray
) -> FeatureData:
    """Return scaled inputs, (n_trajectories, N, n_inputs), as features, with the outputs.

    Both have the precision of the features and of the outputs.
    """
    return torch.as_tensor(features.along(inputs)), torch.as_tensor(outputs)


@dataclass(frozen=True, eq=False)
class Physical:
    """Physical has the physical parameters of trajectories: each trajectory has its own values.

    Attributes:
        basis: the polynomials that the weights follow.
        training: values in the parameters' units, shape (n_trajectories, n_parameters).
        validation, beyond: values for the other data; ``beyond`` is None if there are none.
        eigenvalues: eigenvalues in 1/s of the system linearized at rest, at the corners of the
            parameters' box; None if they are not known.
    """

    basis: ParameterBasis
    training: FloatArray
    validation: FloatArray
    beyond: FloatArray | None = None
    eigenvalues: NDArray[np.complex128] | None = None

    def terms(self, which: Which) -> FloatArray:
        """Return the values of the polynomials, shape (n_trajectories, n_terms)."""
        return np.asarray(self.basis.values(getattr(self, which)))


@dataclass(frozen=True, eq=False)
class Problem:
    """A Problem is one regression, from features of input windows to scaled outputs.

    Attributes:
        window: the surrogate's window.
        features: the features of the network.
        training: training trajectories.
        validation: trajectories that select the weights.
        checkpoint: file for the state of an interrupted fit.
        eigenvalues: eigenvalues in 1/s of the system linearized at rest, one of each conjugate
            pair, without rigid-body modes; None if they are not known, as for measured records.
        beyond: trajectories beyond the inputs' range, trained on with a low weight; None if there
            are none.
        start: network that the fit begins with; None if it searches for one.
        physical: the physical parameters that the weights must follow; None if there are none.
        noise: samples of the outputs' noise in scaled units, (N, n_outputs) each, whose spectrum
            weights the residuals; None if it is not known.
        states: states of the system at the outputs of the training trajectories, in their units,
            shape (n_trajectories, N + 1, n_states), and those of the validation; None if they are
            not known.
        measured: whether the trajectories were cut out of measured records, in the order of time.
        sized: is called with the table of the network as soon as its sizes are known, if that is
            before the last run of the fit; whoever waits for the sizes can go on then.
    """

    window: Window
    features: FeatureMap
    training: FeatureData
    validation: FeatureData
    checkpoint: Path
    eigenvalues: NDArray[np.complex128] | None = None
    beyond: FeatureData | None = None
    start: StateSpace | None = None
    physical: Physical | None = None
    noise: tuple[FloatArray, ...] | None = None
    measured: bool = False
    states: tuple[FloatArray, FloatArray] | None = None
    sized: Sized = _nobody_waits


@dataclass(frozen=True, eq=False)
class FittedNetwork:
    """A FittedNetwork is a network fitted to a problem.

    Attributes:
        network: the network, frozen.
        history: course of its training.
        table: the recipe's table of the network, with the sizes found.
    """

    network: Network
    history: History
    table: NetworkTable
