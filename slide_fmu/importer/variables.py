"""Variables of an instance of an FMU are set and got together; their arrays are made once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from ctypes import c_bool, c_double, c_float, c_int
from typing import Any, final

from fmpy import fmi2
from fmpy.model_description import ModelVariable

_C_TYPES: Mapping[tuple[str, bool], Any] = {
    ("Real", False): c_double,
    ("Boolean", False): c_int,
    ("Float64", True): c_double,
    ("Float32", True): c_float,
    ("Boolean", True): c_bool,
}
"""Type of C of the variables that are set and got as numbers, by type and whether of FMI 3.0."""


@final
class InstanceVariables:
    """InstanceVariables are set and got together, in one order; a Boolean is 0 or 1.

    Its arrays are made once: inputs are set several times in every step of a solver.

    Attributes:
        references: their value references.
        blocks: the variables of each type.

    Args:
        calls: fmpy's object with the calls of the instance.
        fmi_3: whether it is of FMI 3.0.
        variables: fmpy's descriptions, of types Real, Float64, Float32 or Boolean.
    """

    def __init__(self, calls: Any, fmi_3: bool, variables: Sequence[ModelVariable]) -> None:
        self.references = [variable.valueReference for variable in variables]
        types = [variable.type for variable in variables]
        self.blocks: list[VariableBlock] = []
        for kind in dict.fromkeys(types):
            columns = [i for i, type_ in enumerate(types) if type_ == kind]
            references = [self.references[i] for i in columns]
            self.blocks.append(VariableBlock(calls, fmi_3, kind, columns, references))

    def __len__(self) -> int:
        return len(self.references)

    def set(self, values: Sequence[float]) -> None:
        """Set one value for each variable, in their units."""
        if len(self.blocks) == 1:
            self.blocks[0].set(values)
            return
        for block in self.blocks:
            block.set([values[column] for column in block.columns])

    def get(self) -> list[float]:
        """Return one value for each variable, in their units."""
        if len(self.blocks) == 1:
            return self.blocks[0].get()
        values = [0.0] * len(self.references)
        for block in self.blocks:
            for column, value in zip(block.columns, block.get(), strict=True):
                values[column] = value
        return values


@final
class VariableBlock:
    """A VariableBlock has the variables of one type.

    Attributes:
        columns: their places among all that are set and got together.
        kind: their type of ctypes.
        numbers: their value references, as an array of ctypes.
        setter, getter: names of the functions of FMI that set and get them.
    """

    def __init__(
        self, calls: Any, fmi_3: bool, type_: str, columns: list[int], references: list[int]
    ) -> None:
        self.columns = columns
        self._call: Callable[..., Any] = calls._call
        self.kind, count = _C_TYPES[type_, fmi_3], len(columns)
        self._values = (self.kind * count)()
        self._is_real = self.kind in (c_double, c_float)
        self.numbers, lengths = (fmi2.fmi2ValueReference * count)(*references), (count,) * fmi_3
        self._arguments = (calls.component, self.numbers, count, self._values, *lengths)
        prefix = "fmi3" if fmi_3 else "fmi2"
        self.setter, self.getter = f"{prefix}Set{type_}", f"{prefix}Get{type_}"

    def set(self, values: Sequence[float]) -> None:
        self._values[:] = values if self._is_real else [int(value) for value in values]
        self._call(self.setter, *self._arguments)

    def get(self) -> list[float]:
        self._call(self.getter, *self._arguments)
        return self._values[:] if self._is_real else [float(value) for value in self._values]
