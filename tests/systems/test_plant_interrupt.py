"""Ctrl-C within a step of exudyn ends the program, and is no failure of the model."""

from __future__ import annotations

import signal
import time

import numpy as np
import pytest

from mbs_models.oscillators import LinearOscillator
from slide_fmu.systems.simulation import simulate

ENDS = 20.0
"""Time in s after which an interrupt counts as lost; each is noticed within a step."""


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="timers that interrupt")
def test_interrupt_within_a_step_is_never_lost() -> None:
    system = LinearOscillator(step=0.015625, damping=40.0, substeps=6)
    inputs = np.ones((200, 1))
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        for delay in np.linspace(0.002, 0.01, 40):
            with pytest.raises(KeyboardInterrupt):
                signal.setitimer(signal.ITIMER_REAL, float(delay))  # a busy machine may be late
                _simulate_until(time.monotonic() + ENDS, system, inputs)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _simulate_until(end: float, system: LinearOscillator, inputs: np.ndarray) -> None:  # type: ignore[type-arg]
    while time.monotonic() < end:
        simulate(system, inputs)
