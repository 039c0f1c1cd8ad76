"""The surrogate predicts the response to motions from rest to rest; a reference may correct it."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import cached_property
from typing import final

import numpy as np

from slide_fmu.apps.motion.coordinates import Coordinate, inputs_of
from slide_fmu.apps.motion.margin import PLAIN, Margins
from slide_fmu.apps.motion.predictor import Predictor
from slide_fmu.apps.motion.route import Route
from slide_fmu.core.signals import FloatArray
from slide_fmu.surrogate.surrogate import Surrogate

Reference = Callable[[FloatArray], FloatArray]
"""Simulates a reference model: from inputs (N, n_inputs) to outputs (N + 1, n_outputs)."""


@final
class Response:
    """A Response predicts motions of one length between two points.

    Args:
        surrogate: the surrogate that predicts.
        route: the route of the motion, between the coordinates before it and after it.
        samples: longest motion in samples; the response after it covers one window.
        margins: what the margins of predictions are.
        reference: simulates the reference model, if the moves are verified with it.
    """

    def __init__(
        self,
        surrogate: Surrogate,
        route: Route,
        samples: int,
        margins: Margins = PLAIN,
        reference: Reference | None = None,
    ) -> None:
        self.surrogate, self.route, self.samples = surrogate, route, samples
        self.margins, self.reference = margins, reference
        self._correction: FloatArray | float = 0.0
        self._predictor = Predictor(surrogate, samples + surrogate.window.n_in)

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
        """The moving coordinates."""
        return self._predictor.coordinates

    @property
    def count(self) -> int:
        """The number of samples of a motion with the rest after it."""
        return self._predictor.count

    @property
    def lead(self) -> int:
        """The number of samples of rest before a motion."""
        return self._predictor.lead

    @property
    def step(self) -> float:
        """The time between samples, in s."""
        return self.surrogate.window.step

    @property
    def time(self) -> FloatArray:
        """The times in s of a motion's coordinates, (count,).

        At the time 0 they are still the coordinates before.
        """
        return np.asarray(self.step * (np.arange(self.count) + 1))

    @property
    def output_time(self) -> FloatArray:
        """The times in s of the outputs, (count,), which follow a step.

        An input with a zero-order hold has the motion's value at the beginning of the step, others
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
        """Return the outputs after every step of motions (B, count, n_coordinates).

        They are (B, count, n_outputs), relative to rest at the goal. Before a motion the system
        rests at the start.
        """
        return self._predictor.outputs(motions, self.start) - self.rest + self._correction

    def truth(self, motion: FloatArray) -> FloatArray:
        """Return the outputs of the reference model, (count, n_outputs), as for ``outputs``."""
        assert self.reference is not None
        outputs = self.reference(self.inputs(motion))[self.lead + 1 :]
        return np.asarray(outputs - self._true_rest)

    @cached_property
    def _true_rest(self) -> FloatArray:
        assert self.reference is not None
        resting = np.tile(self.goal, (self.lead, 1))
        return np.asarray(self.reference(inputs_of(self.coordinates, resting))[-1])

    def corrected(self, motion: FloatArray, truth: FloatArray) -> Response:
        """Return the same response with what its outputs lack along a motion added to them."""
        response = copy.copy(self)
        response._correction = self._correction + truth - self.outputs(motion[None])[0]
        return response

    def verified_by(self, reference: Reference | None) -> Response:
        """Return the response without corrections, and with another reference or none."""
        return Response(self.surrogate, self.route, self.samples, self.margins, reference)

    def missed(self, motion: FloatArray) -> float:
        """Return the largest miss of a point of its route, relative to the tolerance."""
        return self.route.missed(motion, self.surrogate.hold == "first_order")

    def inputs(self, motions: FloatArray) -> FloatArray:
        """Return the inputs of motions (..., count, n_coordinates), with ``lead`` samples before.

        In these the system rests at the start. The result is (..., lead + count, n_inputs).
        """
        return self._predictor.inputs(motions, self.start)
