"""A system that has signals, and perhaps a serial chain, but never moves."""

from __future__ import annotations

from typing import get_args

import numpy as np

from slide_fmu.core.scaling import Affine
from slide_fmu.core.signals import Angle, FloatArray, Signal
from slide_fmu.features.base import FeatureOffer
from slide_fmu.features.serial_chain import SerialChain
from slide_fmu.systems.base import Chained, Linearizable, Linearization, RandomStates, State

STEP = 0.1

ARM = SerialChain.denavit_hartenberg(
    a=np.array([0.1, 0.5]),
    d=np.array([0.3, 0.0]),
    alpha=np.array([0.5 * np.pi, 0.0]),
    masses=np.array([3.0, 2.0]),
    centres=np.array([[0.02, 0.01, 0.0], [-0.2, 0.03, 0.05]]),
    inertias=np.array([np.diag([0.02, 0.03, 0.02]), np.diag([0.01, 0.04, 0.04])]),
    gravity=np.array([0.0, 0.0, -9.81]),
    tool=np.array([0.1, 0.0, 0.0]),
)
"""Turns about the upright, then lifts."""


class Still(RandomStates, Linearizable, Chained):
    """Inputs from -1 to 1, or cosine and sine of an angle, and one output, at rest."""

    def __init__(
        self, n_inputs: int, chain: SerialChain | None = None, angle: bool = False
    ) -> None:
        self.step, self.chain = STEP, chain
        meanings = get_args(Angle) if angle else (None,) * n_inputs
        unit = "rad" if angle or chain is not None else "N"
        self.inputs = tuple(
            Signal(f"u{i}", unit, -1.0, 1.0, angle=meaning) for i, meaning in enumerate(meanings)
        )
        self.outputs = (Signal("y", "m", -1.0, 1.0),)

    def offered(self, scaling: Affine) -> FeatureOffer:
        """What features can be formed of, with a scaling of the inputs."""
        return FeatureOffer(self.inputs, scaling, self.step, self.chain)

    def random_state(
        self, rng: np.random.Generator, first_input: FloatArray | None = None
    ) -> State:
        return self.get_state()

    def rest_state(self, held_input: FloatArray) -> State:
        return self.get_state()

    def set_state(self, state: State) -> None:
        pass

    def get_state(self) -> State:
        return State(np.zeros(1), np.zeros(1), np.zeros(len(self.inputs)))

    def output(self) -> FloatArray:
        return np.zeros(1)

    def advance(self, inputs: FloatArray) -> FloatArray:
        return self.output()

    def linearize(self, state: State) -> Linearization:
        return Linearization(np.eye(1), np.eye(1), np.eye(1), np.zeros((0, 1)))
