"""A Trust tells how far the outputs of a surrogate may be trusted, sample by sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.error_bound import USUAL_CONFIDENCE, ErrorBound, LocalErrors


@final
@dataclass(frozen=True, eq=False)
class Trust:
    """A Trust is what an error bound says along a sequence of N samples.

    Attributes:
        bound: the error bound.
        output_scale: scales of the outputs, in their units, shape (n_outputs,).
        local: what the error bound evaluates at each sample, relative to these scales.
        in_domain: whether the surrogate knows such inputs, shape (N,): the novelty is at most 1,
            and the inputs lie in their ranges (``Surrogate.inputs_in_range``).
        outputs_in_range: whether the outputs lie in the ranges of the training, shape (N,); True
            where these are not known.
    """

    bound: ErrorBound
    output_scale: FloatArray
    local: LocalErrors
    in_domain: NDArray[np.bool_]
    outputs_in_range: NDArray[np.bool_]

    @property
    def novelty(self) -> FloatArray:
        """The novelty of the inputs, 1 at the edge of the domain, shape (N,)."""
        return self.local.novelty

    def bounds(self, confidence: float = USUAL_CONFIDENCE) -> FloatArray:
        """Return the bound of each sample's error, (N, n_outputs), in the outputs' units.

        Args:
            confidence: the share of samples that is covered on average, in a trajectory of the
                calibrated kinds, 0.9 to 0.99; it is raised to the next calibrated confidence.

        Raises:
            ValueError: the confidence is not calibrated.
        """
        return self.bound.bounds(self.local, confidence) * self.output_scale

    def trusted(self, tolerances: FloatArray | None = None) -> NDArray[np.bool_]:
        """Return at which samples nothing says that outputs may be wrong, (N,).

        There the bound has seen as many inputs as it needs (``ErrorBound.filling_length``), every
        95 % bound is at most its tolerance, the sample is in the domain, and outputs lie in their
        ranges where these are known.

        Args:
            tolerances: (n_outputs,), in the outputs' units; ``Surrogate.error_tolerances`` if
                None.

        Raises:
            ValueError: tolerances that are negative, not finite, or of another number; or 95 %
                bounds are not calibrated.
        """
        known = self.bound.tolerances * self.output_scale
        allowed = known if tolerances is None else np.asarray(tolerances, dtype=np.float64)
        if allowed.shape != known.shape or not np.all(np.isfinite(allowed) & (allowed >= 0)):
            raise ValueError(
                f"tolerances {allowed.tolist()}; expected {len(known)} finite numbers that are "
                "not negative, one for each output in its unit"
            )
        flags = self.in_domain & self.outputs_in_range
        flags &= np.all(self.bounds() <= allowed, axis=1)
        flags[: self.bound.filling_length - 1] = False  # the past is not known
        return flags
