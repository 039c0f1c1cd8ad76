"""The error of a surrogate on unseen motions."""

from __future__ import annotations

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.unseen import UnseenMotion
from slide_fmu.surrogate.surrogate import Surrogate


def scored(surrogate: Surrogate, motion: UnseenMotion) -> tuple[FloatArray, FloatArray]:
    """Error of the newest outputs, as in a co-simulation, and the reference.

    Returns:
        Surrogate minus reference, and reference, from the first scored sample on, shape
        (n_scored, n_outputs) each, in the outputs' units.
    """
    first = motion.first(surrogate.network.memory_length)
    reference = motion.outputs[first:]
    newest = surrogate.predict_newest(motion.inputs)[first - 1 :]
    return newest - reference, reference
