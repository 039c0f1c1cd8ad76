"""The inside of an FMU that carries a torch module. Becomes part of that FMU, word by word.

It imports nothing of slide_fmu where it runs: Python, torch, numpy and pythonfmu are enough.
Window and communication step mean what they mean in the native runtime, see
``fmu/runtime/README.md``.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
import torch
from numpy.typing import NDArray
from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave, Real
from pythonfmu.enums import Fmi2Initial, Fmi2Status, Fmi2Variability

FloatArray = NDArray[np.float64]

DESCRIPTION = "module.json"
SCRIPTED, EXPORTED = "module.pt", "module.pt2"
SAME = 1e-6
"""In sample steps: what counts as rounding."""
SHORTEST = 1 / 32
"""In sample steps: a shorter step is joined to the one after it."""

RANGE_SLACK = 1e-6
"""Relative to half a range, as in ``runtime/ranges.h``."""

_SPARE_REFERENCES: list[dict[str, Any]] = []


class PastInputs:
    """The window and the communication steps behind it, as in ``runtime/stream.c``. Final.

    Attributes:
        window: samples of the inputs, oldest first, shape (n_samples, n_inputs).
        steps: length in s and inputs of every step that is remembered, oldest first.
    """

    def __init__(self, n_samples: int, step: float, ramp: bool) -> None:
        self._n, self._h, self._ramp = n_samples, step, ramp
        self.window: FloatArray | None = None
        self.steps: list[tuple[float, list[float]]] = []

    def begin(self, inputs: list[float]) -> None:
        """The inputs before the first step are known: they are a step of their own."""
        self.window = np.tile(inputs, (self._n, 1))
        self._remember(self._h, inputs)

    def take(self, length: float, inputs: list[float]) -> FloatArray:
        """Take in a step of this length, in s, under these inputs; the window after it."""
        count = round(length / self._h)
        whole = length == count * self._h and count <= self._n
        if self.window is None:
            self.window = np.tile(inputs, (self._n, 1))
            self._remember(length, inputs)
        elif whole:
            newest, reached = np.array(self.steps[-1][1]), np.array(inputs)
            left = np.arange(count - 1.0, -1.0, -1.0)[:, None] / count if self._ramp else 0.0
            added = reached - left * (reached - newest) + np.zeros((count, 1))
            self.window = np.concatenate([self.window[count:], added])
            self._remember(length, inputs)
        else:
            self._remember(length, inputs)
            self.window = self._sampled()
        return self.window

    def _remember(self, length: float, inputs: list[float]) -> None:
        if len(self.steps) > 1:
            before, held = self.steps[-1]
            if before < SHORTEST * self._h or (held == inputs and not self._ramp):
                self.steps.pop()
                length += before
        self.steps.append((length, list(inputs)))
        covered = sum(length for length, _ in self.steps[1:])
        while len(self.steps) > 2 and covered - self.steps[1][0] > (self._n + 1) * self._h:
            covered -= self.steps[1][0]
            del self.steps[0]  # one before those that cover the window is left: ramps begin there

    def _sampled(self) -> FloatArray:
        """All samples anew, up to the end of the newest step."""
        inputs = np.array([row for _, row in self.steps])
        lengths = np.array([length for length, _ in self.steps])
        begins = -np.cumsum(lengths[::-1])[::-1]
        left = np.arange(self._n, 0, -1.0)
        times = -(left - 1) * self._h if self._ramp else -left * self._h + SAME * self._h
        at = np.maximum(np.searchsorted(begins, times, side="right") - 1, 0)
        if not self._ramp:
            return np.asarray(inputs[at])
        part = np.clip((times - begins[at]) / lengths[at], 0.0, 1.0)[:, None]
        return np.asarray(inputs[at] - (1 - part) * (inputs[at] - inputs[np.maximum(at - 1, 0)]))


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
        self.module, identity = _load(folder)
        self.guid = hashlib.sha256(text + identity).hexdigest()[:32]
        self.description = self.about["description"]
        self.sample_step = float(self.about["window"]["step"])
        self.n_in = int(self.about["window"]["n_in"])
        self.default_experiment = DefaultExperiment(0.0, None, self.sample_step)
        signals = self.about["inputs"]
        self.inputs = [float(signal["start"]) for signal in signals]
        self.initial = list(self.inputs)
        self.prehistory_known = 0.0
        self.low = np.array([signal["low"] for signal in signals])
        self.high = np.array([signal["high"] for signal in signals])
        self.offset = np.array([signal["offset"] for signal in signals])
        self.scale = np.array([signal["scale"] for signal in signals])
        self.past = PastInputs(self.n_in, self.sample_step, self.about["hold"] == "ramp")
        self.time, self.filled = 0.0, 0.0
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
            "window_filled",
            "Part of the inputs behind the outputs that were set in this run; trust the outputs "
            "from 1 on",
            lambda: 1.0 if self.prehistory_known else min(1.0, self.filled / self.n_in),
        )
        self._add_output(
            "inputs_in_range",
            "1 when all inputs behind the outputs lay in their ranges; else 0",
            lambda: float(self._in_range()),
            Fmi2Variability.discrete,
        )
        self._add_parameter(
            "prehistory_known",
            "1: before the start the inputs were the initial ones; 0: the first input held for "
            "ever",
            lambda: self.prehistory_known,
            partial(setattr, self, "prehistory_known"),
        )
        for index, signal in enumerate(self.about["inputs"]):
            self._add_parameter(
                f"initial_{signal['name']}",
                f"{signal['name']} before the start, where prehistory_known is 1",
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

    def setup_experiment(self, start_time: float, *others: object) -> None:
        """Start the clock."""
        self.time = start_time

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Take in the present inputs; what cannot be done is refused with a logged message."""
        step = self.sample_step
        allowed = min(SAME * step + 1e-9 * abs(self.time), step / 4)
        if not abs(current_time - self.time) <= allowed:
            return self._refuse(
                f"communication point {current_time} s; expected {self.time} s, the end of the "
                "last step"
            )
        if not (step_size > 0 and math.isfinite(step_size)):
            return self._refuse(f"communication step {step_size} s; expected a positive one")
        if not np.all(np.isfinite(self.inputs)):
            return self._refuse(f"inputs {self.inputs}; expected finite values")
        count = round(step_size / step)
        length = count * step if abs(step_size - count * step) <= SAME * step else step_size
        before = self.past.window, list(self.past.steps)
        if self.past.window is None and self.prehistory_known:
            self.past.begin(self.initial)
        outputs = self._evaluate(self.past.take(length, self.inputs))
        if not np.all(np.isfinite(outputs)):
            self.past.window, self.past.steps = before
            return self._refuse(f"the outputs at {current_time + step_size} s are not finite")
        self.outputs = outputs.tolist()
        self.filled += length / step
        self.time = current_time + step_size
        return True

    def _refuse(self, message: str) -> bool:
        self.log(f"{self.modelName}: {message}; nothing was changed", Fmi2Status.error)
        return False

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
        slack = RANGE_SLACK * (self.high - self.low) / 2
        window = self._window()
        return bool(np.all((window >= self.low - slack) & (window <= self.high + slack)))

    def _output(self, index: int) -> float:
        return self._present_outputs()[index]

    def _evaluate(self, window: FloatArray) -> FloatArray:
        """Outputs, shape (n_outputs,), of a window of inputs, shape (n_in, n_inputs)."""
        scaled = ((window - self.offset) / self.scale).astype(np.float32)
        with torch.no_grad():
            values = self.module(torch.from_numpy(scaled)[None]).reshape(-1)
        signals = self.about["outputs"]
        if len(values) % len(signals) or len(values) < len(signals):
            raise ValueError(
                f"the module gives {len(values)} values; expected a multiple of its "
                f"{len(signals)} outputs, sample by sample, the newest last"
            )
        newest = values[-len(signals) :].double().numpy()
        scale = np.array([signal["scale"] for signal in signals])
        return np.asarray(newest * scale + np.array([signal["offset"] for signal in signals]))

    def _get_fmu_state(self) -> dict[str, Any]:
        """All that changes, as JSON values; floats keep all their bits."""
        return {
            "inputs": list(self.inputs),
            "initial": list(self.initial),
            "prehistory_known": self.prehistory_known,
            "window": None if self.past.window is None else self.past.window.tolist(),
            "steps": list(self.past.steps),
            "outputs": self.outputs,
            "filled": self.filled,
            "time": self.time,
        }

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        self.inputs[:] = state["inputs"]
        self.initial[:] = state["initial"]
        self.prehistory_known = state["prehistory_known"]
        window = state["window"]
        self.past.window = None if window is None else np.array(window)
        self.past.steps = [(length, list(inputs)) for length, inputs in state["steps"]]
        self.outputs = state["outputs"]
        self.filled, self.time = state["filled"], state["time"]

    def to_xml(self, model_options: Mapping[str, str] | None = None) -> Element:
        """Model description; written by slide_fmu, so here and nowhere else it is at hand."""
        from slide_fmu.signals import Signal
        from slide_fmu.systems.python_fmu import child, complete

        root: Element = super().to_xml(dict(model_options or {}))
        for flag in ("canGetAndSetFMUstate", "canSerializeFMUstate"):
            child(root, "CoSimulation").set(flag, "true")
        kept = ("name", "unit", "low", "high", "start")
        tables = (*self.about["inputs"], *self.about["outputs"])
        signals = [Signal(**{key: table[key] for key in kept}) for table in tables]
        others = ("window_filled", "inputs_in_range", "prehistory_known")
        signals += [Signal(name, "1", 0.0, 1.0, start=0.0) for name in others]
        for table in self.about["inputs"]:
            start = {**{key: table[key] for key in kept}, "name": f"initial_{table['name']}"}
            signals.append(Signal(**start))
        complete(root, signals)
        return root


def _load(folder: Path) -> tuple[Callable[[torch.Tensor], torch.Tensor], bytes]:
    """The module of an FMU, ready to be evaluated, and the bytes of its file."""
    scripted, exported = folder / SCRIPTED, folder / EXPORTED
    if exported.exists():
        return torch.export.load(exported).module(), exported.read_bytes()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # scripted modules are an old form
        module = torch.jit.load(scripted)  # type: ignore[no-untyped-call]
        return module.eval(), scripted.read_bytes()


def _keep_module_of(slave_class: type) -> None:
    """As ``keep_module_of`` in ``slide_fmu/systems/python_fmu.py``, which is not at hand."""
    _SPARE_REFERENCES.append(vars(sys.modules[slave_class.__module__]))
