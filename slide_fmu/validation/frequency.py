"""This module estimates spectra of a validation: responses and errors at each frequency."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray, Hold
from slide_fmu.validation.comparison import Comparison

ComplexArray = NDArray[np.complex128]

SEGMENTS = 3
"""Segments are at most such a part of a trajectory; half of each lies in the next one too."""

SHORTEST_SEGMENT = 32
"""Segments of fewer samples show no frequencies worth a chart."""

DRIVEN = 1e-7
"""Frequencies where an input has less than this part of its largest density are not driven."""

RIDGE = 1e-9
"""Relative regularisation: inputs that move alike at a frequency share its response."""

LEAST_RIDGE = 1e-200
"""Least regularisation: where no input moves at all at a frequency, its response is 0."""


@dataclass(frozen=True, eq=False)
class Spectra:
    """Spectra of all trajectories of a validation, at F frequencies above zero.

    Attributes:
        frequency: in Hz, (F,).
        inputs: cross spectral densities of the inputs, (F, n_inputs, n_inputs).
        to_reference, to_surrogate: cross spectral densities of inputs and outputs, (F, n_inputs,
            n_outputs).
        reference, surrogate, error: densities of the outputs and of the error, (F, n_outputs).
        held: time in s for which each input is held before its sample; 0 where it moves.
    """

    frequency: FloatArray
    inputs: ComplexArray
    to_reference: ComplexArray
    to_surrogate: ComplexArray
    reference: FloatArray
    surrogate: FloatArray
    error: FloatArray
    held: float = 0.0

    def responses(self) -> tuple[ComplexArray, ComplexArray]:
        """Return the frequency responses of reference and surrogate, (F, n_inputs, n_outputs).

        They are the responses of the nearest linear system (the H1 estimator). Both are estimated
        from the same inputs, so they can be compared for nonlinear systems too. The response of
        the hold is removed: an input that is held until its sample is half a step ahead of the
        sample, and its amplitude is smaller by sin(x) / x, with x = pi times frequency times step.
        """
        size = np.trace(self.inputs, axis1=1, axis2=2).real / self.inputs.shape[1]
        ridge = np.maximum(RIDGE * size, LEAST_RIDGE)
        whole = self.inputs + ridge[:, None, None] * np.eye(self.inputs.shape[1])
        both = (self.to_reference, self.to_surrogate)
        true, own = (np.asarray(np.linalg.solve(whole, one), dtype=np.complex128) for one in both)
        turns = self.frequency * self.held
        of_hold = (np.sinc(turns) * np.exp(1j * np.pi * turns))[:, None, None]
        return true / of_hold, own / of_hold

    def powers(self) -> FloatArray:
        """Return the power that each input alone causes in the reference, (n_inputs, n_outputs).

        It is the sum over the frequencies of the input's density times the squared response.
        """
        true, _ = self.responses()
        return np.asarray(np.einsum("fio,fii->io", np.abs(true) ** 2, self.inputs.real))

    def driven(self, channel: int) -> NDArray[np.bool_]:
        """Return at which frequencies an input has some power, (F,)."""
        density = self.inputs[:, channel, channel].real
        return np.asarray(density > DRIVEN * density.max())


def spectra_of(
    comparisons: Sequence[Comparison], step: float, hold: Hold = "first_order"
) -> Spectra | None:
    """Estimate spectra by Welch's method, over all trajectories; None where they are too short.

    Inputs with a zero-order hold are stairs, and each stair ends at the time of its sample.
    """
    shortest = min(len(c.time) for c in comparisons)
    length = 2 ** int(np.log2(max(1, shortest // SEGMENTS)))
    if length < SHORTEST_SEGMENT:
        return None
    sums: dict[str, ComplexArray] = {}
    for u, y, z in _segments(comparisons, length):
        for name, one, other in (
            *(("inputs", u, u), ("to_reference", u, y), ("to_surrogate", u, z)),
            *(("reference", y, y), ("surrogate", z, z), ("error", z - y, z - y)),
        ):
            product = np.einsum("fi,fj->fij", one.conj(), other)
            sums[name] = sums[name] + product if name in sums else product
    # one-sided densities, the means over all segments
    window = np.hanning(length)
    scale = 2.0 * step / (_count(comparisons, length) * np.sum(window**2))
    densities = {name: scale * values[1:] for name, values in sums.items()}
    for name in ("reference", "surrogate", "error"):
        densities[name] = np.einsum("fii->fi", densities[name]).real
    frequency = np.asarray(np.fft.rfftfreq(length, step)[1:], dtype=np.float64)
    return Spectra(frequency, **densities, held=step if hold == "zero_order" else 0.0)


def _starts(comparison: Comparison, length: int) -> range:
    return range(0, len(comparison.time) - length + 1, length // 2)


def _count(comparisons: Sequence[Comparison], length: int) -> int:
    return sum(len(_starts(c, length)) for c in comparisons)


def _segments(
    comparisons: Sequence[Comparison], length: int
) -> Iterator[tuple[ComplexArray, ComplexArray, ComplexArray]]:
    """Transform inputs, reference and surrogate of all segments, (F + 1, n_channels) each."""
    window = np.hanning(length)[:, None]
    for comparison in comparisons:
        courses = [comparison.inputs, comparison.reference, comparison.surrogate]
        # one mean is subtracted from both outputs: two means would hide a constant error
        means = [courses[0].mean(axis=0), courses[1].mean(axis=0), courses[1].mean(axis=0)]
        for first in _starts(comparison, length):
            one, other, third = (
                np.fft.rfft(window * (course[first : first + length] - mean), axis=0)
                for course, mean in zip(courses, means, strict=True)
            )
            yield one, other, third
