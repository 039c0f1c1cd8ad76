"""A problem is what a network family is given to learn from.

Inputs and outputs of motions go through four forms, each of which the next step needs. A ``Split``
of the store has them in their units. ``Seen`` has them scaled, as features that a network sees.
``WindowData`` cut windows out of them on the fly, at every phase, for networks without a state.
``Segments`` are long pieces of them side by side, for networks with a state.
"""

from __future__ import annotations

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
"""The trajectories of a problem: to learn from, to choose by, and beyond the inputs' range."""

Seen = tuple[torch.Tensor, torch.Tensor]
"""Features (n_trajectories, N, n_features) and outputs (n_trajectories, N + 1, n_outputs), both in
scaled units."""


def seen(features: FeatureMap, inputs: FloatArray, outputs: FloatArray) -> Seen:
    """Return scaled inputs, (n_trajectories, N, n_inputs), and outputs as a network sees them.

    They have the precision of the features and of the outputs.
    """
    return torch.as_tensor(features.along(inputs)), torch.as_tensor(outputs)


@dataclass(frozen=True, eq=False)
class Physical:
    """Physical parameters of trajectories: each trajectory has its own values.

    Attributes:
        basis: the polynomials that the weights follow.
        training: values in the parameters' units, shape (n_trajectories, n_parameters).
        validation, beyond: the same of the other data; ``beyond`` is None if there are none.
        eigenvalues: eigenvalues in 1/s of the system linearized at rest, at the corners of the
            parameters' box; None where they are not known.
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
    """A problem is one regression, from features of input windows to scaled outputs.

    Attributes:
        window: the surrogate's window.
        features: what the network sees of the inputs.
        training: trajectories to learn from.
        validation: trajectories by which the weights are chosen.
        checkpoint: file that holds the state of an interrupted fit.
        eigenvalues: eigenvalues in 1/s of the system linearized at rest, one of each conjugate
            pair, without those of rigid-body modes; None where they are not known, as for
            measured records.
        beyond: trajectories beyond the inputs' range, learnt with a low weight; None if there are
            none.
        start: network that the fit begins with; None if it searches for one.
        physical: the physical parameters that the weights shall follow; None if there are none.
        noise: samples of the outputs' noise alone in scaled units, (N, n_outputs) each, by whose
            spectrum residuals are weighted; None where it is not known.
    """

    window: Window
    features: FeatureMap
    training: Seen
    validation: Seen
    checkpoint: Path
    eigenvalues: NDArray[np.complex128] | None = None
    beyond: Seen | None = None
    start: StateSpace | None = None
    physical: Physical | None = None
    noise: tuple[FloatArray, ...] | None = None


@dataclass(frozen=True, eq=False)
class FittedNetwork:
    """A network was fitted to a problem.

    Attributes:
        network: the network, frozen.
        history: course of its training.
        table: the recipe's table of the network, with the sizes that were found.
    """

    network: Network
    history: History
    table: NetworkTable
