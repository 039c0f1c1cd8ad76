"""Whether the inputs of a model are the set points of a robot whose URDF is there."""

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
        remark: what was found beside the model; None if nothing was.
    """

    path: Path | None
    remark: str | None = None


def proposed_chain(model: str, given: Path | None, inputs: Sequence[DraftSignal]) -> ProposedChain:
    """Find the URDF of a model: the one that is given, else the only one beside the model's file.

    Raises:
        UrdfError: the file that is given is no URDF of a serial chain.
        RecipeError: its joints are not what the inputs set.
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
    beside = sorted(file.parent.glob("*.urdf")) if file.is_file() else []
    if len(beside) > 1:
        names = [path.name for path in beside]
        return ProposedChain(None, f"the files {names} lie beside the model; --chain takes one")
    if not beside:
        return ProposedChain(None)
    try:
        mismatch = _mismatch(beside[0], inputs)
    except UrdfError as error:
        mismatch = str(error)
    if mismatch is not None:
        return ProposedChain(None, f"{beside[0].name} beside the model is not used: {mismatch}")
    return ProposedChain(
        beside[0], f"{beside[0].name} lies beside the model: its joints are what the inputs set"
    )


def are_angles(inputs: Sequence[Signal]) -> bool:
    """Tell whether all inputs are angles as such, none their cosines or sines."""
    return all(signal.unit in ANGLES for signal in inputs)


def _mismatch(path: Path, inputs: Sequence[DraftSignal]) -> str | None:
    """Say why inputs are not the set points of a robot's joints; None if they can be.

    Raises:
        UrdfError: the file is no URDF of a serial chain.
    """
    read = read_urdf(path)
    wanted = ["m" if sliding else "rad" for sliding in read.chain.prismatic]
    units = [signal.table.unit or "1" for signal in inputs]
    if units == wanted:
        return None
    return (
        f"its joints are {list(read.joints)}; expected their set points as inputs, in this order "
        f"and in {wanted}, found {[signal.name for signal in inputs]} in {units}"
    )
