"""Fixtures: a finished run of a state-space recipe."""

from tests.acceptance.conftest import state_space

__all__ = ["state_space"]
