"""Errors of FMUs that cannot be read, or cannot be run."""

from __future__ import annotations


class FmuError(ValueError):
    """A file is not an FMU, not an FMU of slide-fmu, or damaged."""


class CoSimulationError(RuntimeError):
    """An FMU could not be run, or reports an error."""


class LostError(CoSimulationError):
    """A LostError tells that a call ended with a fatal error, after which no call is allowed."""
