"""True outputs of the models, by solvers that share nothing with ``slide_fmu``."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from slide_fmu.core.signals import FloatArray
from tests.benchmarks.unprepared.by_exudyn import by_exudyn
from tests.benchmarks.unprepared.by_fmpy import by_fmpy
from tests.benchmarks.unprepared.by_scipy import by_scipy
from tests.benchmarks.unprepared.kinds import Motion
from tests.benchmarks.unprepared.models import HERE, Model, Wanted

Solver = Callable[[Model, Wanted, Sequence[Motion]], list[FloatArray]]
"""Gives the outputs of motions from rest under their first inputs, (N, n_outputs) each."""
SOLVERS: dict[str, Solver] = {"function": by_scipy, "exudyn": by_exudyn, "fmu": by_fmpy}
"""Solvers by the kind of the model."""


def truths_of(
    model: Model, wanted: Wanted, motions: Sequence[Motion], cache: Path | None, key: object
) -> list[FloatArray]:
    """Return the true outputs of motions, simulated or kept, (N, n_outputs) each.

    Args:
        cache: folder that keeps them; None to keep nothing.
        key: what the motions were drawn from.
    """
    solver = SOLVERS[model.kind]
    if cache is None:
        return solver(model, wanted, motions)
    digest = hashlib.sha256()
    for source in (model.name, "kinds", "models", solver.__name__):
        digest.update((HERE / f"{source}.py").read_bytes())
    digest.update(repr((key, wanted.inputs, wanted.outputs, len(wanted.times))).encode())
    place = cache / f"{model.name}_{digest.hexdigest()[:16]}.npy"
    if not place.exists():
        cache.mkdir(parents=True, exist_ok=True)
        np.save(place, np.array(solver(model, wanted, motions)))
    return list(np.load(place))
