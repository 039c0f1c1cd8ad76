"""What all FMUs that hold Python have in common inside. Becomes part of FMUs with a torch module.

As ``torch_slave.py`` it imports nothing of slide_fmu where it runs.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar
from xml.etree.ElementTree import Element

from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Slave
from pythonfmu.enums import Fmi2Initial, Fmi2Variability

INITIAL = {"output": Fmi2Initial.calculated, "parameter": Fmi2Initial.exact}
"""How the start values of variables are found, by causality (FMI 2.0.4, section 2.2.7)."""

_SPARE_REFERENCES: list[dict[str, Any]] = []


class Slave(Fmi2Slave):  # type: ignore[misc]
    """A co-simulation slave of FMI 2.0 that completes its model description. Never instantiated.

    Attributes:
        CAPABILITIES: attributes of the element ``CoSimulation`` that PythonFMU has otherwise.
    """

    CAPABILITIES: ClassVar[Mapping[str, str]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        _keep_module_of(cls)

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        _keep_module_of(type(self))

    def introduce(
        self, identity: bytes, description: str, step: float, stop: float | None = None
    ) -> None:
        """Set the GUID, which follows from the identity, the description and the times in s."""
        self.guid = hashlib.sha256(identity).hexdigest()[:32]
        self.description = description
        self.default_experiment = DefaultExperiment(0.0, stop, step)

    def add(
        self,
        kind: Callable[..., Any],
        name: str,
        causality: str,
        variability: str,
        reference: int | None = None,
        **others: Any,
    ) -> None:
        """Declare a variable.

        Args:
            kind: class of PythonFMU for its type.
            name, causality, variability: attributes of the variable, in words of the standard.
            reference: its value reference; PythonFMU counts where none is given.
            others: its description, its getter and its setter.
        """
        variable = kind(
            name,
            causality=Fmi2Causality[causality],
            variability=Fmi2Variability[variability],
            initial=INITIAL.get(causality),
            **others,
        )
        if reference is None:
            self.register_variable(variable, nested=False)
        else:
            variable.value_reference = reference
            self.vars[reference] = variable

    def described(self) -> Sequence[Any]:
        """Give the ``Signal`` of every real variable that has a unit and a range."""
        raise NotImplementedError

    def unlimited(self) -> Sequence[str]:
        """Give the names of variables that nothing keeps within their ranges; none of most."""
        return ()

    def to_xml(self, model_options: Mapping[str, str] | None = None) -> Element:
        """Write the model description, with units, ranges and initial unknowns.

        slide_fmu writes it, so here and nowhere else slide_fmu is at hand.
        """
        from slide_fmu.python_fmu.writer import complete

        root: Element = super().to_xml(dict(model_options or {}))
        complete(root, self.described(), self.CAPABILITIES, self.unlimited())
        return root


def stored(values: Any, key: object) -> dict[str, Any]:
    """Say how a variable is got and set whose value is ``values[key]``."""
    return {"getter": lambda: values[key], "setter": partial(values.__setitem__, key)}


def _keep_module_of(slave_class: type) -> None:
    """Hold one more reference to the names of the module that defines a slave class.

    The library of PythonFMU 0.7 gives back one reference too many per instance (its issue 228);
    without a spare one for each, the second instance in a process finds an emptied module.
    """
    _SPARE_REFERENCES.append(vars(sys.modules[slave_class.__module__]))
