"""The surrogate's answer to motions from rest to rest."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from slide_fmu.apps.motion.coordinates import Coordinate, inputs_of
from slide_fmu.apps.motion.records import Records
from slide_fmu.apps.motion.route import Route
from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.surrogate import Surrogate


class Response:
    """A Response answers motions of one length between two points. Final.

    Args:
        surrogate: what predicts.
        route: of the motion, between the coordinates before it and after it.
        samples: longest motion in samples; the response after it is looked at for as long as the
            window is.

    Raises:
        MotionError: as for ``Records``.
    """

    def __init__(self, surrogate: Surrogate, route: Route, samples: int) -> None:
        self.surrogate, self.route, self.samples = surrogate, route, samples
        self._records = Records(surrogate, samples + surrogate.window.n_in)

    @property
    def start(self) -> FloatArray:
        """Coordinates before the motion, (n_coordinates,)."""
        return self.route.start

    @property
    def goal(self) -> FloatArray:
        """Coordinates after it, (n_coordinates,)."""
        return self.route.goal

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Give what moves."""
        return self._records.coordinates

    @property
    def count(self) -> int:
        """The samples of a motion with the rest after it."""
        return self._records.count

    @property
    def lead(self) -> int:
        """The samples of rest before a motion."""
        return self._records.lead

    @property
    def step(self) -> float:
        """The time between samples, in s."""
        return self.surrogate.window.step

    @property
    def time(self) -> FloatArray:
        """The times in s at which coordinates are what a motion says, (count,).

        At the time 0 they are still what they were before.
        """
        return np.asarray(self.step * (np.arange(self.count) + 1))

    @property
    def output_time(self) -> FloatArray:
        """The times in s of the outputs, (count,): those after a step.

        An input with a zero-order hold is what a motion says at the beginning of the step, others
        at its end.
        """
        later = self.step if self.surrogate.hold == "zero_order" else 0.0
        return self.time + later

    @cached_property
    def rest(self) -> FloatArray:
        """The outputs at rest at the goal, (n_outputs,)."""
        inputs = inputs_of(self.coordinates, self.goal[None])
        return np.asarray(self.surrogate.predict_newest(inputs)[0])

    def outputs(self, motions: FloatArray) -> FloatArray:
        """Give the outputs after every step of motions (B, count, n_coordinates).

        They are (B, count, n_outputs), about what they are at rest at the goal. Before a motion
        the system rests at the start.
        """
        return self._records.outputs(motions, self.start) - self.rest

    def missed(self, motion: FloatArray) -> float:
        """Return the largest part of its tolerance by which it misses a point of its route."""
        return self.route.missed(motion, self.surrogate.hold == "first_order")

    def record(self, motions: FloatArray) -> FloatArray:
        """Give the inputs of motions (..., count, n_coordinates), with ``lead`` samples before.

        In these the system rests at the start. They are (..., lead + count, n_inputs).
        """
        return self._records.inputs(motions, self.start)
