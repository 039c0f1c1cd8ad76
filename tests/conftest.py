"""Shared fixtures and settings of all tests."""

from __future__ import annotations

from hypothesis import settings

# The same examples in every run: a failure comes back. No deadline: machines are shared.
settings.register_profile("slide", deadline=None, derandomize=True, max_examples=60)
settings.load_profile("slide")
