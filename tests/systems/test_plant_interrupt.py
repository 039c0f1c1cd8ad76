"""Ctrl-C within a step of exudyn ends the program, and is no failure of the model."""

from __future__ import annotations

import gc
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
    gc.disable()  # Hypothesis listens to it, and Python ignores an interrupt of such a listener
    try:
        for delay in np.linspace(0.002, 0.01, 40):
            with pytest.raises(KeyboardInterrupt):
                _simulate_until(float(delay), system, inputs)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        gc.enable()


def _simulate_until(delay: float, system: LinearOscillator, inputs: np.ndarray) -> None:  # type: ignore[type-arg]
    """Simulate until an interrupt comes; it may come at once, on a busy machine."""
    end = time.monotonic() + ENDS
    signal.setitimer(signal.ITIMER_REAL, delay)
    while time.monotonic() < end:
        simulate(system, inputs)
