"""A lesson has the training data of all baselines: a surrogate's trajectories, scaled."""

from __future__ import annotations

from dataclasses import dataclass

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.trajectories import Split
from slide_fmu.features.base import FeatureOffer
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.feature_choice import choose_features
from slide_fmu.surrogate.surrogate import Surrogate

SEEN = ("inputs",)
"""Baselines get the inputs unchanged: other features are part of a network's design."""

Motions = tuple[FloatArray, FloatArray]
"""Inputs and outputs of trajectories, (B, N, n_inputs) and (B, N + 1, n_outputs)."""


@dataclass(frozen=True, eq=False)
class Lesson:
    """A Lesson has the training data of all baselines, in scaled units.

    Attributes:
        window: the surrogate's window; its lengths limit how far back a baseline looks.
        features: the inputs as features, for networks of our families.
        training: training trajectories.
        validation: trajectories that select structures and weights.
        seed: seed of random numbers.
    """

    window: Window
    features: FeatureMap
    training: Motions
    validation: Motions
    seed: int

    @property
    def n_inputs(self) -> int:
        """The number of inputs."""
        return int(self.training[0].shape[2])

    @property
    def n_outputs(self) -> int:
        """The number of outputs."""
        return int(self.training[1].shape[2])


def lesson_of(surrogate: Surrogate, training: Split, validation: Split, seed: int) -> Lesson:
    """Return the lesson of the trajectories that a surrogate was trained on.

    Raises:
        ValueError: an input never moves in the training data.
    """
    scaling = surrogate.input_scaling
    offered = FeatureOffer(surrogate.inputs, scaling, surrogate.window.step, None)
    parts = [
        (scaling.apply(split.inputs), surrogate.output_scaling.apply(split.outputs))
        for split in (training, validation)
    ]
    features = choose_features(SEEN, offered, parts[0][0])
    return Lesson(surrogate.window, features, parts[0], parts[1], seed)
