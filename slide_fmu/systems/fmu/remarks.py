"""What is assumed about an FMU that its description does not say, in words for people."""

from __future__ import annotations

from collections.abc import Container

from slide_fmu.core.signals import Hold
from slide_fmu.systems.fmu.file import PREFIX, FmuFile, other_interface
from slide_fmu.systems.fmu.steps import interpolates


def default_hold(file: FmuFile) -> Hold:
    """Give the hold of an FMU's inputs where a recipe names none: what costs no substeps."""
    if file.interface == "model_exchange" or interpolates(file):
        return "first_order"
    return "zero_order"


def proposed_hold(file: FmuFile, inputs: Container[str]) -> Hold:
    """Give the hold that a first recipe names: inputs move, unless one of these is discrete.

    An FMU steps more finely than its surrogate, and smooth inputs that are held over the longer
    steps would be late by half of one.
    """
    found = file.description.modelVariables
    discrete = any(v.name in inputs and v.variability == "discrete" for v in found)
    return "zero_order" if discrete else "first_order"


def is_continuous(file: FmuFile) -> bool:
    """Tell whether an FMU has continuous states alone, as far as its description says."""
    found = file.description
    discrete = any(
        v.variability == "discrete" and v.causality in ("local", "output")
        for v in found.modelVariables
    )
    return (
        file.interface == "model_exchange"
        and found.numberOfContinuousStates > 0
        and found.numberOfEventIndicators == 0
        and not discrete
    )


def remarks_on(file: FmuFile) -> tuple[str, ...]:
    """Say how an FMU is simulated, one sentence each; of its inputs ``remark_on_inputs`` does."""
    version = file.description.fmiVersion
    kind = "co-simulation" if file.interface == "co_simulation" else "model exchange"
    other = other_interface(file)
    beside = f'; {PREFIX}interface = "{other}" takes the other one' if other else ""
    remarks = [f"the FMU is used for {kind}, FMI {version}{beside}"]
    if file.interface == "model_exchange":
        solver = f"fmpy's {file.options.solver} integrates it, anew from each sample on"
        states = (
            "its continuous states are all its states"
            if is_continuous(file)
            else "it has events or discrete states, so a motion leads in instead of initial states"
        )
        remarks += [solver, states]
    else:
        remarks.append("its states are not known: a motion leads in instead of initial states")
    if file.type.needsExecutionTool:
        remarks.append("it needs the tool that made it where it is simulated")
    return tuple(remarks)


def remark_on_inputs(file: FmuFile, hold: Hold) -> str:
    """Say how inputs of a hold act between samples, and what that takes."""
    own = file.options.step
    if hold == "zero_order":
        hint = 'hold = "first_order" in system.inputs lets them move linearly'
        by = "" if own is None else f", in which the FMU does steps of {own:g} s"
        return f"its inputs are held over each sample step{by}; {hint}"
    way = "its inputs move linearly from sample to sample"
    if file.interface == "model_exchange":
        return way
    if own is not None:
        return (
            f"its inputs are held over each of its steps of {own:g} s, as they are when it begins "
            f"({PREFIX}step)"
        )
    if interpolates(file):
        return f"{way}, by their derivatives"
    return (
        f"{way}, as {file.options.substeps} stairs, each a step of the FMU ({PREFIX}substeps); "
        "outputs that it computes from its inputs in its steps see the middle of the last stair. "
        "Where it is run by steps over which its inputs are held, it is late by half a step: "
        f"{PREFIX}step = SECONDS (init --fmu-step) makes a surrogate of that"
    )
