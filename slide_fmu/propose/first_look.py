"""This module simulates a model before it has a recipe, for its step and ranges of outputs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from slide_fmu.core.measures import percent
from slide_fmu.core.progress import Progress, part_of
from slide_fmu.core.signals import FloatArray, Hold, hold_of, on_circles, within_ranges
from slide_fmu.data.failing_motions import Tolerance
from slide_fmu.excitation.base import Kind
from slide_fmu.excitation.box import Box, at_points, corners_of_box, points_inside
from slide_fmu.excitation.kinds import Excitation, drawing_kind
from slide_fmu.memory.bandwidth import (
    GAIN,
    OWN_SAMPLES,
    lost_by_lines,
    proposed_step,
    tidy_step,
)
from slide_fmu.memory.modes import UnstableModeError, spectrum
from slide_fmu.memory.path_dependence import path_dependence_without_recipe
from slide_fmu.memory.sizing import NotForgettingError
from slide_fmu.memory.time_dependence import time_dependence
from slide_fmu.propose.lasting_tones import Tone, answers_to, tones_of
from slide_fmu.propose.working_step import working_step
from slide_fmu.recipe.default_excitation import KindTable
from slide_fmu.recipe.tables import DataRecipe
from slide_fmu.systems.base import Linearizable, Motion, System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.loading import load_system
from slide_fmu.systems.simulation import simulate, simulate_motions
from slide_fmu.systems.specification import Specification

FIRST_STEP = 0.01
"""This step in s is tried first."""
SAMPLES = 1000
"""Each motion by which ranges of outputs are found has this many samples."""
INSIDE = 4
"""Number of points inside of the ranges where inputs are held, in addition to all corners."""
ABOVE_MODES = 3.0
"""A weakly damped resonance has a bandwidth of up to this many times its own frequency."""
AT_REST = 1e-6
"""An output rests where it moves by less than this part of all that was seen. Where no motion goes
further than that beyond an output at rest, it is an end that no motion passes."""

USUAL = (1, 2, 5, 10)
"""Usual communication steps of importers, in ms."""
NEAR_USUAL = 10
"""Those are told that are shorter or longer than the sample step by no more than this factor."""

MakeTables = Callable[..., Sequence[KindTable]]
"""Makes the tables of the excitation for a sample step in s, and for ``resonances`` that are known
by then: the lowest and the highest, in rad/s."""


@dataclass(frozen=True, eq=False)
class FirstLook:
    """A FirstLook holds the results of simulating a model.

    Attributes:
        step: sample step h in s.
        origin: origin of the step.
        low, high: least and greatest outputs that were seen, shape (n_outputs,).
        still: whether an output moved in the later half of no motion, shape (n_outputs,).
        motions: number of motions; 0 if no ranges were to be found.
        remarks: one sentence for each failure.
        low_at_rest, high_at_rest: whether the end is an output at rest under constant inputs,
            beyond which no motion went, shape (n_outputs,).
        resonances: frequencies in Hz at which tones lasted.
    """

    step: float
    origin: str
    low: FloatArray
    high: FloatArray
    still: NDArray[np.bool_]
    motions: int
    remarks: tuple[str, ...]
    low_at_rest: NDArray[np.bool_]
    high_at_rest: NDArray[np.bool_]
    resonances: tuple[float, ...] = ()


@dataclass(frozen=True)
class FirstLookSettings:
    """FirstLookSettings are those with which a model is simulated.

    Attributes:
        specification: specification of the model; its step is proposed if None.
        origin: origin of that step.
        excitation: makes the tables by which ranges of outputs are found; None if they are known.
        driven: whether the inputs are set points of drives or an angle.
        only_step: the step in s whose multiples alone the model takes; None if it takes any.
        highest: highest frequency in Hz at which the machine works in each input, None where it
            is not known; empty if none is.
    """

    specification: Specification
    origin: str
    excitation: MakeTables | None
    driven: bool = False
    only_step: float | None = None
    highest: Sequence[float | None] = ()

    @property
    def first_step(self) -> float:
        """The step in s that is tried first."""
        return self.specification.step or taken_step(FIRST_STEP, self.only_step)


def taken_step(step: float, only: float | None) -> float:
    """Return the step nearest to one that a model takes, in s: a multiple of its only step."""
    if only is None:
        return step
    return float(f"{max(1, round(step / only)) * only:.10g}")


def look(settings: FirstLookSettings, progress: Progress) -> FirstLook:
    """Simulate a model to find its step, if it has none, and the ranges of its outputs.

    Raises:
        LoadError: the model cannot be made.
        NotForgettingError: its outputs integrate, so that no window can hold it, or depend on
            time.
        SimulationError: it fails with any step, or on more than a few motions.
    """
    step, origin, failed = _step(settings, part_of(progress, "step", at_most=True))
    step = taken_step(step, settings.only_step)
    progress = part_of(progress)
    remarks = [] if failed is None else [failed]
    system = load_system(replace(settings.specification, step=step))
    if (clock := time_dependence(system)) is not None:
        raise NotForgettingError(clock)
    if settings.excitation is None:
        nothing, none = np.empty(0), np.empty(0, dtype=bool)
        return FirstLook(step, origin, nothing, nothing, none, 0, tuple(remarks), none, none)
    known = system.remarks  # the model's declarations have these
    lasts = path_dependence_without_recipe(system)
    if lasts is not None:
        raise NotForgettingError(str(lasts))
    mix = TypeAdapter(list[Excitation]).validate_python(settings.excitation(step))
    rng = np.random.default_rng(SAMPLES)
    kinds = [drawing_kind(kind, mix, rng) for kind in mix]
    seen = _outputs(system, kinds, progress)
    low, high = (end([end(rows, axis=0) for rows in seen.all], axis=0) for end in (np.min, np.max))
    still = [(np.ptp(rows[len(rows) // 2 :], axis=0) == 0) for rows in seen.all]
    ends_at_rest = _ends_at_rest(seen.held, low, high)
    remarks += [*seen.remarks, *_idle_inputs(system, kinds[0])]
    remarks += [remark for remark in system.remarks if remark not in known]
    return FirstLook(
        step,
        origin,
        low,
        high,
        np.all(still, axis=0),
        len(seen.all),
        tuple(remarks),
        *ends_at_rest,
        tuple(tone.frequency / step for tone in seen.tones),
    )


def _step(settings: FirstLookSettings, progress: Progress) -> tuple[float, str, str | None]:
    """Return the sample step in s, its origin, and a remark or None.

    The search of a step would go on and on with a system that integrates.
    """
    given = settings.specification
    if given.step is not None:
        return given.step, settings.origin, None

    def make(step: float) -> System:
        return load_system(replace(given, step=step))

    begin = settings.first_step
    first = make(begin)
    if _is_free(first):
        for step in (begin, 10 * begin, 100 * begin):  # it may move slowly
            if (lasts := path_dependence_without_recipe(make(step))) is not None:
                raise NotForgettingError(str(lasts))
    if any(settings.highest):
        return *_step_at_work(make, first, settings.highest), None
    fastest = _fastest_mode(first)
    enough = None if fastest is None else ABOVE_MODES * fastest
    proposed = proposed_step(make, begin, progress, enough, settings.driven)
    seen, hold = proposed.bandwidth, hold_of(first.inputs)
    if fastest is not None and (seen is None or seen >= ABOVE_MODES * fastest):
        step = tidy_step(1.0 / (OWN_SAMPLES * fastest))
        origin = (
            f"The fastest mode at rest has {fastest:.3g} Hz. The rates of the inputs act too. If "
            "your inputs move faster, or springs harden, take a smaller step."
        )
        return step, f"{origin} {_why(step, fastest, hold)}", None
    failed = proposed.failed and (
        "the model failed under inputs over their whole ranges, so a part of them showed the "
        f"step: {proposed.failed}"
    )
    step = proposed.step
    if proposed.own is not None:
        origin = f"When its inputs rest, the model moves on with up to {proposed.own:.3g} Hz."
        return step, f"{origin} {_why(step, proposed.own, hold)}", failed
    if seen is not None:
        origin = (
            f"Up to {seen:.3g} Hz, an output has a gain of {100 * GAIN:g} % of its largest one."
        )
        return step, f"{origin} {_why(step, seen, hold)}", failed
    origin = "This step is assumed, since the outputs show no dynamics of their own."
    return step, f"{origin}{_fitting(step)}", failed


def _step_at_work(
    make: Callable[[float], System], first: System, highest: Sequence[float | None]
) -> tuple[float, str]:
    """Return the step in s for a machine that works up to frequencies in Hz, and its origin."""
    most = max(hz for hz in highest if hz is not None)
    found = working_step(make, first, [hz or most for hz in highest])
    origin = (
        f"The step follows from the working frequencies, up to {most:.3g} Hz. "
        f"{_why(found.for_inputs, most, hold_of(first.inputs))}"
    )
    if found.step < found.for_inputs:
        origin += (
            f" Outputs are faster than the inputs there, and need a step of {found.step:g} s."
        )
    if found.lost is not None:
        origin += (
            f" Under tones there, over the whole ranges, outputs between samples differ by "
            f"{percent(found.lost)} of their standard deviation from a smooth curve."
        )
    return found.step, origin


def _why(step: float, frequency: float, hold: Hold) -> str:
    """Say what a step in s takes of a period of a frequency in Hz, and what it loses of inputs."""
    text = f"A step of {step:g} s takes {1.0 / (frequency * step):.2g} samples in such a period."
    if hold == "first_order":
        lost = percent(lost_by_lines(frequency, step))
        text += f" At this frequency, straight lines between samples lose {lost} of the amplitude."
    return f"{text}{_fitting(step)}"


def _fitting(step: float) -> str:
    """Say which usual steps of importers go with a step in s; empty where none is near it."""

    def fits(other: float) -> bool:
        ratio = max(step, other) / min(step, other)
        return ratio < 1.01 * NEAR_USUAL and math.isclose(ratio, round(ratio), rel_tol=1e-6)

    fitting = [str(usual) for usual in USUAL if fits(usual / 1000.0)]
    if not fitting:
        return ""
    named = " and ".join(filter(None, [", ".join(fitting[:-1]), fitting[-1]]))
    return f" Usual steps of importers that are whole parts or multiples of it: {named} ms."


def _is_free(system: System) -> bool:
    """Return whether a system has a free direction where it rests under its first inputs."""
    if not isinstance(system, Linearizable):
        return False
    start = np.array([signal.start_value for signal in system.inputs])
    try:
        return bool(spectrum(system.linearize(system.rest_state(start))).rigid)
    except (SimulationError, UnstableModeError, ValueError):  # it does not rest there
        return False


def _fastest_mode(system: System) -> float | None:
    """Return the frequency in Hz of the fastest mode, where outputs follow the rates of inputs.

    Rates have no highest frequency, so outputs that follow them have none either: the step follows
    from this mode, unless the bandwidth is about that.
    """
    if not (system.follows_rates and isinstance(system, Linearizable)):
        return None
    start = np.array([signal.start_value for signal in system.inputs])
    modes = spectrum(system.linearize(system.rest_state(start))).modes
    if not modes:
        raise LoadError(
            "the model follows the rates of its inputs and has no mode of its own, so nothing "
            "says how fast these move; expected a sample step: give --step SECONDS, a tenth "
            "of the shortest period of the inputs"
        )
    return max(mode.natural_frequency for mode in modes) / (2 * math.pi)


@dataclass(frozen=True, eq=False)
class _Seen:
    """These outputs were seen in motions, each of shape (samples + 1, n_outputs).

    Attributes:
        moved: under each kind of excitation, and under tones that last and sweeps around them.
        held: under constant inputs.
        tones: the tones.
        remarks: one sentence for each failure.
    """

    moved: list[FloatArray]
    held: list[FloatArray]
    tones: list[Tone]
    remarks: list[str]

    @property
    def all(self) -> list[FloatArray]:
        """The outputs in all motions."""
        return [*self.moved, *self.held]


def _outputs(system: System, kinds: Sequence[Kind], progress: Progress) -> _Seen:
    """Simulate motions: one of each kind of excitation, rests, and tones at resonances.

    Where the system fails on a motion of a kind, another one takes its place. All that is
    simulated is counted in samples, so that a slow machine sees the same.
    """
    tolerance = Tolerance(DataRecipe.model_fields["most_failures"].default)
    held, tones, remarks = _constant_inputs(system, kinds), list[Tone](), list[str]()
    if held:
        try:
            tones = tones_of(system, SAMPLES)
        except SimulationError as error:
            remarks.append(f"no resonance could be looked for: {error}")
    total = len(kinds) + len(held) + len(tones)
    first = [Motion(_motion(system, kind, index, 0)) for index, kind in enumerate(kinds)]
    moved = list[FloatArray]()
    for index, answer in enumerate(simulate_motions(system, first)):
        tolerance.tried += 1
        if isinstance(answer, SimulationError):
            tolerance.count(answer)
            answer = _outputs_under(system, kinds[index], index, tolerance)
        moved.append(answer)
        progress(index + 1, total)
    rests, failed = list[FloatArray](), list[SimulationError]()
    for index, answer in enumerate(simulate_motions(system, [Motion(each) for each in held])):
        failed.append(answer) if isinstance(answer, SimulationError) else rests.append(answer)
        progress(len(kinds) + index + 1, total)
    if tolerance.remark is not None:
        remarks.append(tolerance.remark)
    if failed:
        remarks.append(
            f"the model failed at {len(failed)} of {len(held)} constant inputs at the ends of "
            f"their ranges and inside of them, the first time with: {failed[0]}"
        )
    for index, tone in enumerate(tones):
        answers, failure = answers_to(system, tone)
        moved += answers
        if failure is not None:
            remarks.append(_on_failed_tone(system, tone, *failure))
        progress(len(kinds) + len(held) + index + 1, total)
    return _Seen(moved, rests, tones, remarks)


def _on_failed_tone(system: System, tone: Tone, part: float, error: SimulationError) -> str:
    """Say that a system failed under a tone, and how far the tone goes instead."""
    instead = f"{percent(part)} of them showed the ranges of the outputs" if part else "none did"
    return (
        f"the model failed under a tone of {tone.frequency / system.step:.3g} Hz, a resonance of "
        f"{tone.output}, over the whole ranges of its inputs; {instead}: {error}"
    )


def _ends_at_rest(
    held: Sequence[FloatArray], low: FloatArray, high: FloatArray
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return whether outputs at rest are the ends of all that was seen, (n_outputs,) each."""
    near = AT_REST * (high - low)
    ends = np.zeros((2, len(low)), dtype=bool)
    for rows in held:
        later = rows[len(rows) // 2 :]
        rests = np.ptp(later, axis=0) <= near
        ends |= rests & (np.abs(later[-1] - np.stack([low, high])) <= near)
    return ends[0], ends[1]


def _constant_inputs(system: System, kinds: Sequence[Kind]) -> list[FloatArray]:
    """Return inputs held at the corners of their ranges and at points inside, (SAMPLES, n_inputs).

    The result is empty if the inputs are set points of drives, or angles.
    """
    if not any(isinstance(kind, Box) for kind in kinds):
        return []
    n_inputs = len(system.inputs)
    points = np.concatenate([corners_of_box(n_inputs), points_inside(n_inputs, INSIDE)])
    return [np.tile(point, (SAMPLES, 1)) for point in at_points(system.inputs, points)]


def _outputs_under(system: System, kind: Kind, index: int, tolerance: Tolerance) -> FloatArray:
    """Return the outputs under the first further motion of a kind on which the system succeeds."""
    attempt = 1
    while True:
        tolerance.tried += 1
        try:
            return simulate(system, _motion(system, kind, index, attempt)).outputs
        except SimulationError as error:
            tolerance.count(error)
        attempt += 1


def _motion(system: System, kind: Kind, index: int, attempt: int) -> FloatArray:
    """Draw the inputs of a motion of a kind, (SAMPLES, n_inputs)."""
    further = (attempt,) if attempt else ()
    rng = np.random.default_rng([SAMPLES, index, *further])
    moments = system.step * np.arange(SAMPLES, dtype=np.float64)
    return within_ranges(system.inputs, kind.inputs(system.inputs, moments, 1.0, rng))


def _idle_inputs(system: System, kind: Kind) -> list[str]:
    """Return remarks on inputs whose motion changes no output while the others move too."""
    inputs = _motion(system, kind, 0, 0)
    names, motions = list[str](), [Motion(inputs)]
    for index, signal in enumerate(system.inputs):
        still = inputs.copy()
        still[:, index] = inputs[0, index]
        still = on_circles(system.inputs, still)
        if not np.array_equal(still, inputs):  # else it did not move, so its effect is unknown
            names.append(signal.name)
            motions.append(Motion(still))
    moved, *others = simulate_motions(system, motions)
    # another remark reports motions on which the system fails
    return [
        f"input {name!r} changes no output: the surrogate does not need it"
        for name, other in zip(names, others, strict=True)
        if isinstance(moved, np.ndarray)
        and isinstance(other, np.ndarray)
        and np.array_equal(moved, other)
    ]
