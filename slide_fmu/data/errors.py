"""This module defines the error of trajectories, without the packages that read them."""

from __future__ import annotations


class TrajectoryError(ValueError):
    """Trajectories of a recipe are missing."""
