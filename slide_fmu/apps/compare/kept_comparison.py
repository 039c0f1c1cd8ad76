"""The results of a comparison stay in the run folder: models one by one, and unseen motions."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from slide_fmu.apps.compare.model_figures import ModelFigures
from slide_fmu.core.figures import plain, read_figures
from slide_fmu.core.files import write_whole
from slide_fmu.core.kept import Memo, damage_named
from slide_fmu.data.unseen import UnseenMotion


@dataclass(frozen=True)
class KeptComparison:
    """A KeptComparison is a folder with results, each with a key of everything it depends on."""

    path: Path

    def figures(self, name: str, key: str, find: Callable[[], ModelFigures]) -> ModelFigures:
        """Return the figures of a model; they are computed if none with this key are stored.

        Raises:
            DamagedFileError: a stored file is damaged.
        """
        memo = Memo(self.path / f"{name}.json", {"key": key})
        kept = memo.found("figures")
        if kept is not None:
            return read_figures(ModelFigures, kept)
        found = find()
        memo.keep("figures", plain(found))
        return found

    def motions(self, key: str, find: Callable[[], Sequence[UnseenMotion]]) -> list[UnseenMotion]:
        """Return unseen motions; they are simulated if none with this key are stored.

        Raises:
            DamagedFileError: a stored file is damaged.
        """
        place = self.path / "unseen.npz"
        if place.exists():
            content = io.BytesIO(place.read_bytes())
            with damage_named(place, "arrays that compare wrote"), np.load(content) as kept:
                if str(kept["key"]) == key:
                    return [_motion(kept, number) for number in range(int(kept["count"]))]
        found = list(find())
        arrays: Any = {"key": np.array(key), "count": np.array(len(found))}
        for number, motion in enumerate(found):
            arrays[f"inputs_{number}"], arrays[f"outputs_{number}"] = motion.inputs, motion.outputs
            arrays[f"about_{number}"] = np.array([motion.burn_in, motion.kind])
        buffer = io.BytesIO()
        np.savez(buffer, **arrays)
        write_whole(place, buffer.getvalue())
        return found


def key_of(*parts: Any) -> str:
    """Return a key of values for JSON."""
    text = json.dumps(parts, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def content_of_motions(motions: Sequence[UnseenMotion]) -> str:
    """Return a digest of the values of motions."""
    total = hashlib.sha256()
    for motion in motions:
        total.update(motion.inputs.tobytes() + motion.outputs.tobytes())
    return total.hexdigest()


def _motion(kept: Any, number: int) -> UnseenMotion:
    burn_in, kind = (int(value) for value in kept[f"about_{number}"])
    return UnseenMotion(kept[f"inputs_{number}"], kept[f"outputs_{number}"], burn_in, kind)
