"""What a surrogate gives to an importer that sets inputs to what they are at the start of a step.

Where inputs move linearly, its FMU forecasts what they do within the step. That errs too, and an
error bound shall hold the error that the importer gets: so the FMU itself is run that way.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from slide_fmu.cosim.run import UnpackedFmu, run_fmu, unpacked
from slide_fmu.data.store import Split
from slide_fmu.fmu.export import export_fmu
from slide_fmu.surrogate.surrogate import Surrogate


def plain_predictions(surrogate: Surrogate, splits: Sequence[Split]) -> list[NDArray[np.float64]]:
    """Predict the outputs at samples 1 .. N, (n_trajectories, N, n_outputs), of each split.

    Every trajectory has its own parameters. Where inputs are held, or are planned motions, they
    are known.

    Raises:
        CoSimulationError: the FMU reports an error.
    """
    if surrogate.hold == "zero_order" or surrogate.planned:
        return [_known(surrogate, split) for split in splits]
    alone = dataclasses.replace(surrogate, estimator=None, bound=None)
    with TemporaryDirectory(prefix="slide_fmu_plain_") as folder:
        path = export_fmu(alone, Path(folder) / f"{surrogate.name}.fmu")
        with unpacked(path) as fmu:
            return [_plain(surrogate, fmu, split) for split in splits]


def _plain(surrogate: Surrogate, fmu: UnpackedFmu, split: Split) -> NDArray[np.float64]:
    names, found = [signal.name for signal in surrogate.outputs], []
    for inputs, parameters in zip(split.inputs, _parameters(surrogate, split), strict=True):
        # inputs[k] is reached at the end of step k: so it is set before the next one
        now = np.concatenate([inputs[:1], inputs[:-1]])
        given = {signal.name: now[:, i] for i, signal in enumerate(surrogate.inputs)}
        found.append(run_fmu(fmu, given, names, parameters, surrogate.window.step).values[1:])
    return np.stack(found)


def _known(surrogate: Surrogate, split: Split) -> NDArray[np.float64]:
    if split.parameters is None:
        values = surrogate.network.stream(surrogate.input_scaling.apply(split.inputs))
        newest = values[:, :, -len(surrogate.outputs) :].astype(np.float64)
        return surrogate.output_scaling.invert(newest)
    pairs = zip(split.inputs, _parameters(surrogate, split), strict=True)
    return np.stack([surrogate.predict_newest(inputs, given) for inputs, given in pairs])


def _parameters(surrogate: Surrogate, split: Split) -> list[dict[str, float]]:
    """Return the physical parameters of each trajectory by name; none where there are none."""
    if split.parameters is None:
        return [{} for _ in split.inputs]
    names = [parameter.name for parameter in surrogate.parameters]
    return [dict(zip(names, row, strict=True)) for row in split.parameters.tolist()]
