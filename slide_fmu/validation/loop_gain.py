"""This module finds what becomes of an output's error where the output decides an input.

A surrogate answers G to a small change of the input, and the partner answers C to the output. A
part e of error at the output then becomes the part e / (1 - C G) at the input: the sensitivity of
the closed loop (Åström and Murray, "Feedback Systems", 2008, section 11.1). The answer of a simple
partner is known. That of a model is simulated: it may grow, as that of a free mass does, so the
loop is closed sample by sample, where a sound one forgets.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.signals import FloatArray
from slide_fmu.recipe.loop_partner import OwnPartner, own_partner
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.gradient import gradient
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import Source
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.error_figures import LoopFigures

PLACES = 24
"""The surrogate is linearized at this number of places of the motions it was measured on."""
FREQUENCIES = 300
LOWEST, HIGHEST = 0.1, 0.25
"""Number and range of frequencies: a tenth of that of the window to a quarter of the samples'."""
PERIODS, MOST_SAMPLES, FORGOTTEN = 10, 8000, 0.01
"""A model is simulated over this number of windows, the period of the lowest frequency. Where the
last tenth still has more than this part of the loop's answer, it is simulated over twice as many,
up to this number of samples."""
PULSE = 1e-3
"""Size of the pulse that shows the answer of a model, as a part of the range of the output."""


def loop_figures(
    recipe: Recipe, surrogate: Surrogate, source: Source, comparisons: Sequence[Comparison]
) -> tuple[LoopFigures, ...]:
    """Return how much the error grows in the loops of a recipe, with some of their partners.

    Args:
        recipe: what was learnt.
        surrogate: what has learnt it.
        source: the system, which has the signals of the surrogate.
        comparisons: motions on which the surrogate was measured.

    Raises:
        LoadError, SimulationError: a model that is a partner fails.
    """
    if not recipe.loop:
        return ()
    windows = _windows(surrogate, comparisons)
    step, n_in = surrogate.window.step, surrogate.window.n_in
    hertz = np.geomspace(LOWEST / (n_in * step), HIGHEST / step, FREQUENCIES)
    figures: list[LoopFigures] = []
    for loop in recipe.loop:
        at = loop.interface(surrogate.inputs, surrogate.outputs)
        slopes = newest_slopes(surrogate, windows, at.output, at.input)
        for partner in loop.typical_partners():
            if loop.partner is None:
                answers = slopes @ _waves(slopes.shape[1], hertz * step)
                back = partner.response(2 * np.pi * hertz) * at.output_unit / at.input_unit
                sensitivity = 1.0 / (1.0 - back * answers)
            else:
                model = own_partner(loop, source, partner.own)
                closed = _closed_with(model, surrogate, at.output, slopes)
                sensitivity = closed @ _waves(closed.shape[1], hertz * step)
            gains = np.median(np.abs(sensitivity), axis=0)
            worst = int(np.argmax(gains))
            figures.append(
                LoopFigures(
                    output=loop.output,
                    input=loop.input,
                    partner=loop.partner_words(at.turning, partner),
                    gain=float(gains[worst]),
                    hz=float(hertz[worst]),
                )
            )
    return tuple(figures)


def newest_slopes(
    surrogate: Surrogate, windows: FloatArray, output: int, input: int
) -> FloatArray:
    """Return the slopes of the newest output by an input of each age, (B, n_in), the newest first.

    Args:
        windows: inputs at which it is linearized, shape (B, n_in, n_inputs).
        output, input: channels.
    """
    weights = np.zeros((len(windows), surrogate.window.n_out, len(surrogate.outputs)))
    weights[:, -1, output] = 1.0
    return gradient(surrogate, windows, weights)[:, ::-1, input]


def _waves(count: int, turns: FloatArray) -> NDArray[np.complex128]:
    """Return what delays of 0, 1, ... samples do to waves of some turns a sample, (count, F)."""
    return np.asarray(np.exp(-2j * np.pi * np.outer(np.arange(count), turns)))


def _closed_with(
    model: OwnPartner, surrogate: Surrogate, output: int, slopes: FloatArray
) -> FloatArray:
    """Return what the loop makes of a pulse of error at the output, (B, K), until it forgets."""
    count = PERIODS * slopes.shape[1]
    while True:
        count = min(count, MOST_SAMPLES)
        answer = _closed(slopes, _answer_to_pulse(model, surrogate, output, count))
        later = np.abs(answer[:, 1:])  # the error itself is the first one
        left = later[:, -count // PERIODS :].sum(axis=1)
        if count == MOST_SAMPLES or np.all(left <= FORGOTTEN * later.sum(axis=1)):
            return answer
        count *= 2


def _answer_to_pulse(
    model: OwnPartner, surrogate: Surrogate, output: int, count: int
) -> FloatArray:
    """Return what a model answers to a pulse of one sample, over its size, (count,).

    Before it, the output is that at rest, and all other inputs are in the middle of their ranges.
    """
    middles = np.array([0.5 * (signal.low + signal.high) for signal in surrogate.inputs])
    rest = surrogate.predict_newest(np.tile(middles, (surrogate.window.n_in, 1)))[-1, output]
    held = np.array([0.5 * (signal.low + signal.high) for signal in model.system.inputs])
    held[model.input] = rest
    inputs = np.tile(held, (count + 1, 1))
    still = model.system.simulate(inputs)
    signal = surrogate.outputs[output]
    size = PULSE * (signal.high - signal.low)
    inputs[1, model.input] += size
    moved = model.system.simulate(inputs)
    return np.asarray((moved - still)[2:, model.output] / size)


def _closed(slopes: FloatArray, pulse: FloatArray) -> FloatArray:
    """Return the answer of the closed loop to an error of one sample at the output, (B, K).

    It is that of the surrogate and of the model, from sample to sample: its spectrum is
    1 / (1 - C G), which is found without the spectrum of a model that grows.
    """
    from scipy.signal import fftconvolve, lfilter  # slow to import

    once = np.eye(1, len(pulse))[0]
    rounds = [once - fftconvolve(one, pulse)[: len(pulse)] for one in slopes]
    return np.array([lfilter([1.0], one, once) for one in rounds])


def _windows(surrogate: Surrogate, comparisons: Sequence[Comparison]) -> FloatArray:
    """Return windows of inputs, evenly from all motions, (PLACES, n_in, n_inputs) at most."""
    n_in = surrogate.window.n_in
    motions = [
        np.concatenate([np.repeat(c.inputs[:1], n_in, axis=0), c.inputs]) for c in comparisons
    ]
    ends = [(motion, k) for motion in motions for k in range(len(motion), n_in, -n_in)]
    chosen = np.unique(np.linspace(0, len(ends) - 1, PLACES).round().astype(int))
    return np.stack([motion[k - n_in : k] for motion, k in (ends[i] for i in chosen)])
