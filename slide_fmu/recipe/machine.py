"""This module defines the recipe's tables of a serial chain and finds drive laws."""

from __future__ import annotations

from slide_fmu.features.drive_law import DRIVE_LAWS, DriveLaw, Weights
from slide_fmu.features.urdf import STANDARD_GRAVITY
from slide_fmu.recipe.learning import Table


class ChainRecipe(Table):
    """The table ``system.chain`` names the serial chain whose joints' set points the inputs are.

    Attributes:
        urdf: path of the robot's URDF, found as models are: in the current folder, or in one of
            Python's search path, to which the recipe's own folder belongs.
        tool: link whose origin is the tool point; the last one if not given.
        gravity: acceleration of gravity in the axes of the URDF's base link, in m/s^2.
    """

    urdf: str
    tool: str | None = None
    gravity: tuple[float, float, float] = STANDARD_GRAVITY


Drive = str | tuple[Weights, Weights, Weights]
"""A drive law in a recipe: its name, or its weights of position, rate and acceleration."""


def drive_law(drive: Drive) -> DriveLaw:
    """Return a drive law, by its name or by its weights of position, rate and acceleration.

    Raises:
        ValueError: no such law exists, or a joint with these weights does not follow its set
            points.
    """
    if not isinstance(drive, str):
        return DriveLaw(*drive)
    if drive not in DRIVE_LAWS:
        raise ValueError(
            f"expected one of {list(DRIVE_LAWS)}, or three lists with the weights of position, "
            "rate and acceleration"
        )
    return DRIVE_LAWS[drive]
