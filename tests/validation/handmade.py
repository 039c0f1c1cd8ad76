"""Validations whose numbers are made by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from slide_fmu.core.scaling import Affine, LogError
from slide_fmu.core.signals import Signal
from slide_fmu.features.differences import Differences
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.network.feed_forward.network import FeedForward, Layer
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.results import Validation
from slide_fmu.validation.task import Task
from slide_fmu.validation.trust import TrustOutputs
from tests.bounded import bounded_surrogate
from tests.fmu.samples import CellShape, Shape, sum_surrogate
from tests.recipes import ESTIMATOR, tiny_recipe, tiny_state_space_recipe

KINDS: list[dict[str, Any]] = [
    {"kind": "held_random", "weight": 1.0},
    {"kind": "sweep", "weight": 1.0, "angular_frequency": [1.0, 9.0]},
]


def recipe() -> Recipe:
    """The tiny recipe with two kinds of excitation; the estimate's resolution is 0.01."""
    return tiny_recipe(
        data={"excitation": KINDS, "estimator": 1, "estimator_validation": 1},
        estimator={**ESTIMATOR, "expert": {"resolution": 0.01}},
    )


def surrogate_of(units: tuple[str, ...] = ("m", "m"), scale: float = 2.0) -> Surrogate:
    """Two outputs whose scale is 2; what the network gives does not matter here."""
    count, features = len(units), FeatureMap(Differences(1))
    flat = Layer(np.zeros((count, 1), np.float32), np.zeros(count, np.float32), "identity")
    ranges = np.array([[-1], [1]], np.float32)
    network = FeedForward((flat,), 1, features)
    return replace(
        sum_surrogate(1),
        outputs=tuple(Signal(f"y{k}", unit, -9, 9) for k, unit in enumerate(units)),
        output_scaling=Affine.of_channels([0.0] * count, [scale] * count),
        network=network,
        estimator=ErrorEstimator(network, LogError(-3, 1), 2, ranges),
    )


def comparison(errors: list[list[float]], kind: int = 0, **more: Any) -> Comparison:
    """A trajectory whose references are 3 and -4 in turns, with the given errors."""
    values = np.array(errors)
    signs = np.where(np.arange(len(values)) % 2, -4.0, 3.0)
    reference = np.repeat(signs[:, None], values.shape[1], axis=1)
    plain = Comparison(
        kind,
        np.arange(len(values)) * 1.0,
        np.zeros((len(values), 1)),
        reference,
        reference + values,
        np.full(values.shape, 0.5),
        np.full(values.shape, 0.25),
        (np.array([2e-6, 4e-6, 9e-6]), np.array([8e-6, 8e-6, 12e-6])),
        None,
    )
    return replace(plain, **more)


def validation(*comparisons: Comparison, **more: Any) -> Validation:
    plain = Validation(Task(5, amplitude=(1.0, 2.0)), surrogate_of(), recipe(), comparisons)
    return replace(plain, **more)


def trust_outputs(bounds: list[list[float]], novelty: list[float]) -> TrustOutputs:
    """Bounds and flags of an FMU.

    Samples whose novelty is above 1 are outside of its domain, all others are trusted.
    """
    values = np.array(novelty)
    inside = (values <= 1).astype(float)
    return TrustOutputs(np.array(bounds), values, inside, inside)


def bounded(*comparisons: Comparison, **more: Any) -> Validation:
    """A validation of a surrogate with two outputs and an error bound, without an estimator."""
    surrogate = bounded_surrogate(Shape(n_outputs=2, cell=CellShape()))
    own = tiny_state_space_recipe(
        data={"excitation": KINDS, "calibration": 150, "duration": 4.0}, bound={}
    )
    return Validation(Task(5, **more), surrogate, own, comparisons)
