"""Variables by their place in the model description, where tests want several in a row."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable
from itertools import groupby

from slide_fmu.fmu.description.surrogate_variables import fmu_variables
from slide_fmu.fmu.libraries.platforms import FmiVersion
from slide_fmu.surrogate.surrogate import Surrogate

Read = Callable[[ctypes.Array[ctypes.c_uint], bool], tuple[int, list[float]]]
"""Reads variables that are all Boolean, or all Real: status and values."""


def first_of(surrogate: Surrogate, key: str, fmi: FmiVersion = 3) -> int:
    """The place of the first variable of a kind, such as ``TIME``."""
    return [one.kind.key for one in fmu_variables(surrogate, fmi)].index(key)


class Places:
    """Value references and types by place; a place behind the last variable is its own reference.

    Args:
        surrogate: whose FMU it is; None: places are value references, all of type Real.
        fmi: version of the standard.
    """

    def __init__(self, surrogate: Surrogate | None, fmi: FmiVersion) -> None:
        self._variables = [] if surrogate is None else fmu_variables(surrogate, fmi)

    def references(self, places: Iterable[int]) -> ctypes.Array[ctypes.c_uint]:
        """Value references as an array of C."""
        references = [
            self._variables[place].reference if place < len(self._variables) else place
            for place in places
        ]
        return (ctypes.c_uint * len(references))(*references)

    def of_held(self) -> list[int]:
        """The value reference of the parameter that says that inputs are held, if there is one."""
        return [one.reference for one in self._variables if one.kind.key == "INPUTS_HELD"]

    def _is_boolean(self, place: int) -> bool:
        return place < len(self._variables) and self._variables[place].type == "Boolean"

    def read(self, places: range, read: Read) -> tuple[int, list[float]]:
        """Values of variables of both types, and the worst status."""
        values: list[float] = []
        worst = 0
        for boolean, group in groupby(places, self._is_boolean):
            status, those = read(self.references(group), boolean)
            values += map(float, those)
            worst = max(worst, status)
        return worst, values
