"""How far error estimates are off, by the span of samples over which the error is averaged.

    python tests/benchmarks/estimate_spans.py fmus/robot_6r/robot_6r.fmu --json -

Unseen motions, in range and at the amplitudes on which the error estimator was trained. The
estimator gives squared errors sample by sample; the root of their mean over a span is held
against the true RMSE of the surrogate over the same samples, which ends at every sample whose
span is scored as a whole. Deviations are relative to the true RMSE, errors below the estimator's
resolution count as the resolution: mean and 95th percentile, for every output, for all outputs
in one heap (``together``), and where several share a unit for the Euclidean norm of the outputs'
RMSE (``euclidean``). ``estimated_samples`` is the span of the FMU's own estimate.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write
from numpy.typing import ArrayLike
from seeds import ESTIMATE_SPANS
from unseen import scored

from slide_fmu.core.measures import moving_rms
from slide_fmu.core.progress import Progress, Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import TEST, Stream
from slide_fmu.data.unseen import UnseenMotion, unseen_motions
from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.measurement import tasks
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.error_estimator import ErrorEstimator
from slide_fmu.surrogate.surrogate import Surrogate

SPANS = (0.5, 1.0, 2.0, 4.0, 8.0)
"""In s."""


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors along one motion, shape (n_scored, n_outputs) each, in the outputs' units.

    Attributes:
        true: surrogate minus reference.
        estimated: root of the squared error that the estimator gives for every sample.
    """

    true: FloatArray
    estimated: FloatArray


@dataclass(frozen=True, eq=False)
class Bench:
    """What is measured.

    Attributes:
        recipe: of the surrogate.
        surrogate: with its error estimator.
        estimator: gives errors sample by sample.
        spans: in s.
    """

    recipe: Recipe
    surrogate: Surrogate
    estimator: ErrorEstimator
    spans: Sequence[float]

    @property
    def resolution(self) -> FloatArray:
        """Smallest error that is told apart, shape (n_outputs,), in the outputs' units."""
        assert self.recipe.estimator is not None
        return self.recipe.estimator.expert.resolution * self.surrogate.output_scaling.scale

    @property
    def several(self) -> bool:
        """Whether several outputs share their unit."""
        outputs = self.surrogate.outputs
        return len(outputs) > 1 and len({signal.unit for signal in outputs}) == 1


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Deviations by span, in range and beyond."""
    surrogate, found = read_fmu(arguments.fmu)
    recipe = recipe_of_provenance(found, str(arguments.fmu))
    bench = Bench(recipe, surrogate, estimator_of(surrogate), arguments.spans)
    duration = arguments.duration or recipe.measured_duration()
    count = recipe.unseen(arguments.trajectories)
    streams = {
        name: Stream(TEST, task.seed, task.amplitude, duration)
        for name, task in tasks(recipe, arguments.seed).items()
    }
    return {
        "recipe": recipe.name,
        "reference": dict(recipe.system.reference),
        "step_s": surrogate.window.step,
        "estimated_samples": surrogate.estimated_samples,
        "resolution": bench.resolution.tolist(),
        "outputs": [signal.name for signal in surrogate.outputs],
        "units": [signal.unit for signal in surrogate.outputs],
        "motions": {
            name: stream_figures(bench, stream, count, bar(f"motions {name}"))
            for name, stream in streams.items()
        },
    }


def estimator_of(surrogate: Surrogate) -> ErrorEstimator:
    """The estimator, if it gives errors sample by sample."""
    estimator = surrogate.estimator
    if estimator is None or estimator.positions == 1:
        found = "no error estimator" if estimator is None else "one error of the whole window"
        raise SystemExit(
            f"surrogate {surrogate.name!r} gives {found}; expected errors sample by sample: train "
            "with estimator.network.time_invariant = true"
        )
    return estimator


def stream_figures(bench: Bench, stream: Stream, count: int, advance: Progress) -> dict[str, Any]:
    """Deviations by span at one range of amplitudes.

    Args:
        count: number of motions.
    """
    motions = unseen_motions(bench.recipe, case_of(bench.recipe).reference, stream, count, advance)
    errors = [errors_of(bench.surrogate, bench.estimator, motion) for motion in motions]
    step = bench.surrogate.window.step
    lengths = {span: max(1, round(span / step)) for span in bench.spans}
    return {
        "seed": stream.seed,
        "amplitude": list(stream.factors),
        "trajectories": count,
        "duration_s": stream.duration,
        "spans": [
            {"span_s": span, "samples": length, **span_figures(bench, errors, length)}
            for span, length in lengths.items()
        ],
    }


def errors_of(surrogate: Surrogate, estimator: ErrorEstimator, motion: UnseenMotion) -> Errors:
    """True and estimated errors of the samples that are scored."""
    true, _ = scored(surrogate, motion)
    scaled = surrogate.input_scaling.apply(motion.inputs)
    estimated = np.sqrt(estimator.along(scaled, len(surrogate.outputs)))
    first = motion.first(surrogate.network.memory_length, estimator.network.memory_length)
    count = len(motion.outputs) - first
    return Errors(
        true[len(true) - count :], estimated[first - 1 :] * surrogate.output_scaling.scale
    )


def span_figures(bench: Bench, errors: Sequence[Errors], length: int) -> dict[str, Any]:
    """Deviations over one span; null where no motion is as long.

    Args:
        errors: of all motions.
        length: of the span in samples.
    """
    parts = [part for part in errors if len(part.true) >= length]
    if not parts:
        return {"outputs": None, "together": None, "euclidean": None}
    estimated = np.concatenate([moving_rms(part.estimated, length) for part in parts])
    true = np.concatenate([moving_rms(part.true, length) for part in parts])
    by_output = relative_deviation(estimated, true, bench.resolution)
    norms = [np.linalg.norm(values, axis=-1) for values in (estimated, true, bench.resolution)]
    return {
        "outputs": [deviation(column) for column in by_output.T],
        "together": deviation(by_output.ravel()),
        "euclidean": deviation(relative_deviation(*norms)) if bench.several else None,
    }


def deviation(values: FloatArray) -> dict[str, float]:
    """Mean and 95th percentile of relative deviations."""
    return {
        "mean_relative_deviation": float(np.mean(values)),
        "p95_relative_deviation": float(np.quantile(values, 0.95)),
    }


def relative_deviation(
    estimate: FloatArray, true: FloatArray, resolution: ArrayLike
) -> FloatArray:
    """Compute |estimate - true| / true of errors, all of the same shape and not negative.

    Errors below the resolution, the smallest error that is told apart, count as the resolution in
    both; it has the same units and is broadcast.
    """
    floor_true = np.maximum(true, resolution)
    return np.asarray(np.abs(np.maximum(estimate, resolution) - floor_true) / floor_true)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("fmu", type=Path)
    parser.add_argument("--spans", type=float, nargs="+", default=SPANS, help="in s")
    parser.add_argument("--trajectories", type=int, help="the recipe's if not given")
    parser.add_argument("--duration", type=float, help="in s; the recipe's if not given")
    parser.add_argument("--seed", type=int, default=ESTIMATE_SPANS, help="of the motions")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
