"""This module defines the error of stored trajectories, without the packages that read them."""

from __future__ import annotations


class StoreError(ValueError):
    """The store on disk is damaged or incomplete, or does not belong to the recipe."""
