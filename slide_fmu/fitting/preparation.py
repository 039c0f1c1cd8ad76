"""The data of a fit are prepared in one way, for every network.

The steps are scalings and knowledge of the system (``scales_of``), then the features of the
network (``prepare``), then the problem for a network family (``FitPreparation.problem``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from slide_fmu.core.parameter_basis import ParameterBasis
from slide_fmu.core.progress import Stages
from slide_fmu.core.scaling import Affine, range_scaling
from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.units import behind
from slide_fmu.data.trajectories import Split, Trajectories
from slide_fmu.features.base import FeatureOffer
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.checkpoint import checkpoint_key
from slide_fmu.fitting.feature_choice import choose_features, require_odd
from slide_fmu.fitting.feature_search import Trials, choices, search_features
from slide_fmu.fitting.history import History
from slide_fmu.fitting.problem import FeatureData, Physical, Problem, features_and_outputs
from slide_fmu.memory.modes import spectrum
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.learning import NetworkTable, StateSpaceRecipe
from slide_fmu.recipe.offers import offered_features
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Linearizable, Source

LEARNT_BY = {"window", "network", "training", "parameters"}
"""Tables of a recipe that determine the training of its network."""
STILL = 1e-9
"""A standard deviation below this part of the range is rounding, not motion."""

Eigenvalues = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Work:
    """Work has what all fits of one surrogate share.

    Attributes:
        case: the case to fit, with the source of its trajectories.
        folder: folder of the trajectories.
        checkpoints: folder for the states of interrupted trainings.
        progress: opens the progress of each training.
        known: surrogate whose network, features and scalings a fit begins with; None if it begins
            anew.
    """

    case: Case
    folder: Path
    checkpoints: Path
    progress: Stages
    known: Surrogate | None = None

    @property
    def recipe(self) -> Recipe:
        """The recipe of the case."""
        return self.case.recipe

    @cached_property
    def offered(self) -> FeatureOffer:
        """The values to form features from; inputs are scaled by their ranges, or as known."""
        source, known = self.case.source, self.known
        scaling = range_scaling(source.inputs) if known is None else known.input_scaling
        return offered_features(self.recipe, source, scaling)

    @property
    def device(self) -> torch.device:
        """The device for fits: a GPU if there is one."""
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")

    @property
    def linearized(self) -> bool:
        """Whether the fit begins with the eigenvalues of the linearized system.

        Its data are then in double precision, whatever the training's precision.
        """
        return isinstance(self.recipe.network, StateSpaceRecipe)

    @property
    def start(self) -> StateSpace | None:
        """The network that the fit begins with, if any."""
        network = None if self.known is None else self.known.network
        return network if isinstance(network, StateSpace) else None

    @cached_property
    def trajectories(self) -> Trajectories:
        """The trajectories of the recipe."""
        return Trajectories.of(self.case, self.folder)

    def splits(self, *names: str) -> list[Split]:
        """Read splits of the recipe."""
        return [self.trajectories.read(name) for name in names]


@dataclass(frozen=True, eq=False)
class Scales:
    """Scales have scalings and knowledge of a fit, and its key, before its features are chosen.

    Attributes:
        outputs: scaling of the outputs.
        eigenvalues: eigenvalues in 1/s of the system linearized at rest; None if they are not
            known or not useful.
        noise: samples of the outputs' noise in scaled units, (N, n_outputs) each; None if it is
            not known.
        training_key: key of all that decides the fit: its data, what is known of the system, the
            features that it offers, and the recipe. An interrupted fit goes on from the
            checkpoint that is named by it.
    """

    outputs: Affine
    eigenvalues: Eigenvalues | None
    noise: tuple[FloatArray, ...] | None
    training_key: str


@dataclass(frozen=True, eq=False)
class FitPreparation:
    """A FitPreparation fixes scalings and features for a fit, also for one to more trajectories.

    Attributes:
        work: what the fits share.
        scales: scalings, and knowledge of the system.
        table: the recipe's table of the network, with its features.
        features: the features of the network.
        tried: result of each choice of features by name; empty if there was only one.
    """

    work: Work
    scales: Scales
    table: NetworkTable
    features: FeatureMap
    tried: dict[str, History]

    def problem(self, splits: Sequence[Split], checkpoint: Path) -> Problem:
        """Return the problem of a network family for these trajectories.

        The splits are for training, for validation, and possibly beyond the range. ``checkpoint``
        is the file for the state of an interrupted fit.
        """
        work, scales = self.work, self.scales
        training, validation, *beyond = (self._data_of(split) for split in splits)
        return Problem(
            work.recipe.window.as_window,
            self.features,
            training,
            validation,
            checkpoint,
            scales.eigenvalues,
            beyond[0] if beyond else None,
            work.start,
            _physical(work.case, splits),
            scales.noise,
            work.case.source.sampled_only,
            _states(splits),
        )

    def _data_of(self, split: Split) -> FeatureData:
        recipe = self.work.recipe
        precision = "float64" if self.work.linearized else recipe.training.expert.precision
        scaled = self.work.offered.scaling.apply(split.inputs)
        values = features_and_outputs(
            self.features, scaled, self.scales.outputs.apply(split.outputs)
        )
        one, other = (part.to(self.work.device, getattr(torch, precision)) for part in values)
        return one, other


def scales_of(work: Work, splits: Sequence[Split], outputs: Affine | None = None) -> Scales:
    """Return scalings and knowledge of the system for a fit, and the key of the fit.

    The splits are as for ``FitPreparation.problem``. By default the outputs have the scaling of
    the known surrogate, or else of the first split.

    Raises:
        ValueError: signs are to be flipped of signals that are not symmetric, or a signal never
            moves.
        UnstableModeError: a mode of the system linearized at rest grows.
    """
    recipe, source = work.recipe, work.case.source
    if any(training.flips_signs for training in recipe.trainings()):
        require_symmetry((*source.inputs, *source.outputs))
    require_motion(source.inputs, splits[0].inputs)
    own = standard_deviation_scaling(source.outputs, splits[0])
    outputs = outputs or (own if work.known is None else work.known.output_scaling)
    eigenvalues = eigenvalues_at_rest(source) if work.linearized else None
    noise = source.noise_at_rest and tuple(part / outputs.scale for part in source.noise_at_rest)
    training_key = checkpoint_key(
        splits,
        str(eigenvalues),  # to the digits that all processors agree about
        work.offered.geometry,
        (work.offered.scaling, outputs),
        recipe.model_dump(mode="json", include=LEARNT_BY),
        work.known and work.known.to_bytes(),
        noise,
    )
    return Scales(outputs, eigenvalues, noise, training_key)


def prepare(work: Work, scales: Scales, splits: Sequence[Split]) -> FitPreparation:
    """Choose the features of a fit: of a known network, the named ones, or the best.

    Raises:
        RecipeError: the recipe leaves features open, although it has physical parameters.
        TrainingError: no choice of features has a finite error.
        ValueError: features never change, or are not odd although signs are flipped.
    """
    recipe, start = work.recipe, work.start
    table, tried = recipe.network, dict[str, History]()
    if start is not None:
        features = start.features
    else:
        require_chosen_features(recipe, work.offered, len(work.case.source.outputs))
        learnt, judging = splits[:2]
        both, window = (learnt, judging), recipe.window.as_window
        trials = Trials(work.offered, window, both, scales.eigenvalues, work.checkpoints)
        table, tried = search_features(table, recipe.training, trials, work.progress)
        scaled = work.offered.scaling.apply(splits[0].inputs)
        features = choose_features(table.feature_names(), work.offered, scaled)
    if recipe.training.flips_signs:
        require_odd(features)
    return FitPreparation(work, scales, table, features, tried)


def eigenvalues_at_rest(system: Source) -> Eigenvalues | None:
    """Return the eigenvalues in 1/s of the system linearized at rest under its start inputs.

    There is one eigenvalue of each conjugate pair, and none for rigid-body modes; None if the
    system does not offer linearization.
    """
    if not isinstance(system, Linearizable):
        return None
    start = np.array([signal.start_value for signal in system.inputs])
    at_rest = spectrum(system.linearize(system.rest_state(start)))
    return np.array([mode.eigenvalue for mode in at_rest.modes], dtype=np.complex128)


def _physical(case: Case, splits: Sequence[Split]) -> Physical | None:
    """Return the physical parameters of trajectories; None if the recipe has none.

    Eigenvalues are known if all corners of the parameters' box are linearized.
    """
    parameters, network = case.recipe.physical(), case.recipe.network
    if not parameters:
        return None
    assert isinstance(network, StateSpaceRecipe)
    basis = ParameterBasis.of_degree(parameters, network.parameter_degree)
    training, validation, *beyond = (split.parameters for split in splits)
    assert training is not None
    assert validation is not None
    corners = case.corners() if isinstance(case.source, Linearizable) else []
    of_corners = [eigenvalues_at_rest(case.at(corner).source) for corner in corners]
    known = [values for values in of_corners if values is not None]
    eigenvalues = np.concatenate(known) if known and len(known) == len(of_corners) else None
    return Physical(basis, training, validation, beyond[0] if beyond else None, eigenvalues)


def _states(splits: Sequence[Split]) -> tuple[FloatArray, FloatArray] | None:
    """Return the states of the trajectories for training and for validation, if both are known."""
    training, validation = splits[0].states, splits[1].states
    return None if training is None or validation is None else (training, validation)


def require_chosen_features(recipe: Recipe, offered: FeatureOffer, n_outputs: int) -> None:
    """Refuse to search for features of a network with parameters: this is not supported.

    Raises:
        RecipeError: the recipe leaves the features open, and there are several choices.
    """
    network = recipe.network
    if not recipe.parameters or not isinstance(network, StateSpaceRecipe):
        return
    if len(choices(network, offered, n_outputs)) > 1:
        raise RecipeError(
            f"recipe {recipe.name!r}: network.drive is left open, with parameters "
            f"{list(recipe.parameters)}; expected names of features, since those that are tried "
            "know no parameters: name them (network.drive)"
        )


def require_symmetry(signals: tuple[Signal, ...]) -> None:
    """Refuse to flip the signs of signals whose ranges are not symmetric about 0.

    Raises:
        ValueError: a range is not symmetric; the message names the signal.
    """
    for signal in signals:
        if signal.low != -signal.high:
            raise ValueError(
                f"flip_signs = true in a training, but the range of {signal.name!r} is "
                f"{signal.low} .. {signal.high}{behind(signal.unit)}; flipping needs ranges about "
                "0 and a system that answers -u with -y: set flip_signs = false, or declare a "
                "symmetric range"
            )


def require_motion(signals: tuple[Signal, ...], values: FloatArray) -> None:
    """Refuse data (..., n_signals) in which a signal never moves.

    Raises:
        ValueError: a signal is constant, so nothing can be learnt about it; the message names it.
    """
    deviations = values.reshape(-1, len(signals)).std(axis=0)
    for signal, value in zip(signals, deviations, strict=True):
        if not value > STILL * (signal.high - signal.low):
            raise ValueError(
                f"{signal.name!r} is constant in the training data; expected it to move within "
                f"{signal.low} .. {signal.high}{behind(signal.unit)}: check data.excitation and "
                "the signal's range"
            )


def standard_deviation_scaling(signals: tuple[Signal, ...], split: Split) -> Affine:
    """Return the scaling by the middle of the ranges and the standard deviation in the data."""
    outputs = split.outputs.reshape(-1, len(signals))
    outputs = outputs[np.isfinite(outputs).all(axis=1)]
    require_motion(signals, outputs)
    deviation = outputs.std(axis=0)
    return Affine(range_scaling(signals).offset, deviation)
