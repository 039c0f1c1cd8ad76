"""The features that one network sees: chosen signals of a set, centred and scaled."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.features.base import BEFORE, Features, PullBack


class FeatureMap:
    """A FeatureMap gives what a network sees: signals of a set, centred and scaled. Final.

    Args:
        features: the set.
        chosen: indices of its signals, in the order in which the network takes them; all if not
            given.
        offset: subtracted from them, shape (len(chosen),); zeros if not given.
        scale: what they are then divided by, shape (len(chosen),); ones if not given.

    Raises:
        ValueError: an index is out of range, an offset not finite, or a scale not positive.
    """

    def __init__(
        self,
        features: Features,
        chosen: tuple[int, ...] | None = None,
        offset: NDArray[Any] | None = None,
        scale: NDArray[Any] | None = None,
    ) -> None:
        self.features = features
        self.chosen = tuple(range(features.n_signals)) if chosen is None else chosen
        if not self.chosen or not 0 <= min(self.chosen) <= max(self.chosen) < features.n_signals:
            raise ValueError(
                f"chosen features {self.chosen}; expected at least one, each from 0 to "
                f"{features.n_signals - 1}"
            )
        count = len(self.chosen)
        self.offset = np.zeros(count) if offset is None else np.asarray(offset, dtype=np.float64)
        self.scale = np.ones(count) if scale is None else np.asarray(scale, dtype=np.float64)
        fine = np.all(np.isfinite(self.offset)) and np.all(np.isfinite(self.scale))
        if self.offset.shape != (count,) or self.scale.shape != (count,) or not fine:
            raise ValueError(
                f"feature offset of shape {self.offset.shape}, scale of shape "
                f"{self.scale.shape}; expected {count} finite numbers each"
            )
        if not np.all(self.scale > 0):
            raise ValueError(f"feature scale {self.scale.tolist()}; expected positive numbers")

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

        Inputs before a sequence count as equal to its first.
        """
        signals = self.features.along(sequences)[:, :, list(self.chosen)]
        return ((signals - self.offset) / self.scale).astype(np.float32)

    def pull_back(self, sequences: FloatArray) -> PullBack:
        """Prepare the reverse mode of ``along``, in float64.

        Args:
            sequences: scaled inputs, shape (B, N, n_channels).

        Returns:
            A function from weights of the features, shape (B, N, n_signals), to the gradient of
            their weighted sum with respect to the inputs, shape (B, N, n_channels).
        """
        padded = np.pad(sequences, ((0, 0), (BEFORE, 0), (0, 0)), mode="edge")
        of_set = self.features.pull_back(padded)
        chosen = list(zip(self.chosen, self.scale.tolist(), strict=True))

        def pull_back(weights: FloatArray) -> FloatArray:
            signals = np.zeros((*weights.shape[:2], self.features.n_signals))
            for place, (signal, scale) in enumerate(chosen):
                signals[:, :, signal] += weights[:, :, place] / scale
            gradient = of_set(signals)
            first = gradient[:, : BEFORE + 1].sum(axis=1, keepdims=True)
            return np.concatenate([first, gradient[:, BEFORE + 1 :]], axis=1)

        return pull_back
