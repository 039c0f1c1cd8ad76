"""A trained model is measured on unseen motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slide_fmu.apps.compare.baselines.base import Baseline
from slide_fmu.apps.compare.baselines.free_run import diverged, free_run
from slide_fmu.apps.compare.model_figures import ModelOutput
from slide_fmu.core.measures import TINY, rms
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.unseen import UnseenMotion
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
        deviation = np.maximum(truth.std(axis=0), TINY)
        return [float(error) for error in rms(values - truth) / deviation]
