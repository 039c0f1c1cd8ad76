"""User functions of a model read the inputs from ``mbs.variables``."""

from __future__ import annotations

from typing import Any

RATE = "_rate"
"""The rate of an input stands in ``mbs.variables`` under its name with this behind."""
Motion = dict[str, tuple[float, float]]
"""Of every input and every rate by its name: the value at the step's start and its rate per s."""


class Variables(dict[str, Any]):
    """These ``mbs.variables`` know the inputs: whenever a user function asks, the value of then.

    Attributes:
        motion: how the inputs move in this step.
        asked: names of inputs that were read.
    """

    def __init__(self, mbs: Any) -> None:
        super().__init__()
        self.motion: Motion = {}
        self.asked: set[str] = set()
        self._data = mbs.systemData

    def __getitem__(self, name: str) -> Any:
        if name not in self.motion:
            return super().__getitem__(name)
        self.asked.add(name.removesuffix(RATE))
        start, rate = self.motion[name]
        return start + rate * self._data.GetTime() if rate else start
