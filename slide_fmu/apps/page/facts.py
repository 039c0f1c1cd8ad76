"""What a page knows about a surrogate: its variables, by the value references of the FMU."""

from __future__ import annotations

from collections.abc import Sequence

from slide_fmu.core.figures import JsonObject
from slide_fmu.core.signals import Signal
from slide_fmu.fmu.description.surrogate_variables import fmu_variables, memory_lengths
from slide_fmu.fmu.description.variables import AT_STEP_END, BY_KEY, CONFIDENCE
from slide_fmu.surrogate.surrogate import Surrogate

FLAGS = ("WINDOW_FILLED", "ESTIMATE_FILLED", "IN_RANGE", "IN_DOMAIN", "NOVELTY", "BOUND_FILLED")
"""Kinds of variables that say how far the outputs can be trusted."""


def facts_of(surrogate: Surrogate) -> JsonObject:
    """Describe a surrogate as plain values, from which the page makes its controls and plots.

    References are value references of the FMU; ``estimate`` and ``bound`` of an output are None
    where the surrogate has none. Times are in s.
    """
    references = {variable.name: variable.reference for variable in fmu_variables(surrogate)}
    window, estimated = surrogate.window, surrogate.estimates_errors
    errors = {"estimate": BY_KEY["ERROR_ESTIMATE"], "bound": BY_KEY["ERROR_BOUND"]}
    outputs = _signals(surrogate.outputs, references)
    for output in outputs:
        for what, kind in errors.items():
            output[what] = references.get(kind.name_for(output["name"]))
    return {
        "name": surrogate.name,
        "step": window.step,
        "hold": surrogate.hold,
        "memory": window.step * max(memory_lengths(surrogate).values()),
        "estimated": window.step * surrogate.estimated_samples if estimated else None,
        "inputs": _signals(surrogate.inputs, references),
        "outputs": outputs,
        "parameters": _signals([p.signal for p in surrogate.parameters], references),
        "flags": {
            BY_KEY[key].name: references[BY_KEY[key].name]
            for key in FLAGS
            if BY_KEY[key].name in references
        },
        "confidence": _confidence(surrogate, references),
        "atStepEnd": references.get(AT_STEP_END),
    }


def names_of(surrogate: Surrogate) -> list[str]:
    """Return the names of inputs, outputs and parameters, which a drawing may use."""
    owners = (surrogate.inputs, surrogate.outputs, surrogate.parameters)
    return [signal.name for group in owners for signal in group]


def _signals(signals: Sequence[Signal], references: dict[str, int]) -> list[JsonObject]:
    return [
        {
            "name": signal.name,
            "unit": signal.unit,
            "low": signal.low,
            "high": signal.high,
            "start": signal.start_value,
            "angle": signal.angle,
            "description": signal.description,
            "reference": references[signal.name],
        }
        for signal in signals
    ]


def _confidence(surrogate: Surrogate, references: dict[str, int]) -> JsonObject | None:
    if surrogate.bound is None:
        return None
    high = surrogate.bound.confidences[-1]
    low, _, start = BY_KEY["CONFIDENCE"].bounds
    return {"low": low, "high": high, "start": start, "reference": references[CONFIDENCE]}
