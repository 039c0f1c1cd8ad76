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
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import Draw
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Restorable, State, System
from slide_fmu.systems.simulation import simulate


@dataclass(frozen=True, eq=False)
class MeasuredInputs:
    """MeasuredInputs are N samples of inputs, with errors and bounds of a surrogate on them.

    Attributes:
        inputs: in their units, shape (N, n_inputs).
        reference: true outputs after each input, in their units, shape (N, n_outputs).
        errors: absolute errors, in the outputs' units, shape (N, n_outputs).
        bounds: their bounds at the usual confidence, likewise.
        trusted: where nothing says that outputs may be wrong, (N,).
        first: the first sample that counts.
    """

    inputs: FloatArray
    reference: FloatArray
    errors: FloatArray
    bounds: FloatArray
    trusted: NDArray[np.bool_]
    first: int

    @property
    def drawn(self) -> Draw:
        """The inputs as a trajectory without a burn-in."""
        return Draw(0, 1.0, None, self.inputs, 0)

    @property
    def ratios(self) -> FloatArray:
        """Errors over their bounds, (N, n_outputs); 0 where they do not count or are flagged."""
        found = self.errors / self.bounds
        found[~self.trusted] = 0.0
        found[: self.first] = 0.0
        return found

    @property
    def step(self) -> int:
        """The sample with the largest of these ratios."""
        return int(np.argmax(self.ratios.max(axis=1)))

    @property
    def ratio(self) -> float:
        """The largest of these ratios."""
        return float(self.ratios.max())


def measured_inputs(
    surrogate: Surrogate, inputs: FloatArray, reference: FloatArray, first: int
) -> MeasuredInputs:
    """Measure a surrogate with a bound on inputs, (N, n_inputs), and true outputs after each."""
    errors = np.abs(surrogate.predict_newest(inputs) - reference)
    bounds, trusted = surrogate.error_bounds_and_flag(inputs)
    return MeasuredInputs(inputs, reference, errors, bounds, trusted, first)


def first_measured(surrogate: Surrogate, burn_in: int) -> int:
    """Return the first sample that counts, behind the burn-in, where the bound is filled."""
    assert surrogate.bound is not None
    return max(burn_in, surrogate.bound.filling_length)


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

    def worst(self, run: AttackedRun) -> tuple[float, int]:
        """Return the largest error over its bound where it is trusted, and its sample."""
        found = self.measured(run)
        return found.ratio, found.step

    def measured(self, run: AttackedRun) -> MeasuredInputs:
        """Measure the surrogate as far as the reference was run."""
        truth = run.outputs[1:]
        return measured_inputs(self.surrogate, run.inputs[: len(truth)], truth, self.first)

    @property
    def first(self) -> int:
        """The first sample that counts."""
        return first_measured(self.surrogate, self.drawn.burn_in)

    @property
    def forgotten_after(self) -> int:
        """The number of samples after which neither outputs nor bounds know a change."""
        assert self.surrogate.bound is not None
        return max(self.surrogate.window.n_in, self.surrogate.bound.filling_length)
