"""This module finds what becomes of an output's error where the output decides an input.

A surrogate answers G to a small change of the input, and the partner answers C to the output. A
part e of error at the output then becomes the part e / (1 - C G) at the input: the sensitivity of
the closed loop (Åström and Murray, "Feedback Systems", 2008, section 11.1).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.gradient import gradient
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.error_figures import LoopFigures

PLACES = 24
"""The surrogate is linearized at this number of places of the motions it was measured on."""
FREQUENCIES = 300
LOWEST, HIGHEST = 0.1, 0.25
"""Number and range of frequencies: a tenth of that of the window to a quarter of the samples'."""


def loop_figures(
    recipe: Recipe, surrogate: Surrogate, comparisons: Sequence[Comparison]
) -> tuple[LoopFigures, ...]:
    """Return how much the error grows in the loops of a recipe, with some of their partners."""
    if not recipe.loop:
        return ()
    windows = _windows(surrogate, comparisons)
    step, n_in = surrogate.window.step, surrogate.window.n_in
    hertz = np.geomspace(LOWEST / (n_in * step), HIGHEST / step, FREQUENCIES)
    found: list[LoopFigures] = []
    for loop in recipe.loop:
        at = loop.interface(surrogate.inputs, surrogate.outputs)
        answers = frequency_response(surrogate, windows, at.output, at.input, hertz)
        for partner in loop.typical_partners():
            back = partner.response(2 * np.pi * hertz) * at.output_unit / at.input_unit
            gains = np.median(1.0 / np.abs(1.0 - back * answers), axis=0)
            worst = int(np.argmax(gains))
            found.append(
                LoopFigures(
                    output=loop.output,
                    input=loop.input,
                    partner=loop.partner_words(at.turning, partner),
                    gain=float(gains[worst]),
                    hz=float(hertz[worst]),
                )
            )
    return tuple(found)


def frequency_response(
    surrogate: Surrogate, windows: FloatArray, output: int, input: int, hertz: FloatArray
) -> NDArray[np.complex128]:
    """Return what the newest output answers to a channel of the inputs, (B, F), by its slopes.

    Args:
        windows: inputs at which it is linearized, shape (B, n_in, n_inputs).
        output, input: channels.
        hertz: frequencies in Hz, shape (F,).
    """
    window = surrogate.window
    weights = np.zeros((len(windows), window.n_out, len(surrogate.outputs)))
    weights[:, -1, output] = 1.0
    slopes = gradient(surrogate, windows, weights)[:, ::-1, input]  # the newest first
    ages = window.step * np.arange(window.n_in)
    return np.asarray(slopes @ np.exp(-2j * np.pi * np.outer(ages, hertz)))


def _windows(surrogate: Surrogate, comparisons: Sequence[Comparison]) -> FloatArray:
    """Return windows of inputs, evenly from all motions, (PLACES, n_in, n_inputs) at most."""
    n_in = surrogate.window.n_in
    motions = [
        np.concatenate([np.repeat(c.inputs[:1], n_in, axis=0), c.inputs]) for c in comparisons
    ]
    ends = [(motion, k) for motion in motions for k in range(len(motion), n_in, -n_in)]
    chosen = np.unique(np.linspace(0, len(ends) - 1, PLACES).round().astype(int))
    return np.stack([motion[k - n_in : k] for motion, k in (ends[i] for i in chosen)])
