"""The loop of a coupled system: what all components exchange, and how they go on and back."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slide_fmu.apps.couple.algebraic_loop import agreeing_values
from slide_fmu.apps.couple.component import Component, StepOutputs
from slide_fmu.core.signals import FloatArray

REMEMBERED = 3
"""Number of former steps from which the linked inputs of the next one are continued. In a car with
a surrogate, the third one saves a seventh of the iterations, and a fourth one no more."""

EVEN = {2: (2.0, -1.0), 3: (3.0, -3.0, 1.0)}
"""Weights of that many former steps, the last one first, where all are as long as the next one."""

SMALL = 1e-3
"""A linked input has at least this part of its value as its size."""

SLOPE_PART = 1e-4
"""Change of an input, as a part of its size, with which derivatives are measured by rollback."""


class Mix(NamedTuple):
    """A Mix says how a linked input comes from its source: the weights of the output at the start
    of a step, of its mean over the step, and at the end, (n_links,)."""

    start: FloatArray
    mean: FloatArray
    end: FloatArray


@dataclass(eq=False)
class Loop:
    """A Loop has the present state of a coupled system. Links are in the order of ``inputs``.

    Attributes:
        components: in the order of the system.
        places: the linked inputs of each component, as a part of all of them.
        sources: for each link, the index of its output among all outputs.
        parts: the outputs of each component, as a part of all of them.
        held: whether each linked input is constant over a step.
        mix: how linked inputs come from their sources in implicit steps; discrete outputs in all.
        sizes: size of each linked input, in its unit: its largest value so far, and at least some
            small part of its declared range.
        rounding: what a linked input is exact to, in its unit, (n_links,).
        outputs: all outputs at the present time, (n_outputs,).
        inputs: linked inputs at the present time, (n_links,).
        solved: linked inputs of the last steps, the last one first, each with its length in s.
        last_change: change of the values that links carry, over the last step.
        late: whether the value that a link carries still belongs to the middle of the last step,
            since its source computes it there from held inputs, (n_links,).
    """

    components: Sequence[Component]
    places: Sequence[slice]
    sources: list[int]
    parts: Sequence[slice]
    held: NDArray[np.bool_]
    mix: Mix
    sizes: FloatArray
    rounding: FloatArray
    outputs: FloatArray
    inputs: FloatArray
    solved: list[tuple[FloatArray, float]] = field(default_factory=list)
    last_change: FloatArray = field(default_factory=lambda: np.zeros(0))
    late: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))

    def __post_init__(self) -> None:
        self.discrete = self.mix.start == 1.0  # sources that are constant over a step
        self.first = self.inputs.copy()
        floors = self.sizes
        self.sizes = self._least = np.maximum(self.sizes, np.abs(self.inputs))
        self.motions = np.maximum(floors, SMALL * np.abs(self.inputs))
        sampled = np.zeros(len(self.outputs), dtype=bool)
        sampled[[s for s, one in zip(self.sources, self.discrete, strict=True) if one]] = True
        self._following = [
            k
            for k, one in enumerate(self.components)
            if one.inputs == "held" and one.feeds_through and not sampled[self.parts[k]].any()
        ]
        follow = np.zeros(len(self.outputs), dtype=bool)
        for k in self._following:
            follow[self.parts[k]] = True
        self.following = follow[self.sources]
        self.late = np.zeros(len(self.inputs), dtype=bool)
        self.last_change = np.zeros(len(self.inputs))

    def motions_with(self, inputs: FloatArray) -> FloatArray:
        """Return how far linked inputs, (n_links,), have moved, at least a small part of them.

        Solutions are exact to a part of this: a coordinate may be far from zero.
        """
        moved = np.abs(inputs - self.first)
        least = np.maximum(moved, SMALL * np.abs(inputs))
        return np.asarray(np.maximum(self.motions, least))

    def settle(self, time: float) -> None:
        """Read outputs again that follow held inputs at once, with the inputs of this time in s.

        Within a step they got means. Without agreement the outputs of the step stay.
        """
        if not self._following:
            return
        outputs = self.outputs.copy()

        def exchanged(inputs: FloatArray) -> FloatArray:
            for k in self._following:
                one = self.components[k]
                one.set_linked(inputs[self.places[k]], time)
                outputs[self.parts[k]] = one.read()
            return outputs[self.sources]

        values = outputs[self.sources]
        _, left = agreeing_values(exchanged, values, len(self._following) + 1)
        if np.all(left <= SMALL * np.maximum(self.sizes, np.abs(values))):
            self.outputs = outputs

    def values(self, outputs: FloatArray) -> FloatArray:
        """Return the values that the links carry, (n_links,)."""
        return outputs[self.sources]

    def step(
        self,
        which: Collection[int],
        time: float,
        length: float,
        now: FloatArray,
        into: StepOutputs,
        slopes: bool = False,
    ) -> None:
        """Let some components take a step under linked inputs, and write their outputs."""
        for k in which:
            place, part = self.places[k], self.parts[k]
            one = self.components[k]
            stepped = one.advance(
                time, length, self.inputs[place], now[place], slopes and one.has_slopes(length)
            )
            into.mean[part], into.end[part] = stepped.mean, stepped.end
            if stepped.slopes is not None and into.slopes is not None:
                for all_, of_one in zip(into.slopes, stepped.slopes, strict=True):
                    all_[part, place] = of_one

    def empty(self, slopes: bool = False) -> StepOutputs:
        """Return a place for the outputs of all components, filled with the present ones."""
        shape = (len(self.outputs), len(self.inputs))
        rates = (np.zeros(shape), np.zeros(shape)) if slopes else None
        return StepOutputs(self.outputs.copy(), self.outputs.copy(), rates)

    def given(self, stepped: StepOutputs) -> FloatArray:
        """Return the linked inputs of a step that its outputs give, (n_links,)."""
        start, mean, end = map(self.values, (self.outputs, stepped.mean, stepped.end))
        return self.mix.start * start + self.mix.mean * mean + self.mix.end * end

    def carried(self, before: FloatArray, stepped: StepOutputs) -> FloatArray:
        """Return what links carried over the explicit step that was accepted last, (n_links,).

        ``before`` are their values at its beginning.
        """
        end = self.values(self.outputs)
        of_middle = np.where(self.following, self.values(stepped.end), 0.5 * (before + end))
        return np.where(self.discrete, before, np.where(self.held, of_middle, end))

    def slopes(self, stepped: StepOutputs) -> FloatArray:
        """Return the derivatives of ``given`` by the linked inputs, (n_links, n_links)."""
        assert stepped.slopes is not None
        mean, end = (rates[self.sources] for rates in stepped.slopes)
        return self.mix.mean[:, None] * mean + self.mix.end[:, None] * end

    def difference(
        self, which: Collection[int], time: float, length: float, now: FloatArray, at: StepOutputs
    ) -> None:
        """Write derivatives by differences: components step once more for each linked input.

        They are at the beginning of the step before, and somewhere in it behind.
        """
        assert at.slopes is not None
        for k in which:
            place, part, one = self.places[k], self.parts[k], self.components[k]
            state = one.instance.save()
            for index in range(place.start, place.stop):
                moved = now.copy()
                moved[index] += (change := SLOPE_PART * self.sizes[index] or SLOPE_PART)
                one.instance.restore(state)
                stepped = one.advance(time, length, self.inputs[place], moved[place])
                pairs = ((stepped.mean, at.mean), (stepped.end, at.end))
                for rates, (new, old) in zip(at.slopes, pairs, strict=True):
                    rates[part, index] = (new - old[part]) / change
            one.instance.free_state(state)

    def continued(self, length: float, linear: bool) -> FloatArray:
        """Return linked inputs of the next step, continued from outputs alone, (n_links,)."""
        values = self.values(self.outputs)
        if not linear or not self.solved:
            return values
        onward = np.where(self.held, 0.5, 1.0) * self.change(length)
        onward += np.where(self.late, 0.5 * self.last_change, 0.0)
        return np.asarray(values + np.where(self.discrete, 0.0, onward))

    def change(self, length: float) -> FloatArray:
        """Return how the values of links change in a step, as in the last one, (n_links,)."""
        if not self.solved:
            return np.zeros(len(self.inputs))
        return np.asarray(length / self.solved[0][1] * self.last_change)

    def guess(self, length: float) -> FloatArray:
        """Return linked inputs of the next step, continued from those that were solved for.

        A parabola goes through the last three, a straight line through two.
        """
        if len(self.solved) < 2:
            return self.continued(length, linear=True)
        lengths = [h for _, h in self.solved]
        if all(h == length for h in lengths):  # the usual case, where it costs least
            weighted = zip(EVEN[len(lengths)], self.solved, strict=True)
            onward = np.sum([weight * values for weight, (values, _) in weighted], axis=0)
            return np.where(self.discrete, self.values(self.outputs), onward)
        # a mean belongs to the middle of its step
        middle = np.where(self.held, 0.5, 0.0)
        places = [-sum(lengths[:i]) - middle * h for i, h in enumerate(lengths)]
        onward = np.zeros(len(self.inputs))
        for i, (values, _) in enumerate(self.solved):  # Lagrange's polynomials
            weights = np.ones(len(self.inputs))
            for j in range(len(places)):
                if j != i:
                    weights *= ((1 - middle) * length - places[j]) / (places[i] - places[j])
            onward += weights * values
        return np.asarray(np.where(self.discrete, self.values(self.outputs), onward))

    def accept(
        self,
        stepped: StepOutputs,
        now: FloatArray,
        given: FloatArray,
        length: float,
        time: float | None = None,
    ) -> None:
        """Go on to the end of a step with linked inputs ``now``; its outputs give ``given``.

        After an implicit step, outputs settle at its end, a time in s.
        """
        before = self.values(self.outputs)
        self.outputs = stepped.end.copy()
        if time is not None:
            self.settle(time)
        self.late = self.following & (self.values(self.outputs) == self.values(stepped.end))
        self.last_change = self.values(self.outputs) - before
        self.inputs = np.where(self.held, self.values(self.outputs), now)
        self.solved = [(given.copy(), length), *self.solved[: REMEMBERED - 1]]
        self.sizes = np.maximum(self.sizes, np.abs(now))
        self.motions = self.motions_with(now)

    def save(self, which: Collection[int]) -> dict[int, object]:
        """Return the states of some components."""
        return {k: self.components[k].instance.save() for k in which}

    def restore(self, states: dict[int, object]) -> None:
        """Go back to these states."""
        for k, state in states.items():
            self.components[k].instance.restore(state)

    def free(self, states: dict[int, object]) -> None:
        """Forget these states."""
        for k, state in states.items():
            self.components[k].instance.free_state(state)

    def watch(self) -> list[float]:
        """Return the values of all watched variables at the present time."""
        return [value for one in self.components for value in one.watch()]

    def mark(self) -> tuple[object, ...]:
        """Return what ``go_back`` needs to undo ``accept``; states of components are apart."""
        values = self.outputs, self.inputs, list(self.solved), self.last_change, self.late
        return *values, self.motions, self.sizes

    def go_back(self, mark: tuple[Any, ...]) -> None:
        """Undo what was accepted since a mark.

        An input that has not moved before keeps its size in the longest step that was tried: the
        size in a shorter one would make the error of that as large as before.
        """
        *others, sizes = mark
        self.outputs, self.inputs, self.solved, self.last_change, self.late, self.motions = others
        self.sizes = np.where(sizes > self._least, sizes, self.sizes)

    def difference_of(self, values: FloatArray, others: FloatArray) -> float:
        """Return the largest difference of linked values, as a part of their sizes."""
        parts = np.abs(values - others) / np.where(self.sizes > 0, self.sizes, np.inf)
        return float(np.max(parts, initial=0.0))
