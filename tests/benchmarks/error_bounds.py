"""Error bounds beside each other: how well do they cover, how wide are they, what do they know?

    python tests/benchmarks/error_bounds.py FMU --trajectories 150 --json -

Trajectories that nothing has learnt from are divided at random, 20 times, into those that
calibrate and those that test. A local scale of the error becomes a bound of 95 % by one factor,
conformal by trajectory; "bare" is the scale itself, with the factor 1.96 that makes an RMS error a
bound of normally distributed errors. The scales are a constant, the FMU's estimate of the RMS
error over a span, the estimator at the single sample (both are the paper's second network), the
disagreement of surrogate and companion, the head of the error bound, and, as an oracle, the true
RMS error within a quarter of a second. Skill is 1 minus the pinball loss over that of the best
constant.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from figures_out import measure_and_write
from scipy.ndimage import uniform_filter1d

from slide_fmu.bounds.judge import conformal_factors
from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import TEST, Stream, draw, simulate_draw
from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from tests.benchmarks.bound_measures import output_bound

SPLITS, SEED, CONFIDENCE = 20, 20280001, 0.95
CALIBRATING = 2 / 3
"""Part of the trajectories that calibrate."""
NORMAL = 1.96
"""So many standard deviations cover 95 % of normally distributed errors."""
ORACLE_SPAN = 0.5
"""Time in s over which the oracle averages, in the middle of which the sample is."""
LEAST = 1e-12
"""A scale is at least this part of the output's scale."""


def scales_of(
    surrogate: Surrogate, inputs: FloatArray, errors: FloatArray
) -> dict[str, tuple[FloatArray, bool]]:
    """Return local scales by name, (N, n_outputs), and whether each is an RMS error.

    Errors are relative to the outputs' scales, (N, n_outputs), not negative.
    """
    scaled, scale = surrogate.input_scaling.apply(inputs), surrogate.output_scaling.scale
    found = {"constant": (np.ones(errors.shape), False)}
    if surrogate.estimates_errors:
        found["estimate over its span"] = surrogate.estimate_error(inputs) / scale, True
    if surrogate.estimator is not None:
        squares = surrogate.estimator.along(scaled, len(surrogate.outputs))
        found["estimator at the sample"] = np.sqrt(squares), True
    local = surrogate.trust(inputs).local
    found["disagreement"] = local.disagreement, True
    found["head of the error bound"] = local.scales, False
    samples = max(1, round(ORACLE_SPAN / surrogate.window.step))
    rms = np.sqrt(uniform_filter1d(errors**2, samples, axis=0, mode="nearest"))
    found["oracle, local RMS"] = rms, True
    return found


def measured(
    surrogate: Surrogate, recipe: Recipe, count: int, stages: Stages
) -> tuple[FloatArray, dict[str, tuple[FloatArray, bool]]]:
    """Return errors and scales of fresh trajectories, (n, N, n_outputs)."""
    system, progress = case_of(recipe).system, stages("fresh trajectories")
    duration = recipe.measured_duration()
    stream = Stream(TEST, SEED, (1.0, 1.0), duration)
    errors: list[FloatArray] = []
    scales: dict[str, list[FloatArray]] = {}
    is_rms = {}
    for index in range(count):
        drawn = draw(recipe, system, stream, index)
        truth = simulate_draw(system, drawn).outputs[1:]
        error = np.abs(surrogate.predict_newest(drawn.inputs)[drawn.burn_in :] - truth)
        error = np.pad(error / surrogate.output_scaling.scale, ((drawn.burn_in, 0), (0, 0)))
        first = max(drawn.burn_in, surrogate.window.n_in)
        for name, (values, rms) in scales_of(surrogate, drawn.inputs, error).items():
            scales.setdefault(name, []).append(np.maximum(values[first:], LEAST))
            is_rms[name] = rms
        errors.append(error[first:])
        progress(index + 1, count)
    return np.stack(errors), {name: (np.stack(v), is_rms[name]) for name, v in scales.items()}


def compared(
    errors: FloatArray, scales: Mapping[str, tuple[FloatArray, bool]]
) -> list[dict[str, Any]]:
    """Return one row for each scale and output: conformal, and bare where it is an RMS error."""
    rows = []
    for name, (values, is_rms) in scales.items():
        for output in range(errors.shape[2]):
            error, scale = errors[:, :, output], values[:, :, output]
            if is_rms:
                bare = vars(output_bound("", list(error), list(NORMAL * scale)))
                rows.append(
                    {
                        "scale": name,
                        "output": output,
                        "conformal": False,
                        **{key: bare[key] for key in (*_KEYS, "rank_correlation")},
                    }
                )
            found = [_split(error, scale, seed) for seed in range(SPLITS)]
            mean = {key: float(np.mean([one[key] for one in found])) for key in _KEYS}
            coverage = [one["coverage"] for one in found]
            spread = {"least_coverage": min(coverage), "largest_coverage": max(coverage)}
            rows.append({"scale": name, "output": output, "conformal": True, **mean, **spread})
    return rows


_KEYS = "coverage", "coverage_of_worst_trajectories", "width", "skill"


def _split(error: FloatArray, scale: FloatArray, seed: int) -> dict[str, Any]:
    order = np.random.default_rng(seed).permutation(len(error))
    count = round(CALIBRATING * len(error))
    first, rest = order[:count], order[count:]
    ratios = (error[first] / scale[first])[:, :, None]
    (factor,) = conformal_factors(ratios, CONFIDENCE)
    return vars(output_bound("", list(error[rest]), list(factor * scale[rest])))


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("fmu", type=Path, help="FMU with an error bound and its recipe")
    parser.add_argument("--trajectories", type=int, default=150)

    def measure(given: argparse.Namespace, stages: Stages) -> dict[str, Any]:
        surrogate, found = read_fmu(given.fmu)
        recipe = recipe_of_provenance(found, str(given.fmu))
        errors, scales = measured(surrogate, recipe, given.trajectories, stages)
        return {"trajectories": given.trajectories, "bounds": compared(errors, scales)}

    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
