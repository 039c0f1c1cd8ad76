"""A learning curve: how the validation error falls with the number of trajectories.

One network of moderate size goes on learning from twice as many trajectories, point by point. It
starts each point with what it knows: the validation error falls with the iterations too, so it is
the difference from the training error that shows whether more data would pay.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from slide_fmu.core.progress import Heard, Progress, part_of
from slide_fmu.core.scaling import Affine, range_scaling
from slide_fmu.core.window import Window
from slide_fmu.data.store import Split, read_split
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.checkpoint_keys import checkpoint_key, content_of, machine_of
from slide_fmu.fitting.eigenvalues import eigenvalues_at_corners, eigenvalues_at_rest
from slide_fmu.fitting.feature_choice import choose_features
from slide_fmu.fitting.feature_search import Trials, search_features
from slide_fmu.fitting.network import LEARNT_BY, standard_deviation_scaling
from slide_fmu.fitting.physical import physical_of, require_chosen_features
from slide_fmu.fitting.problem import Problem
from slide_fmu.fitting.state_space.fit import prepare
from slide_fmu.fitting.state_space.multi_start import (
    LINEAR_ITERATIONS,
    Candidate,
    MultiStart,
)
from slide_fmu.fitting.state_space.normal_equations import sum_of_squares
from slide_fmu.fitting.state_space.sizes import FIRST_UNITS
from slide_fmu.recipe.learning import LeastSquaresRecipe, StateSpaceRecipe
from slide_fmu.recipe.offers import offered_features
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.systems.base import Source

FIRST_ITERATIONS, ITERATIONS = 20, 10
"""The first point of the curve takes at most so many iterations, each further one so many."""


@dataclass(frozen=True, eq=False)
class _Scales:
    """This says what the first point fixes for all: scalings and features, of its data.

    Errors in scaled units compare only where the scale is the same.
    """

    inputs: Affine
    outputs: Affine
    features: FeatureMap
    eigenvalues: NDArray[np.complex128] | None
    at_corners: list[NDArray[np.complex128] | None]
    key: str


class LearningCurve:
    """A learning curve of a recipe with a state-space network, on trajectories in a store. Final.

    Points are asked for with rising numbers of trajectories. A curve that was broken off goes on
    from its checkpoint in the folder ``checkpoints``.
    """

    def __init__(self, recipe: Recipe, system: Source, store: Path, checkpoints: Path) -> None:
        assert isinstance(recipe.network, StateSpaceRecipe)
        assert isinstance(recipe.training, LeastSquaresRecipe)
        self._recipe, self._system, self._store = recipe, system, store
        self._network, self._training = recipe.network, recipe.training
        self._checkpoints = checkpoints
        self._scales: _Scales | None = None
        self._candidate: Candidate | None = None

    def errors(self, train: int, validation: int, progress: Progress) -> tuple[float, float]:
        """Return validation and training error after learning from the first trajectories.

        Both are RMS in scaled units.

        Raises:
            StoreError: trajectories are missing.
            TrainingError: the checkpoint cannot be read.
            ValueError: a signal never moves in the data.
        """
        splits = [
            read_split(self._store, name, count)
            for name, count in (("train", train), ("validation", validation))
        ]
        progress = Heard(progress, with_error=not self._training.even_out)
        if self._scales is None:
            self._scales = self._found(splits, progress)
        scales = self._scales
        window, place = self._recipe.window, self._checkpoints / f"curve-{scales.key}.pt"
        problem = Problem(
            Window(window.step, window.n_in, window.n_out),
            scales.features,
            self._seen(splits[0], scales),
            self._seen(splits[1], scales),
            place,
            scales.eigenvalues,
            physical=physical_of(self._recipe, splits, scales.at_corners),
        )
        data = prepare(problem, self._network, self._training)
        fit = MultiStart(problem, self._network, self._training, data, progress)
        first = self._candidate is None
        iterations = FIRST_ITERATIONS if first else ITERATIONS
        starts = 2 * LINEAR_ITERATIONS + self._training.start_iterations if first else 0
        fit.plan(starts + iterations)
        before = self._candidate or self._first(fit)
        self._candidate = candidate = fit.with_more_data(before, iterations)
        fit.finish()
        squares = sum_of_squares(candidate.shape, candidate.state.best, data.whole)
        return candidate.error, math.sqrt(squares / data.whole.counted)

    def _first(self, fit: MultiStart) -> Candidate:
        """Return what the curve starts from: the sizes that are given, else moderate ones."""
        order, units = self._network.order, self._network.hidden
        order = fit.first_order() if order == "auto" else order
        units = fit.dense_units(order, FIRST_UNITS if units == "auto" else units)
        linear = fit.linear(order)
        return fit.start(linear, units, 0) if units else linear

    def _found(self, splits: list[Split], progress: Progress) -> _Scales:
        system, recipe, split = self._system, self._recipe, splits[0]
        inputs, eigenvalues = range_scaling(system.inputs), eigenvalues_at_rest(system)
        offered = offered_features(recipe, system, inputs)
        require_chosen_features(recipe, offered, len(system.outputs))
        window = Window(recipe.window.step, recipe.window.n_in, recipe.window.n_out)
        trials = Trials(offered, window, (split, splits[1]), eigenvalues, self._checkpoints)
        network, _ = search_features(
            self._network, self._training, trials, partial(part_of, progress)
        )
        assert isinstance(network, StateSpaceRecipe)
        self._network = network
        tables = recipe.model_dump(mode="json", include=LEARNT_BY)
        return _Scales(
            inputs,
            standard_deviation_scaling(system.outputs, split),
            choose_features(network.feature_names(), offered, inputs.apply(split.inputs)),
            eigenvalues,
            eigenvalues_at_corners(recipe, system),
            checkpoint_key(content_of(split), machine_of(offered), tables),
        )

    def _seen(self, split: Split, scales: _Scales) -> tuple[torch.Tensor, torch.Tensor]:
        seen = scales.features.along(scales.inputs.apply(split.inputs))
        return torch.as_tensor(seen), torch.as_tensor(scales.outputs.apply(split.outputs))
