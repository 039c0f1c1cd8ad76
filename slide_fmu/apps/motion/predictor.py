"""A surrogate predicts whole motions, many at once, each after a rest."""

from __future__ import annotations

from typing import final

import numpy as np

from slide_fmu.apps.motion.coordinates import Coordinate, coordinates_of, inputs_of
from slide_fmu.core.signals import FloatArray
from slide_fmu.fmu.native import NativeSurrogate
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate


class MotionError(ValueError):
    """A motion is impossible because of a limit, a goal, a tolerance, or the surrogate."""


@final
class Predictor:
    """A Predictor predicts motions of one length in the C runtime.

    Before a motion the system rests at its first coordinates, for the length of the window.

    Args:
        surrogate: of the state-space family, whose response to a whole sequence has no window.
        count: samples of a motion.

    Attributes:
        coordinates: the moving coordinates.
        lead: samples of rest before a motion, in its inputs.
        count: as above.

    Raises:
        MotionError: the surrogate is of another family.
    """

    def __init__(self, surrogate: Surrogate, count: int) -> None:
        network = surrogate.network
        if not isinstance(network, StateSpace):
            raise MotionError(
                f"surrogate {surrogate.name!r} has a network of type {type(network).__name__}; "
                "expected one of the family 'state_space', which predicts whole sequences"
            )
        self.coordinates: tuple[Coordinate, ...] = coordinates_of(surrogate.inputs)
        self.lead, self.count = surrogate.window.n_in, count
        self._native = NativeSurrogate(surrogate)

    def inputs(self, motions: FloatArray, first: FloatArray | None = None) -> FloatArray:
        """Return the inputs of motions (..., count, n_coordinates), with ``lead`` samples before.

        In these the coordinates rest at ``first``, (n_coordinates,), or at the motion's own first
        coordinates. The result is (..., lead + count, n_inputs).
        """
        resting = motions[..., :1, :] if first is None else first
        shape = (*motions.shape[:-2], self.lead, motions.shape[-1])
        before = np.broadcast_to(resting, shape)
        return inputs_of(self.coordinates, np.concatenate([before, motions], axis=-2))

    def outputs(self, motions: FloatArray, first: FloatArray | None = None) -> FloatArray:
        """Return the outputs after every step of motions (B, count, n_coordinates).

        ``first`` is as for ``inputs``; the result is (B, count, n_outputs), in the outputs' units.
        """
        # the first input counts as constant before, so one sample of rest is enough
        return self._native.predict(self.inputs(motions, first)[:, self.lead - 1 :])[:, 1:]
