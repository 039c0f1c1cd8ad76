"""Recorded inputs as FMU: drives other FMUs in masters that take no inputs from outside."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Real
from pythonfmu.enums import Fmi2Initial, Fmi2Variability

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.python_fmu.torch_window import SAME, Clock
from slide_fmu.python_fmu.writer import complete, keep_module_of, write_python_fmu

RECORD = "inputs.npz"

_SCRIPT = '''"""Recorded inputs; the Python environment must offer slide_fmu."""

from slide_fmu.python_fmu import input_source


class {class_name}(input_source.InputSource):
    """Named by the file of inputs beside it."""
'''


def write_input_source(
    signals: Sequence[Signal], step: float, inputs: FloatArray, path: Path
) -> Path:
    """Write an FMU whose outputs are recorded inputs, sample k from time k h on.

    After the record its last sample is held. Needs this Python environment where it runs.

    Args:
        signals: what the columns are; become the outputs.
        step: h in s.
        inputs: shape (N, n_inputs), in the signals' units.
        path: file to write, ending in ``.fmu``.

    Returns:
        The path.

    Raises:
        ValueError: the path does not end in ``.fmu``.
    """
    about = json.dumps({"step": step, "signals": [asdict(signal) for signal in signals]})
    record = io.BytesIO()
    np.savez(record, about=np.array(about), inputs=inputs)
    class_name = "InputSource"
    script = _SCRIPT.format(class_name=class_name)
    return write_python_fmu(class_name, script, path, {RECORD: record.getvalue()})


class InputSource(Fmi2Slave):  # type: ignore[misc]
    """A record of inputs as FMI 2.0 co-simulation slave."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        keep_module_of(cls)

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        keep_module_of(type(self))
        record = Path(self.resources) / RECORD
        with np.load(record) as found:
            about, self.inputs = json.loads(str(found["about"])), found["inputs"]
        self.guid = hashlib.sha256(record.read_bytes()).hexdigest()[:32]
        self.signals = [Signal(**signal) for signal in about["signals"]]
        self.step = float(about["step"])
        self.clock = Clock(self.step)
        self.description = "Recorded inputs; the last one is held"
        self.default_experiment = DefaultExperiment(0.0, None, self.step)
        for index, signal in enumerate(self.signals):
            self.register_variable(
                Real(
                    signal.name,
                    causality=Fmi2Causality.output,
                    variability=Fmi2Variability.continuous,
                    initial=Fmi2Initial.calculated,
                    description=signal.description,
                    getter=partial(self._value, index),
                ),
                nested=False,
            )

    def setup_experiment(self, start_time: float, *others: object) -> None:
        """Begin with the sample of the start time."""
        self.clock.anchor = start_time

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Go on to the sample that acts from the end of the step.

        Whole steps are counted: rounded ones must not add up.
        """
        length, _ = self.clock.meant(step_size)
        self.clock.advance(self.clock.time, length)
        return True

    def _value(self, index: int) -> float:
        """Of an output now."""
        sample = min(
            max(int(np.floor(self.clock.time / self.step + SAME)), 0), len(self.inputs) - 1
        )
        return float(self.inputs[sample, index])

    def to_xml(self, model_options: Mapping[str, str] | None = None) -> Element:
        """Model description with units, ranges and initial unknowns."""
        root: Element = super().to_xml(dict(model_options or {}))
        complete(root, self.signals)
        return root
