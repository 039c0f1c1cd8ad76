"""This module tries a recipe before it is run: its tables, its window, and its time."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from slide_fmu.core.parameters import corners_of
from slide_fmu.core.progress import Progress, quiet, quiet_stages
from slide_fmu.core.signals import Signal
from slide_fmu.data.answers import asked_of_sources
from slide_fmu.data.draws import PROBE, Stream, draw, probe, simulate_draw
from slide_fmu.data.parameter_draws import case_at, with_values
from slide_fmu.data.simulation_time import TIMED_SAMPLES, simulation_time
from slide_fmu.excitation.kinds import names_of
from slide_fmu.memory.decay_figures import SizingFigures
from slide_fmu.memory.sizing import AnySizing
from slide_fmu.pipeline.apps import remarks_on_app_tables
from slide_fmu.pipeline.case_checks import guarded_case
from slide_fmu.pipeline.job import Job, checked, open_job
from slide_fmu.pipeline.numbers import least_numbers, states_at_start
from slide_fmu.pipeline.stages import remark_on_step, size_recipe
from slide_fmu.pipeline.work_estimate import Span, estimated_work
from slide_fmu.recipe.against_system import remarks_on_clipping
from slide_fmu.recipe.case import Case
from slide_fmu.recipe.checks import remarks_on_sampling
from slide_fmu.recipe.open_recipe import OpenRecipe
from slide_fmu.recipe.recipe import SPLITS, Recipe
from slide_fmu.systems.base import (
    Chained,
    Linearizable,
    RandomStates,
    Restorable,
    Source,
    Stepping,
    System,
)
from slide_fmu.systems.errors import SimulationError

PATIENCE = 25.0
"""The window is sized no longer than this time in s, so that a trial takes less than a minute."""
MOST_TIME = 10.0
"""Approximate limit in s for simulating all kinds that a run needs once."""
OFFERS: dict[str, type] = {
    "steps": Stepping,
    "states": Restorable,
    "random initial states": RandomStates,
    "linearization": Linearizable,
    "geometry of a serial chain": Chained,
}
"""Offers of a system in addition to its outputs, by their names for people."""
STEPS = 4
"""Number of steps of a trial's progress; the first one ends with the lengths."""


@dataclass(frozen=True, kw_only=True)
class SystemFigures:
    """This is the tried system with its signals and further offers."""

    kind: str
    model: str
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    offers: Mapping[str, bool]


@dataclass(frozen=True, kw_only=True)
class Costs:
    """These are the data of a recipe and the time that they take.

    Attributes:
        trajectories: numbers of trajectories by their use.
        at_least: whether the numbers may grow.
        wall_time_per_simulated_second_s: time in one process; None for records.
        expected_wall_time_s: time with ``workers`` processes.
        computing_time_s: the least and the largest time of the whole run on one core, with
            training and measuring.
    """

    trajectories: Mapping[str, int]
    at_least: bool
    duration_s: float
    burn_in_s: float
    simulated_time_s: float
    wall_time_per_simulated_second_s: float | None
    workers: int
    expected_wall_time_s: float
    computing_time_s: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class TrialFigures:
    """These are the figures of a trial, as JSON files hold them."""

    name: str
    system: SystemFigures
    window: SizingFigures
    data: Costs
    remarks: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Trial:
    """A Trial holds the findings about a recipe without data.

    Attributes:
        open_recipe: the recipe with its lengths; numbers of trajectories may still be open.
        system: the system that makes its data, or the records of one.
        sizing: memory of the system, compared with the window.
        seconds: wall time in s that a simulated second takes in one process; None for records.
        remarks: remarks for the user, one sentence each.
    """

    open_recipe: OpenRecipe
    system: Source
    sizing: AnySizing
    seconds: float | None
    remarks: tuple[str, ...]

    def figures(self) -> TrialFigures:
        """Return the figures."""
        guess = self.open_recipe.guess
        data = guess.data
        cost = (self.seconds or 0.0) * (data.duration + data.burn_in)
        least = least_numbers(self.system, self.open_recipe, cost)
        recipe = self.open_recipe.with_found(least, f"recipe {guess.name!r}").resolved()
        counts = {split: recipe.count(split) for split in SPLITS}
        simulated = sum(counts.values()) * (data.duration + data.burn_in)
        workers = os.cpu_count() or 1
        system = SystemFigures(
            kind=guess.system.kind,
            model=guess.system.model,
            inputs=tuple(self.system.inputs),
            outputs=tuple(self.system.outputs),
            offers={name: isinstance(self.system, kind) for name, kind in OFFERS.items()},
        )
        signals = len(self.system.inputs), len(self.system.outputs)
        open_keys = self.open_recipe.open_keys
        states = self.sizing.states
        known = guess if states is None else recipe  # the samples of records decide the numbers
        cost_of_second, shown = self.seconds or 0.0, states_at_start(known, self.system)
        work = estimated_work(known, open_keys, cost_of_second, signals, states, shown)
        whole = sum(work.values(), Span())
        costs = Costs(
            trajectories=counts,
            at_least=bool(least),
            duration_s=data.duration,
            burn_in_s=data.burn_in,
            simulated_time_s=simulated,
            wall_time_per_simulated_second_s=self.seconds,
            workers=workers,
            expected_wall_time_s=simulated * (self.seconds or 0.0) / workers,
            computing_time_s=(whole.low, whole.high),
        )
        return TrialFigures(
            name=guess.name,
            system=system,
            window=self.sizing.figures(),
            data=costs,
            remarks=self.remarks,
        )


def open_trial(recipe: Path, runs: Path, progress: Progress) -> Job:
    """Read a recipe, and find its lengths, in a limited time, as the first step of a trial.

    The progress of the trial begins when the recipe is read. Its stages show none of their own.
    """

    def begin(stage: str) -> Progress:
        progress(0, STEPS)
        return quiet

    job = open_job(recipe, runs, begin, patience=PATIENCE)
    progress(1, STEPS)
    return replace(job, bar=quiet_stages)


def try_recipe(job: Job, progress: Progress, seed: int | None = None) -> Trial:
    """Try a recipe: its system, its window, its step, and the cost of its data.

    The window is sized by motions with the seed, or with the data's seed if None.
    """
    job = checked(job)
    known = job.sizing if seed is None else None  # found with the open lengths of the recipe
    sizing = known or size_recipe(job, seed, PATIENCE)
    progress(2, STEPS)
    case, recipe = job.case, job.recipe
    tried = tried_motions(case.source, case)
    progress(3, STEPS)
    of_step = remark_on_step(case), *remarks_on_sampling(recipe)
    of_ranges = remarks_on_clipping(recipe, case.source)
    of_apps = remarks_on_app_tables(recipe)
    of_inputs = *of_step, *of_ranges
    remarks = sizing.problem, sizing.remark, tried.failed, *of_inputs, *tried.remarks, *of_apps
    progress(STEPS, STEPS)
    given = tuple(remark for remark in remarks if remark is not None)
    return Trial(job.open_recipe, case.source, sizing, tried.seconds, given)


@dataclass(frozen=True)
class MotionTrial:
    """A MotionTrial holds the results of simulating the motions of a recipe.

    Attributes:
        remarks: one sentence each; None stands for no remark.
        seconds: wall time in s that a simulated second takes; None if nothing is simulated.
        failed: remark on motions that failed in this measurement.
    """

    remarks: tuple[str | None, ...]
    seconds: float | None = None
    failed: str | None = None


@asked_of_sources
def tried_motions(system: System, case: Case) -> MotionTrial:
    """Simulate a short motion of each kind that a run needs."""
    seconds, failed, own_remarks = guarded_case(case, simulation_time)
    of_kinds = guarded_case(case, _failures_of_kinds)
    beyond = guarded_case(case, _failures_beyond_parameters)
    return MotionTrial((*own_remarks, *of_kinds, beyond), seconds, failed)


def _failures_of_kinds(case: Case) -> tuple[str, ...]:
    """Say which kinds of motions that a run needs could not be simulated, a short motion each.

    Some trajectories are simulated late in a run, and drive a system further than the usual ones.
    """
    recipe, system = case.recipe, case.system
    begin, remarks, untried = time.perf_counter(), list[str](), 0
    short = min(recipe.data.duration, TIMED_SAMPLES * recipe.window.step)
    for table, mixed, factor in _needed_kinds(recipe):
        stream, failed = Stream(PROBE, recipe.data.seed, (factor, factor), short), list[str]()
        first = len(mixed.data.excitation) if mixed.loop else 0
        kinds = mixed.mix()[first:]
        for index, name in enumerate(names_of(kinds), first):
            if time.perf_counter() - begin > MOST_TIME:
                untried += 1
                continue
            try:
                simulate_draw(system, draw(mixed, system, stream, 0, kind=index))
            except SimulationError as error:
                failed.append(
                    f"a motion of the kind {name!r} of {table} could not be simulated: {error}; "
                    "give it smaller amplitudes or lower frequencies there, or correct the model"
                )
        if failed and stream.beyond:
            failed = [
                f"{len(failed)} of {len(kinds)} kinds of motions could not be simulated at "
                f"{factor:g} times the amplitude, for which {table} asks; trajectories that fail "
                f"beyond the range are left out. First {failed[0]}"
            ]
        remarks += failed
    if untried:
        remarks.append(
            f"there was no time to simulate {untried} of the kinds of motions that the run needs: "
            "nothing to do, unless the run says that the model fails on them. A faster model or "
            "a larger window.step leaves time for more"
        )
    return tuple(remarks)


def _failures_beyond_parameters(case: Case) -> str | None:
    """Say where a model fails beyond the ranges of its parameters, as far as data go.

    The ends of the ranges themselves are tested by the sizing of the window.
    """
    recipe = case.recipe
    shares = {name: table.beyond for name, table in recipe.parameters.items() if table.beyond}
    if not shares:
        return None
    wider = []
    for parameter in recipe.physical():
        low, high = parameter.beyond(shares.get(parameter.name, 0.0))
        wider.append(replace(parameter, low=low, high=high))
    corners, failed = corners_of(tuple(wider)), list[str]()
    for corner in corners:
        try:
            probe(recipe, case_at(case, corner).system)
        except SimulationError as error:
            failed.append(with_values(str(error), corner))
    if not failed:
        return None
    keys = " and ".join(f"parameters.{name}.beyond" for name in shares)
    return (
        f"at {len(failed)} of {len(corners)} ends beyond the ranges of the parameters, for which "
        f"{keys} asks, the model fails; trajectories that fail beyond the range are left out. "
        f"First: {failed[0]}"
    )


def _needed_kinds(recipe: Recipe) -> Iterator[tuple[str, Recipe, float]]:
    """Return recipes of the kinds of motion that a run needs, with table and amplitude factor.

    A recipe with loops stands for these alone. Kinds that the networks learn from come last, since
    some of their motions were simulated already.
    """
    tables, estimator = recipe.tables_of_kinds(), recipe.estimator
    usual = recipe.with_kinds(tables.pop("data"))
    for table, others in tables.items():
        if others:
            yield f"{table}.excitation", recipe.with_kinds(others), 1.0
    if recipe.loop:
        yield "loop", recipe, 1.0
    if recipe.data.beyond:
        yield "data.beyond", usual, recipe.data.beyond_factor[1]
    if estimator is not None and estimator.beyond:
        yield "estimator.beyond", usual, estimator.expert.amplitude_factor[1]
    yield "data.excitation", usual, 1.0
