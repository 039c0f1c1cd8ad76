"""This module makes all rows of an FMU: of unseen trajectories, and of inputs of further kinds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from slide_fmu.core.measures import FEWEST, size_about
from slide_fmu.core.progress import Progress, Stages, quiet
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.importer.file import UnpackedFmu, unpacked
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.validation.adversarial import Attack
from slide_fmu.validation.calls import (
    CallAnswers,
    ErrorLevels,
    InputsLabel,
    MeasuredMotion,
    answers,
    row_of,
)
from slide_fmu.validation.constant_inputs import constant_motions
from slide_fmu.validation.input_courses import course_of
from slide_fmu.validation.results import Validation
from slide_fmu.validation.row import (
    ALL,
    FINER,
    OF_TRAINING,
    SEARCH,
    SMOOTH,
    TONES,
    YOURS,
    Call,
    Row,
)
from slide_fmu.validation.smooth_inputs import (
    STEPS,
    TRAJECTORIES,
    fine_truths,
    model_rows,
    smooth_motions,
)
from slide_fmu.validation.tones import tone_kinds
from slide_fmu.validation.user_inputs import simulated_kinds, user_kinds
from slide_fmu.validation.your_inputs import JudgingPart, judging_parts, your_motions

Calls = Sequence[tuple[Call, float]]
"""Calls, each with the number of its communication steps in the surrogate's own step."""


@dataclass(frozen=True, eq=False)
class Meter:
    """A Meter is an FMU with what its errors are compared with.

    Attributes:
        fmu: the unpacked FMU, whose library is run.
        surrogate: the surrogate that it runs.
        levels: which errors are usual.
    """

    fmu: UnpackedFmu
    surrogate: Surrogate
    levels: ErrorLevels

    @property
    def step(self) -> float:
        """The surrogate's own step in s."""
        return self.surrogate.window.step

    def relative_to(self, size: FloatArray) -> Meter:
        """Return the meter whose errors are relative to a size of the outputs, (n_outputs,)."""
        return replace(self, levels=replace(self.levels, size=size))

    def usual_calls(self, finer: bool = True) -> Calls:
        """Return the calls that every kind of input is measured in.

        They are the plain call at the own step, and where it is known what inputs do between
        samples at a shorter one, too (``finer``). Where inputs move, they are also known.
        """
        calls: list[tuple[Call, float]] = [("plain", 1.0)]
        if finer:
            calls.append(("plain", float(FINER)))
        if self.surrogate.hold == "first_order":
            calls.append(("known", 1.0))
        return calls

    def answers(
        self, motions: Sequence[MeasuredMotion], call: Call, steps: float
    ) -> list[CallAnswers]:
        """Return what the FMU gives on motions in a call, with a number of steps in the own step.

        It is run where a motion has not its answers already.

        Raises:
            CoSimulationError: the FMU reports an error.
        """
        signals = self.surrogate.inputs, self.surrogate.outputs
        known = [one.answers.get(call) if steps == 1.0 else None for one in motions]
        return [
            answers(self.fmu, *signals, motion, call, self.step / steps) if done is None else done
            for motion, done in zip(motions, known, strict=True)
        ]

    def rows(
        self,
        kinds: Mapping[InputsLabel, Sequence[MeasuredMotion]],
        calls: Calls,
        joined: bool = False,
    ) -> list[Row]:
        """Return a row for each call and each kind that has a communication point that counts.

        Args:
            kinds: motions of each kind of inputs.
            calls: the calls.
            joined: whether a row of all kinds together, which are of one group, comes before them.

        Raises:
            CoSimulationError: the FMU reports an error.
        """
        rows: list[Row | None] = []
        for call, steps in calls:
            of_kinds = {
                label: self.answers(motions, call, steps)
                for label, motions in kinds.items()
                if motions
            }
            if joined and of_kinds:
                every = [one for of_kind in of_kinds.values() for one in of_kind]
                of_kinds = {InputsLabel(next(iter(of_kinds)).group, ALL): every, **of_kinds}
            rows += [self._row(given, label, call, steps) for label, given in of_kinds.items()]
        return [row for row in rows if row is not None]

    def _row(
        self, given: Sequence[CallAnswers], label: InputsLabel, call: Call, steps: float
    ) -> Row | None:
        lengths = self.step / steps, self.step
        return row_of(given, self.surrogate.outputs, label, call, lengths, self.levels)


def rows_of(
    fmu: Path,
    validations: Mapping[str, Validation],
    case: Case,
    usual: FloatArray | None,
    bar: Stages,
    attacks: Sequence[Attack] = (),
) -> tuple[Row, ...]:
    """Measure an FMU on all inputs, in all calls, at the communication steps that count.

    Args:
        fmu: the FMU, whose library is run.
        validations: its validations by the name of their group, the one in range first if it is
            there. Inputs of further kinds are measured with that one alone.
        case: what it was made from.
        usual: the usual level of the errors of each output, (n_outputs,); None if unknown.
        bar: opens the progress of a stage.
        attacks: results of the search for unnoticed errors.

    Raises:
        CoSimulationError: the FMU reports an error.
    """
    first = next(iter(validations.values()))
    progress = bar("communication steps")
    rows: list[Row] = []
    total = len(validations)
    progress(0, total)
    with unpacked(fmu) as files:
        meter = Meter(files, first.surrogate, ErrorLevels(first.mean, usual))
        for number, (group, validation) in enumerate(validations.items(), start=1):
            beyond = validation.task.amplitude != (1.0, 1.0)
            finer = validation.between_known and not beyond
            held = first.surrogate.hold == "zero_order"
            calls = meter.usual_calls(finer=finer and not held)
            rows += meter.rows(_labelled(group, motions_by_kind(validation)), calls, joined=True)
            if finer and held:
                shown = motions_between(validation, case, bar("motions between samples"))
                shorter: Calls = [("plain", float(FINER))]
                rows += meter.rows(_labelled(group, shown), shorter, joined=True)
            progress(number, total)
        if first.in_range:
            rows += further_rows(case.source, meter, first, case, bar)
        label = InputsLabel(SEARCH, "noise that a search has made worse")
        attacked = {label: [_of_attack(attack, first.surrogate) for attack in attacks]}
        rows += meter.rows(attacked, meter.usual_calls())
    return tuple(rows)


def _labelled(
    group: str, by_name: Mapping[str, Sequence[MeasuredMotion]]
) -> dict[InputsLabel, Sequence[MeasuredMotion]]:
    return {InputsLabel(group, name): motions for name, motions in by_name.items()}


def motions_by_kind(validation: Validation) -> dict[str, list[MeasuredMotion]]:
    """Return the motions of a validation by the names of their kinds."""
    recipe = validation.recipe
    by_name: dict[str, list[MeasuredMotion]] = {}
    names = [motion.full_name or motion.name for motion in rules_of(recipe).motions(recipe)]
    for comparison in validation.comparisons:
        if comparison.motion is not None:
            by_name.setdefault(names[comparison.kind], []).append(comparison.motion)
    return dict(sorted(by_name.items(), key=lambda item: names.index(item[0])))


def motions_between(
    validation: Validation, case: Case, progress: Progress = quiet
) -> dict[str, list[MeasuredMotion]]:
    """Simulate the reference between the samples, too, under inputs that are held over each.

    Its own samples alone would show what an FMU gives at multiples of its step, where inputs that
    are held over it are exact. The model starts at rest, so that points count later, by the
    burn-in. None of a model without a finer step; motions on which it fails are left out.

    Returns:
        The motions by the names of their kinds, whose truth has the steps of the shorter call, or
        those that the model names.
    """
    by_name: dict[str, list[MeasuredMotion]] = {}
    step = case.recipe.window.step
    times = FINER if case.reference.own_step is None else case.finer_steps
    chosen = []
    for name, motions in motions_by_kind(validation).items():
        chosen += [(name, motion) for motion in motions[:FEWEST]]
    progress(0, len(chosen))
    for number, (name, motion, truth) in enumerate(_between(case, chosen, times), start=1):
        if not isinstance(truth, Exception):
            first = motion.first + case.recipe.data.burn_in
            fine = MeasuredMotion(motion.course, truth, step / times, first, motion.parameters)
            by_name.setdefault(name, []).append(fine)
        progress(number, len(chosen))
    return by_name


def _between(
    case: Case, chosen: Sequence[tuple[str, MeasuredMotion]], times: int
) -> Iterator[tuple[str, MeasuredMotion, FloatArray | LoadError | SimulationError]]:
    """Yield motions with their truth at the steps of the shorter call, or why there is none."""
    step = case.recipe.window.step
    for parameters in {tuple(motion.parameters.items()): None for _, motion in chosen}:
        same = [one for one in chosen if tuple(one[1].parameters.items()) == parameters]
        counts = [motion.count(step) * times for _, motion in same]
        truths: Iterable[FloatArray | LoadError | SimulationError]
        try:
            system = case.at(dict(parameters)).reference_as_it_runs(parts=times)
            truths = fine_truths(system, [motion.course for _, motion in same], counts)
        except LoadError as error:
            truths = [error] * len(same)
        for (name, motion), truth in zip(same, truths, strict=True):
            yield name, motion, truth


@asked_of_sources
def further_rows(
    system: System, meter: Meter, in_range: Validation, case: Case, bar: Stages
) -> list[Row]:
    """Measure your inputs, smooth and constant ones, tones, and such as users set.

    Records have none.
    """
    surrogate, rows = meter.surrogate, list[Row]()
    rows += your_rows(meter, case, judging_parts(case.recipe, surrogate), bar)
    rows += _smooth_rows(meter, in_range, case, bar("smooth inputs"))
    truth = np.concatenate([comparison.reference for comparison in in_range.comparisons])
    resting = meter.relative_to(truth.std(axis=0))
    for label, motions in constant_motions(surrogate, case, bar("constant inputs")).items():
        rows += resting.rows({label: motions}, resting.usual_calls())
    given = surrogate, case, in_range.task, in_range.each
    kinds = [*tone_kinds(*given), *user_kinds(*given)]
    progress = bar("lasting tones, and inputs as users set them")
    motions_of = simulated_kinds(surrogate, case, kinds, progress)
    tones = {label: of_kind for label, of_kind in motions_of.items() if label.group == TONES}
    rows += meter.rows(tones, meter.usual_calls()[:2], joined=True)
    for label, of_kind in motions_of.items():
        if label.group != TONES:
            rows += meter.rows({label: of_kind}, meter.usual_calls())
    return rows


def your_rows(meter: Meter, case: Case, parts: Sequence[JudgingPart], bar: Stages) -> list[Row]:
    """Measure parts of files of inputs; errors are relative to what the reference does there.

    Raises:
        CoSimulationError: an FMU reports an error.
        SimulationError: the reference could not be simulated.
    """
    rows: list[Row] = []
    if not parts:
        return rows
    moving, progress = meter.surrogate.hold == "first_order", bar(YOURS)
    by_steps: dict[float, dict[InputsLabel, MeasuredMotion]] = {}
    for call, steps in meter.usual_calls():
        as_set = 1.0 if moving else steps  # held inputs follow the importer's step
        if as_set not in by_steps:
            by_steps[as_set] = your_motions(meter.surrogate, case, parts, as_set, progress)
        for label, motion in by_steps[as_set].items():
            size = size_about(motion.truth[round(motion.first / motion.grid) :])
            rows += meter.relative_to(size).rows({label: [motion]}, [(call, steps)])
    return rows


def _smooth_rows(meter: Meter, in_range: Validation, case: Case, progress: Progress) -> list[Row]:
    """Measure the plain call at several communication steps, under smooth inputs.

    These are sums of sines, or the motions of the training where inputs are planned or angles, and
    where the model has no finer step. Planned motions have no second line: their models know a
    motion by its samples, so that one with other samples is another model.
    """
    surrogate = meter.surrogate
    turning = any(signal.angle is not None for signal in surrogate.inputs)
    calls: Calls = [*(("plain", steps) for steps in STEPS), *meter.usual_calls()[2:]]
    progress(0, 3)
    try:
        if not (surrogate.planned or turning):
            smooth = smooth_motions(surrogate, case, in_range.task, in_range.each)
            progress(1, 3)
            rows = meter.rows({smooth.label: smooth.motions}, calls)
            progress(2, 3)
            rows += model_rows(smooth, case, surrogate.outputs, meter.levels, meter.step)
            progress(3, 3)
            return rows
    except (LoadError, SimulationError):  # no finer step, or no smooth motion that it survives
        pass
    rows = []
    if surrogate.hold == "first_order":
        chosen = [c.motion for c in in_range.comparisons[:TRAJECTORIES] if c.motion is not None]
        rows = meter.rows({InputsLabel(SMOOTH, OF_TRAINING): chosen}, calls)
    progress(3, 3)
    return rows


def _of_attack(attack: Attack, surrogate: Surrogate) -> MeasuredMotion:
    """Return the motion that a search has found."""
    attacked, step = attack.measured, surrogate.window.step
    # the output at the start does not count
    truth = np.concatenate([attacked.reference[:1], attacked.reference])
    course = course_of(attacked.drawn, surrogate.inputs, step, surrogate.planned)
    return MeasuredMotion(course, truth, step, (attacked.first + 1) * step)
