"""This module defines the recipe's tables of a serial chain and of its drive law."""

from __future__ import annotations

from pydantic import model_validator

from slide_fmu.features.drive_law import DRIVE_LAWS, DriveLaw
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


class DriveRecipe(Table):
    """The table ``system.drive`` gives the drive law by its weights (``DriveLaw``).

    Attributes:
        position, rate, acceleration: weights of the newest set point and of the two before it in
            the joint's place, its rate times the step, its acceleration times the step squared.
    """

    position: tuple[float, float, float]
    rate: tuple[float, float, float]
    acceleration: tuple[float, float, float]

    @model_validator(mode="after")
    def _is_a_law(self) -> DriveRecipe:
        self.law()
        return self

    @classmethod
    def named(cls, name: str) -> DriveRecipe:
        """Return the table of a law in ``DRIVE_LAWS``.

        Raises:
            ValueError: no such law exists.
        """
        if name not in DRIVE_LAWS:
            raise ValueError(
                f"expected one of {list(DRIVE_LAWS)}, or a table with the weights of position, "
                "rate and acceleration"
            )
        return cls(**vars(DRIVE_LAWS[name]))

    def law(self) -> DriveLaw:
        """Return the law.

        Raises:
            ValueError: a joint with these weights does not follow its set points.
        """
        return DriveLaw(self.position, self.rate, self.acceleration)
