"""What networks see in each phase of time, in plain loops: apart from the C runtime."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from slide_fmu.core.signals import FloatArray
from slide_fmu.network.feed_forward.network import FeedForward
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.surrogate.surrogate import Surrogate
from tests.fmu.any_step import n_phases
from tests.fmu.moving_inputs import MovingOracle
from tests.fmu.plain import UNSETTLED, plain_features, plain_layers, plain_pair

NEAR = 1e-5
"""Of times in samples."""


@dataclass
class Phase:
    """The samples of one phase.

    Attributes:
        end: of the newest sample, in h.
        samples: physical, oldest first; the newest ``n_open`` may still change, and features alone
            see the first three.
        n_held: so many samples like the first were before.
        age: number of the step that needed it last.
        errors: truncation errors that stay until they are measured.
    """

    end: float
    n_held: int = 0
    samples: list[FloatArray] = field(default_factory=list)
    n_open: int = 0
    age: int = 0
    errors: FloatArray | None = None

    @property
    def known_end(self) -> float:
        return self.end - self.n_open


class PlainPhases:
    """An FMU whose steps go on in the phase of their end.

    Attributes:
        inputs: all that is known and expected of them.
    """

    def __init__(self, surrogate: Surrogate, known: bool = False) -> None:
        self.surrogate, self.inputs = surrogate, MovingOracle(surrogate, known)
        self._phases: list[Phase] = []
        self._steps, self._errors = 0, np.zeros(len(surrogate.outputs))

    def step(
        self, length: float, inputs: FloatArray, rates: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Outputs and truncation errors after a step of a length in h."""
        assert n_phases(length) > 0, "outputs between phases are interpolated"
        h, begin = self.surrogate.window.step, self.inputs.now
        self.inputs.step(length * h, inputs, rates)
        self._steps += 1
        phase = self._reach(self.inputs.now / h, begin / h)
        phase.age = self._steps
        outputs, self._errors = self._results(phase)
        return outputs, self._errors

    def _reach(self, time: float, begin: float) -> Phase:
        n_in, n_ahead = self.surrogate.window.n_in, max(math.ceil(time - begin - NEAR), 0)
        n_open = 0 if self.inputs.known else n_ahead
        unsettled = 0 if self.inputs.first_order else UNSETTLED
        if unsettled > 0:
            n_open = max(n_open + unsettled - 1, unsettled)
        for phase in self._phases:
            if abs((time - phase.end + 0.5) % 1 - 0.5) < 2 * NEAR:
                if round(time - phase.known_end) <= n_in + unsettled:
                    return self._go_on(phase, time, n_open)
                self._phases.remove(phase)
                break
        if len(self._phases) == 10:
            self._phases.remove(min(self._phases, key=lambda phase: phase.age))
        if time <= n_in + NEAR + (unsettled > 0):
            settled = 2 * self.surrogate.network.n_samples - max(unsettled - 1, 0)
            earlier = math.ceil(time - NEAR) + max(unsettled - 1, 0)
            phase = Phase(time - earlier, settled - self._first_is_held)
        else:
            ahead = 0 if self.inputs.known else n_ahead
            lasts = ahead <= n_in  # else it has seen nothing that stays
            n_open, late = (n_open, ahead) if lasts else (0, 0)
            phase = Phase(time if lasts else math.nan, n_open=n_open, errors=self._errors)
            count = 3 + max(self.surrogate.network.n_samples + late, n_open)
            phase.samples = self._samples(time, count)
        self._phases.append(phase)
        return phase if phase.samples else self._go_on(phase, time, n_open)

    @property
    def _first_is_held(self) -> bool:
        """The sample of the first inputs is one of those that settle."""
        return self.inputs.known or not self.inputs.first_order

    def _samples(self, end: float, count: int) -> list[FloatArray]:
        return list(self.inputs.samples_until(end * self.surrogate.window.step, count))

    def _go_on(self, phase: Phase, time: float, n_open: int) -> Phase:
        del phase.samples[len(phase.samples) - phase.n_open :]
        count = round(time - phase.known_end)
        phase.samples += self._samples(time, count)
        phase.end, phase.n_open = time, min(n_open, count)
        return phase

    def _results(self, phase: Phase) -> tuple[FloatArray, FloatArray]:
        surrogate, network = self.surrogate, self.surrogate.network
        first = [self.inputs.rows[0]] * (phase.n_held + 3 * (phase.n_held > 0))
        scaled = surrogate.input_scaling.apply(np.array(first + phase.samples))
        assert isinstance(network, StateSpace | FeedForward)
        features = plain_features(network.features, scaled)[3:]
        scale = surrogate.output_scaling.scale
        if isinstance(network, FeedForward):
            values = plain_layers(network, features[-network.n_samples :])
            outputs = values[-len(surrogate.outputs) :]
            return np.asarray(surrogate.output_scaling.invert(outputs)), np.zeros(len(scale))
        values, errors = plain_pair(network, features)
        measured = phase.errors is None or len(features) >= 2 * network.n_samples
        truncation = errors[-1] * scale if measured else np.asarray(phase.errors)
        return np.asarray(surrogate.output_scaling.invert(values[-1])), truncation
