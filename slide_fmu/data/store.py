"""A store holds the trajectories of a recipe by split, and says what they were made from.

It is one Zarr group for each run. It keeps a fingerprint of the recipe and a short motion of the
model, so that data of other values, or of a model that has changed since, is refused.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, final

import numpy as np
import zarr

from slide_fmu.core.figures import plain, read_figures
from slide_fmu.core.files import writing
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.errors import StoreError
from slide_fmu.data.fingerprint import Fingerprint
from slide_fmu.data.stored_split import StoredSplit
from slide_fmu.recipe.model_rules import rules_of_tables
from slide_fmu.recipe.recipe import SPLITS, Recipe

FORMAT = 1
"""Stores of other formats are refused. The number rises when the fingerprint gets other keys."""


@final
@dataclass(frozen=True, eq=False)
class Store:
    """A Store is opened once, by ``open_store``, and then read and written by split.

    Attributes:
        path: its folder.
        group: its Zarr group, for reading.
        fingerprint: values of the recipe, as they were when it was opened.
        probe: outputs of a short motion of the model, or a digest of records
            (``slide_fmu.data.fingerprint.identity``).
    """

    path: Path
    group: Any
    fingerprint: Fingerprint
    probe: FloatArray

    def split(self, name: str) -> StoredSplit:
        """Return a split of the store."""
        rules = rules_of_tables({"system": self.fingerprint.system})
        return StoredSplit(self.path, name, self.group, rules.lacks_outputs)

    def require(self, recipe: Recipe) -> None:
        """Refuse a store that lacks trajectories of a recipe.

        Raises:
            StoreError: trajectories are missing, or it is damaged.
        """
        for split in SPLITS:
            if recipe.count(split):
                self.split(split).require(recipe.count(split))

    def with_origin(self, fingerprint: Fingerprint) -> Store:
        """Write what the store was made from, and return it with this.

        Raises:
            OSError: the store cannot be written; it names the path.
        """
        with writing(self.path):
            attributes = zarr.open_group(self.path, mode="r+").attrs
            attributes["fingerprint"] = plain(fingerprint)
        return replace(self, fingerprint=fingerprint)


def open_store(path: Path) -> Store:
    """Open a store.

    Raises:
        StoreError: there is no store, it is damaged, or has another version.
    """
    if not path.exists():
        raise StoreError(f"no data at {path}; generate it first (slide-fmu generate RECIPE)")
    try:
        group = zarr.open_group(path, mode="r")
        found: dict[str, Any] = group.attrs.asdict()
        probe = np.array(found["probe"], dtype=np.float64)
        tables = [found["fingerprint"][name] for name in ("data", "system")]
        if not all(isinstance(table, dict) for table in tables):
            raise TypeError("its recipe has no tables")
        if found.get("format") == FORMAT:
            return Store(path, group, read_figures(Fingerprint, found["fingerprint"]), probe)
    except (FileNotFoundError, LookupError, TypeError, ValueError) as error:
        raise StoreError(
            f"{path} is not a trajectory store, or a damaged one ({error}); remove it and "
            "generate again"
        ) from error
    raise StoreError(
        f"{path} was made by another version of slide-fmu; generate again (slide-fmu "
        "generate RECIPE --overwrite), or use the version that made it"
    )
