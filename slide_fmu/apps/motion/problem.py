"""A problem has the data that every search for a motion needs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slide_fmu.apps.motion.coordinates import coordinates_of, inputs_of
from slide_fmu.apps.motion.limits import Limits
from slide_fmu.apps.motion.margin import MOST_AT_REST, PLAIN, Margins, novelty_at_rest
from slide_fmu.apps.motion.predictor import MotionError
from slide_fmu.apps.motion.response import Reference, Response
from slide_fmu.apps.motion.route import Route
from slide_fmu.core.signals import FloatArray
from slide_fmu.core.units import behind
from slide_fmu.surrogate.surrogate import Surrogate

MOST_SAMPLES = 5000
"""Largest number of samples of a move: time and memory of its linear programs grow with it."""


LOOKED_AT = 1000
"""Number of places on a curve at which its coordinates are checked."""


@dataclass(frozen=True, eq=False)
class ViaPoints:
    """ViaPoints are passed by a move without resting there.

    Attributes:
        points: coordinates, (n, n_coordinates), in their order.
        near: largest distance of each coordinate from them, (n_coordinates,), above 0.
    """

    points: FloatArray
    near: FloatArray


@dataclass(frozen=True, eq=False)
class MoveProblem:
    """A MoveProblem is a move from rest to rest, with the surrogate that predicts its response.

    Attributes:
        surrogate: the surrogate.
        start, goal: coordinates at rest, (n_coordinates,).
        limits: limits of every move.
        tolerance: distance of the outputs from rest that counts as settled, in their unit, as a
            norm over all outputs.
        via: points to pass, if any.
        slower: factor on the shortest time of profiles.
        margins: what the margins of predictions are.
        straight: whether coordinates stay on the line from start to goal, instead of having time
            laws of their own.
        reference: simulates the reference model, if moves are verified with it: then they have
            its outputs, no margin, and no domain.

    Raises:
        MotionError: points, limits or tolerance are not valid numbers, one for each coordinate;
            two successive points are the same, the route leaves the ranges, or the outputs have
            several units, so that a norm is not defined.
    """

    surrogate: Surrogate
    start: FloatArray
    goal: FloatArray
    limits: Limits
    tolerance: float
    via: ViaPoints | None = None
    slower: float = 1.0
    margins: Margins = PLAIN
    straight: bool = False
    reference: Reference | None = None

    def __post_init__(self) -> None:
        self._require_numbers()
        self._require_range()
        units = sorted({output.unit for output in self.surrogate.outputs})
        if len(units) > 1:
            raise MotionError(
                f"surrogate {self.surrogate.name!r} has outputs in {units}; expected one unit, "
                "since the distance from rest is a norm over all of them"
            )

    def _require_numbers(self) -> None:
        """Refuse values that are not one valid number for each coordinate."""
        coordinates, limits = coordinates_of(self.surrogate.inputs), self.limits
        points = [("start", self.start), ("goal", self.goal)]
        sizes = [(name, limit) for name, _, limit in limits.derivatives()]
        if self.via is not None:
            points += [(f"via {k}", point) for k, point in enumerate(self.via.points, start=1)]
            sizes.append(("via_tolerance", self.via.near))
        for name, values in points + sizes:
            if np.shape(values) != (len(coordinates),):
                raise MotionError(
                    f"{name} has the shape {np.shape(values)}; expected ({len(coordinates)},), "
                    f"one number for each of {[c.name for c in coordinates]}: give such an array"
                )
        for name, values in points:
            if not np.isfinite(values).all():
                found = values.tolist()
                raise MotionError(f"{name} is {found}; expected finite numbers: correct it")
        for name, values in [*sizes, ("tolerance", np.array([self.tolerance]))]:
            if not (np.asarray(values) > 0).all():
                raise MotionError(f"{name} is {values.tolist()}; expected more than 0: correct it")

    def _require_range(self) -> None:
        """Refuse a curve that leaves the ranges between its points."""
        along = self.route.at(np.linspace(0, 1, LOOKED_AT))
        beyond = np.maximum(along - self.limits.high, self.limits.low - along).max(axis=0)
        worst = int(np.argmax(beyond))
        if not self.route.straight and beyond[worst] > 0:
            coordinate = coordinates_of(self.surrogate.inputs)[worst]
            raise MotionError(
                f"the smooth route past the points leaves the range of {coordinate.name} by "
                f"{beyond[worst]:.3g}{behind(coordinate.unit)}; expected one within it: move "
                "the points, "
                "or raise via_tolerance"
            )

    @cached_property
    def route(self) -> Route:
        """The route from the start to the goal."""
        if self.via is None:
            free = np.full(len(self.start), np.inf)
            return Route(np.stack([self.start, self.goal]), free, free)
        points = np.vstack([self.start, self.via.points, self.goal])
        speed, ranges = self.limits.speed, np.ptp(points, axis=0)
        pace = speed if np.isfinite(speed).all() else np.where(ranges > 0, ranges, np.inf)
        return Route(points, self.via.near, pace)

    def admits(self, response: Response, motion: FloatArray) -> bool:
        """Return whether a motion, (count, n_coordinates), keeps limits and passes the points."""
        kept = self.limits.kept(self.start, motion, response.step)
        return kept and response.missed(motion) <= 1

    def require_known_start(self) -> None:
        """Refuse a start at which the surrogate does not know rest.

        Raises:
            MotionError: rest at the start lies outside the domain.
        """
        surrogate = self.surrogate
        if surrogate.bound is None or self.reference is not None:
            return
        inputs = inputs_of(coordinates_of(surrogate.inputs), self.start)
        novelty = novelty_at_rest(surrogate, inputs)
        if novelty > MOST_AT_REST:
            raise MotionError(
                f"rest at the start {self.start.tolist()} is outside of the domain of the "
                f"surrogate {surrogate.name!r} (novelty {novelty:.3g}; expected at most "
                f"{MOST_AT_REST:g}): its error bound says nothing there; begin elsewhere"
            )

    @property
    def unit(self) -> str:
        """The unit of the outputs."""
        return self.surrogate.outputs[0].unit

    def response(self, time: float) -> Response:
        """Return the response to moves that take at most a time in s.

        Raises:
            MotionError: there are too many samples, or as for ``Response``.
        """
        samples = int(np.ceil(time / self.surrogate.window.step)) + 1
        if samples > MOST_SAMPLES:
            raised = "the limits" if self.route.straight else "via_tolerance or the limits"
            raise MotionError(
                f"a move of {time:.4g} s has {samples} samples; expected at most {MOST_SAMPLES}: "
                f"raise {raised}, or lower duration or longest"
            )
        terms = self.margins, self.reference
        return Response(self.surrogate, self.route, samples, *terms)
