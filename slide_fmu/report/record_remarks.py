"""What one should know about a surrogate of records: of the records, and of the errors on them."""

from __future__ import annotations

from slide_fmu.core.measures import percent
from slide_fmu.data.division_remarks import remarks_on_division
from slide_fmu.memory.rest import apart_at_rest
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.validation.comparison import Validation

CUT_OFF = 1.5
"""A window cuts something off where the FMU errs so many times as much as the free network."""
APART = 2e-3
"""Outputs come to rest elsewhere where they stay apart by more than this part of their standard
deviation: twice what a window usually leaves of the past. Networks of systems that forget leave
1e-5."""


def remarks_on_records(source: MeasuredRecords, validation: Validation) -> list[str]:
    """Return all remarks, one sentence each.

    Raises:
        RecipeError: the records cannot be divided as the recipe says.
    """
    return [
        *source.remarks,
        *remarks_on_division(validation.recipe, source),
        *_on_what_is_cut_off(validation),
        *_on_rest(source, validation),
    ]


def _on_what_is_cut_off(validation: Validation) -> list[str]:
    """Name the outputs whose error is that of the window."""
    found = []
    for output in validation.figures().outputs:
        error, free = output.relative_rmse, output.free_relative_rmse
        if free is not None and error > CUT_OFF * free:
            found.append(
                f"output {output.name!r}: the FMU errs by {percent(error)}, but the network "
                f"that runs freely along the record by {percent(free)}: the system remembers "
                "what the window cuts off. It may have hysteresis, which no window can hold, or a "
                "slow part that a linear fit does not show: raise window.n_in, and see whether "
                "that helps"
            )
    return found


def _on_rest(source: MeasuredRecords, validation: Validation) -> list[str]:
    """Name the outputs that come to rest elsewhere after each motion."""
    surrogate = validation.surrogate
    apart = apart_at_rest(surrogate, validation.recipe, source)
    if apart is None:
        return []
    return [
        f"output {signal.name!r}: after different motions of the record the network comes to rest "
        f"apart, by {100 * share:.2g} % of the output's standard deviation one window after the "
        f"inputs stand still; expected at most {100 * APART:g} %: the system seems to have "
        "hysteresis or dry friction, or to be damped less where it hardly moves. Trust the "
        "surrogate under inputs that keep it moving as the record does, and not at rest"
        for signal, share in zip(surrogate.outputs, apart, strict=True)
        if share > APART
    ]
