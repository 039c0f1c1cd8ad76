"""A lesson is what all baselines learn from: a surrogate's trajectories, as it scales them."""

from __future__ import annotations

from dataclasses import dataclass

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import Window
from slide_fmu.data.trajectories import Split
from slide_fmu.features.base import Offered
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.fitting.feature_choice import choose_features
from slide_fmu.surrogate.surrogate import Surrogate

SEEN = ("inputs",)
"""Baselines see the inputs as they are: what else a network sees is part of its design."""

Record = tuple[FloatArray, FloatArray]
"""Inputs and outputs of trajectories, (B, N, n_inputs) and (B, N + 1, n_outputs)."""


@dataclass(frozen=True, eq=False)
class Lesson:
    """A lesson is what all baselines learn from, in scaled units.

    Attributes:
        window: the surrogate's window; its lengths bound how far back a baseline looks.
        features: the inputs as features, for networks of our families.
        training: trajectories to learn from.
        validation: trajectories by which structures and weights are chosen.
        seed: seed of what is random.
    """

    window: Window
    features: FeatureMap
    training: Record
    validation: Record
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
    """Return the lesson of the trajectories that a surrogate has learnt from.

    Raises:
        ValueError: an input never moves in the training data.
    """
    scaling = surrogate.input_scaling
    offered = Offered(surrogate.inputs, scaling, surrogate.window.step, None)
    records = [
        (scaling.apply(split.inputs), surrogate.output_scaling.apply(split.outputs))
        for split in (training, validation)
    ]
    features = choose_features(SEEN, offered, records[0][0])
    return Lesson(surrogate.window, features, records[0], records[1], seed)
