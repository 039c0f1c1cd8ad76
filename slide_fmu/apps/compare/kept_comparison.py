"""The results of a comparison stay in the run folder: models one by one, and unseen motions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slide_fmu.apps.compare.model_figures import ModelFigures
from slide_fmu.core.result_cache import ResultFile, damage_named
from slide_fmu.data.unseen import UnseenMotion


@dataclass(frozen=True)
class KeptComparison:
    """A KeptComparison is a folder with the results of comparisons."""

    path: Path

    def figures(self, name: str, key: str, find: Callable[[], ModelFigures]) -> ModelFigures:
        """Return the figures of a model; they are computed if none with this key are stored.

        Raises:
            DamagedFileError: a stored file is damaged.
        """
        file = ResultFile.of(self.path, name, key)
        known = file.read_json(ModelFigures)
        if known is not None:
            return known
        figures = find()
        file.write_json(figures)
        return figures

    def motions(self, key: str, find: Callable[[], Sequence[UnseenMotion]]) -> list[UnseenMotion]:
        """Return unseen motions; they are simulated if none with this key are stored.

        Raises:
            DamagedFileError: a stored file is damaged.
        """
        file = ResultFile.of(self.path, "unseen", key, suffix=".npz")
        known = file.read_arrays()
        if known is not None:
            with damage_named(file.path, "arrays that compare wrote"):
                numbers = range(len(known["about"]))
                return [
                    UnseenMotion(
                        known[f"inputs_{number}"],
                        known[f"outputs_{number}"],
                        *known["about"][number].tolist(),
                    )
                    for number in numbers
                ]
        motions = list(find())
        arrays = {"about": np.array([[motion.burn_in, motion.kind] for motion in motions])}
        for number, motion in enumerate(motions):
            arrays[f"inputs_{number}"], arrays[f"outputs_{number}"] = motion.inputs, motion.outputs
        file.write_arrays(arrays)
        return motions
