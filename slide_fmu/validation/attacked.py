"""A target of the search for unnoticed errors runs a surrogate and its reference on inputs.

Most of a changed trajectory stays as it was. A reference whose states can be set goes on from the
change, and ends when the change is forgotten.

Moving inputs go straight from sample to sample here, whatever the recipe's kinds of excitation do.
A surrogate of ``data.substeps`` has learnt from inputs that bend, so what the straight lines
change is part of its errors here. Without ``data.substeps`` the data have straight lines too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import Draw
from slide_fmu.surrogate.error_bound import USUAL_CONFIDENCE
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Restorable, State, System
from slide_fmu.systems.simulation import simulate


@dataclass(frozen=True, eq=False)
class AttackedRun:
    """An AttackedRun holds the outputs of the reference on inputs, as far as it was simulated.

    Attributes:
        inputs: in their units, shape (N, n_inputs).
        outputs: outputs at the start and after the first M <= N inputs, in their units, shape
            (M + 1, n_outputs).
        states: the states at these samples; empty if the system cannot start from a state.
    """

    inputs: FloatArray
    outputs: FloatArray
    states: tuple[State, ...]


@dataclass(frozen=True, eq=False)
class Target:
    """A Target is a surrogate with a bound, its reference, and a trajectory to start from.

    Attributes:
        surrogate: the one with the bound.
        system: its reference.
        drawn: where the search starts.
        goes_on: whether a run starts where its inputs were changed, and ends when the change is
            forgotten, if the drawn trajectory has an initial state; if not, every trajectory is
            simulated whole.
    """

    surrogate: Surrogate
    system: System
    drawn: Draw
    goes_on: bool = True

    def run(self, inputs: FloatArray) -> AttackedRun:
        """Run the reference on a whole trajectory, or raise a SimulationError."""
        initial = self.drawn.initial
        if not self.goes_on or initial is None or not isinstance(self.system, Restorable):
            return AttackedRun(inputs, simulate(self.system, inputs, initial).outputs, ())
        states: list[State] = []
        outputs = simulate(self.system, inputs, initial, states).outputs
        return AttackedRun(inputs, outputs, tuple(states))

    def run_changed(self, parent: AttackedRun, inputs: FloatArray, changed: slice) -> AttackedRun:
        """Run the reference on inputs that differ from another run in a range of samples alone.

        Samples later than the window, or than the memory of the bound, have forgotten the change.
        """
        if not parent.states:
            return self.run(inputs)
        assert isinstance(self.system, Restorable)
        first, end = changed.start, changed.stop + self.forgotten_after
        states: list[State] = []
        part = inputs[first:end]
        outputs = simulate(self.system, part, parent.states[first], states).outputs
        return AttackedRun(
            inputs,
            np.concatenate([parent.outputs[:first], outputs]),
            (*parent.states[:first], *states),
        )

    def errors(self, run: AttackedRun) -> FloatArray:
        """Return absolute errors where the reference was run, shape (M, n_outputs)."""
        truth = run.outputs[1:]
        return np.abs(self.surrogate.predict_newest(run.inputs[: len(truth)]) - truth)

    def worst(self, run: AttackedRun, confidence: float = USUAL_CONFIDENCE) -> tuple[float, int]:
        """Return the largest error over its bound in the domain, and its sample."""
        errors = self.errors(run)
        inputs = run.inputs[: len(errors)]
        ratios = (errors / self.surrogate.error_bounds(inputs, confidence)).max(axis=1)
        ratios[~self.surrogate.in_domain(inputs)] = 0.0
        ratios[: self.first] = 0.0
        step = int(np.argmax(ratios))
        return float(ratios[step]), step

    @property
    def highest(self) -> float:
        """The highest confidence of the bounds."""
        assert self.surrogate.bound is not None
        return self.surrogate.bound.confidences[-1]

    @property
    def first(self) -> int:
        """The first sample that counts."""
        assert self.surrogate.bound is not None
        return max(self.drawn.burn_in, self.surrogate.bound.filling_length)

    @property
    def forgotten_after(self) -> int:
        """The number of samples after which neither outputs nor bounds know a change."""
        assert self.surrogate.bound is not None
        return max(self.surrogate.window.n_in, self.surrogate.bound.filling_length)
