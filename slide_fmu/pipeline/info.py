"""An FMU of slide-fmu is described as plain values."""

from __future__ import annotations

from pathlib import Path

from slide_fmu.core.figures import JsonObject
from slide_fmu.fmu.export import read_fmu
from slide_fmu.surrogate.error_bound import ErrorBound


def describe_fmu(fmu: Path) -> JsonObject:
    """Return an FMU's signals, window, size and provenance.

    Of an error bound, it tells sizes, confidences, and lengths of the blocks of its means in s.

    Raises:
        FmuError: the file is no FMU of slide-fmu, or it is damaged.
        OSError: the file cannot be read.
    """
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
        "memory_s": surrogate.network.memory_length * surrogate.window.step,
        "planned": surrogate.planned,
        "parameters": surrogate.network.count_parameters(),
        "estimator_parameters": None
        if estimator is None
        else estimator.network.count_parameters(),
        **_of_bound(surrogate.bound, surrogate.window.step),
        **({"physical_parameters": physical} if physical else {}),
        "provenance": provenance,
    }


def _of_bound(bound: ErrorBound | None, step: float) -> JsonObject:
    """Return what is told of an error bound, of samples of a step in s; nothing without one."""
    if bound is None:
        return {}
    return {
        "error_bound": {
            "companion_parameters": bound.companion.count_parameters(),
            "head_parameters": bound.head.count_parameters(),
            "confidences": list(bound.confidences),
            "blocks_s": [length * step for length in bound.blocks],
            **({} if bound.span is None else {"estimate_span_s": bound.span.samples * step}),
        }
    }
