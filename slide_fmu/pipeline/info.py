"""An FMU of slide-fmu is described as plain values."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from slide_fmu.fmu.export import MODULE, read_fmu, read_json


def describe_fmu(fmu: Path) -> dict[str, Any]:
    """Return an FMU's signals, window, size and provenance; of a torch module, its versions.

    Raises:
        FmuError: the file is no FMU of slide-fmu, or it is damaged.
        OSError: the file cannot be read.
    """
    module = read_json(fmu, MODULE)
    if module:
        return module
    surrogate, provenance = read_fmu(fmu)
    estimator, physical = surrogate.estimator, [vars(p) for p in surrogate.parameters]
    return {
        "name": surrogate.name,
        "inputs": [vars(signal) for signal in surrogate.inputs],
        "outputs": [
            {name: value for name, value in vars(signal).items() if name not in ("hold", "angle")}
            for signal in surrogate.outputs
        ],
        "hold": surrogate.hold,
        "window": vars(surrogate.window),
        "parameters": surrogate.network.count_parameters(),
        "estimator_parameters": None
        if estimator is None
        else estimator.network.count_parameters(),
        **({"physical_parameters": physical} if physical else {}),
        "provenance": provenance,
    }
