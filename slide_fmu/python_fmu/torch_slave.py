"""The inside of an FMU that carries a torch module. Becomes part of that FMU.

It imports nothing of slide_fmu where it runs: Python with torch and numpy is enough, PythonFMU is
in the FMU. This file and those that it imports get names of their own there. Window and
communication step mean what they mean in the native runtime, see ``fmu/runtime/README.md``.

The library of PythonFMU answers a call with fmi2OK, a step with fmi2Discard too, and every
exception with fmi2Fatal, after which the instance is gone. So a step that cannot be taken is
discarded; what else is refused is logged and changes nothing (values that cannot be had are NaN),
and the next step is discarded: no master goes on as if nothing were wrong.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
import zlib
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Real
from pythonfmu.enums import Fmi2Initial, Fmi2Status, Fmi2Variability

from slide_fmu.fmu.description.names import IN_RANGE, PREHISTORY_KNOWN, WINDOW_FILLED, initial_name
from slide_fmu.python_fmu.torch_network import ModuleNetwork
from slide_fmu.python_fmu.torch_window import Clock, FloatArray, PastInputs

DESCRIPTION = "module.json"
RANGE_SLACK = 1e-6
"""Of scaled inputs, as in ``runtime/window/ranges.h``."""

TRIALS = 5
"""Windows of random inputs that a module is tried on when its FMU is written."""

_SPARE_REFERENCES: list[dict[str, Any]] = []


class ModuleSlave(Fmi2Slave):  # type: ignore[misc]
    """A torch module on a sliding window as FMI 2.0 co-simulation slave."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        _keep_module_of(cls)

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        _keep_module_of(type(self))
        folder = Path(self.resources)
        text = (folder / DESCRIPTION).read_bytes()
        self.about: dict[str, Any] = json.loads(text)
        self.network = ModuleNetwork(folder, len(self.about["outputs"]))
        self.guid = hashlib.sha256(text + self.network.identity).hexdigest()[:32]
        self.description = self.about["description"]
        self.sample_step = float(self.about["window"]["step"])
        self.n_in = int(self.about["window"]["n_in"])
        self.default_experiment = DefaultExperiment(0.0, None, self.sample_step)
        signals = self.about["inputs"]
        self.inputs = [float(signal["start"]) for signal in signals]
        self.initial = list(self.inputs)
        self.prehistory_known = 0.0
        self.offset = np.array([signal["offset"] for signal in signals])
        self.scale = np.array([signal["scale"] for signal in signals])
        self.past = PastInputs(self.n_in, self.sample_step, signals[0]["hold"] == "first_order")
        self.clock, self.filled = Clock(self.sample_step), 0.0
        self.stepping = False
        self.refused: str | None = None  # why the next step is
        self.outputs: list[float] | None = None  # None: those of the present inputs, held
        self._register()
        self._present_outputs()

    def _register(self) -> None:
        """Declare the variables, in the order of ``fmu/model_description.py``."""
        for index, signal in enumerate(self.about["inputs"]):
            self.register_variable(
                Real(
                    signal["name"],
                    causality=Fmi2Causality.input,
                    variability=Fmi2Variability.continuous,
                    description=signal["description"],
                    getter=partial(self.inputs.__getitem__, index),
                    setter=partial(self.inputs.__setitem__, index),
                ),
                nested=False,
            )
        for index, signal in enumerate(self.about["outputs"]):
            self._add_output(
                signal["name"],
                signal["description"],
                partial(self._output, index),
            )
        self._add_output(
            WINDOW_FILLED,
            "Part of the inputs behind the outputs that were set in this run; trust the outputs "
            "from 1 on",
            lambda: 1.0 if self.prehistory_known else min(1.0, self.filled / self.n_in),
        )
        self._add_output(
            IN_RANGE,
            "1 when all inputs behind the outputs lay in their ranges; else 0",
            lambda: float(self._in_range()),
            Fmi2Variability.discrete,
        )
        self._add_parameter(
            PREHISTORY_KNOWN,
            "1: before the start the inputs were the initial ones; 0: the first input held for "
            "ever",
            lambda: self.prehistory_known,
            partial(setattr, self, "prehistory_known"),
        )
        for index, signal in enumerate(self.about["inputs"]):
            self._add_parameter(
                initial_name(signal["name"]),
                f"{signal['name']} before the start, where {PREHISTORY_KNOWN} is 1",
                partial(self.initial.__getitem__, index),
                partial(self.initial.__setitem__, index),
            )

    def _add_parameter(
        self, name: str, text: str, getter: Callable[[], float], setter: Callable[[float], None]
    ) -> None:
        variable = Real(
            name,
            causality=Fmi2Causality.parameter,
            variability=Fmi2Variability.fixed,
            initial=Fmi2Initial.exact,
            description=text,
            getter=getter,
            setter=setter,
        )
        self.register_variable(variable, nested=False)

    def _add_output(
        self,
        name: str,
        text: str,
        getter: Callable[[], float],
        variability: Fmi2Variability = Fmi2Variability.continuous,
    ) -> None:
        variable = Real(
            name,
            causality=Fmi2Causality.output,
            variability=variability,
            initial=Fmi2Initial.calculated,
            description=text,
            getter=getter,
        )
        self.register_variable(variable, nested=False)

    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, *others: object
    ) -> None:
        """Start the clock."""
        stop = math.inf if stop_time is None else stop_time
        if not stop >= start_time:
            self._refuse_next(
                f"start time {start_time:g} s, stop time {stop:g} s; expected no earlier stop"
            )
        elif abs(start_time) <= self.clock.farthest:
            self.clock.anchor, self.clock.stop = start_time, stop
        else:
            self._refuse_next(
                f"start time {start_time:.15g} s; expected at most {self.clock.farthest:.3g} s "
                "from 0, where steps can be told apart"
            )

    def exit_initialization_mode(self) -> None:
        """From here on parameters keep their values."""
        self.stepping = True

    def get_real(self, vrs: Sequence[int]) -> list[float]:
        """Values of variables; all NaN where one is none, or the module gives no outputs."""
        try:
            if any(vr not in self.vars for vr in vrs):
                raise ValueError(f"value references {vrs}; expected less than {len(self.vars)}")
            values: list[float] = super().get_real(vrs)
        except ValueError as error:
            self._refuse_next(str(error))
            return [math.nan] * len(vrs)
        return values

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        """Take over values, all or none."""
        faults = (self._fault_of(vr, value) for vr, value in zip(vrs, values, strict=True))
        fault = next((fault for fault in faults if fault is not None), None)
        if fault is None:
            super().set_real(vrs, values)
        else:
            self._refuse_next(fault)

    def _fault_of(self, reference: int, value: float) -> str | None:
        """Why a variable cannot have a value now."""
        n_inputs, n_outputs = len(self.inputs), len(self.about["outputs"])
        known = n_inputs + n_outputs + 2  # of prehistory_known; the initial inputs follow
        if not (0 <= reference < n_inputs or known <= reference < len(self.vars)):
            return (
                f"value reference {reference} is no input; only inputs, 0 to {n_inputs - 1}, and "
                f"parameters, from {known} on, can be set"
            )
        if reference >= known and self.stepping:
            return (
                f"value reference {reference} is a parameter; set it before the end of "
                "initialization mode"
            )
        if reference == known:
            fine = value in (0.0, 1.0)
            return None if fine else f"{PREHISTORY_KNOWN} = {value}; expected 0 or 1"
        index = reference if reference < n_inputs else reference - known - 1
        with np.errstate(over="ignore"):
            scaled = np.float32((value - self.offset[index]) / self.scale[index])
        if np.isfinite(value) and np.isfinite(scaled):
            return None
        return (
            f"input with value reference {reference} = {value}; expected a finite number near the "
            "input's range"
        )

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Take in the present inputs; what cannot be done is refused with a logged message."""
        fault = self.refused or self.clock.fault_of(current_time, step_size)
        self.refused = None
        if fault is not None:
            return self._refuse(fault)
        length, count = self.clock.meant(step_size)
        before = self.past.window, list(self.past.steps)
        if self.past.window is None and self.prehistory_known:
            self.past.begin(self.initial)
        try:
            outputs = self._evaluate(self.past.take(length, count, self.inputs))
        except ValueError as error:
            self.past.window, self.past.steps = before
            return self._refuse(f"step to {current_time + step_size} s: {error}")
        self.outputs = outputs.tolist()
        self.filled += count or length / self.sample_step
        self.clock.advance(current_time, step_size)
        return True

    def _refuse(self, fault: str) -> bool:
        self.log(f"{self.modelName}: {fault}; nothing was changed", Fmi2Status.error)
        return False

    def _refuse_next(self, fault: str) -> None:
        """Tell a fault for which PythonFMU has no status, and discard the next step for it."""
        self._refuse(fault)
        self.refused = f"refused because of what went before: {fault}"

    def _present_outputs(self) -> list[float]:
        """Outputs at the present time; before the first step, of inputs held for ever."""
        if self.outputs is not None:
            return self.outputs
        outputs: list[float] = self._evaluate(self._window()).tolist()
        return outputs

    def _window(self) -> FloatArray:
        """The inputs behind the present outputs, shape (n_in, n_inputs)."""
        if self.past.window is not None:
            return self.past.window
        return np.tile(self.initial if self.prehistory_known else self.inputs, (self.n_in, 1))

    def _in_range(self) -> bool:
        return bool(np.all(np.abs(self._scaled(self._window())) <= 1 + RANGE_SLACK))

    def _output(self, index: int) -> float:
        return self._present_outputs()[index]

    def _evaluate(self, window: FloatArray) -> FloatArray:
        """Outputs, shape (n_outputs,), of a window of inputs, shape (n_in, n_inputs).

        Raises:
            ValueError: the module gives none that are finite numbers.
        """
        signals = self.about["outputs"]
        offset, scale = (np.array([s[key] for s in signals]) for key in ("offset", "scale"))
        return np.asarray(self.network.values(self._scaled(window)) * scale + offset)

    def _scaled(self, window: FloatArray) -> FloatArray:
        return np.asarray((window - self.offset) / self.scale)

    def _get_fmu_state(self) -> dict[str, Any]:
        """All that changes, as JSON values; floats keep all their bits."""
        return {
            "guid": self.guid,
            "inputs": list(self.inputs),
            "initial": list(self.initial),
            "prehistory_known": self.prehistory_known,
            "stepping": self.stepping,
            "window": None if self.past.window is None else self.past.window.tolist(),
            "steps": list(self.past.steps),
            "outputs": self.outputs,
            "filled": self.filled,
            "clock": [self.clock.anchor, self.clock.stride, self.clock.count],
        }

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        if state.get("guid") != self.guid:
            self._refuse_next(str(state.get("fault", "the state belongs to another FMU")))
            return
        self.inputs[:] = state["inputs"]
        self.initial[:] = state["initial"]
        self.prehistory_known, self.stepping = state["prehistory_known"], state["stepping"]
        window = state["window"]
        self.past.window = None if window is None else np.array(window)
        self.past.steps = [(length, list(inputs)) for length, inputs in state["steps"]]
        self.outputs, self.filled = state["outputs"], state["filled"]
        self.clock.anchor, self.clock.stride, self.clock.count = state["clock"]

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        text = json.dumps(state).encode("utf-8")
        return b"%08x" % zlib.crc32(text) + text

    @staticmethod
    def _fmu_state_from_bytes(data: bytes) -> dict[str, Any]:
        """The state; of damaged bytes, what is wrong with them."""
        text = data[8:]
        if data[:8] != b"%08x" % zlib.crc32(text):
            return {"fault": "the state is damaged: its checksum does not match its content"}
        return dict(json.loads(text))

    def to_xml(self, model_options: Mapping[str, str] | None = None) -> Element:
        """Model description; written by slide_fmu, so here and nowhere else it is at hand."""
        from slide_fmu.core.signals import Signal
        from slide_fmu.python_fmu.writer import child, complete

        self.network.require_function([self._scaled(window) for window in self._trials()])
        root: Element = super().to_xml(dict(model_options or {}))
        for flag in ("canGetAndSetFMUstate", "canSerializeFMUstate"):
            child(root, "CoSimulation").set(flag, "true")
        kept = ("name", "unit", "low", "high", "start")
        tables = (*self.about["inputs"], *self.about["outputs"])
        signals = [Signal(**{key: table[key] for key in kept}) for table in tables]
        others = (WINDOW_FILLED, IN_RANGE, PREHISTORY_KNOWN)
        signals += [Signal(name, "1", 0.0, 1.0, start=0.0) for name in others]
        for table in self.about["inputs"]:
            start = {**{key: table[key] for key in kept}, "name": initial_name(table["name"])}
            signals.append(Signal(**start))
        complete(root, signals)
        return root

    def _trials(self) -> list[FloatArray]:
        """Windows that the module must know: of the start, and of inputs in their ranges."""
        low, high = (np.array([s[key] for s in self.about["inputs"]]) for key in ("low", "high"))
        rng = np.random.default_rng(0)
        windows = [np.tile(row, (self.n_in, 1)) for row in (self.inputs, low, high)]
        for _ in range(TRIALS):
            part = rng.uniform(size=(self.n_in, len(low)))
            windows.append((1 - part) * low + part * high)
        return windows


def _keep_module_of(slave_class: type) -> None:
    """As ``keep_module_of`` in ``slide_fmu/python_fmu/writer.py``, which is not at hand."""
    _SPARE_REFERENCES.append(vars(sys.modules[slave_class.__module__]))
