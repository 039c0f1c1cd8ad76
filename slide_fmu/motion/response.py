"""The surrogate's answer to motions from rest to rest, and what is left of it after them."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.core.window import MAX_WINDOW, Window
from slide_fmu.fmu.native import NativeSurrogate
from slide_fmu.motion.coordinates import Coordinate, coordinates_of, inputs_of
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate


class MotionError(ValueError):
    """A motion cannot be had: a limit, a goal, a tolerance, or the surrogate is in the way."""


class Response:
    """A Response answers motions of one length between two points. Final.

    Args:
        surrogate: of a family whose response to a whole record has no window: a state space.
        start, goal: coordinates before and after the motion, (n_coordinates,) each.
        samples: longest motion in samples; the response after it is looked at for as long as the
            window is.

    Raises:
        MotionError: the surrogate is of another family, or the record is too long.
    """

    def __init__(
        self, surrogate: Surrogate, start: FloatArray, goal: FloatArray, samples: int
    ) -> None:
        network = surrogate.network
        if not isinstance(network, StateSpace):
            raise MotionError(
                f"surrogate {surrogate.name!r} has a network of type {type(network).__name__}; "
                "expected one of the family 'state_space', which answers whole records"
            )
        self.surrogate, self.start, self.goal = surrogate, start, goal
        self.coordinates: tuple[Coordinate, ...] = coordinates_of(surrogate.inputs)
        self.samples, self.lead = samples, surrogate.window.n_in
        self.count = samples + surrogate.window.n_in
        length = self.lead + self.count
        if length > MAX_WINDOW:
            raise MotionError(
                f"a motion of {samples} samples needs records of {length} samples; expected at "
                f"most {MAX_WINDOW}: go over to a shorter motion"
            )
        record = StateSpace(
            network.cell, length, length, network.features, network.roles, network.turned
        )
        whole = Window(surrogate.window.step, length, length)
        self._native = NativeSurrogate(
            replace(surrogate, window=whole, network=record, estimator=None, bound=None)
        )

    @property
    def step(self) -> float:
        """The time between samples, in s."""
        return self.surrogate.window.step

    @property
    def time(self) -> FloatArray:
        """The times in s at which coordinates are what a motion says, (count,).

        A zero-order hold takes a value at the begin of a step, others reach it at its end.
        """
        first = 0 if self.surrogate.hold == "zero_order" else 1
        return np.asarray(self.step * (np.arange(self.count) + first))

    @cached_property
    def rest(self) -> FloatArray:
        """The outputs at rest at the goal, (n_outputs,)."""
        inputs = inputs_of(self.coordinates, self.goal[None])
        return np.asarray(self.surrogate.predict_newest(inputs)[0])

    def outputs(self, motions: FloatArray) -> FloatArray:
        """Give the outputs after every step of motions (B, count, n_coordinates).

        They are (B, count, n_outputs), about what they are at rest at the goal. Before a motion
        the system rests at its first sample.
        """
        predicted = self._native.predict_windows(self.record(motions))[:, self.lead :]
        return np.asarray(predicted - self.rest)

    def record(self, motions: FloatArray) -> FloatArray:
        """Give the inputs of motions (..., count, n_coordinates), with ``lead`` samples before.

        In these the system rests at the start. They are (..., lead + count, n_inputs).
        """
        shape = (*motions.shape[:-2], self.lead, len(self.start))
        first = np.broadcast_to(self.start, shape)
        return inputs_of(self.coordinates, np.concatenate([first, motions], axis=-2))
