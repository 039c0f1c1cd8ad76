"""A trained model is measured on unseen motions: its errors, and the time of its steps.

Step times are those of our networks in the FMU, and of others in the library that runs them.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from slide_fmu.apps.compare.baselines.base import Baseline, NetworkBaseline, SteppedBaseline
from slide_fmu.apps.compare.baselines.free_run import diverged, free_run
from slide_fmu.apps.compare.model_figures import ModelFigures, ModelOutput
from slide_fmu.core.measures import relative_rmse, size_about
from slide_fmu.core.signals import FloatArray
from slide_fmu.cosim.whole_run import run_fmu
from slide_fmu.data.unseen import UnseenMotion
from slide_fmu.fmu.export import export_fmu
from slide_fmu.importer.file import UnpackedFmu, unpacked
from slide_fmu.surrogate.surrogate import Surrogate


@dataclass(frozen=True)
class ModelErrors:
    """ModelErrors are a model's errors, and its numbers of parameters and diverged motions."""

    parameters: int
    diverged: int
    outputs: tuple[ModelOutput, ...]


@dataclass(frozen=True, eq=False)
class UnseenTest:
    """An UnseenTest measures all models.

    Attributes:
        surrogate: the recipe's own network, with scalings, signals and window.
        motions: unseen trajectories, of one length or of several.
    """

    surrogate: Surrogate
    motions: Sequence[UnseenMotion]

    def errors(self, baseline: Baseline) -> ModelErrors:
        """Return the errors of a model on every output, over all motions.

        If a model has diverged on a motion, its RMSE is meaningless.
        """
        runs = [self._run(baseline, motion) for motion in self.motions]
        truth = np.concatenate([motion.outputs for motion in self.motions])
        lost = [diverged(values, truth) for values, _ in runs]
        kept = [run for run, gone in zip(runs, lost, strict=True) if not gone]
        everything = None if any(lost) else self._errors(runs)
        bounded = self._errors(kept) if kept else None
        outputs = tuple(
            ModelOutput(
                name=signal.name,
                unit=signal.unit,
                rmse_over_deviation=None if everything is None else everything[i],
                bounded_rmse_over_deviation=None if bounded is None else bounded[i],
            )
            for i, signal in enumerate(self.surrogate.outputs)
        )
        return ModelErrors(baseline.parameters, sum(lost), outputs)

    def _run(self, baseline: Baseline, motion: UnseenMotion) -> tuple[FloatArray, FloatArray]:
        """Return simulated and true outputs of the scored samples, in their units."""
        surrogate = self.surrogate
        first = motion.first(surrogate.network.memory_length)
        inputs = surrogate.input_scaling.apply(motion.inputs)
        start = surrogate.output_scaling.apply(motion.outputs[: baseline.start_length])
        values = free_run(baseline, inputs, start)[first - 1 :]
        return surrogate.output_scaling.invert(values), motion.outputs[first:]

    def _errors(self, runs: Sequence[tuple[FloatArray, FloatArray]]) -> list[float]:
        values, truth = (np.concatenate(parts) for parts in zip(*runs, strict=True))
        return [float(error) for error in relative_rmse(values - truth, size_about(truth))]


FIRST_STEPS, TIMED_STEPS, ROUNDS = 30, 300, 7
"""Number of first steps, in which models start, number of steps timed in one go, for both models
in turn, and number of rounds."""


@dataclass(frozen=True, eq=False)
class StepTimes:
    """StepTimes are measured in turn with those of the recipe's own network, in its FMU.

    Attributes:
        surrogate: the recipe's own network, with scalings, signals and window.
        own: its FMU.
        motion: an unseen motion, whose inputs are repeated if it is short.
    """

    surrogate: Surrogate
    own: UnpackedFmu
    motion: UnseenMotion

    def of(self, baseline: Baseline) -> tuple[float, float]:
        """Return the time of a model's step in us, and its ratio to that of the own network.

        The machine may be busier while one model is measured than while another is. So the ratio
        is measured, and the time follows from it and from one time of the own network.

        Raises:
            CoSimulationError: an FMU reports an error.
        """
        with ExitStack() as stack:
            fmu = stack.enter_context(self._fmu_of(baseline))
            rounds = []
            for _ in range(ROUNDS):
                ours = self._in_fmu(self.own, self.surrogate)
                rounds.append((self._seconds(baseline, fmu), ours))
        theirs, ours = np.array(rounds).T
        ratio = float(np.median(theirs / ours))
        return ratio * self._own_us, ratio

    @cached_property
    def _own_us(self) -> float:
        """Return the time of a step of the own network in us."""
        times = [self._in_fmu(self.own, self.surrogate) for _ in range(ROUNDS)]
        return float(1e6 * np.median(times))

    @contextmanager
    def _fmu_of(self, baseline: Baseline) -> Iterator[tuple[UnpackedFmu, Surrogate] | None]:
        """Export one of our networks as an FMU; None for other models."""
        if not isinstance(baseline, NetworkBaseline):
            yield None
            return
        network, window = baseline.network, baseline.window
        alone = replace(self.surrogate, estimator=None, bound=None)
        surrogate = replace(alone, network=network, window=window)
        with fmu_of(surrogate) as fmu:
            yield fmu, surrogate

    def _seconds(self, baseline: Baseline, fmu: tuple[UnpackedFmu, Surrogate] | None) -> float:
        if fmu is not None:
            return self._in_fmu(*fmu)
        assert isinstance(baseline, SteppedBaseline)
        inputs = self.surrogate.input_scaling.apply(self._inputs)
        outputs = self.surrogate.output_scaling.apply(self.motion.outputs)
        start, times = outputs[: baseline.start_length], []
        for length in (FIRST_STEPS, len(inputs)):
            begin = time.perf_counter()
            with np.errstate(all="ignore"):  # diverging models are timed too
                baseline.step_along(inputs[:length], start)
            times.append(time.perf_counter() - begin)
        return max(times[1] - times[0], 1e-9) / TIMED_STEPS

    def _in_fmu(self, fmu: UnpackedFmu, surrogate: Surrogate) -> float:
        names = [signal.name for signal in surrogate.outputs]
        inputs = {s.name: self._inputs[:, i] for i, s in enumerate(surrogate.inputs)}
        run = run_fmu(fmu, inputs, names, step=surrogate.window.step, timed=True)
        return float(np.median(run.step_seconds[FIRST_STEPS:]))

    @property
    def _inputs(self) -> FloatArray:
        inputs = self.motion.inputs
        return np.resize(inputs, (FIRST_STEPS + TIMED_STEPS, inputs.shape[1]))


@contextmanager
def fmu_of(surrogate: Surrogate) -> Iterator[UnpackedFmu]:
    """Export a surrogate, and unpack its FMU for the time of a ``with`` block."""
    with TemporaryDirectory() as folder:
        path = export_fmu(surrogate, Path(folder) / f"{surrogate.name}.fmu")
        with unpacked(path) as fmu:
            yield fmu


@dataclass(frozen=True, eq=False)
class ComparisonBench:
    """A ComparisonBench measures every model."""

    test: UnseenTest
    times: StepTimes

    def measured(self, model: ModelFigures, baseline: Baseline) -> ModelFigures:
        """Return the figures of a model with its parameters, errors and time of its steps."""
        errors, (step_us, ratio) = self.test.errors(baseline), self.times.of(baseline)
        return replace(model, **vars(errors), step_us=step_us, time_ratio=ratio)
