"""A cell leaves over what it could still learn, what it cannot learn, and noise.

The residual is regressed on random units of the cell's states and features, as they are and as
they pass through the cell's own poles: what hidden units would add to the outputs at first order.
It is scored on segments that were left out (cross-validation), so that noise, and what lies before
the window, do not count. Where residuals are weighted by the spectrum of noise, they and what
predicts them are filtered alike.

White noise in what was measured hides how accurate a network is: errors are compared without it.
Two networks that are off by 0.34 % and 0.32 % of an output with a noise of 0.316 % are not nearly
alike: without the noise they are off by 0.12 % and 0.05 %.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import torch

from slide_fmu.core.noise_floor import SHORTEST_PIECE, noise_of_residuals
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.multi_start import Candidate
from slide_fmu.fitting.state_space.segments import Segments

UNITS = 32
"""The regression has this many random units."""
STEEPNESS = (0.3, 10.0)
"""Their arguments are random with deviations between these: friction needs steep units."""
POLES = 6
"""The units pass through at most this many poles, of those that decay most slowly."""
SEGMENTS = 64
"""At most this many segments of each kind of data are taken."""
FOLDS = 3
"""Every so manyth segment is left out in turn: other stretches of the same trajectories stay."""
RIDGES = (1e-3, 1e-2, 1e-1)
"""The regression is regularised by these parts of the regressors' mean square; the best counts."""
PART = 0.5
"""Noise below this part of an error does not matter, and is not told from the error for sure."""
RESOLUTION = 0.1
"""Without the noise an error is known down to this part of the noise."""


def learnable_share(shape: CellShape, theta: torch.Tensor, data: Sequence[Segments]) -> float:
    """Return the share of the squared error of a cell that can be predicted, from 0 to 1.

    The parameters theta have the shape (P,). All data are regressed on and scored together.
    """
    units = _Units(shape, theta, data[0])
    regressions = [
        _regression(*(torch.cat(parts) for parts in zip(*groups, strict=True)))
        for groups in zip(*map(units.of, data), strict=True)
    ]
    before = sum(squares for squares, _ in regressions)
    after = min(map(sum, zip(*(left for _, left in regressions), strict=True)))
    return max(0.0, 1 - after / before) if before > 0 else 0.0


def _regression(
    known: torch.Tensor, residuals: torch.Tensor, folds: torch.Tensor
) -> tuple[float, list[float]]:
    """Return the squares of residuals, (N, p), and those that regressors, (N, R), leave over.

    The latter are those of segments that were left out, for each of ``RIDGES``; the folds have
    the shape (N,).
    """
    size = known.square().mean(0).sqrt()
    known = known / size.clamp_min(1e-12 * float(size.max()))  # what never moves has no size
    before, after = float(residuals.square().sum()), [0.0] * len(RIDGES)
    whole = known.T @ known, known.T @ residuals
    for fold in range(FOLDS):
        left = folds == fold
        others, wanted = known[left], residuals[left]
        matrix, right = whole[0] - others.T @ others, whole[1] - others.T @ wanted
        for index, ridge in enumerate(RIDGES):
            damping = torch.full_like(matrix[0], ridge * int((~left).sum()))
            coefficients = torch.linalg.solve(matrix + torch.diag(damping), right)
            after[index] += float((wanted - others @ coefficients).square().sum())
    return before, after


def noise_in(candidate: Candidate, validation: Segments) -> float:
    """Return the RMS of the white noise in a network's validation error, in scaled units.

    It is 0 where the error is mostly the network's own, or not finite.
    """
    if not math.isfinite(candidate.error) or len(validation.targets) < SHORTEST_PIECE:
        return 0.0
    with torch.no_grad():
        found, _ = simulate(
            candidate.shape, candidate.state.best, validation.features, validation.phi
        )
    left = validation.whitened(validation.targets - found[validation.burn_in :])
    residuals = left.double().cpu().numpy()
    floors = noise_of_residuals([residuals[:, k] for k in range(residuals.shape[1])]).floor
    noise = float(np.sqrt(np.mean(np.square(floors))))
    return noise if noise > PART * candidate.error else 0.0


def without_noise(error: float, noise: float) -> float:
    """Return what is left of an error without a noise that has no part in the other rest."""
    return math.sqrt(max(error**2 - noise**2, (RESOLUTION * noise) ** 2))


_Regressed = tuple[torch.Tensor, torch.Tensor, torch.Tensor]
"""Regressors (N, R), residuals (N, p) and folds (N,)."""


class _Units:
    """Random units that see states and features of a cell, scaled by segments of it. Final."""

    def __init__(self, shape: CellShape, theta: torch.Tensor, segments: Segments) -> None:
        self._shape, self._theta = shape, theta
        # of cells with physical parameters, those of the mean cell
        phi = None if segments.phi is None else segments.phi.mean(0, keepdim=True)
        mean = shape.weights(theta, phi).flatten()
        poles = torch.linalg.eigvals(shape.split(mean).a.double())
        poles = poles**shape.substeps  # of whole samples
        upper = poles[poles.imag >= 0]  # one of each conjugate pair
        slowest = torch.argsort(upper.abs(), descending=True, stable=True)
        self._poles = [complex(pole) for pole in upper[slowest][:POLES] if abs(pole) < 1]
        seen, _ = self._seen(_some(segments))
        self._size = seen.square().mean((0, 1)).sqrt().clamp_min(1e-12)
        generator = torch.Generator().manual_seed(0)
        count = seen.shape[2] + 1
        weights = torch.randn(UNITS, count, generator=generator, dtype=torch.float64)
        low, high = (math.log(value) for value in STEEPNESS)
        spread = torch.rand(UNITS, 1, generator=generator, dtype=torch.float64)
        steep = (low + (high - low) * spread).exp() / math.sqrt(count)
        self._weights = (weights * steep).to(seen.device)

    def of(self, segments: Segments) -> list[_Regressed]:
        """Return regressors and what they are regressed on, of scored samples.

        All outputs have the same regressors, unless noise has a spectrum of its own in each.
        """
        chosen = _some(segments)
        seen, outputs = self._seen(chosen)
        scaled, first = seen / self._size, chosen.burn_in
        arguments = torch.cat([scaled, torch.ones_like(scaled[:, :, :1])], 2) @ self._weights.T
        both = torch.cat([scaled, torch.tanh(arguments)], 2)
        parts = [both, *(_filtered(both, pole) for pole in self._poles)]
        known = torch.cat([part[first:] for part in parts], 2)
        residuals = chosen.targets.double() - outputs[first:]
        folds = _folds(*known.shape[:2]).to(known.device).flatten()
        if chosen.whitening is None:
            return [(known.flatten(0, 1), residuals.flatten(0, 1), folds)]
        whitening = chosen.whitening.to(known)
        filtered = whitening.along(residuals).flatten(0, 1)
        outputs_alone = [whitening.of_output(k) for k in range(filtered.shape[1])]
        return [
            (own.along(known[:, :, None]).flatten(0, 2), filtered[:, k : k + 1], folds)
            for k, own in enumerate(outputs_alone)
        ]

    def _seen(self, segments: Segments) -> tuple[torch.Tensor, torch.Tensor]:
        """Return what hidden units may see, (N, B, m), late and not, and the outputs (N, B, p)."""
        outputs, states = simulate(self._shape, self._theta, segments.features, segments.phi)
        features = segments.features
        seen = torch.cat([_before(states), features, _before(features)], 2)
        return seen.double(), outputs.double()


def _folds(samples: int, segments: int) -> torch.Tensor:
    """Return the folds of samples, shape (N, B): whole segments, or stretches of very few."""
    if segments >= FOLDS:
        return (torch.arange(segments) % FOLDS).expand(samples, segments)
    return (FOLDS * torch.arange(samples) // samples)[:, None].expand(samples, segments)


def _some(segments: Segments) -> Segments:
    """Return at most ``SEGMENTS`` segments, from all over the data."""
    return segments.every(math.ceil(segments.count / SEGMENTS))


def _before(values: torch.Tensor) -> torch.Tensor:
    """Return values (N, B, m) one sample late, with zeros at first."""
    return torch.cat([torch.zeros_like(values[:1]), values[:-1]])


def _filtered(values: torch.Tensor, pole: complex) -> torch.Tensor:
    """Pass values, (N, B, m), through a pole: its real part and, if complex, the imaginary."""
    real = pole.imag == 0
    factor = pole.real if real else pole
    state = torch.zeros_like(values[0], dtype=values.dtype if real else torch.complex128)
    passed = []
    for value in values:
        state = factor * state + (1 - abs(pole)) * value
        passed.append(state)
    whole = torch.stack(passed)
    return whole if real else torch.cat([whole.real, whole.imag], 2)
