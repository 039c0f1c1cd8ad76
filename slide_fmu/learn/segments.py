"""Trajectories cut into segments: a burn-in from zero state, then samples that are scored."""

from __future__ import annotations

from dataclasses import dataclass

import torch


@dataclass(frozen=True, eq=False)
class Segments:
    """Segments that a recursive network is fitted to; no sample is scored twice.

    The sample comes first in the shapes, so that one sample of all segments is one piece of
    memory.

    Attributes:
        features: shape (burn_in + scored, B, n_features).
        targets: shape (scored, B, n_outputs): of the last samples.
    """

    features: torch.Tensor
    targets: torch.Tensor

    @property
    def burn_in(self) -> int:
        """Samples in which the zero state is forgotten; not scored."""
        return len(self.features) - len(self.targets)

    def every(self, stride: int) -> Segments:
        """Every ``stride``-th segment: a part of the data that still covers all trajectories."""
        return Segments(
            self.features[:, ::stride].contiguous(), self.targets[:, ::stride].contiguous()
        )

    def chosen(self, numbers: torch.Tensor) -> Segments:
        """Some segments, by their numbers."""
        return Segments(self.features[:, numbers], self.targets[:, numbers])

    def chunks(self, size: int) -> list[Segments]:
        """Pieces of at most ``size`` segments."""
        firsts = range(0, self.count, size)
        return [
            Segments(self.features[:, s : s + size], self.targets[:, s : s + size]) for s in firsts
        ]

    @property
    def count(self) -> int:
        """Number of segments B."""
        return self.features.shape[1]


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
    return Segments(
        torch.cat([features[:, s : s + burn_in + length] for s in firsts])
        .transpose(0, 1)
        .contiguous(),
        torch.cat([targets[:, s + burn_in + 1 : s + burn_in + length + 1] for s in firsts])
        .transpose(0, 1)
        .contiguous(),
    )


def with_differences(inputs: torch.Tensor, differences: int) -> torch.Tensor:
    """Inputs and their backward differences up to an order.

    Args:
        inputs: shape (n_trajectories, N, n_inputs); before, the first one was held.

    Returns:
        Shape (n_trajectories, N, (1 + differences) n_inputs): u, u[k] - u[k-1], and the
        difference of that.
    """
    parts = [inputs]
    for _ in range(differences):
        parts.append(torch.diff(parts[-1], dim=1, prepend=parts[-1][:, :1]))
    return torch.cat(parts, dim=2)
