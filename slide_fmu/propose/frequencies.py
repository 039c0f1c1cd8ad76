"""A first recipe drives a machine near its resonances, and at its working frequencies."""

from __future__ import annotations

import math
from collections.abc import Sequence

from slide_fmu.core.signals import Signal
from slide_fmu.core.suggestions import or_meant
from slide_fmu.memory.bandwidth import OWN_SAMPLES, tidy_step
from slide_fmu.propose.draft_signals import ALL_OTHERS, Bands
from slide_fmu.propose.first_look import FirstLook
from slide_fmu.recipe.default_excitation import (
    Band,
    InputKind,
    full_range_below,
    highest_frequency,
)
from slide_fmu.recipe.recipe import RecipeError

NEAR = (0.7, 1.4)
"""Frequencies between the first part of the lowest resonance and the second of the highest one are
near them."""
SINES: tuple[InputKind, ...] = ("held", "moving", "rates")
"""Kinds of inputs that the mix moves in sines."""


def bands_of(bands: Bands, inputs: Sequence[Signal]) -> list[Band | None]:
    """Return the working frequencies of each input in Hz; none of any if no band is given.

    Raises:
        RecipeError: a band names no input.
    """
    names = [signal.name for signal in inputs]
    for name in bands:
        if name != ALL_OTHERS and name not in names:
            raise RecipeError(
                f"--band {_words(name, bands[name])}: there is no input {name!r}; expected one of "
                f"{', '.join(names)}{or_meant(name, names)}"
            )
    if not bands:
        return []
    return [bands.get(name, bands.get(ALL_OTHERS)) for name in names]


def require_sines(bands: Bands, kind: InputKind) -> None:
    """Refuse working frequencies of inputs that move within limits of their speed instead."""
    for name, band in bands.items():
        if kind not in SINES:
            raise RecipeError(
                f"--band {_words(name, band)}, but the inputs are set points of drives or an "
                "angle, whose limits of speed say how fast they move; expected other inputs: "
                "leave it out, and correct speed and acceleration in the recipe"
            )


def require_resolved(bands: Bands, step: float) -> None:
    """Refuse working frequencies in Hz of which a step in s has too few samples in a period."""
    for name, band in bands.items():
        if in_rad(*band)[1] <= highest_frequency(step):
            continue
        finer = tidy_step(1.0 / (OWN_SAMPLES * band[1]))
        raise RecipeError(
            f"--band {_words(name, band)} with a sample step of {step:g} s, which has "
            f"{1.0 / (band[1] * step):.2g} samples in a period; expected more than six: give a "
            f"finer step too, --step {finer:g}"
        )


def _words(name: str, band: Band) -> str:
    """Write a band as on the command line."""
    return f"{name}{'=' if name else ''}{band[0]:g}..{band[1]:g}"


def remarks_on_frequencies(bands: Bands, seen: FirstLook, kind: InputKind) -> list[str]:
    """Say that the mix may reach little where the machine works, if it does."""
    whole = full_range_below(seen.step, kind)
    if bands or kind not in SINES or whole == highest_frequency(seen.step):
        return []
    return [
        f"sines reach through the whole range up to {whole / (2 * math.pi):.3g} Hz, and a part of "
        "it above. Does your machine work at known frequencies? --band LOW..HIGH, in Hz, adds "
        "motions there, up to the whole range"
    ]


def near_resonances(seen: FirstLook, step: float) -> tuple[float, float] | None:
    """Return frequencies in rad/s from near the lowest resonance to near the highest one.

    Resonances that the step in s cannot carry do not count.
    """
    highest = highest_frequency(step)
    within = [hz for hz in seen.resonances if in_rad(hz, hz)[1] < highest]
    if not within:
        return None
    low, high = in_rad(NEAR[0] * min(within), NEAR[1] * max(within))
    return low, min(high, highest)


def in_rad(low: float, high: float) -> tuple[float, float]:
    """Return frequencies in Hz as angular frequencies in rad/s."""
    return 2 * math.pi * low, 2 * math.pi * high
