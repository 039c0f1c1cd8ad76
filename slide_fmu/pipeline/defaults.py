"""This module defines defaults of the subcommands and of the Python interface."""

from __future__ import annotations

UNSEEN_SEED = 20_260_000
"""Seed of validation trajectories; their stream of seeds is used for nothing else."""
