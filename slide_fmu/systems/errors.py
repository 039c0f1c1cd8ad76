"""This module defines the errors of reference systems that cannot be made or simulated."""

from __future__ import annotations


class SimulationError(RuntimeError):
    """A reference system could not be simulated.

    Attributes:
        time: time of the failure in s from the start of the motion; None if unknown.
    """

    def __init__(self, message: str, time: float | None = None) -> None:
        super().__init__(message)
        self.time = time


class LoadError(ValueError):
    """A reference system could not be made from its name and parameters.

    Attributes:
        parameter: name of the parameter that is wrong; None for other faults.
    """

    def __init__(self, message: str, parameter: str | None = None) -> None:
        super().__init__(message)
        self.parameter = parameter
