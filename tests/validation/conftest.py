"""Fixtures of ``tests.finer``."""

from tests.finer import finer, fmu, surrogate

__all__ = ["finer", "fmu", "surrogate"]
