"""Remarks on a surrogate of records are about records, errors, and positions of rest.

A system with hysteresis or dry friction comes to rest elsewhere after each motion. Inputs that
never rest hide that: while they keep the system moving it forgets, and the test of fading memory
under the same inputs passes. So motions of a record are followed by constant inputs for one
window.
"""

from __future__ import annotations

import numpy as np

from slide_fmu.core.measures import percent, rms
from slide_fmu.core.signals import FloatArray
from slide_fmu.memory.stability import SEQUENCES
from slide_fmu.network.state_space.network import StateSpace
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.records.model import MeasuredRecords
from slide_fmu.records.parts import (
    comes_again,
    divided,
    files_of,
    has_known_inputs,
    scored_parts,
)
from slide_fmu.records.segments import inputs_beyond, segments
from slide_fmu.records.specimens import scarce_specimens, specimens, values_in_file
from slide_fmu.surrogate.error_bound import calibrated
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.results import Validation

CUT_OFF = 1.5
"""A window is too short where the FMU's error is this many times that of the free network."""
UNEVEN = 2.0
"""Blocks differ much in their error if one in ten has this many times that of the median one."""
KNOWN, COSTLY = 50, 2.0
"""Number of first outputs that say in which state a sequence begins; an unknown start is remarked
where its error is this many times the one with these outputs."""
APART = 2e-3
"""Outputs have several positions of rest if these differ by more than this part of their standard
deviation: twice the usual remaining amplitude. Networks of systems that forget reach 1e-5."""


def remarks_on_records(source: MeasuredRecords, in_range: Validation) -> tuple[str, ...]:
    """Return all remarks, one sentence each.

    Raises:
        RecipeError: the records cannot be divided as the recipe says.
    """
    return (
        *source.remarks,
        *remarks_on_division(in_range.recipe, source),
        *on_spread(in_range),
        *_on_what_is_cut_off(in_range),
        *_on_rest(source, in_range),
        *_on_unknown_start(in_range),
    )


def on_spread(validation: Validation) -> list[str]:
    """Name the outputs whose error differs much between the blocks that were tested."""
    blocks = len(validation.comparisons)
    remarks = []
    for output in validation.figures().outputs:
        spread = output.relative_rmse_of_trajectories
        if blocks > 1 and spread.p90 > UNEVEN * spread.median:
            remarks.append(
                f"output {output.name!r}: of the {blocks} tested blocks, the median one has an "
                f"error of {percent(spread.median)}, and one in ten {percent(spread.p90)}: rare "
                "events decide the error, which may differ as much elsewhere; record more of them"
            )
    return remarks


def _on_what_is_cut_off(validation: Validation) -> list[str]:
    """Name the outputs whose error comes from the window."""
    remarks = []
    for output in validation.figures().outputs:
        error, free = output.relative_rmse, output.free_relative_rmse
        if free is not None and error > CUT_OFF * free:
            remarks.append(
                f"output {output.name!r}: the FMU has an error of {percent(error)}, but the "
                f"network that runs freely along the record one of {percent(free)}: the system "
                "remembers what the window cuts off. It may have hysteresis, which no window can "
                "hold, or a "
                "slow part that a linear fit does not show: raise window.n_in, and see whether "
                "that helps"
            )
    return remarks


def _on_unknown_start(validation: Validation) -> list[str]:
    """Say what it costs that nobody knows what was before the first sample of a sequence."""
    costs = costs_of_start(validation)
    if costs is None:
        return []
    surrogate = validation.surrogate
    return [
        f"output {signal.name!r}: along the first window of {surrogate.window.n_in} samples, a "
        f"start in mid-motion has an error of {percent(unknown)} if nothing is known before it, "
        f"and of {percent(known)} if the first {KNOWN} outputs are: give them to predict "
        "(known_outputs)"
        for signal, (unknown, known) in zip(surrogate.outputs, costs.T.tolist(), strict=True)
        if unknown > COSTLY * known
    ]


def costs_of_start(validation: Validation) -> FloatArray | None:
    """Return the errors along the first window of the tested blocks, begun in mid-motion.

    The rows are the relative RMSE with an unknown past, and with the first ``KNOWN`` outputs
    known, behind these outputs; shape (2, n_outputs). It is None for networks without a state,
    and where no block has samples behind them.
    """
    surrogate = validation.surrogate
    if not isinstance(surrogate.network, StateSpace):
        return None
    errors: tuple[list[FloatArray], list[FloatArray]] = [], []
    for one in validation.comparisons:
        own = surrogate.at(one.parameters)
        inputs, truth = (part[: surrogate.window.n_in] for part in (one.inputs, one.reference))
        if len(inputs) <= KNOWN:
            continue
        for kept, known in zip(errors, (None, truth[:KNOWN]), strict=True):
            given = own.predict(inputs, known_outputs=known)
            kept.append((given - truth)[KNOWN:])
    if not errors[0]:
        return None
    size = np.array([o.rms_reference_about_mean for o in validation.figures().outputs])
    return np.asarray(np.stack([rms(np.concatenate(kept)) for kept in errors]) / size)


def _on_rest(source: MeasuredRecords, validation: Validation) -> list[str]:
    """Name the outputs whose position of rest depends on the motion before."""
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


def apart_at_rest(
    surrogate: Surrogate, recipe: Recipe, source: MeasuredRecords
) -> FloatArray | None:
    """Return the deviation of positions of rest after different motions.

    The inputs of segments of the records, one window long each, are followed by one window of
    their mean. The result is the standard deviation of the last outputs over the segments,
    relative to that of the output in motion, shape (n_outputs,). It is None for networks other
    than state-space ones, since their memory is their window.

    Raises:
        RecipeError: the records cannot be divided as the recipe says.
    """
    network, n_in = surrogate.network, surrogate.window.n_in
    if not isinstance(network, StateSpace):
        return None
    moving, still = (
        network.features.along(
            surrogate.input_scaling.apply(inputs_beyond(recipe, source, n_in, SEQUENCES, factor))
        )
        for factor in (1.0, 0.0)
    )
    outputs, states = network.run(moving)
    rest, _ = network.run(still, states)
    size = np.maximum(outputs.std(axis=(0, 1), dtype=np.float64), np.finfo(np.float32).tiny)
    return np.asarray(rest[:, -1].std(axis=0, dtype=np.float64) / size)


def remarks_on_division(recipe: Recipe, source: MeasuredRecords) -> list[str]:
    """Return remarks on the samples that are lost by the division."""
    remarks = [
        about_repeats(recipe, source),
        _behind_no_lead(recipe, source),
        left_out(recipe, source),
        *about_specimens(recipe, source),
        about_bound(recipe, source),
    ]
    return [remark for remark in remarks if remark is not None]


def about_bound(recipe: Recipe, source: MeasuredRecords) -> str | None:
    """Say how many blocks calibrate an error bound, and what they allow; None without a bound."""
    if recipe.bound is None:
        return None
    blocks = len(segments(recipe, source, "calibration"))
    return (
        f"the error bound is calibrated by {blocks} held-out blocks of "
        f"{recipe.data.duration:.4g} s, which allow a confidence of "
        f"{percent(max(calibrated(blocks), default=blocks / (blocks + 1)))} at most; on other "
        "stretches of the machine it holds as far as they are like these blocks"
    )


def about_repeats(recipe: Recipe, source: MeasuredRecords) -> str | None:
    """Say how many inputs repeat, and how this affects the error; None if no input repeats."""
    if not comes_again(source):
        return None
    lengths = [len(piece.trajectory.inputs) for piece in source.pieces]
    files = np.repeat([piece.record for piece in source.pieces], lengths)
    order = np.argsort(source.numbers, kind="stable")
    again = np.diff(source.numbers[order]) == 0
    before, later = order[:-1][again], order[1:][again]
    alike = np.unique(files[[before, later]][:, files[before] != files[later]])
    if len(alike):
        where = f"{', '.join(source.files[file] for file in alike)} have them in common"
    else:
        lag = int(np.median(later - before))
        where = f"mostly {lag * source.step:.6g} s ({lag} samples) later"
    if has_known_inputs(recipe, source):
        meaning = (
            "too few are different to hold some of them back, so what is tested was learnt from, "
            "and the error says nothing about other inputs: record other inputs too"
        )
    else:
        meaning = "each part has inputs of its own, and all samples that repeat them"
    return f"{100 * len(later) / len(order):.0f} % of the inputs come again, {where}; {meaning}"


def about_specimens(recipe: Recipe, source: MeasuredRecords) -> list[str | None]:
    """Say which errors of specimens are not measured; None if all are."""
    if not recipe.parameters:
        return []
    parts = divided(recipe, source)
    learnt, tested = (
        [values_in_file(recipe, file) for file in files_of(source, parts[part])]
        for part in ("train", "test")
    )
    lacking = [one for one in specimens(recipe) if one not in tested]
    names = "; ".join(", ".join(f"{k} = {v:g}" for k, v in one.items()) for one in lacking)
    seen = all(one in learnt for one in tested)
    return [
        scarce_specimens(recipe),
        f"no error is measured at {names}: the part to test has none of these records; give it a "
        'larger share, or divide each file by itself (data.by = "each")'
        if lacking and seen
        else None,
        "the error is measured on specimens that were learnt from; to see the one between them, "
        'hold whole files out (data.by = "record"; the last ones are tested)'
        if seen
        else None,
    ]


def left_out(recipe: Recipe, source: MeasuredRecords) -> str | None:
    """Say which blocks are shorter than a segment, and so are not learnt from.

    None if no block is.
    """
    lead = recipe.window.n_in - recipe.window.n_out
    scored = round(recipe.data.duration / recipe.window.step) - lead
    parts = scored_parts(recipe, source)
    blocks = [block for part, own in parts.items() if part != "test" for block in own]
    short = [b.stop - b.scored for b in blocks if b.stop - b.scored < scored]
    if not short:
        return None
    return (
        f"{len(short)} of {len(blocks)} blocks of the records, with {sum(short)} samples to learn "
        f"from, are shorter than data.duration = {recipe.data.duration:g} s and left out: give a "
        "shorter duration to use them"
    )


def _behind_no_lead(recipe: Recipe, source: MeasuredRecords) -> str | None:
    """Say which pieces are too short to be scored; None if no piece is."""
    lead = recipe.window.n_in - recipe.window.n_out
    lengths = [len(piece.trajectory.inputs) for piece in source.pieces]
    short = [
        length
        for length, piece in zip(lengths, source.pieces, strict=True)
        if length <= lead and piece.rest is None
    ]
    if not short:
        return None
    return (
        f"{len(short)} of {len(lengths)} pieces of the records, with {sum(short)} of "
        f"{sum(lengths)} samples, are no longer than the {lead} samples that the window truncates "
        "and left out: nobody knows what was before them. Record with fewer gaps, or shorten the "
        "window"
    )
