"""This module refuses a store of another recipe, or of a model that has changed since."""

from __future__ import annotations

from dataclasses import replace

from slide_fmu.core.signals import FloatArray
from slide_fmu.data.errors import StoreError
from slide_fmu.data.fingerprint import (
    Fingerprint,
    data_fingerprint,
    first_difference,
    same_kinds_of_draws,
    same_motion,
)
from slide_fmu.data.store import Store
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.recipe.recipe import Recipe


def require_origin(store: Store, recipe: Recipe, probe: FloatArray, redrawn: bool = False) -> None:
    """Refuse a store that was made from another recipe, or from a model that has changed since.

    Recipes with and without error estimator may share a store. The probe is as in
    ``prepared_store``, which may draw trajectories beyond the ranges anew: these are ``redrawn``.

    Raises:
        StoreError: a value differs (the message names the first that does), or the model gives
            other outputs.
    """
    found, wanted = store.fingerprint, data_fingerprint(recipe)
    # a store without trajectories for an estimator, or of the bound's own kinds, gets them later,
    # in streams of their own
    if found.estimator is None or wanted.estimator is None:
        found, wanted = replace(found, estimator=None), replace(wanted, estimator=None)
    if found.bound is None or wanted.bound is None:
        found, wanted = replace(found, bound=None), replace(wanted, bound=None)
    _require_same_values(store, found, wanted, redrawn)
    if not same_motion(store.probe, probe):
        changed = rules_of(recipe).changed(recipe.system, store.probe, probe)
        raise StoreError(f"{store.path}: {changed}")


def _require_same_values(
    store: Store, found: Fingerprint, wanted: Fingerprint, redrawn: bool
) -> None:
    """Refuse fingerprints that differ in more than the redrawn trajectories."""
    same, command = same_kinds_of_draws, "slide-fmu generate RECIPE --overwrite"
    difference = first_difference(same(found), same(wanted))
    if difference is None and not redrawn:
        difference = first_difference(found, wanted)
        command = (
            "slide-fmu generate RECIPE, which keeps the trajectories that are drawn as before"
        )
    if difference is not None:
        raise StoreError(
            f"{store.path} was generated from other values: {difference}; restore the recipe, or "
            f"generate again ({command})"
        )


def require_motion(store: Store, probe: FloatArray, where: str) -> None:
    """Refuse a model whose short motion differs from the motion of the store's model.

    Raises:
        StoreError: the motions differ; the message begins with the place.
    """
    if not same_motion(store.probe, probe):
        raise StoreError(
            f"{where} simulates another motion than the machine where {store.path} was made; "
            "expected the same model: install the same packages there, and restart the workers, "
            "since they keep what they have loaded"
        )
