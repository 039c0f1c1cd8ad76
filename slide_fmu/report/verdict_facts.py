"""This module gives the large numbers and the commands of a verdict."""

from __future__ import annotations

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import ratio_text
from slide_fmu.report.html_report import Fact, Verdict
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.validity import is_valid
from slide_fmu.report.verdict import Subject, verdict, worst_output
from slide_fmu.validation.error_figures import (
    PlainCallFigures,
    Timing,
    ValidationFigures,
    worst_of,
)
from slide_fmu.validation.trust_figures import BoundFigures

MISSING = 0.02
"""A bound that covers less than its confidence by more than this is no longer what it promises."""


def verdict_of(measured: RunFigures, subject: Subject) -> Verdict:
    """Return the verdict on an FMU, with its numbers and commands."""
    found = measured.in_range
    commands = [
        ("Read it", f"slide-fmu info {measured.name}.fmu"),
        (
            "Run it",
            f'fmpy.simulate_fmu("{measured.name}.fmu", input=table, '
            f"output_interval={subject.step:g})",
        ),
        (
            "Measure it again",
            f"slide-fmu validate {measured.name}.fmu --trajectories {found.trajectories} "
            f"--seed {found.seed}",
        ),
        ("Make it again", measured.command),
    ]
    facts = facts_of(found, measured.plain_call, subject)
    return Verdict(verdict(measured, subject), facts, commands)


def facts_of(
    found: ValidationFigures, call: PlainCallFigures | None, subject: Subject
) -> list[Fact]:
    """Return the numbers of one validation: error, bound, validity, speed and memory."""
    facts = [
        _error(found, call),
        _bound(found.error_bound),
        _validity(found.error_bound),
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


def _validity(found: BoundFigures | None) -> Fact | None:
    """Return how many kinds of inputs the FMU is valid for."""
    kinds = [] if found is None else [k.harm for k in found.excitations if k.harm is not None]
    if not kinds:
        return None
    valid = sum(map(is_valid, kinds))
    text = "Valid for these kinds of input, of those that were measured."
    return Fact("Validity", f"{valid} of {len(kinds)}", text, valid == len(kinds))


def _speed(found: Timing) -> Fact:
    step = f"{found.fmu_step_us:.3g} µs"
    if found.speedup is None:
        return Fact("Speed", step, "A step of the FMU takes this time.")
    speedup = f"{ratio_text(found.speedup)} times"
    if found.speedup < 1:
        slower = f"{ratio_text(1 / found.speedup)} times as long as the model"
        return Fact("Speed", speedup, f"A step takes {step}, which is {slower}.", good=False)
    return Fact("Speed", speedup, f"Faster than its model: {step} a step.")
