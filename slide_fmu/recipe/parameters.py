"""The tables ``parameters.NAME`` declare physical parameters that users of the FMU may set."""

from __future__ import annotations

from pydantic import Field, model_validator

from slide_fmu.core.parameters import Parameter, Transform
from slide_fmu.recipe.learning import Table


class ParameterRecipe(Table):
    """A table ``parameters.NAME`` declares a parameter of the model, with its range.

    The model has a parameter of this name: a class a keyword argument, a function or an FMU a
    parameter. Of measured records, it has a value in each file. An error estimator sees the inputs
    alone: it gives the usual error over all values of the parameters.

    Attributes:
        range: lowest and highest value, in ``unit``; for records, of ``values``.
        values: for records, the value in each file, in ``unit``, in the order of ``system.model``
            and ``system.further``.
        unit: unit of the values, as FMI names it (``"kg"``).
        description: one line for people.
        start: value before anybody sets one; the middle of the range, as ``transform`` divides it,
            if not given.
        transform: the quantity on which the response depends most evenly: the value
            (``"linear"``), its logarithm (``"log"``), or one over it (``"reciprocal"``), for
            example for a mass that is moved by a force.
        beyond: part of the range by which values of training trajectories leave it at both ends,
            where errors are largest otherwise. Without this key the range is a hard limit of the
            model.
    """

    range: tuple[float, float] | None = None
    values: tuple[float, ...] = ()
    unit: str = "1"
    description: str = ""
    start: float | None = None
    transform: Transform = "linear"
    beyond: float = Field(default=0.0, ge=0.0, le=1.0)

    @model_validator(mode="after")
    def _has_a_range_or_values(self) -> ParameterRecipe:
        if (self.range is None) == (not self.values):
            raise ValueError(
                f"range = {self.range}, values = {list(self.values)}; expected the range of a "
                "parameter that the model has, or the values in the files of measured records"
            )
        if self.values and self.beyond:
            raise ValueError(
                f"beyond = {self.beyond:g} with values = {list(self.values)}; expected 0: nothing "
                "is known of what lies beyond measured records, so remove beyond"
            )
        return self

    def parameter(self, name: str) -> Parameter:
        """Return the parameter of a name.

        Raises:
            ValueError: its range, start or transform is invalid.
        """
        low, high = self.range or (min(self.values), max(self.values))
        return Parameter(name, self.unit, low, high, self.start, self.description, self.transform)
