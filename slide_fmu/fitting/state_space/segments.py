"""Trajectories are cut into segments: a burn-in from zero state, then scored samples.

A recursive network is run from zero state on every segment. Short segments run in parallel. The
zero state is forgotten in the burn-in, which is as long as the truncated part of the window.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch

from slide_fmu.fitting.state_space.whitening import Whitening


@dataclass(frozen=True, eq=False)
class Segments:
    """A recursive network is fitted to Segments; no sample is scored twice.

    The samples are the first axis, so that one sample of all segments is contiguous in memory.
    Segments of one trajectory follow each other.

    Attributes:
        features: features of the inputs, shape (burn_in + scored, B, n_features).
        targets: scaled outputs one step after the last features, shape (scored, B, n_outputs).
        weights: factors on the residuals of each segment, shape (B,).
        phi: values of the terms of the physical parameters, for each segment, shape (B, terms);
            None without parameters.
        whitening: weights the residuals by the spectrum of the outputs' noise; None if it is not
            known, with equal weights for all residuals.
        initial: states of the network before the first feature, shape (B, n_states); zero if None.
    """

    features: torch.Tensor
    targets: torch.Tensor
    weights: torch.Tensor
    phi: torch.Tensor | None = None
    whitening: Whitening | None = None
    initial: torch.Tensor | None = None

    @property
    def burn_in(self) -> int:
        """The number of first samples, not scored, in which the zero state is forgotten."""
        return len(self.features) - len(self.targets)

    @property
    def count(self) -> int:
        """The number B of segments."""
        return self.features.shape[1]

    @property
    def counted(self) -> float:
        """The number of residuals, each counted as its weight squared; it scales the cost."""
        return self.targets.numel() * float(self.weights.square().mean())

    def whitened(self, residuals: torch.Tensor) -> torch.Tensor:
        """Return weighted residuals of the scored samples, (scored, B, n_outputs)."""
        return residuals if self.whitening is None else self.whitening.along(residuals)

    def every(self, stride: int) -> Segments:
        """Return every ``stride``-th segment, so that all parts of the data are included."""
        return self.chosen(torch.arange(0, self.count, stride, device=self.weights.device))

    def chosen(self, numbers: torch.Tensor | slice) -> Segments:
        """Return the segments with these numbers, shape (K,), or in a slice."""
        return Segments(
            self.features[:, numbers],
            self.targets[:, numbers],
            self.weights[numbers],
            None if self.phi is None else self.phi[numbers],
            self.whitening,
            None if self.initial is None else self.initial[numbers],
        )

    def chunks(self, size: int) -> list[Segments]:
        """Split the segments into chunks of at most ``size`` segments."""
        return [self.chosen(slice(first, first + size)) for first in range(0, self.count, size)]

    def and_others(self, others: Segments, factor: float) -> Segments:
        """Return these segments and others of the same lengths, with a factor on their weights.

        Raises:
            ValueError: some of them have initial states, or parameters, and the others have none.
        """
        return Segments(
            torch.cat([self.features, others.features], 1),
            torch.cat([self.targets, others.targets], 1),
            torch.cat([self.weights, factor * others.weights]),
            _of_both("terms of the parameters", self.phi, others.phi),
            self.whitening,
            _of_both("initial states", self.initial, others.initial),
        )

    def evened_out(self) -> Segments:
        """Return the segments with lower weights for those that move more than usual.

        r is the ratio of a segment's mean square, about the mean of all segments, to the usual
        one. Its weight is sqrt(2 / (1 + r)): rare violent motions do not dominate a fit.
        """
        squares = (self.targets - self.targets.mean((0, 1))).square().mean((0, 2))
        usual = squares.mean().clamp_min(torch.finfo(squares.dtype).tiny)  # 0 if nothing moves
        weights = (2 / (1 + squares / usual)).sqrt()
        return replace(self, weights=self.weights * weights)


def _of_both(
    what: str, one: torch.Tensor | None, other: torch.Tensor | None
) -> torch.Tensor | None:
    """Return rows of segments, (B, columns), followed by those of others; None without any."""
    if one is None or other is None:
        if one is other:
            return None
        with_them, without = ("these", "the other") if other is None else ("the other", "these")
        raise ValueError(
            f"{with_them} segments have {what}, and {without} ones have none; expected them of "
            "both, or of neither: give them to both"
        )
    return torch.cat([one, other])


def cut_segments(
    features: torch.Tensor,
    targets: torch.Tensor,
    burn_in: int,
    scored: int,
    phi: torch.Tensor | None = None,
) -> Segments:
    """Cut trajectories into segments of equal length that overlap by the burn-in, of weight 1.

    Features have the shape (n_trajectories, N, n_features), scaled outputs (n_trajectories, N + 1,
    n_outputs): targets[:, k + 1] belongs to features[:, : k + 1]. The number of scored samples in
    a segment is the one nearest to the wanted number that leaves few samples over. Segments take
    the terms phi of their trajectories' physical parameters, (n_trajectories, terms).

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
        None if phi is None else phi.repeat_interleave(pieces, 0),
    )
