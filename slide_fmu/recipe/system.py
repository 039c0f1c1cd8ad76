"""The recipe's table ``system`` names the reference system, and completes its signals."""

from __future__ import annotations

from typing import Any

from pydantic import Field, field_validator
from pydantic_core import PydanticCustomError

from slide_fmu.core.mistakes import WITHIN
from slide_fmu.core.suggestions import or_meant
from slide_fmu.core.units import NO_UNIT, require_unit
from slide_fmu.features.drive_law import DEFAULT_LAW
from slide_fmu.recipe.learning import Table
from slide_fmu.recipe.machine import ChainRecipe, Drive, drive_law
from slide_fmu.systems.declared import Parameter, SignalTable
from slide_fmu.systems.loading import KINDS, NAMED


class SystemRecipe(Table):
    """The table ``system`` names the reference system.

    Attributes:
        kind: kind of ``model``: ``"class"``, ``"exudyn"``, ``"fmu"``, ``"function"`` or
            ``"record"``.
        model: ``"module:Class"`` for a class; for all other kinds the path of a file in the
            current folder or in the folder of the recipe.
        further: for records, further files with the same columns.
        noise_record: for records, a file with the columns of the outputs that was taken in the
            same way while nothing moved. A state-space network weights its residuals by the
            spectrum of that noise.
        parameters: parameters of the system other than ``step``; for a class, keyword arguments.
        inputs, outputs: properties of the signals that the model leaves open, by their names;
            empty for a class, which declares its own.
        reference: parameters that differ when an FMU is measured: a finer model may be the
            reference for data of a faster one. If empty, it is the same model.
        picture: ``"module:function"`` that draws the reference system in motion, for the model
            card: it takes the system and gives the bytes of a PNG file.
        chain: serial chain; the inputs are the set points of its joints, in their order. The path
            of its URDF can replace its table. If not given, it is the chain of the model, if that
            has one.
        drive: how the joints follow the set points: a name (``"linear"``,
            ``"quadratic_b_spline"``, ``"cubic_b_spline"``), or three lists. They weight the newest
            set point and the two before it in the joint's place, its rate times the step, and its
            acceleration times the step squared.
    """

    kind: str = "class"
    model: str
    further: tuple[str, ...] = ()
    noise_record: str | None = None
    parameters: dict[str, Parameter] = Field(default={})
    inputs: dict[str, SignalTable] = Field(default={})
    outputs: dict[str, SignalTable] = Field(default={})
    reference: dict[str, Parameter] = Field(default={})
    picture: str | None = Field(default=None, pattern=r"^[\w.]+:\w+$")
    chain: ChainRecipe | None = None
    drive: Drive = DEFAULT_LAW

    @field_validator("kind")
    @classmethod
    def _kind_exists(cls, value: str) -> str:
        if value not in KINDS:
            raise ValueError(f"expected one of {NAMED}: correct it{or_meant(value, NAMED)}")
        return value

    @field_validator("inputs", "outputs")
    @classmethod
    def _units_are_known(cls, value: dict[str, SignalTable]) -> dict[str, SignalTable]:
        for name, table in value.items():
            try:
                require_unit(name, NO_UNIT if table.unit is None else table.unit)
            except ValueError as error:
                place = {"text": str(error), WITHIN: [name, "unit"]}
                raise PydanticCustomError("unit", "{text}", place) from error
        return value

    @field_validator("chain", mode="before")
    @classmethod
    def _path_is_short_for_the_table(cls, value: Any) -> Any:
        return {"urdf": value} if isinstance(value, str) else value

    @field_validator("drive", mode="before")
    @classmethod
    def _is_a_name_or_three_lists(cls, value: Any) -> Any:
        lists = isinstance(value, list | tuple) and [
            len(part) if isinstance(part, list | tuple) else 0 for part in value
        ]
        if not isinstance(value, str) and lists != [3, 3, 3]:
            raise ValueError(
                "expected the name of a law in quotes, or three lists of three weights: drive = "
                "[position, rate, acceleration]"
            )
        return value

    @field_validator("drive")
    @classmethod
    def _is_a_law(cls, value: Drive) -> Drive:
        drive_law(value)
        return value
