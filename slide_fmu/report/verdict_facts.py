"""This module gives the large numbers and the commands of a verdict."""

from __future__ import annotations

from collections.abc import Sequence

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import ratio_text
from slide_fmu.report.html_report import Fact, Verdict
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.speed import speed_text
from slide_fmu.report.validity import is_valid
from slide_fmu.report.verdict import MISSING, Subject, verdict, worst_output
from slide_fmu.validation.error_figures import (
    PlainCallFigures,
    Timing,
    ValidationFigures,
    worst_of,
)
from slide_fmu.validation.trust_figures import BoundFigures


def verdict_of(measured: RunFigures, subject: Subject) -> Verdict:
    """Return the verdict on an FMU, with its numbers and commands."""
    found = measured.in_range
    commands = [
        ("Read it", f"slide-fmu info {measured.name}.fmu"),
        (
            "Run it",
            f'fmpy.simulate_fmu("{measured.name}.fmu", input=table, stop_time=T, '
            f"output_interval={subject.step:.10g})",
        ),
        (
            "Measure it again",
            f"slide-fmu validate {measured.name}.fmu --trajectories {found.trajectories} "
            f"--seed {found.seed}",
        ),
        ("Make it again", measured.command),
    ]
    unseen = [one for one in measured.validation.values() if one.held_out]
    facts = facts_of(found, measured.plain_call, subject, unseen)
    return Verdict(verdict(measured, subject), facts, commands)


def facts_of(
    found: ValidationFigures,
    call: PlainCallFigures | None,
    subject: Subject,
    unseen: Sequence[ValidationFigures] = (),
) -> list[Fact]:
    """Return the numbers of one validation: error, bound, validity, speed and memory.

    The validity also counts the kinds of input of ``unseen``, which no training saw.
    """
    facts = [
        _error(found, call),
        _bound(found.error_bound),
        _validity(_judged(found), [kind for one in unseen for kind in _judged(one)]),
        _speed(found.timing),
        Fact("Memory", f"{subject.memory:.3g} s", "Outputs depend on inputs no older than this."),
    ]
    return [fact for fact in facts if fact is not None]


def _error(found: ValidationFigures, call: PlainCallFigures | None) -> Fact:
    """Return the error of the worst output in the plain call."""
    rough = None if call is None else call.worst("rough")
    plain = worst_of(output.plain_relative_rmse for output in found.outputs)
    error = rough if rough is not None else found.worst if plain is None else plain
    smooth = None if call is None else call.worst("smooth")
    of_output = "" if len(found.outputs) == 1 else " of the worst output"
    named = None if call is None else worst_output(call)
    others = "" if named is None else named[2]
    of_output = of_output if named is None else f" of {named[0]}"
    text = f"Relative RMSE{of_output} in the plain call, on unseen inputs{others}."
    if smooth is not None:
        text += f" Under smooth inputs: {percent(smooth)}."
    return Fact("Error", percent(error), text)


def _bound(found: BoundFigures | None) -> Fact | None:
    """Return the least covered share of samples, of all outputs and both ways of calling."""
    if found is None:
        return None
    known = min(output.coverage for output in found.outputs)
    plain = known if found.plain is None else min(found.plain.coverage)
    least = min(known, plain)
    text = f"This part of the samples lies below the error bound of {percent(found.confidence)}"
    if least < known:
        text += f" in the plain call. With inputs known to the step's end: {percent(known)}"
    return Fact("Bound", percent(least), f"{text}.", least >= found.confidence - MISSING)


def _judged(found: ValidationFigures) -> list[bool]:
    """Return for each kind of inputs that was measured whether the FMU is valid for it."""
    bound = found.error_bound
    return [] if bound is None else [is_valid(k.harm) for k in bound.excitations if k.harm]


def _validity(trained: list[bool], unseen: list[bool]) -> Fact | None:
    """Return how many kinds of inputs the FMU is valid for; of unseen kinds none is expected."""
    if not trained:
        return None
    value = f"{sum(trained + unseen)} of {len(trained + unseen)}"
    text = "Valid for these kinds of input, of those that were measured."
    if unseen:
        text = "Valid for these kinds of input, of those that were measured: "
        text += f"{sum(trained)} of {len(trained)} kinds of its training, "
        text += f"{sum(unseen)} of {len(unseen)} others."
    good = None if all(trained) and not all(unseen) else all(trained)
    return Fact("Validity", value, text, good)


def _speed(found: Timing) -> Fact:
    step = f"{found.fmu_step_us:.3g} µs"
    if found.speed is None:
        return Fact("Speed", step, "A step of the FMU takes this time.")
    good = None if found.speed.ratio >= 1 else False
    text = f"A step takes {step}. {speed_text(found.speed)}"
    return Fact("Speed", f"{ratio_text(found.speed.ratio)} times", text, good)
