"""What every search for a motion is given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.motion.limits import Limits
from slide_fmu.motion.records import MotionError
from slide_fmu.motion.response import Response
from slide_fmu.surrogate.surrogate import Surrogate

MOST_SAMPLES = 2000
"""A move has at most so many samples: a linear program's matrix grows with their square."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A Problem is a move from rest to rest that a surrogate answers.

    Attributes:
        surrogate: what predicts.
        start, goal: coordinates at rest, (n_coordinates,).
        limits: that every move keeps.
        tolerance: distance of the outputs from rest that counts as settled, in their unit, as a
            norm over all outputs.

    Raises:
        MotionError: start and goal are the same, or outputs have several units, of which no norm
            can be taken.
    """

    surrogate: Surrogate
    start: FloatArray
    goal: FloatArray
    limits: Limits
    tolerance: float

    def __post_init__(self) -> None:
        if np.array_equal(self.start, self.goal):
            raise MotionError(
                f"start and goal are both {self.start.tolist()}; expected two points: correct the "
                "task"
            )
        units = sorted({output.unit for output in self.surrogate.outputs})
        if len(units) > 1:
            raise MotionError(
                f"surrogate {self.surrogate.name!r} has outputs in {units}; expected one unit, "
                "since the distance from rest is a norm over all of them"
            )

    @property
    def unit(self) -> str:
        """The unit of the outputs."""
        return self.surrogate.outputs[0].unit

    def response(self, time: float) -> Response:
        """Give the response to moves that take at most a time in s.

        Raises:
            MotionError: there are too many samples, or as for ``Response``.
        """
        samples = int(np.ceil(time / self.surrogate.window.step)) + 1
        if samples > MOST_SAMPLES:
            raise MotionError(
                f"a move of {time:.4g} s has {samples} samples; expected at most {MOST_SAMPLES}: "
                "raise the limits, or lower duration or longest"
            )
        return Response(self.surrogate, self.start, self.goal, samples)
