"""This module collects the sources of features: inputs, serial chain and drive law of a system."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.core.scaling import Affine
from slide_fmu.core.search_path import AmbiguousFileError, find_file
from slide_fmu.core.signals import Signal
from slide_fmu.features.base import FeatureOffer
from slide_fmu.features.placed_chain import PlacedChain
from slide_fmu.features.urdf import UrdfError, read_urdf
from slide_fmu.recipe.machine import drive_law
from slide_fmu.recipe.recipe import Recipe, RecipeError
from slide_fmu.systems.base import Source, chain_of


def offered_features(recipe: Recipe, system: Source, scaling: Affine) -> FeatureOffer:
    """Return the sources of features; the scaling is the scaling of the system's inputs.

    The serial chain is the recipe's, else the system's own; its drive law is the recipe's.

    Raises:
        UrdfError: the recipe's chain cannot be read.
        RecipeError: the inputs are not the set points of its joints.
    """
    wanted, chain = recipe.system.chain, chain_of(system)
    if wanted is not None:
        read = read_urdf(_found(wanted.urdf), wanted.tool, wanted.gravity)
        _require_set_points(recipe, system.inputs, read)
        chain = read.chain
    return FeatureOffer(system.inputs, scaling, system.step, chain, drive_law(recipe.system.drive))


def _require_set_points(recipe: Recipe, inputs: tuple[Signal, ...], read: PlacedChain) -> None:
    """Refuse a chain whose joints are not driven by one input each, in SI units."""
    names, units = [signal.name for signal in inputs], [signal.unit for signal in inputs]
    wanted = ["m" if sliding else "rad" for sliding in read.chain.prismatic]
    if units != wanted:
        raise RecipeError(
            f"recipe {recipe.name!r}: system.chain has the joints {list(read.joints)}; expected "
            f"their set points as inputs, in this order and in {wanted}, found {names} in {units}"
        )


def _found(name: str) -> Path:
    """Find a file as models are found.

    Raises:
        UrdfError: no file is found, or it differs from the specified one.
    """
    try:
        return find_file(name)
    except (AmbiguousFileError, FileNotFoundError) as error:
        raise UrdfError(f"system.chain: {error}") from error
