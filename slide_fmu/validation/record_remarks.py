"""What one should know about a surrogate of records, by its errors beside what was measured."""

from __future__ import annotations

from slide_fmu.validation.comparison import Validation

CUT_OFF = 1.5
"""A window cuts something off where the FMU errs so many times as much as the free network."""


def remarks_on_records(validation: Validation) -> list[str]:
    """Return one sentence each on outputs whose error is that of the window."""
    found = []
    for output in validation.figures()["outputs"]:
        error, free = output["relative_rmse"], output.get("free_relative_rmse")
        if free is not None and error > CUT_OFF * free:
            found.append(
                f"output {output['name']!r}: the FMU errs by {100 * error:.3g} %, but the network "
                f"that runs freely along the record by {100 * free:.3g} %: the system remembers "
                "what the window cuts off. It may have hysteresis, which no window can hold, or a "
                "slow part that a linear fit does not show: raise window.n_in, and see whether "
                "that helps"
            )
    return found
