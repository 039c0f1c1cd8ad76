"""Noise in what was measured hides how accurate a network is: errors are compared without it.

Two networks that err by 0.34 % and 0.32 % of an output beside a noise of 0.316 % are not nearly
alike: without the noise they err by 0.12 % and 0.05 %.
"""

from __future__ import annotations

import math

import numpy as np
import torch

from slide_fmu.core.noise_floor import SHORTEST_PIECE, noise_of_residuals
from slide_fmu.fitting.state_space.cell import simulate
from slide_fmu.fitting.state_space.multi_start import Candidate
from slide_fmu.fitting.state_space.segments import Segments

PART = 0.5
"""Noise below this part of an error does not matter, and is not told from the error for sure."""
RESOLUTION = 0.1
"""Without the noise an error is known down to this part of the noise."""


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
