"""A reference system that cannot be made or simulated raises these errors."""

from __future__ import annotations


class SimulationError(RuntimeError):
    """A reference system could not be simulated.

    Attributes:
        time: when it failed, in s from the beginning of the record; None where that is not known.
    """

    def __init__(self, message: str, time: float | None = None) -> None:
        super().__init__(message)
        self.time = time


class LoadError(ValueError):
    """A reference system could not be made from its name and parameters."""
