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
        range: lowest and highest value of the intended range, in ``unit``; that of the model if
            not given, and likewise for the keys below.
        unit: unit of the values, as FMI names it (``"N"``, ``"m"``, ``"rad"``).
        description: one line for people.
        start: value before anybody sets one, within the range; the one nearest to 0 if neither the
            recipe nor the model says one.
        hold: how an input acts between samples: ``"zero_order"`` holds it over a step,
            ``"first_order"`` moves it linearly to its next value. All inputs have the same.
        angle: ``"cosine"`` or ``"sine"`` of an input that is the one of an angle; the sine follows
            its cosine, and both turn on the circle between samples.
        period: of an input that means the same after so much more, in ``unit``; inputs in rad or
            deg are angles without it.
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

    @field_validator("range")
    @classmethod
    def _low_end_comes_first(cls, ends: tuple[float, float] | None) -> tuple[float, float] | None:
        if ends is not None and not ends[0] < ends[1]:
            raise ValueError("expected [LOW, HIGH], the smaller number first")
        return ends

    def choice(self, name: str) -> SignalChoice:
        """Return the choice that this table makes about the signal of a name."""
        low, high = self.range or (None, None)
        given = {key: value for key, value in self if key != "range"}
        return SignalChoice(name, low=low, high=high, **given)


class SystemRecipe(Table):
    """The table ``system`` names the reference system.

    Attributes:
        kind: says what ``model`` is: ``"class"``, ``"exudyn"``, ``"fmu"``, ``"function"`` or
            ``"record"``.
        model: where the model is: ``"module:Class"`` of a class, of all others the path of a file,
            found here or beside the recipe.
        further: of records, further files with the same columns.
        noise_record: of records, a file with the columns of the outputs that was taken in the same
            way while nothing moved: a state-space network weights its residuals by the spectrum of
            that noise. Without one all residuals count alike.
        parameters: those of the system beside ``step``; of a class, its keyword arguments.
        inputs, outputs: what the model leaves open about its signals, by their names; empty of a
            class, which declares its own.
        reference: those that are other when an FMU is measured: a finer model may be the reference
            of what a faster one has taught. If empty, it is the same model.
        picture: ``"module:function"`` that draws the reference system in motion, for the model
            card: it takes the system and gives the bytes of a PNG file.
        chain: serial chain whose joints' set points the inputs are, in the order of the joints;
            the path of its URDF alone is short for its table. If not given, it is that of the
            model, if it has one.
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
    chain: ChainRecipe | None = None
    drive: DriveRecipe = DriveRecipe.named(DEFAULT_LAW)

    @property
    def is_record(self) -> bool:
        """Tell whether there are measured records instead of a model that can be simulated."""
        return self.kind == KIND

    @field_validator("chain", mode="before")
    @classmethod
    def _path_is_short_for_the_table(cls, value: Any) -> Any:
        return {"urdf": value} if isinstance(value, str) else value

    @field_validator("drive", mode="before")
    @classmethod
    def _name_is_short_for_the_law(cls, value: Any) -> Any:
        return DriveRecipe.named(value) if isinstance(value, str) else value
