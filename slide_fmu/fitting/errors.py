"""Trainings raise this error."""

from __future__ import annotations


class TrainingError(RuntimeError):
    """A training diverged, or its checkpoint cannot be used."""
