"""A trained model is measured on unseen motions, and its steps are timed beside the network's."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slide_fmu.core.measures import rms
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.unseen import Motion
from slide_fmu.fitting.baselines.base import Baseline, Frozen
from slide_fmu.fitting.baselines.free_run import diverged, free_run
from slide_fmu.surrogate.surrogate import Surrogate

FIRST_STEPS, TIMED_STEPS, ROUNDS = 30, 200, 7
"""After the first steps, in which models come to their start, so many are timed in one go, of both
models in turn, in so many rounds."""


@dataclass(frozen=True, eq=False)
class UnseenTest:
    """An unseen test is what all models are measured on.

    Attributes:
        surrogate: the recipe's own network, with scalings, signals and window.
        motions: unseen trajectories; those of one length or of several.
    """

    surrogate: Surrogate
    motions: Sequence[Motion]

    def figures(self, baseline: Baseline) -> dict[str, Any]:
        """Return a model's parameters, its error on every output, and the time of its steps.

        Errors are the RMSE over the standard deviation of the truth, all motions together; None
        of a model that has diverged on a motion: its RMSE says nothing. The error on the motions
        on which it has not stands beside.
        """
        runs = [self._run(baseline, motion) for motion in self.motions]
        truth = np.concatenate([motion.outputs for motion in self.motions])
        lost = [diverged(values, truth) for values, _ in runs]
        kept = [run for run, gone in zip(runs, lost, strict=True) if not gone]
        everything = None if any(lost) else self._errors(runs)
        bounded = self._errors(kept) if kept else None
        return {
            "parameters": baseline.parameters,
            **self._times(baseline),
            "diverged": sum(lost),
            "outputs": [
                {
                    "name": signal.name,
                    "unit": signal.unit,
                    "rmse_over_deviation": None if everything is None else everything[i],
                    "bounded_rmse_over_deviation": None if bounded is None else bounded[i],
                }
                for i, signal in enumerate(self.surrogate.outputs)
            ],
        }

    def _run(self, baseline: Baseline, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """Return simulated and true outputs of the scored samples, in their units."""
        surrogate = self.surrogate
        first = motion.first(surrogate.network.memory_length)
        inputs = surrogate.input_scaling.apply(motion.inputs)
        start = surrogate.output_scaling.apply(motion.outputs[: baseline.start_length])
        values = free_run(baseline, inputs, start)[first - 1 :]
        return surrogate.output_scaling.invert(values), motion.outputs[first:]

    def _errors(self, runs: Sequence[tuple[FloatArray, FloatArray]]) -> list[float]:
        values, truth = (np.concatenate(parts) for parts in zip(*runs, strict=True))
        deviation = np.maximum(truth.std(axis=0), np.finfo(np.float64).tiny)
        return [float(error) for error in rms(values - truth) / deviation]

    def _times(self, baseline: Baseline) -> dict[str, float]:
        """Return the time of a step in us, and its ratio to that of the recipe's own network."""
        motion, surrogate = self.motions[0], self.surrogate
        inputs = surrogate.input_scaling.apply(motion.inputs)
        inputs = np.resize(inputs, (FIRST_STEPS + TIMED_STEPS, inputs.shape[1]))
        outputs = surrogate.output_scaling.apply(motion.outputs)
        own = Frozen(surrogate.network, len(surrogate.outputs))
        rounds = []
        for _ in range(ROUNDS):
            rounds.append([_seconds(model, inputs, outputs) for model in (baseline, own)])
        theirs, ours = np.array(rounds).T
        return {
            "step_us": float(1e6 * np.median(theirs)),
            "time_ratio": float(np.median(theirs / ours)),
        }


def _seconds(baseline: Baseline, inputs: FloatArray, outputs: FloatArray) -> float:
    """Return the time of a step in s, without what comes before the first ones."""
    start, times = outputs[: baseline.start_length], []
    for length in (FIRST_STEPS, len(inputs)):
        begin = time.perf_counter()
        with np.errstate(all="ignore"):  # also those that diverge are timed
            baseline.step_along(inputs[:length], start)
        times.append(time.perf_counter() - begin)
    return max(times[1] - times[0], 1e-9) / TIMED_STEPS
