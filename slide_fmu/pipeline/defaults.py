"""What the subcommands and the Python interface take where nothing is said."""

from __future__ import annotations

UNSEEN_SEED = 20_260_000
"""Seed of validation trajectories; their stream of seeds is used for nothing else."""
