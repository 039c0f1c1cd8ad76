"""This module finds the URDF of a robot whose set points are the inputs of a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from slide_fmu.core.signals import Signal
from slide_fmu.features.urdf import UrdfError, read_urdf
from slide_fmu.recipe.recipe import RecipeError
from slide_fmu.recipe.writing import DraftSignal

ANGLES = ("rad", "deg")
"""Inputs that are all in one of these units are set points of joints, with or without a URDF."""


@dataclass(frozen=True)
class ProposedChain:
    """A ProposedChain is a URDF whose joints the inputs of a model set, if there is one.

    Attributes:
        path: the file, or None.
        remark: remark on URDFs in the model's folder; None without any.
    """

    path: Path | None
    remark: str | None = None


def proposed_chain(model: str, given: Path | None, inputs: Sequence[DraftSignal]) -> ProposedChain:
    """Find the URDF of a model: the given one, else the only one in the model's folder.

    Raises:
        UrdfError: the given file is no URDF of a serial chain.
        RecipeError: its joints are not set by the inputs.
    """
    if given is not None:
        mismatch = _mismatch(given, inputs)
        if mismatch is not None:
            raise RecipeError(
                f"--chain {given}: {mismatch}: give the model its inputs in the joints' order, or "
                "choose those of an FMU by --input"
            )
        return ProposedChain(given)
    file = Path(model.partition(":")[0])
    files = sorted(file.parent.glob("*.urdf")) if file.is_file() else []
    if len(files) > 1:
        names = [path.name for path in files]
        return ProposedChain(None, f"the files {names} lie next to the model; --chain takes one")
    if not files:
        return ProposedChain(None)
    try:
        mismatch = _mismatch(files[0], inputs)
    except UrdfError as error:
        mismatch = str(error)
    if mismatch is not None:
        return ProposedChain(None, f"{files[0].name} next to the model is not used: {mismatch}")
    return ProposedChain(
        files[0], f"{files[0].name} lies next to the model: its joints are what the inputs set"
    )


def are_angles(inputs: Sequence[Signal]) -> bool:
    """Tell whether all inputs are angles themselves, not their cosines or sines."""
    return all(signal.unit in ANGLES for signal in inputs)


def _mismatch(path: Path, inputs: Sequence[DraftSignal]) -> str | None:
    """Say why inputs are not the set points of a robot's joints; None if they can be."""
    read = read_urdf(path)
    wanted = ["m" if sliding else "rad" for sliding in read.chain.prismatic]
    units = [signal.table.unit or "1" for signal in inputs]
    if units == wanted:
        return None
    return (
        f"its joints are {list(read.joints)}; expected their set points as inputs, in this order "
        f"and in {wanted}, found {[signal.name for signal in inputs]} in {units}"
    )
