"""Fixtures: a finished run of a state-space recipe."""

from tests.acceptance.conftest import bounded

__all__ = ["bounded"]
