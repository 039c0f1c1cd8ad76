"""The recipe's table ``system`` names the reference system, and says what it leaves open."""

from __future__ import annotations

from typing import Any

from pydantic import Field, field_validator

from slide_fmu.core.signals import Angle, Hold
from slide_fmu.features.drive_law import DEFAULT_LAW
from slide_fmu.recipe.learning import Table
from slide_fmu.recipe.machine import ChainRecipe, DriveRecipe
from slide_fmu.recipe.measured import KIND
from slide_fmu.systems.specification import SignalChoice


class SignalRecipe(Table):
    """A table ``system.inputs.NAME`` or ``system.outputs.NAME`` says what a model leaves open.

    Attributes:
        range: lowest and highest value of the intended range, in ``unit``.
        unit, description, start, hold, angle, period: as of ``slide_fmu.core.signals.Signal``;
            those of the model if not given.
        column: of records, the name of the signal's column; that of the signal if not given.
    """

    range: tuple[float, float] | None = None
    unit: str | None = None
    description: str | None = None
    start: float | None = None
    hold: Hold | None = None
    angle: Angle | None = None
    period: float | None = None
    column: str | None = None

    def choice(self, name: str) -> SignalChoice:
        """Return the choice that this table makes about the signal of a name."""
        low, high = self.range or (None, None)
        given = {key: value for key, value in self if key != "range"}
        return SignalChoice(name, low=low, high=high, **given)


class SystemRecipe(Table):
    """The table ``system`` names the reference system.

    Attributes:
        kind: one of ``slide_fmu.systems.loading.KINDS``, which says what ``model`` is.
        model: of a class, ``"module:Class"`` of a ``slide_fmu.systems.base.System``.
        further: of records, further files with the same columns.
        noise_record: of records, a file with the columns of the outputs that was taken in the same
            way while nothing moved: a state-space network weights its residuals by the spectrum of
            that noise. None: all residuals count alike.
        parameters: those of the system beside ``step``; of a class, its keyword arguments.
        inputs, outputs: what the model leaves open about its signals, by their names; empty of a
            class, which declares its own.
        reference: those that are other when an FMU is measured: a finer model may be the reference
            of what a faster one has taught. Empty: the same model.
        picture: ``"module:function"`` that draws the reference system in motion, for the model
            card: it takes the system and gives the bytes of a PNG file. None: no picture.
        drawing: ``"module:function"`` or ``"file.py:function"`` that describes how the machine
            looks in motion (``slide_fmu/page/drawing.py``), for its page and its report; the FMU
            carries the description. None: no drawing.
        chain: serial chain whose joints' set points the inputs are, in the order of the joints;
            the path of its URDF alone is short for its table. None: that of the model, if it has
            one.
        drive: how the joints follow the set points: a name in ``DRIVE_LAWS`` is short for
            the table of its weights.
    """

    kind: str = "class"
    model: str
    further: tuple[str, ...] = ()
    noise_record: str | None = None
    parameters: dict[str, float | int | str | bool] = Field(default={})
    inputs: dict[str, SignalRecipe] = Field(default={})
    outputs: dict[str, SignalRecipe] = Field(default={})
    reference: dict[str, float | int | str | bool] = Field(default={})
    picture: str | None = Field(default=None, pattern=r"^[\w.]+:\w+$")
    drawing: str | None = Field(default=None, pattern=r"^[^:]+:\w+$")
    chain: ChainRecipe | None = None
    drive: DriveRecipe = DriveRecipe.named(DEFAULT_LAW)

    @property
    def is_record(self) -> bool:
        """Whether there are measured records instead of a model that can be simulated."""
        return self.kind == KIND

    @field_validator("chain", mode="before")
    @classmethod
    def _path_is_short_for_the_table(cls, value: Any) -> Any:
        return {"urdf": value} if isinstance(value, str) else value

    @field_validator("drive", mode="before")
    @classmethod
    def _name_is_short_for_the_law(cls, value: Any) -> Any:
        return DriveRecipe.named(value) if isinstance(value, str) else value
