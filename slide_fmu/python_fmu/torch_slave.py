"""The inside of an FMU that carries a torch module. Becomes part of that FMU.

It imports nothing of slide_fmu where it runs: Python with torch and numpy is enough, PythonFMU is
in the FMU. This file and those that it imports get names of their own there. Window and
communication step mean what they mean in the native runtime, see ``fmu/runtime/README.md``.
Nothing is known of how the inputs of a module go on, so that there is no forecast: inputs with a
first-order hold are set to what they reach by the end of a step, and the description says so.

The library of PythonFMU answers a call with fmi2OK, a step with fmi2Discard too, and every
exception with fmi2Fatal, after which the instance is gone. So a step that cannot be taken is
discarded; what else is refused is logged and changes nothing (values that cannot be had are NaN),
and the next step is discarded: no importer goes on as if nothing were wrong.
"""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pythonfmu import Boolean, Fmi2Causality, Real
from pythonfmu.enums import Fmi2Status

from slide_fmu.fmu.description.variables import KINDS, PREHISTORY_KNOWN, REFERENCES_PER_KIND
from slide_fmu.python_fmu.slave import Slave, stored
from slide_fmu.python_fmu.torch_network import ModuleNetwork
from slide_fmu.python_fmu.torch_window import Clock, FloatArray, PastInputs

DESCRIPTION = "module.json"
AT_STEP_END = "; inputs are set to what they reach by the end of a step"
RANGE_SLACK = 1e-6
"""Of scaled inputs, as in ``runtime/window/ranges.h``."""

TRIALS = 5
"""Windows of random inputs that a module is tried on when its FMU is written."""

PLAIN_STATE = ("prehistory_known", "stepping", "outputs", "filled")
"""Attributes of a slave that are saved as they are."""

_Value = TypeVar("_Value", float, bool)


class ModuleSlave(Slave):
    """A torch module on a sliding window as co-simulation slave of FMI 2.0.

    Values of inputs and outputs are in the units of their signals, times in s.
    """

    CAPABILITIES = dict.fromkeys(("canGetAndSetFMUstate", "canSerializeFMUstate"), "true")

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        folder = Path(self.resources)
        content = (folder / DESCRIPTION).read_bytes()
        self.about: dict[str, Any] = json.loads(content)
        self.network = ModuleNetwork(folder, len(self.about["outputs"]))
        self.clock, self.filled = Clock(float(self.about["window"]["step"])), 0.0
        self.n_in = int(self.about["window"]["n_in"])
        identity, step = content + self.network.identity, self.clock.step
        first_order = self.about["inputs"][0]["hold"] == "first_order"
        text = self.about["description"] + (AT_STEP_END if first_order else "")
        self.introduce(identity, text, step)
        signals = self.about["inputs"]
        self.inputs = [float(signal["start"]) for signal in signals]
        self.initial = list(self.inputs)
        self.prehistory_known = 0.0
        self.offset = np.array([signal["offset"] for signal in signals])
        self.scale = np.array([signal["scale"] for signal in signals])
        self.past = PastInputs(self.n_in, step, first_order)
        self.stepping = False
        self.refused: str | None = None  # why the next step is
        self.outputs: list[float] | None = None  # None: those of the present inputs, held
        self._register()
        self._present_outputs()

    def _register(self) -> None:
        """Declare the variables of the table, with its names, types and value references."""
        tables = {"one": [{}], "input": self.about["inputs"], "output": self.about["outputs"]}
        for kind in KINDS:
            for index, signal in enumerate(tables[kind.per] if kind.in_module_fmus else ()):
                name = signal.get("name", "")
                own_text = signal["description"] if kind.name == "{signal}" else ""
                self.add(
                    {"Real": Real, "Boolean": Boolean}[kind.type],
                    kind.name_for(name),
                    kind.causality,
                    kind.variability,
                    kind.reference(index),
                    description=own_text or kind.text.format(signal=name),
                    **self._access(kind.key, index),
                )

    def _access(self, key: str, index: int) -> dict[str, Any]:
        """Say how the variables of a kind are got and, where they can be, set."""
        access: dict[str, dict[str, Any]] = {
            "INPUT": stored(self.inputs, index),
            "OUTPUT": {"getter": lambda: self._present_outputs()[index]},
            "WINDOW_FILLED": {"getter": self._window_filled},
            "IN_RANGE": {"getter": self._in_range},
            "PREHISTORY_KNOWN": stored(vars(self), "prehistory_known"),
            "INITIAL_INPUT": stored(self.initial, index),
        }
        return access[key]

    def _window_filled(self) -> float:
        return 1.0 if self.prehistory_known else min(1.0, self.filled / self.n_in)

    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, *others: object
    ) -> None:
        """Start the clock at a start time, both in s."""
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
        """Go on to stepping: from here on parameters keep their values."""
        self.stepping = True

    def get_real(self, vrs: Sequence[int]) -> list[float]:
        """Give values of variables; all NaN where one is none or the module gives no outputs."""
        return self._get(Real, vrs, math.nan)

    def get_boolean(self, vrs: Sequence[int]) -> list[bool]:
        """Give values of variables; all are false where one is none."""
        return self._get(Boolean, vrs, False)

    def _get(self, wanted: type, vrs: Sequence[int], none: _Value) -> list[_Value]:
        try:
            for vr in vrs:
                if not isinstance(self.vars.get(vr), wanted):
                    raise ValueError(
                        f"value reference {vr} is no variable of type {wanted.__name__}; expected "
                        "those of modelDescription.xml"
                    )
            return [type(none)(self.vars[vr].getter()) for vr in vrs]
        except ValueError as error:
            self._refuse_next(str(error))
            return [none] * len(vrs)

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        """Take over values, all or none."""
        faults = (self._fault_of(vr, value) for vr, value in zip(vrs, values, strict=True))
        fault = next((fault for fault in faults if fault is not None), None)
        if fault is None:
            super().set_real(vrs, values)
        else:
            self._refuse_next(fault)

    def set_boolean(self, vrs: Sequence[int], values: Sequence[bool]) -> None:
        """Refuse to set anything: the only Boolean variable is an output."""
        if len(vrs) > 0:
            self._refuse_next(
                f"value reference {vrs[0]} is no Boolean variable that can be set; only inputs, "
                f"0 to {len(self.inputs) - 1}, and parameters can be set, which are Real"
            )

    def _fault_of(self, reference: int, value: float) -> str | None:
        """Say why a variable cannot have a value now."""
        variable, index = self.vars.get(reference), reference % REFERENCES_PER_KIND
        if variable is None or variable.setter is None:
            return (
                f"value reference {reference} is no input; only inputs, 0 to "
                f"{len(self.inputs) - 1}, and parameters can be set"
            )
        if variable.causality == Fmi2Causality.parameter and self.stepping:
            return (
                f"value reference {reference} is a parameter; set it before the end of "
                "initialization mode"
            )
        if variable.name == PREHISTORY_KNOWN:
            fine = value in (0.0, 1.0)
            return None if fine else f"{PREHISTORY_KNOWN} = {value}; expected 0 or 1"
        with np.errstate(over="ignore"):
            scaled = np.float32((value - self.offset[index]) / self.scale[index])
        if np.isfinite(value) and np.isfinite(scaled):
            return None
        return (
            f"input with value reference {reference} = {value}; expected a finite number near the "
            "input's range"
        )

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Take in the present inputs; a step that cannot be taken is rejected with a message."""
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
        self.filled += count or length / self.clock.step
        self.clock.advance(current_time, step_size)
        return True

    def _refuse(self, fault: str) -> bool:
        self.log(f"{self.modelName}: {fault}; nothing was changed", Fmi2Status.error)
        return False

    def _refuse_next(self, fault: str) -> None:
        """Report a fault for which PythonFMU has no status; discard the next step for it."""
        self._refuse(fault)
        self.refused = f"refused because of what went before: {fault}"

    def _present_outputs(self) -> list[float]:
        """Give the present outputs; before the first step, those of inputs held for ever."""
        if self.outputs is not None:
            return self.outputs
        outputs: list[float] = self._evaluate(self._window()).tolist()
        return outputs

    def _window(self) -> FloatArray:
        """Give the inputs behind the present outputs, shape (n_in, n_inputs)."""
        if self.past.window is not None:
            return self.past.window
        return np.tile(self.initial if self.prehistory_known else self.inputs, (self.n_in, 1))

    def _in_range(self) -> bool:
        return bool(np.all(np.abs(self._scaled(self._window())) <= 1 + RANGE_SLACK))

    def _evaluate(self, window: FloatArray) -> FloatArray:
        """Give the outputs, shape (n_outputs,), of a window of inputs, shape (n_in, n_inputs)."""
        signals = self.about["outputs"]
        offset, scale = (np.array([s[key] for s in signals]) for key in ("offset", "scale"))
        return np.asarray(self.network.values(self._scaled(window)) * scale + offset)

    def _scaled(self, window: FloatArray) -> FloatArray:
        return np.asarray((window - self.offset) / self.scale)

    def _get_fmu_state(self) -> dict[str, Any]:
        """Give all that changes, as JSON values; floats keep all their bits."""
        return {
            **{name: getattr(self, name) for name in PLAIN_STATE},
            "guid": self.guid,
            "inputs": list(self.inputs),
            "initial": list(self.initial),
            "window": None if self.past.window is None else self.past.window.tolist(),
            "steps": list(self.past.steps),
            "clock": [self.clock.anchor, self.clock.stride, self.clock.count],
        }

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        if state.get("guid") != self.guid:
            self._refuse_next(str(state.get("fault", "the state belongs to another FMU")))
            return
        self.inputs[:] = state["inputs"]
        self.initial[:] = state["initial"]
        for name in PLAIN_STATE:
            setattr(self, name, state[name])
        window = state["window"]
        self.past.window = None if window is None else np.array(window)
        self.past.steps = [(length, list(inputs)) for length, inputs in state["steps"]]
        self.clock.anchor, self.clock.stride, self.clock.count = state["clock"]

    @staticmethod
    def _fmu_state_to_bytes(state: dict[str, Any]) -> bytes:
        text = json.dumps(state).encode("utf-8")
        return b"%08x" % zlib.crc32(text) + text

    @staticmethod
    def _fmu_state_from_bytes(data: bytes) -> dict[str, Any]:
        """Read the state; of damaged bytes, say what is wrong with them."""
        text = data[8:]
        if data[:8] != b"%08x" % zlib.crc32(text):
            return {"fault": "the state is damaged: its checksum does not match its content"}
        return dict(json.loads(text))

    def described(self) -> list[Any]:
        """Give the signals of all real variables, after the module was tried.

        Raises:
            ValueError: the module is no function of the window, or gives no outputs.
        """
        from slide_fmu.core.signals import Signal

        self.network.require_function([self._scaled(window) for window in self._trials()])
        kept = ("unit", "low", "high", "start")
        tables = {"input": self.about["inputs"], "output": self.about["outputs"]}
        signals = []
        for kind in (kind for kind in KINDS if kind.in_module_fmus and kind.type == "Real"):
            low, high, _ = kind.bounds
            alone = {"unit": kind.unit, "low": low, "high": high, "start": 0.0}
            for table in tables.get(kind.per, [{**alone, "name": ""}]):
                name = kind.name_for(table["name"])
                signals.append(Signal(name, **{key: table[key] for key in kept}))
        return signals

    def unlimited(self) -> list[str]:
        """Give the names of the outputs, which nothing keeps within the range that is intended."""
        return [table["name"] for table in self.about["outputs"]]

    def _trials(self) -> list[FloatArray]:
        """Draw windows that the module must know: the start, and inputs in their ranges."""
        low, high = (np.array([s[key] for s in self.about["inputs"]]) for key in ("low", "high"))
        rng = np.random.default_rng(0)
        windows = [np.tile(row, (self.n_in, 1)) for row in (self.inputs, low, high)]
        for _ in range(TRIALS):
            part = rng.uniform(size=(self.n_in, len(low)))
            windows.append((1 - part) * low + part * high)
        return windows
