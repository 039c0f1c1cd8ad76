"""Parameters of the models are checked here."""

from __future__ import annotations

import math


def expect(name: str, value: float, fine: bool, expected: str) -> None:
    """Refuse a parameter of a system that is not finite or not ``fine``.

    Raises:
        ValueError: the message has the name, the value, what is expected, and the remedy.
    """
    if not (fine and math.isfinite(value)):
        raise ValueError(
            f"system parameter {name} = {value!r}; expected {expected}: correct the "
            "constructor argument or the recipe's [system.parameters]"
        )


def expect_positive(**values: float) -> None:
    """Refuse parameters that are not positive, by name; ``expect`` raises the ValueError."""
    for name, value in values.items():
        expect(name, value, value > 0, "a positive number")


def expect_not_negative(**values: float) -> None:
    """Refuse negative parameters, by name; ``expect`` raises the ValueError."""
    for name, value in values.items():
        expect(name, value, value >= 0, "zero or positive")


def expect_substeps(substeps: float) -> None:
    """Refuse substeps that are not a whole number from 1; ``expect`` raises the ValueError."""
    whole = math.isfinite(substeps) and substeps == int(substeps) and substeps >= 1
    expect("substeps", substeps, whole, "a whole number from 1")
