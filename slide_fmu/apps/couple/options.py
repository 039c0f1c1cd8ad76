"""The options of a coupled run are checked here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slide_fmu.core.shown import shown
from slide_fmu.importer.description import is_multiple

EXPLICIT, IMPLICIT = ("jacobi", "gauss_seidel"), ("fixed_point", "newton")
"""Names of the methods."""

CONTROLS = ("predictor", "halving")

NEEDED = {
    "error": ("control", CONTROLS),
    "extrapolation": ("method", EXPLICIT),
    "tolerance": ("method", IMPLICIT),
    "iterations": ("method", IMPLICIT),
}
"""Options that have an effect only where another one has one of some values."""

MOST_TOLERANCE = 0.01
"""Largest difference at which implicit steps may end, as a part of an input's motion."""

MOST_STEPS = 1e8
"""Largest number of steps of a run."""


@dataclass(frozen=True)
class CouplingOptions:
    """CouplingOptions say how a coupled system is run; ``couple`` explains them."""

    step: float
    stop: float
    method: str = "newton"
    extrapolation: str = "linear"
    tolerance: float = 1e-5
    iterations: int = 20
    control: str | None = None
    error: float = 1e-3
    record: Sequence[str] | None = None
    moving: Sequence[str] = ()
    deadline: float = 120.0

    @classmethod
    def of(cls, **given: Any) -> CouplingOptions:
        """Return options of which those that are None have their defaults.

        Raises:
            ValueError: an option is wrong, or it was given and has no effect.
        """
        given = {name: value for name, value in given.items() if value is not None}
        for name in ("step", "stop"):
            if name not in given:
                raise ValueError(f"{name} = None; expected a time in s")
        options = cls(**given)
        for name, (other, choices) in NEEDED.items():
            if name in given and getattr(options, other) not in choices:
                raise ValueError(
                    f"{name} = {shown(given[name])} has no effect with {other} = "
                    f"{getattr(options, other)!r}; expected {other} as one of {list(choices)}: "
                    f"choose one of them, or leave {name} out"
                )
        return options

    def __post_init__(self) -> None:
        """Refuse options that cannot be used.

        Raises:
            ValueError: the message names the option, its value and what was expected.
        """
        _require_one_of("method", self.method, (*EXPLICIT, *IMPLICIT))
        _require_one_of("extrapolation", self.extrapolation, ("zero", "linear"))
        if self.control is not None:
            _require_one_of("control", self.control, CONTROLS)
        if self.control == "predictor" and self.method in EXPLICIT:
            raise ValueError(
                f"control = 'predictor' with the method {self.method!r}; expected one of "
                f"{list(IMPLICIT)}, which correct the predicted inputs: or choose 'halving'"
            )
        for name in ("step", "stop", "tolerance", "error", "deadline"):
            value = getattr(self, name)
            number = isinstance(value, int | float | np.number)
            if not number or not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {shown(value)}; expected a positive number")
        if self.tolerance > MOST_TOLERANCE:
            raise ValueError(
                f"tolerance = {self.tolerance:g}; expected at most {MOST_TOLERANCE:g}: with more, "
                "inputs and their sources would not agree"
            )
        if not isinstance(self.iterations, int | np.integer) or self.iterations < 1:
            raise ValueError(
                f"iterations = {shown(self.iterations)}; expected a whole number above 0"
            )
        for name, what in (("moving", "components"), ("record", "COMPONENT.VARIABLE")):
            if isinstance(given := getattr(self, name), str):
                raise ValueError(f"{name} = {given!r}; expected a list of {what}")
        _require_count(self.step, self.stop)


def _require_count(step: float, stop: float) -> None:
    """Refuse an end in s that is no whole number of steps in s, or of too many."""
    count = stop / step
    if count > MOST_STEPS:
        raise ValueError(
            f"step = {step:g} s takes {count:.3g} steps up to stop = {stop:g} s; expected at most "
            f"{MOST_STEPS:g}: choose a longer step"
        )
    if not is_multiple(stop, step):
        raise ValueError(
            f"stop = {stop:g} s is {count:.6g} steps of {step:g} s; expected a whole number of "
            "steps: change one of them"
        )


def _require_one_of(name: str, value: str, choices: Sequence[str]) -> None:
    if value not in choices:
        raise ValueError(f"{name} = {value!r}; expected one of {list(choices)}: correct it")
