"""The verdict gives a user the most important facts about an FMU in a few lines.

Console, report and card begin with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Sized
from dataclasses import dataclass

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import decimal
from slide_fmu.core.units import behind
from slide_fmu.report.run_figures import RunFigures
from slide_fmu.report.speed import speed_text
from slide_fmu.report.validity import is_valid
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.error_figures import (
    BoxFigures,
    EstimateFigures,
    PlainCallFigures,
    Timing,
    ValidationFigures,
    worst_of,
)
from slide_fmu.validation.plain_call import late_words
from slide_fmu.validation.trust_figures import BoundFigures, KindBound

FAR_ABOVE = 3.0
"""An output is named if its error is larger than all others by this factor. It follows inputs
within a step if it is larger in the plain call than with known inputs by this factor."""

MISSING = 0.02
"""A bound that covers less than its confidence by more than this is no longer what it promises."""

MOST_INPUTS = 3
"""Largest number of inputs whose ranges the verdict names; the table of variables has all."""


@dataclass(frozen=True)
class Subject:
    """A Subject holds the properties of an FMU that its verdict needs.

    Attributes:
        inputs: name, low, high and unit of each input of the FMU, but for cosine and sine of an
            angle: it turns without end, and their range says nothing.
        memory: time in s for which its outputs depend on an input.
        filling: time in s from which on its error bounds count; None without a bound.
        step: the FMU's step in s, at which all errors are measured.
        planned: whether its inputs are planned motions.
    """

    inputs: tuple[tuple[str, float, float, str], ...]
    memory: float
    filling: float | None
    step: float
    planned: bool = False

    @classmethod
    def of(cls, surrogate: Surrogate) -> Subject:
        """Return the properties of a surrogate that its verdict needs."""
        inputs = tuple(
            (s.name, s.low, s.high, s.unit) for s in surrogate.inputs if s.angle is None
        )
        step, bound = surrogate.window.step, surrogate.bound
        memory = surrogate.network.memory_length * step
        filling = None if bound is None else bound.filling_length * step
        return cls(inputs, memory, filling, step, surrogate.planned)


def verdict(measured: RunFigures | None, subject: Subject) -> tuple[str, ...]:
    """Return at most seven lines about an FMU, the error of the plain call first.

    Args:
        measured: the figures of its report; None, and no lines, of an FMU that was not measured.
        subject: its properties.
    """
    if measured is None:
        return ()
    in_range = measured.in_range
    others = sorted(
        (each for each in measured.validation.values() if each is not in_range),
        key=lambda v: (v.amplitude[1] > 1, v.held_out),
    )
    found = [
        _plain(measured.plain_call, in_range, subject),
        _smooth_or_known(measured.plain_call, subject.planned, in_range.error_bound is not None),
        _box(measured.box),
        _bound(in_range, measured),
        _estimate(in_range.error_estimate, measured.plain_call),
        _valid(subject, in_range, others),
        _time(in_range.timing) + _times_of(subject),
    ]
    return tuple(sentence for sentence in found if sentence)


def _up_to(error: float, outputs: Sized) -> str:
    return percent(error) if len(outputs) == 1 else f"up to {percent(error)}"


def _plain(found: PlainCallFigures | None, in_range: ValidationFigures, subject: Subject) -> str:
    """Say the error of the plain call at the FMU's own step."""
    if found is None:
        return _without_plain_call(in_range)
    rough, smooth = found.worst("rough"), found.worst("smooth")
    single = found.worst("smooth_worst")
    parts = [] if smooth is None else [f"{_up_to(smooth, found.outputs)} under smooth inputs"]
    if parts and single:
        parts[0] += f" ({percent(single)} in the worst motion)"
    if rough is not None:
        parts.append(f"{_up_to(rough, found.outputs)} under inputs as in the training")
        parts[-1] += f" ({''.join(of)})" if (of := worst_output(found)) else ""
    call = f"fmpy.simulate_fmu with output_interval = {subject.step:.10g}"
    return f"Relative RMSE of the plain call, {call}: {', '.join(parts)}."


def worst_output(found: PlainCallFigures) -> tuple[str, str, str] | None:
    """Name the output whose error in the plain call is far above the errors of all others.

    The result has its name, the reason if it is known, and words on the others. The errors are
    those under inputs as in the training. None is returned without such an output.
    """
    *others, worst = sorted(found.outputs, key=lambda output: output.rough)
    if not others or worst.rough < FAR_ABOVE * others[-1].rough:
        return None
    known = worst.known_to_step_end
    follows = known is not None and worst.rough > FAR_ABOVE * known
    why = ", which follows inputs within a step" if follows else ""
    return worst.name, why, f"; the others up to {percent(others[-1].rough)}"


def _without_plain_call(in_range: ValidationFigures) -> str:
    """Say the error on unseen inputs, where the plain call was not measured by itself."""
    known = _up_to(in_range.worst, in_range.outputs)
    worst = worst_of(output.plain_relative_rmse for output in in_range.outputs)
    if worst is None:
        return f"Relative RMSE: {known} on inputs that no training saw."
    return (
        f"Relative RMSE on inputs that no training saw: {_up_to(worst, in_range.outputs)} in the "
        f"plain call, fmpy.simulate_fmu, and {known} with inputs known to the step's end "
        "(slide_fmu.simulate)."
    )


def _smooth_or_known(found: PlainCallFigures | None, planned: bool, bounded: bool) -> str | None:
    """Say the error where smooth inputs are held, or with inputs known to the step's end."""
    if found is None:
        return None
    held, known = found.worst("smooth_if_held"), found.worst("known_to_step_end")
    if held is not None:
        assert found.smooth_hz is not None  # the band in which ``held`` was measured
        low, high = found.smooth_hz
        error = f"{_up_to(held, found.outputs)} at {low:.2g} to {high:.2g} Hz"
        late = late_words(found, error)
        return f"Inputs are held over each step. {late[0].upper()}{late[1:]}."
    if known is not None:
        text = f"With inputs known to the step's end: {_up_to(known, found.outputs)}."
        jumps = " An input that jumps acts like a ramp over one step, half of one late or early. "
        jumps += "The bound includes that with" if bounded else "Networks learn that with"
        return (
            text if planned else f"{text}{jumps} data.jumps = true in the recipe (init --jumps)."
        )
    return None


def _box(found: BoxFigures | None) -> str | None:
    """Say the error at constant inputs."""
    if found is None:
        return None
    names = {"corners": "at the corners of the inputs' ranges", "steady": "inside of them"}
    parts = [f"{_up_to(g.worst, g.outputs)} {names[name]}" for name, g in found.groups.items()]
    return f"Error at constant inputs: {', '.join(parts)}."


def _bound(in_range: ValidationFigures, measured: RunFigures) -> str | None:
    """Say how much the error bound covers, and how wide it is."""
    found = in_range.error_bound
    if found is None:
        return "It has no error bound."
    covered = _shares(output.coverage for output in found.outputs)
    plain = "" if found.plain is None else _shares(found.plain.coverage)
    text = f"Its error bound of {100 * found.confidence:g} % covers {covered} of the samples"
    if plain not in ("", covered):
        text += f" with inputs known to the step's end, {plain} in the plain call"
    elif plain:
        text += " in the plain call"
    call, box = measured.plain_call, measured.box
    corners = None if box is None else box.corners
    smooth = () if call is None else (output.smooth_covered for output in call.outputs)
    at_corners = () if corners is None else (output.covered for output in corners.outputs)
    for where, values in (("under smooth inputs", smooth), ("at the corners", at_corners)):
        if shares := _shares(value for value in values if value is not None):
            text += f", {shares} {where}"
    width = worst_of(output.width for output in found.outputs)
    if width is None:
        return f"{text}."
    most = "up to " if len(found.outputs) > 1 else ""
    text += f". On average it is {most}{width:.2g} times as large as the constant that covers "
    text += f"{100 * found.confidence:g} % of the errors"
    worse = [output.name for output in found.outputs if (output.skill or 0.0) < 0]
    text += f"; for {', '.join(worse)} a constant bound says more." if worse else "."
    return text + _harm_in_plain_call(found)


def _harm_in_plain_call(found: BoundFigures) -> str:
    """Say how often the plain call is trusted, where harm was measured with known inputs."""
    harm = None if found.plain is None else found.plain.harm
    if found.plain is None or harm is None or harm == found.harm:
        return ""
    flagged = ""
    if harm.harmful_flagged is not None:
        flagged = f" ({percent(harm.harmful_flagged)} of these flagged)"
    return (
        f" In the plain call, trusted is false in {percent(found.plain.untrusted)} of the "
        f"samples, {percent(harm.harmful)} are harmful{flagged}, and "
        f"{percent(harm.harmful_unnoticed)} are harmful and unnoticed."
    )


def _shares(values: Iterable[float]) -> str:
    """Return shares in per cent, the least and the largest of several; empty without shares."""
    found = sorted(values)
    return " to ".join(dict.fromkeys(map(percent, found[:1] + found[-1:])))


def _estimate(found: EstimateFigures | None, call: PlainCallFigures | None) -> str | None:
    """Say how far the error estimate is off."""
    if found is None or not found.without_floor:
        return None
    own, constant = max((one.mean, one.constant_mean) for one in found.without_floor)
    moving = call is not None and call.worst("known_to_step_end") is not None
    begin = "With inputs known to the step's end, on average," if moving else "On average,"
    text = (
        f"{begin} its error estimate differs from the true error by {percent(own)}; the best "
        f"constant estimate would differ by {percent(constant)}."
    )
    if found.plain:
        own, constant = max((one.mean, one.constant_mean) for one in found.plain)
        text += f" In the plain call, these are {percent(own)} and {percent(constant)}."
    return text


def _valid(
    subject: Subject, in_range: ValidationFigures, others: Sequence[ValidationFigures]
) -> str:
    """Say for which inputs the FMU is valid, and for which it is not."""
    ranges = [
        f"{name} {decimal(low, 6)} .. {decimal(high, 6)}{behind(unit)}"
        for name, low, high, unit in subject.inputs
    ]
    shown = f" ({', '.join(ranges)})" if len(ranges) <= MOST_INPUTS else ""
    within = f", within their ranges{shown}" if ranges else ""
    like = f"inputs like those of its training{within}"
    if in_range.error_bound is None:
        text = f"Made for {like}. No kind of them was judged, since it has no error bound."
    else:
        call = "With inputs known to the step's end, valid for" if subject.planned else "Valid for"
        _, bad = _kinds(in_range)
        text = f"{call} {like}{f', except {_listed(bad, in_range)}' if bad else ''}."
        if bad:
            text += " More trajectories of these kinds, or a mix of fewer kinds, may mend this."
    for figures in others:
        if figures.held_out:
            text += f" {_of_others(figures)}"
        else:
            low, high = figures.amplitude
            text += f" Beyond the range, at {low:g} to {high:g} times the amplitude: "
            text += f"{percent(figures.worst)}{_flagged(figures)}."
    return text + _little_covered([in_range, *(each for each in others if each.held_out)])


def _kinds(figures: ValidationFigures) -> tuple[list[KindBound], list[KindBound]]:
    """Return the kinds of input for which the FMU is valid, and the others."""
    bound = figures.error_bound
    judged = [] if bound is None else [k for k in bound.excitations if k.harm is not None]
    good = [kind for kind in judged if kind.harm is not None and is_valid(kind.harm)]
    return good, [kind for kind in judged if kind not in good]


def _listed(kinds: Sequence[KindBound], figures: ValidationFigures) -> str:
    """Name kinds with their errors, and which share of the harmful samples the FMU flags."""
    errors = {kind.name: max(kind.relative_rmse) for kind in figures.excitations}
    parts, share = [], "{} of the harmful samples flagged"
    for kind in kinds:
        found = [percent(errors[kind.name])] if kind.name in errors else []
        if kind.harm is not None and kind.harm.harmful_flagged is not None and kind.harm.harmful:
            found.append(share.format(percent(kind.harm.harmful_flagged)))
            share = "{}"  # once is enough
        parts.append(f"{kind.name} ({', '.join(found)})" if found else kind.name)
    return ", ".join(parts)


def _of_others(figures: ValidationFigures) -> str:
    """Say for which of the kinds that no training saw the FMU is valid too."""
    good, bad = _kinds(figures)
    if not good and not bad:
        return f"Other kinds of input that were measured: {percent(figures.worst)}."
    parts = [f"also valid for {', '.join(kind.name for kind in good)}"] if good else []
    parts += [f"not for {_listed(bad, figures)}"] if bad else []
    return f"Of the kinds that it was not trained on, it is {'; '.join(parts)}."


def _little_covered(validations: Sequence[ValidationFigures]) -> str:
    """Name the kinds for which the FMU is valid, but whose errors its bound covers too seldom."""
    found, confidence = [], 0.0
    for figures in validations:
        confidence = max(confidence, figures.error_bound.confidence if figures.error_bound else 0)
        found += [(kind.name, min(kind.coverage, default=1.0)) for kind in _kinds(figures)[0]]
    least = confidence - MISSING
    named = [f"{name} ({percent(share)})" for name, share in found if share < least]
    if not named:
        return ""
    return f" Its bound covers less than {percent(least)} of the samples of {', '.join(named)}."


def _flagged(figures: ValidationFigures) -> str:
    """Say which share of the harmful samples the FMU flags; an empty text if it is not known."""
    harm = None if figures.error_bound is None else figures.error_bound.harm
    if harm is None or harm.harmful_flagged is None or not harm.harmful:
        return ""
    return f" ({percent(harm.harmful_flagged)} of the harmful samples are flagged)"


def _times_of(subject: Subject) -> str:
    """Say for how long the inputs of the past act, and from when on the error bounds count."""
    text = f"Its outputs depend on the inputs of the last {subject.memory:.4g} s"
    if subject.filling is not None:
        text += f", and its bound counts from {subject.filling:.4g} s on"
    return f"{text}."


def _time(found: Timing) -> str:
    """Say the time of a step of the FMU, and of the model at equal accuracy."""
    text = f"A step takes {found.fmu_step_us:.3g} µs. "
    return text if found.speed is None else f"{text}{speed_text(found.speed)} "
