"""A network that was learnt from records must forget in the states that the records reach.

The test of fading memory pairs states of some sequences. A network with several lasting responses
may pass it, if no pair is in two of them. So the surrogate also runs along the whole records, and
along many more inputs that are made of theirs (``records.rearranged``): a network that has learnt
the records by heart may have a state beside them that it never leaves again. The FMU restarts its
states from zero again and again, and measures what that changes, its truncation error. ``predict``
and ``predict_newest`` restart at other samples, so that their answers differ where the start is
not forgotten. An FMU that contradicts its measured error in this way is not exported: its error
would be another one with other restarts.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from slide_fmu.core.measures import percent
from slide_fmu.core.signals import FloatArray
from slide_fmu.memory.stability import CONTRACTION, UnstableSurrogateError
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.rearranged import rearranged
from slide_fmu.records.specimens import values_in_file
from slide_fmu.validation.results import Validation

OTHERS = 300_000
"""Number of samples of inputs that are made of those of the records."""
OTHERS_IN_WORDS = "inputs like those of "
"""What comes before "the records" where such inputs contradict an error."""

CONTRADICTS = 2.0
"""Restarts contradict an error that their effect exceeds by this factor. A truncation error is
the largest one between two restarts, so that its RMS may be somewhat above that of the error."""


def effect_of_restarts(
    source: MeasuredRecords, in_range: Validation, others: int = 0
) -> FloatArray | None:
    """Return how much restarts change the outputs of a surrogate along the records.

    The rows are the truncation error, and the difference of ``predict`` and ``predict_newest``:
    RMS over all samples of the records, relative to the standard deviation of each output in the
    validation, shape (2, n_outputs). It is None for networks without a state. With a number of
    ``others``, so many samples of inputs that are made of the records take their place; where the
    outputs move more under these, the effect is relative to their RMS about the mean there.
    """
    surrogate = in_range.surrogate
    if not isinstance(surrogate.network, StateSpace):
        return None
    size = np.array([output.rms_reference_about_mean for output in in_range.figures().outputs])
    squares, moved, count = np.zeros((2, len(size))), np.zeros(len(size)), 0
    for values, inputs in _runs(source, in_range, others):
        own = surrogate.at(values) if values else surrogate
        truncated = own.truncation_errors(inputs)
        assert truncated is not None
        newest = own.predict_newest(inputs)
        apart = own.predict(inputs) - newest
        squares += [np.sum(np.square(one), axis=0) for one in (truncated, apart)]
        moved += np.sum(np.square(newest - newest.mean(axis=0)), axis=0)
        count += len(inputs)
    if others:
        size = np.maximum(size, np.sqrt(moved / count))
    return np.asarray(np.sqrt(squares / count) / size)


def _runs(
    source: MeasuredRecords, in_range: Validation, others: int
) -> Iterator[tuple[dict[str, float], FloatArray]]:
    """Return values of physical parameters, with inputs of the records or made of them."""
    recipe = in_range.recipe
    blocks = [piece.trajectory.inputs for piece in source.pieces]
    own = [values_in_file(recipe, piece.record) for piece in source.pieces]
    if not others:
        yield from zip(own, blocks, strict=True)
        return
    specimens = list({tuple(values.items()): values for values in own}.values())
    window = in_range.surrogate.memory_length
    for number, values in enumerate(specimens):
        yield values, rearranged(blocks, window, others // len(specimens), number)


def require_own_memory(source: MeasuredRecords, in_range: Validation) -> None:
    """Refuse a surrogate whose answers along the records depend on its restarts.

    Raises:
        UnstableSurrogateError: they depend on them more than its measured error allows, and the
            recipe does not set ``allow_unstable``.
    """
    recipe = in_range.recipe
    if recipe.stability.allow_unstable:
        return
    problems: list[str] = []
    for others, where in ((0, ""), (OTHERS, OTHERS_IN_WORDS)):
        effects = effect_of_restarts(source, in_range, others)
        if effects is not None and not problems:
            problems = _problems(in_range, effects, where)
    if problems:
        raise UnstableSurrogateError(
            f"surrogate {recipe.name!r} is not exported: {'; '.join(problems)} (RMS over the "
            f"standard deviation of the output); expected at most {percent(CONTRACTION)}, or "
            f"{CONTRADICTS:g} times the error. The network does not forget its state where the "
            "records lead it: raise window.n_in, give fewer states (network.order) or units "
            "(network.hidden), another training.seed, or a longer record; hysteresis fits into no "
            "window; or set stability.allow_unstable = true"
        )


def _problems(in_range: Validation, effects: FloatArray, where: str) -> list[str]:
    """Describe the outputs whose error the effects of restarts, (2, n_outputs), contradict."""
    measured = in_range.figures().outputs
    return [
        f"output {output.name!r} has a measured error of {percent(output.relative_rmse)}, but "
        f"along {where}the records its own truncation error is {percent(truncated)}, and predict "
        f"and predict_newest differ by {percent(apart)}"
        for output, truncated, apart in zip(measured, *effects.tolist(), strict=True)
        if not max(truncated, apart) <= max(CONTRACTION, CONTRADICTS * output.relative_rmse)
    ]
