"""An FMU and its model are timed at equal accuracy.

A model that is solved finely takes long, and next to it an inaccurate surrogate would seem fast.
So the model's own solver is loosened, to larger steps or tolerances, until its error against the
finest reference is that of the FMU. The fastest setting whose error is no larger is compared.
Errors are those of motions whose inputs are known, for both.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from slide_fmu.core.measures import TINY, relative_rmse, rms, size_about
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import Draw, Stream, draw, first_that_runs, shortened
from slide_fmu.importer.description import start_time
from slide_fmu.importer.file import UnpackedFmu
from slide_fmu.recipe.case import Case
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.systems.base import System
from slide_fmu.systems.errors import LoadError, SimulationError
from slide_fmu.systems.looser import Rung, ladders
from slide_fmu.systems.simulation import simulate
from slide_fmu.validation.error_figures import SolverSetting, SpeedFigures

LONGEST = 8.0
"""CPU seconds after which no further setting is tried, or as many as the reference took; the
report says so."""
SCORED = 200
"""Samples of a trajectory that are scored; what comes after them is left out."""
TRAJECTORIES, BRIEF = 4, 0.3
"""The most trajectories that are compared, and the CPU seconds that those before may take."""
LEAST_STEPS = 2000
"""The FMU is timed over this number of steps at least."""
ROUNDS = 3
"""How often the model that is compared and the FMU are timed in turns."""


@dataclass(frozen=True, eq=False)
class _Motion:
    """A motion is a drawn trajectory, straight between samples, with the truth about it.

    Attributes:
        index: its number in the stream.
        drawn: its inputs, and where the reference begins.
        truth: outputs of the reference, shape (N + 1, n_outputs).
        seconds: time of the reference in s.
        first: the first sample that is scored.
    """

    index: int
    drawn: Draw
    truth: FloatArray
    seconds: float
    first: int


@dataclass
class _Search:
    """A search compares the settings of a case's models on the same motions.

    Attributes:
        motions: the trajectories.
        deadline: the time, of ``time.process_time``, after which nothing more is tried.
        complete: whether nothing was left out for it.
        solved: settings whose error is at most that of the FMU.
    """

    case: Case
    stream: Stream
    motions: Sequence[_Motion]
    deadline: float
    complete: bool = True
    solved: list[tuple[SolverSetting, System]] = field(default_factory=list)

    def bisect(self, model: str, rungs: Sequence[Rung], allowed: float) -> None:
        """Find the loosest setting of a ladder whose error is allowed, by halving it."""
        low, high = -1, len(rungs)  # the last that is good enough, the first that is not
        while high - low > 1:
            if time.process_time() > self.deadline:
                self.complete = False
                return
            middle = (low + high) // 2
            solved = self._try(model, rungs[middle])
            if solved is not None and solved[0].relative_error <= allowed:
                self.solved.append(solved)
                low = middle
            else:
                high = middle

    def _try(self, model: str, rung: Rung) -> tuple[SolverSetting, System] | None:
        """Return a setting with its error and time; None where it fails."""
        try:
            system = rung.make()
            outputs, seconds = zip(
                *(self.run(model, system, m) for m in self.motions), strict=True
            )
        except (LoadError, SimulationError):
            return None
        error = _error(self.motions, outputs)
        per_second = sum(seconds) / simulated(self.motions, system.step)
        solved = SolverSetting(
            model=model,
            solver=rung.solver,
            setting=rung.setting,
            relative_error=error,
            seconds=per_second,
        )
        return solved, system

    def run(self, model: str, system: System, motion: _Motion) -> tuple[FloatArray, float]:
        """Return the outputs of a system along a motion, and its time in s."""
        drawn = motion.drawn
        if model == "model":  # it begins with a state of its own
            own = draw(
                self.case.recipe, self.case.system, self.stream, motion.index, drawn.attempt
            )
            drawn = replace(own, inputs=drawn.inputs, between=None)
        return timed(system, drawn)


def speed_at_equal_accuracy(
    fmu: UnpackedFmu, surrogate: Surrogate, case: Case, stream: Stream, allowed: float
) -> SpeedFigures:
    """Compare the time of an FMU with that of its model at equal accuracy, in one run.

    Where another model made the data than the reference, its settings are tried too. Inputs go
    straight from sample to sample, and physical parameters have their start values. Times are CPU
    times, the least of some rounds, in which the FMU and the model take turns.

    Args:
        fmu: the unpacked FMU.
        surrogate: what it runs.
        case: its recipe with the models.
        stream: of unseen trajectories in range.
        allowed: the relative error of the FMU (``relative_error``), with inputs that are known to
            the step's end.

    Raises:
        CoSimulationError: the FMU reports an error.
        SimulationError: the reference could not be simulated on any draw.
    """
    motions = list(_motions(surrogate, case, stream))
    longest = max(LONGEST, sum(motion.seconds for motion in motions))
    search = _Search(case, stream, motions, time.process_time() + longest)
    systems = case.systems
    finest = ladders(case.reference, systems.reference_specification)
    reference = SolverSetting(
        model="reference",
        solver=finest[0][0].solver,
        setting=finest[0][0].setting,
        relative_error=0.0,
        seconds=sum(m.seconds for m in motions) / simulated(motions, case.reference.step),
    )
    if case.recipe.system.reference:  # the coarser model comes first: it takes less time
        for ladder in ladders(case.system, systems.specification):
            search.bisect("model", ladder, allowed)
    for ladder in (*finest[1:], finest[0][1:]):  # of a function, whole motions come first
        search.bisect("reference", ladder, allowed)
    best, system = min(
        search.solved, key=lambda one: one[0].seconds, default=(reference, case.reference)
    )
    model_seconds, fmu_seconds = best.seconds, np.inf
    for number in range(ROUNDS):
        fmu_seconds = min(fmu_seconds, _seconds_in_fmpy(fmu, surrogate, motions[0].drawn))
        if number == 0 or time.process_time() < search.deadline:
            seconds = sum(search.run(best.model, system, motion)[1] for motion in motions)
            model_seconds = min(model_seconds, seconds / simulated(motions, system.step))
    return SpeedFigures(
        finest=reference,
        loosened=replace(best, seconds=model_seconds),
        relative_error=allowed,
        seconds=fmu_seconds,
        ratio=model_seconds / fmu_seconds,
        can_be_loosened=bool(case.recipe.system.reference) or len(finest[0]) > 1,
        complete=search.complete,
    )


def _motions(surrogate: Surrogate, case: Case, stream: Stream) -> Iterator[_Motion]:
    """Yield trajectories that the reference could simulate, few where it takes long."""
    spent = 0.0
    for index in range(TRAJECTORIES):
        if spent > BRIEF:
            return

        def run(drawn: Draw, index: int = index) -> _Motion:
            first = max(drawn.burn_in + 1, surrogate.network.memory_length)
            straight = shortened(drawn, first + SCORED)
            truth, seconds = timed(case.reference, straight)
            return _Motion(index, straight, truth, seconds, first)

        motion = first_that_runs(case.recipe, case.reference, stream, index, run)
        spent += motion.seconds
        yield motion


def timed(system: System, drawn: Draw) -> tuple[FloatArray, float]:
    """Return outputs of a system, (N + 1, n_outputs), and the CPU time that passed, in s.

    It does one step before, in which it may be built. Other programs change CPU times little.
    """
    simulate(system, drawn.inputs[:1], drawn.initial)
    begin = time.process_time()
    outputs = simulate(system, drawn.inputs, drawn.initial).outputs
    return outputs, time.process_time() - begin


def simulated(motions: Sequence[_Motion], step: float) -> float:
    """Return the length of all motions in s."""
    return step * sum(len(motion.drawn.inputs) for motion in motions)


def _error(motions: Sequence[_Motion], outputs: Sequence[FloatArray]) -> float:
    """Return the relative error of outputs, (N + 1, n_outputs) of each motion."""
    truth = np.concatenate([m.truth[m.first :] for m in motions])
    every = np.concatenate([o[m.first :] for o, m in zip(outputs, motions, strict=True)])
    return relative_error(every - truth, truth)


def relative_error(error: FloatArray, truth: FloatArray) -> float:
    """Return the RMS over the outputs of their RMSE over the RMS of the truth about its mean.

    An output that does not move at all is left out. Both arguments have the shape (n, n_outputs).
    """
    size = size_about(truth)
    moving = size > TINY
    return float(rms(relative_rmse(error, size)[moving, None])[0]) if moving.any() else 0.0


def _seconds_in_fmpy(fmu: UnpackedFmu, surrogate: Surrogate, drawn: Draw) -> float:
    """Return the CPU time of a simulated second of the FMU in ``fmpy.simulate_fmu``, in s.

    The inputs are repeated, so that the start of the run does not count.
    """
    import fmpy

    step, names = surrogate.window.step, [signal.name for signal in surrogate.inputs]
    count = max(LEAST_STEPS, len(drawn.inputs))
    rows = np.resize(drawn.inputs, (count, len(names)))
    table = np.zeros(count, dtype=[("time", float), *((name, float) for name in names)])
    begin = start_time(fmu.description)
    table["time"] = begin + step * np.arange(count)
    for column, name in enumerate(names):
        table[name] = rows[:, column]
    began = time.process_time()
    fmpy.simulate_fmu(
        fmu.folder,
        model_description=fmu.description,
        fmi_type="CoSimulation",
        start_time=begin,
        stop_time=begin + step * (count - 1),
        output_interval=step,
        input=table,
        output=[signal.name for signal in surrogate.outputs],
    )
    return (time.process_time() - began) / (step * (count - 1))
