"""Features named in a recipe get their set, their normalisation from data, and their roles."""

from __future__ import annotations

import numpy as np

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import FeatureOffer
from slide_fmu.features.feature_map import FeatureMap
from slide_fmu.features.sets import LINEAR_NAMES, feature_set
from slide_fmu.network.state_space.cell import Roles
from slide_fmu.recipe.learning import StateSpaceRecipe

STILL = 1e-9
"""A feature with a standard deviation below this fraction of its size never changes: the rest is
rounding. The same holds for a change, relative to the standard deviation of the changing signal.
Components of a vector are compared with the largest of them: a component that geometry makes zero
contains rounding of the others."""


def choose_features(
    names: tuple[str, ...], offered: FeatureOffer, inputs: FloatArray
) -> FeatureMap:
    """Build the map from scaled inputs to the named features of one set, normalised by data.

    Bounded features stay unscaled. The others are divided by their standard deviation, some of
    them after their mean is removed. The data are scaled inputs, (n_trajectories, N, n_inputs).

    Raises:
        ValueError: names are unknown or from several sets, the system lacks what the set needs, or
            a feature never changes (for vectors: none of its components does).
    """
    features = feature_set(names, offered)
    chosen = features.indices(names)
    signals = features.along(inputs).reshape(-1, features.n_signals)
    values = signals[:, list(chosen)]
    offset, scale = np.zeros(len(chosen)), np.ones(len(chosen))
    first = 0
    for name in names:
        part = slice(first, first + features.blocks[name])
        first = part.stop
        if name in features.bounded:
            continue
        deviation, size = values[:, part].std(0), np.abs(values[:, part]).max(0)
        if name in features.CHANGES_OF:
            changed = features.indices((features.CHANGES_OF[name],))
            size = np.maximum(size, signals[:, changed].std(0))
        if name in features.vectors | features.centred:
            size = np.full(size.shape, size.max())
        still = deviation <= STILL * size
        if name in features.centred:
            offset[part] = values[:, part].mean(0)
        elif np.all(still) if name in features.vectors else np.any(still):
            raise ValueError(
                f"feature {name!r} never changes in the training data (its component "
                f"{np.flatnonzero(still)[0]}); expected it to: leave it out of the network's "
                "table, or check data.excitation"
            )
        scale[part] = np.where(still, 1.0, deviation)
    # files store the scales in float32: training must use the same numbers
    rounded = scale.astype(np.float32).astype(np.float64)
    return FeatureMap(features, chosen, Affine(offset, rounded))


def require_odd(features: FeatureMap) -> None:
    """Refuse features that do not change their sign with the inputs, if signs are to be flipped.

    Raises:
        ValueError: the features are not odd functions of the inputs; the message names them.
    """
    if not features.features.linear:
        raise ValueError(
            "flip_signs = true in a training of a network that sees "
            f"{list(features.features.blocks)}; flipping needs features that change their sign "
            f"with the inputs: set flip_signs = false, or use {', '.join(LINEAR_NAMES)}"
        )


def roles_of(network: StateSpaceRecipe, features: FeatureMap) -> Roles:
    """Return the indices of the features of each role among the chosen features.

    Recipes and ``Roles`` use ``drive`` for the state input, ``static`` for the feedthrough and
    ``schedule`` for the scheduling variables of LPV units.
    """
    place = {signal: index for index, signal in enumerate(features.chosen)}

    def indices(names: tuple[str, ...]) -> tuple[int, ...]:
        return tuple(place[signal] for signal in features.features.indices(names))

    return Roles(**{role: indices(names) for role, names in network.roles().items()})
