"""Recorded inputs become an FMU that drives other FMUs in importers without external inputs."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pythonfmu import Real

from slide_fmu.apps.reference.slave import SAME, Slave, whole_steps
from slide_fmu.apps.reference.writer import write_python_fmu
from slide_fmu.core.signals import FloatArray, Signal

RECORD = "inputs.npz"

_SCRIPT = '''"""Recorded inputs; the Python environment must offer slide_fmu."""

from slide_fmu.apps.reference import input_source


class InputSource(input_source.InputSource):
    """Named by the file of inputs beside it."""
'''


def write_input_source(
    signals: Sequence[Signal], step: float, inputs: FloatArray, path: Path
) -> Path:
    """Write an FMU whose outputs are recorded inputs, sample k from time k h on.

    After the last sample its value is held. The FMU needs this Python environment to run.

    Args:
        signals: one for each column of the inputs; they become the outputs.
        step: sample step h in s.
        inputs: the recorded inputs, shape (N, n_inputs), in the signals' units.
        path: the file to write, ending in ``.fmu``.

    Returns:
        The path.
    """
    about = json.dumps({"step": step, "signals": [asdict(signal) for signal in signals]})
    record = io.BytesIO()
    np.savez(record, about=np.array(about), inputs=inputs)
    return write_python_fmu("InputSource", _SCRIPT, path, {RECORD: record.getvalue()})


class InputSource(Slave):
    """An InputSource is an FMI 2.0 slave with recorded inputs. Final but for its name."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        record = Path(self.resources) / RECORD
        with np.load(record) as arrays:
            about, self.inputs = json.loads(str(arrays["about"])), arrays["inputs"]
        self.signals = [Signal(**signal) for signal in about["signals"]]
        self.step, self.start = float(about["step"]), 0.0
        self.stride, self.count = 0.0, 0  # equal steps since the start: not added, counted
        text = "Recorded inputs; the last one is held"
        self.introduce(record.read_bytes(), text, self.step)
        for index, signal in enumerate(self.signals):
            text, getter = signal.description, partial(self._value, index)
            kind = "discrete" if signal.hold == "zero_order" else "continuous"  # importers ask
            self.add(Real, signal.name, "output", kind, description=text, getter=getter)

    def setup_experiment(self, start_time: float, *others: object) -> None:
        """Start with the sample of the start time, in s."""
        self.start = start_time

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Move on to the sample that acts from the end of the step.

        Whole steps are counted, so that rounding does not accumulate.
        """
        length = whole_steps(step_size, self.step, self._time) * self.step or step_size
        if length != self.stride:
            self.start, self.stride, self.count = self._time, length, 0
        self.count += 1
        return True

    @property
    def _time(self) -> float:
        """The time of the present outputs in s."""
        return self.start + self.count * self.stride

    def _value(self, index: int) -> float:
        """Return the present value of an output."""
        sample = int(np.floor(self._time / self.step + SAME))
        return float(self.inputs[min(max(sample, 0), len(self.inputs) - 1), index])

    def described(self) -> list[Signal]:
        """Return the recorded signals."""
        return self.signals
