"""This module reads what an FMU of slide-fmu, used as a model, declares in its surrogate."""

from __future__ import annotations

from dataclasses import replace

from slide_fmu.core.search_path import find_file
from slide_fmu.fmu.export import SURROGATE, read_fmu, read_member
from slide_fmu.systems.declared import DeclaredModel, SignalTable

REMARK = (
    "slide-fmu wrote this FMU: the recipe has the outputs, the hold of the inputs and the step of "
    "its surrogate; --output NAME takes other outputs, such as error estimates"
)


def as_surrogate(declared: DeclaredModel, outputs_chosen: bool) -> DeclaredModel:
    """Return declarations from the surrogate of an FMU of slide-fmu; all others stay as they are.

    Its own outputs are proposed, without those on errors and windows, unless the user has chosen
    outputs; they have the ranges that the recipe intended, which the FMU does not declare. Its
    inputs act between samples as they did in its training.
    """
    if declared.kind != "fmu":
        return declared
    path = find_file(declared.model)
    if read_member(path, SURROGATE) is None:
        return declared
    surrogate, _ = read_fmu(path)
    inputs = {signal.name: SignalTable.of(signal) for signal in surrogate.inputs}
    own = {s.name: SignalTable(range=(s.low, s.high)) for s in surrogate.outputs}
    outputs = {
        name: own.get(name, SignalTable()).over(table)
        for name, table in declared.outputs.items()
        if outputs_chosen or name in own
    }
    return replace(
        declared,
        inputs=inputs,
        outputs=outputs,
        step=surrogate.window.step,
        held_step=None,
        remarks=(REMARK,),
    )
