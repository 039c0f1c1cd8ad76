"""The residual of a cell has three parts: learnable error, error that cannot be learnt, and noise.

The residual is regressed on random hidden units of the cell's states and features, directly and
filtered by the cell's poles: this is what hidden units would add to the outputs at first order. It
is scored on segments that were left out (cross-validation), so that noise and effects from before
the window do not count. If residuals are weighted by the spectrum of noise, they and the
regressors are filtered alike.

White noise in measured outputs hides the accuracy of a network, so errors are compared without it.
Two networks with errors of 0.34 % and 0.32 % of an output with a noise of 0.316 % differ widely:
without the noise their errors are 0.12 % and 0.05 %.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import final

import numpy as np
import torch

from slide_fmu.core.noise_floor import SHORTEST_PIECE, noise_of_residuals
from slide_fmu.fitting.state_space.cell import CellShape, simulate
from slide_fmu.fitting.state_space.multi_start import Candidate
from slide_fmu.fitting.state_space.segments import Segments

RANDOM_UNITS = 32
"""Number of random hidden units in the regression."""
STEEPNESS = (0.3, 10.0)
"""Smallest and largest deviation of their random arguments: friction needs steep units."""
POLES = 6
"""Largest number of poles that filter the units: those that decay most slowly."""
SEGMENTS = 64
"""Largest number of segments of each kind of data."""
FOLDS = 3
"""Number of folds: in turn, each is left out; other segments of the same trajectories stay."""
RIDGES = (1e-3, 1e-2, 1e-1)
"""Regularisation of the regression, relative to the regressors' mean square; the best is taken."""
PART = 0.5
"""Noise below this fraction of an error is not significant, and cannot be reliably separated."""
RESOLUTION = 0.1
"""Without the noise an error is known down to this fraction of the noise."""


def learnable_share(shape: CellShape, theta: torch.Tensor, data: Sequence[Segments]) -> float:
    """Return the share of the squared error of a cell that can be predicted, from 0 to 1.

    The parameters theta have the shape (P,). All data are regressed on and scored together.
    """
    units = _RandomUnits(shape, theta, data[0])
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
    """Return the squares of residuals, (N, p), and of what regressors, (N, R), do not explain.

    The latter are from segments that were left out, for each of ``RIDGES``; the folds have the
    shape (N,).
    """
    size = known.square().mean(0).sqrt()
    known = known / size.clamp_min(1e-12 * float(size.max()))  # what never moves has the size 0
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

    It is 0 if the error is mostly the network's own, or not finite.
    """
    if not math.isfinite(candidate.error) or len(validation.targets) < SHORTEST_PIECE:
        return 0.0
    with torch.no_grad():
        outputs, _ = simulate(
            candidate.shape, candidate.state.best, validation.features, validation.phi
        )
    left = validation.whitened(validation.targets - outputs[validation.burn_in :])
    residuals = left.double().cpu().numpy()
    floors = noise_of_residuals([residuals[:, k] for k in range(residuals.shape[1])]).floor
    noise = float(np.sqrt(np.mean(np.square(floors))))
    return noise if noise > PART * candidate.error else 0.0


def without_noise(error: float, noise: float) -> float:
    """Return an error without a noise that is independent of the remaining error."""
    return math.sqrt(max(error**2 - noise**2, (RESOLUTION * noise) ** 2))


_Regressed = tuple[torch.Tensor, torch.Tensor, torch.Tensor]
"""Regressors (N, R), residuals (N, p) and folds (N,)."""


@final
class _RandomUnits:
    """Random hidden units on states and features of a cell, scaled by its segments."""

    def __init__(self, shape: CellShape, theta: torch.Tensor, segments: Segments) -> None:
        self._shape, self._theta = shape, theta
        # for cells with physical parameters, the mean cell
        phi = None if segments.phi is None else segments.phi.mean(0, keepdim=True)
        mean = shape.weights(theta, phi).flatten()
        poles = torch.linalg.eigvals(shape.split(mean).a.double())
        poles = poles**shape.substeps  # poles for whole samples
        upper = poles[poles.imag >= 0]  # one of each conjugate pair
        slowest = torch.argsort(upper.abs(), descending=True, stable=True)
        self._poles = [complex(pole) for pole in upper[slowest][:POLES] if abs(pole) < 1]
        seen, _ = self._inputs_and_outputs(_some(segments))
        self._size = seen.square().mean((0, 1)).sqrt().clamp_min(1e-12)
        generator = torch.Generator().manual_seed(0)
        count = seen.shape[2] + 1
        weights = torch.randn(RANDOM_UNITS, count, generator=generator, dtype=torch.float64)
        low, high = (math.log(value) for value in STEEPNESS)
        spread = torch.rand(RANDOM_UNITS, 1, generator=generator, dtype=torch.float64)
        steep = (low + (high - low) * spread).exp() / math.sqrt(count)
        self._weights = (weights * steep).to(seen.device)

    def of(self, segments: Segments) -> list[_Regressed]:
        """Return regressors and residuals of scored samples.

        All outputs have the same regressors, unless each has its own noise spectrum.
        """
        chosen = _some(segments)
        seen, outputs = self._inputs_and_outputs(chosen)
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

    def _inputs_and_outputs(self, segments: Segments) -> tuple[torch.Tensor, torch.Tensor]:
        """Return inputs of hidden units, (N, B, m), delayed and not, and the outputs (N, B, p)."""
        outputs, states = simulate(self._shape, self._theta, segments.features, segments.phi)
        features = segments.features
        seen = torch.cat([_before(states), features, _before(features)], 2)
        return seen.double(), outputs.double()


def _folds(samples: int, segments: int) -> torch.Tensor:
    """Return the folds of samples, shape (N, B): whole segments, or parts of very few segments."""
    if segments >= FOLDS:
        return (torch.arange(segments) % FOLDS).expand(samples, segments)
    return (FOLDS * torch.arange(samples) // samples)[:, None].expand(samples, segments)


def _some(segments: Segments) -> Segments:
    """Return at most ``SEGMENTS`` segments, from all over the data."""
    return segments.every(math.ceil(segments.count / SEGMENTS))


def _before(values: torch.Tensor) -> torch.Tensor:
    """Return values (N, B, m) delayed by one sample, with zeros at first."""
    return torch.cat([torch.zeros_like(values[:1]), values[:-1]])


def _filtered(values: torch.Tensor, pole: complex) -> torch.Tensor:
    """Filter values, (N, B, m), by a pole: its real part and, if complex, the imaginary part."""
    real = pole.imag == 0
    factor = pole.real if real else pole
    state = torch.zeros_like(values[0], dtype=values.dtype if real else torch.complex128)
    passed = []
    for value in values:
        state = factor * state + (1 - abs(pole)) * value
        passed.append(state)
    whole = torch.stack(passed)
    return whole if real else torch.cat([whole.real, whole.imag], 2)
