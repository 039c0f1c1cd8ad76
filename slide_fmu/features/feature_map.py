"""A feature map selects the signals that one network takes from a set, and scales them."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import BEFORE, Features, PullBack


@final
class FeatureMap:
    """A FeatureMap gives the input of a network: signals of a set, centred and scaled.

    Args:
        features: the set.
        chosen: indices of its signals, in the order in which the network takes them; default all.
        scaling: of the chosen signals; default unscaled.

    Raises:
        ValueError: an index is out of range, or the scaling has another number of signals.
    """

    def __init__(
        self,
        features: Features,
        chosen: tuple[int, ...] | None = None,
        scaling: Affine | None = None,
    ) -> None:
        self.features = features
        self.chosen = tuple(range(features.n_signals)) if chosen is None else chosen
        if not self.chosen or not 0 <= min(self.chosen) <= max(self.chosen) < features.n_signals:
            raise ValueError(
                f"chosen features {self.chosen}; expected at least one, each from 0 to "
                f"{features.n_signals - 1}"
            )
        count = len(self.chosen)
        self.scaling = Affine(np.zeros(count), np.ones(count)) if scaling is None else scaling
        if len(self.scaling.scale) != count:
            raise ValueError(
                f"scaling of {len(self.scaling.scale)} features; expected {count}, the number of "
                "chosen features"
            )

    @property
    def n_channels(self) -> int:
        """The number of input channels."""
        return self.features.n_channels

    @property
    def n_signals(self) -> int:
        """The number of features that the network takes."""
        return len(self.chosen)

    def along(self, sequences: NDArray[Any]) -> NDArray[np.float32]:
        """Form features along sequences: (B, N, n_channels) to (B, N, n_signals), float32.

        Inputs before a sequence count as equal to its first input.
        """
        return np.asarray(self.exactly_along(sequences), dtype=np.float32)

    def exactly_along(self, sequences: NDArray[Any]) -> FloatArray:
        """Form features as ``along`` does, in double precision."""
        return self.scaling.apply(self.features.along(sequences)[:, :, list(self.chosen)])

    def pull_back(self, sequences: FloatArray) -> PullBack:
        """Prepare the reverse mode of ``along`` at scaled inputs (B, N, n_channels), in float64.

        Weights have the shape of the features, (B, N, n_signals); the gradient has the shape of
        the inputs.
        """
        padded = np.pad(sequences, ((0, 0), (BEFORE, 0), (0, 0)), mode="edge")
        of_set = self.features.pull_back(padded)
        chosen = list(zip(self.chosen, self.scaling.scale.tolist(), strict=True))

        def pull_back(weights: FloatArray) -> FloatArray:
            signals = np.zeros((*weights.shape[:2], self.features.n_signals))
            for place, (signal, scale) in enumerate(chosen):
                signals[:, :, signal] += weights[:, :, place] / scale
            gradient = of_set(signals)
            first = gradient[:, : BEFORE + 1].sum(axis=1, keepdims=True)
            return np.concatenate([first, gradient[:, BEFORE + 1 :]], axis=1)

        return pull_back
