"""The base class of all FMUs that contain Python adds what PythonFMU 0.7 lacks."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial, wraps
from types import MappingProxyType
from typing import Any, ClassVar
from xml.etree.ElementTree import Element, SubElement

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave
from pythonfmu.enums import Fmi2Initial, Fmi2Variability

from slide_fmu.core.parameters import Parameter
from slide_fmu.core.signals import Signal
from slide_fmu.fmu.description.fmi2 import unit_definitions

INITIAL = {"output": Fmi2Initial.calculated, "parameter": Fmi2Initial.exact}
"""FMI's attribute ``initial`` of variables, by causality (FMI 2.0.4, section 2.2.7)."""

SAME = 1e-6
"""Rounding in times, in sample steps."""

_SPARE_REFERENCES: list[object] = []

_CALLED = (
    *("setup_experiment", "enter_initialization_mode", "exit_initialization_mode", "do_step"),
    *("get_real", "get_integer", "get_boolean", "get_string"),
    *("set_real", "set_integer", "set_boolean", "set_string"),
    *("_get_fmu_state", "_set_fmu_state", "terminate"),
)
"""Methods that the library of PythonFMU calls."""


class Slave(Fmi2Slave):  # type: ignore[misc]
    """A Slave is a co-simulation slave of FMI 2.0 with a complete description. Never instantiated.

    Attributes:
        CAPABILITIES: attributes of the element ``CoSimulation`` where PythonFMU has other values.
        capabilities: further ones, which depend on the instance.
    """

    CAPABILITIES: ClassVar[Mapping[str, str]] = {}
    capabilities: Mapping[str, str] = MappingProxyType({})

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        _keep_module_of(cls)
        for name in _CALLED:
            if (method := getattr(cls, name, None)) is not None:
                setattr(cls, name, _kept_on_failure(method))

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        _keep_module_of(type(self))

    def introduce(
        self, identity: bytes, description: str, step: float, stop: float | None = None
    ) -> None:
        """Set the GUID, computed from the identity, the description and the times in s."""
        self.guid = hashlib.sha256(identity).hexdigest()[:32]
        self.description = description
        self.default_experiment = DefaultExperiment(0.0, stop, step)

    def add(
        self,
        kind: Callable[..., Any],
        name: str,
        causality: str,
        variability: str,
        **others: Any,
    ) -> None:
        """Declare a variable.

        Args:
            kind: class of PythonFMU for its type.
            name, causality, variability: attributes of the variable, in words of the standard.
            others: its description, its getter and its setter.
        """
        variable = kind(
            name,
            causality=Fmi2Causality[causality],
            variability=Fmi2Variability[variability],
            initial=INITIAL.get(causality),
            **others,
        )
        self.register_variable(variable, nested=False)

    def described(self) -> Sequence[Signal | Parameter]:
        """Return the ``Signal`` of every real variable that has a unit and a range."""
        raise NotImplementedError

    def to_xml(self, model_options: Mapping[str, str] | None = None) -> Element:
        """Write the model description, with units, ranges and initial unknowns.

        The date is removed, so that the same FMU is the same file on another day.
        """
        root: Element = super().to_xml(dict(model_options or {}))
        root.attrib.pop("generationDateAndTime", None)
        signals, slave = self.described(), _child(root, "CoSimulation")
        slave.attrib.update({**self.CAPABILITIES, **self.capabilities})
        root.insert(list(root).index(slave) + 1, unit_definitions({s.unit for s in signals}))
        by_name = {variable.get("name"): variable for variable in _child(root, "ModelVariables")}
        for signal in signals:
            real = _child(by_name[signal.name], "Real")
            real.attrib.update(unit=signal.unit, min=repr(signal.low), max=repr(signal.high))
            if "start" in real.attrib:
                real.set(
                    "start", repr(signal.start_value)
                )  # all digits, so that it lies within the range
        structure = _child(root, "ModelStructure")
        unknowns = SubElement(structure, "InitialUnknowns")
        for unknown in _child(structure, "Outputs"):
            SubElement(unknowns, "Unknown", index=unknown.attrib["index"])
        return root


def stored(values: Any, key: object) -> dict[str, Callable[..., Any]]:
    """Return the getter and the setter of a variable whose value is ``values[key]``."""
    return {"getter": lambda: values[key], "setter": partial(values.__setitem__, key)}


def whole_steps(length: float, step: float, time: float = 0.0) -> int:
    """Return the number of sample steps in a communication step; 0 if it is not a multiple.

    Args:
        length: communication step in s.
        step: sample step in s.
        time: time in s to which the importer adds it: its rounding is ignored.
    """
    count = round(length / step)
    rounding = 2 * sys.float_info.epsilon * abs(time)
    return count if count > 0 and abs(length - count * step) <= SAME * step + rounding else 0


def _child(parent: Element, tag: str) -> Element:
    """Return a child that PythonFMU always writes; raise a RuntimeError if it is missing."""
    element = parent.find(tag)
    if element is None:
        raise RuntimeError(f"model description: no {tag} in {parent.tag}; expected PythonFMU 0.7")
    return element


def _kept_on_failure(method: Callable[..., Any]) -> Callable[..., Any]:
    """Return a method of a slave, after whose exceptions the slave stays in memory.

    The library of PythonFMU 0.7 releases a slave, its class and its messages at each exception,
    and again with the instance. Without spare references the interpreter crashes later.
    """
    if hasattr(method, "__wrapped__"):
        return method

    @wraps(method)
    def call(self: Slave, *args: Any) -> Any:
        try:
            return method(self, *args)
        except BaseException:
            _SPARE_REFERENCES.append((self, type(self), self._get_log_queue()))
            raise

    return call


def _keep_module_of(slave_class: type) -> None:
    """Keep one more reference to the names of the module that defines a slave class.

    The library of PythonFMU 0.7 releases one reference too many per instance (its issue 228).
    Without a spare one for each, the second instance in a process finds an emptied module.
    """
    _SPARE_REFERENCES.append(vars(sys.modules[slave_class.__module__]))
