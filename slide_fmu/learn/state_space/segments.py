"""Trajectories cut into segments: a burn-in from zero state, then samples that are scored."""

from __future__ import annotations

from dataclasses import dataclass

import torch


@dataclass(frozen=True, eq=False)
class Segments:
    """Segments that a recursive network is fitted to; no sample is scored twice.

    The sample comes first in the shapes, so that one sample of all segments is one piece of
    memory. Segments of one trajectory follow each other.

    Attributes:
        features: shape (burn_in + scored, B, n_features).
        targets: shape (scored, B, n_outputs): of the last samples.
        weights: factors on the residuals, shape (B,).
    """

    features: torch.Tensor
    targets: torch.Tensor
    weights: torch.Tensor

    @property
    def burn_in(self) -> int:
        """Samples in which the zero state is forgotten; not scored."""
        return len(self.features) - len(self.targets)

    @property
    def count(self) -> int:
        """Number of segments B."""
        return self.features.shape[1]

    @property
    def counted(self) -> float:
        """Number of residuals, each counted as often as its weight squared."""
        return self.targets.numel() * float(self.weights.square().mean())

    def every(self, stride: int) -> Segments:
        """Every ``stride``-th segment, of trajectories all over the data."""
        return self.chosen(torch.arange(0, self.count, stride, device=self.weights.device))

    def chosen(self, numbers: torch.Tensor) -> Segments:
        """Some segments, by their numbers."""
        return Segments(self.features[:, numbers], self.targets[:, numbers], self.weights[numbers])

    def chunks(self, size: int) -> list[Segments]:
        """Pieces of at most ``size`` segments."""
        parts = [slice(first, first + size) for first in range(0, self.count, size)]
        return [
            Segments(self.features[:, part], self.targets[:, part], self.weights[part])
            for part in parts
        ]

    def and_others(self, others: Segments, factor: float) -> Segments:
        """These segments and some of the same lengths, with a factor on the others' weights."""
        return Segments(
            torch.cat([self.features, others.features], 1),
            torch.cat([self.targets, others.targets], 1),
            torch.cat([self.weights, factor * others.weights]),
        )

    def evened_out(self) -> Segments:
        """The segments, those that move more than usual with lower weights.

        The weight of a segment falls from sqrt(2) to that divided by its RMS about the mean of
        all segments, relative to the usual one: rare violent motions do not rule a fit.
        """
        squares = (self.targets - self.targets.mean((0, 1))).square().mean((0, 2))
        usual = squares.mean().clamp_min(torch.finfo(squares.dtype).tiny)  # 0: none moves
        weights = (2 / (1 + squares / usual)).sqrt()
        return Segments(self.features, self.targets, self.weights * weights)

    def mirrored(self) -> Segments:
        """The segments with the opposite sign."""
        return Segments(-self.features, -self.targets, self.weights)


def cut_segments(
    features: torch.Tensor, targets: torch.Tensor, burn_in: int, scored: int
) -> Segments:
    """Cut trajectories into segments of equal length that overlap by the burn-in.

    Args:
        features: shape (n_trajectories, N, n_features).
        targets: shape (n_trajectories, N + 1, n_outputs); targets[k + 1] follows features[.. k].
        burn_in: samples from zero state that are not scored.
        scored: scored samples of a segment, about; the nearest length that leaves little over.

    Raises:
        ValueError: trajectories are not longer than the burn-in.
    """
    rest = features.shape[1] - burn_in
    if rest < 1:
        raise ValueError(
            f"trajectories of {features.shape[1]} samples; expected more than the {burn_in} "
            "samples that the window truncates; make data.duration longer"
        )
    pieces = max(1, round(rest / scored))
    length = rest // pieces
    firsts = [piece * length for piece in range(pieces)]
    seen = torch.stack([features[:, s : s + burn_in + length] for s in firsts], 1)
    scores = [targets[:, s + burn_in + 1 : s + burn_in + length + 1] for s in firsts]
    return Segments(
        seen.flatten(0, 1).transpose(0, 1).contiguous(),
        torch.stack(scores, 1).flatten(0, 1).transpose(0, 1).contiguous(),
        features.new_ones(len(features) * pieces),
    )
