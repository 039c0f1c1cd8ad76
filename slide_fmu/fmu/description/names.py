"""Names of the variables that no signal names. Becomes part of FMUs that carry a torch module."""

from __future__ import annotations

WINDOW_FILLED = "window_filled"
IN_RANGE = "inputs_in_range"
PREHISTORY_KNOWN = "prehistory_known"


def initial_name(name: str) -> str:
    """Parameter for the value of an input before the start."""
    return f"initial_{name}"
