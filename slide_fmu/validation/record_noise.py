"""The noise of what was measured, which stands beside the errors: no surrogate can predict it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slide_fmu.core.noise_floor import SHORTEST_PIECE, noise_of_residuals
from slide_fmu.core.signals import FloatArray
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.records.noise_record import Noise

ORIGINS = {
    "noise_record": "by the noise record",
    "residuals": "by the flat bottom of the residuals' spectrum",
}
"""The dictionary says in words from what the noise is known."""


def origin_of_noise(recipe: Recipe) -> str:
    """Return from what the noise of a recipe's records is known, one of ``ORIGINS``."""
    return "residuals" if recipe.system.noise_record is None else "noise_record"


def measured_noise(noise: Noise | None, errors: Sequence[FloatArray]) -> FloatArray | None:
    """Return the RMS of the noise of every output in its unit, (n_outputs,); None if not known.

    A noise record tells it, whatever its colour. Without one it is that of white noise in the
    errors of stretches, (N, n_outputs) each, if some are long enough.
    """
    if noise is not None:
        return np.asarray(np.std(np.concatenate(noise.stretches), axis=0))
    long_enough = [error for error in errors if len(error) >= SHORTEST_PIECE]
    return noise_of_residuals(long_enough).floor if long_enough else None
