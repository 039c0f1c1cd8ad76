"""Alarms of ``in_domain`` with and without filters against single ones: does persistence pay?

    python tests/benchmarks/alarm_filters.py FMU --json -

A filter counts a sample as outside of the domain where the novelty of at least k of the last m
samples is above a threshold. For each filter the threshold is the one with which false alarms on
calibrating trajectories in range are as many as the recipe gives to the domain, so that filters
compare. They are tested on further trajectories in range and on kinds of excitation at settings
that no recipe here trains on: longer steps, and sines of larger amplitudes.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from figures_out import measure_and_write
from pydantic import TypeAdapter

from slide_fmu.core.progress import Stages
from slide_fmu.core.signals import FloatArray
from slide_fmu.data.draws import TEST, Stream, draw, simulate_draw
from slide_fmu.excitation.kinds import Excitation
from slide_fmu.fmu.export import read_fmu
from slide_fmu.pipeline.run_folder import recipe_of_provenance
from slide_fmu.recipe.case import case_of
from slide_fmu.recipe.recipe import Recipe
from slide_fmu.surrogate.surrogate import Surrogate
from slide_fmu.validation.trust import TrustOutputs
from tests.benchmarks.bound_measures import domain_figures, harm_of

SEED = 20290001
FILTERS = ((1, 1), (2, 2), (2, 3), (3, 5), (5, 5), (5, 8), (1, 5), (1, 17))
"""Pairs k, m; with (1, 1) there is none, and with k = 1 an alarm lasts."""
OTHERS: list[dict[str, Any]] = [
    {"kind": "binary", "duration": [0.05, 2.0]},
    {"kind": "filtered_random", "amplitude": [0.3, 0.6], "angular_frequency": [5.0, 60.0]},
    {"kind": "harmonic", "amplitude": [0.3, 0.6], "angular_frequency": [4.0, 80.0]},
    {"kind": "sweep", "amplitude": [0.3, 0.6], "angular_frequency": [5.0, 80.0]},
    {"kind": "multisine", "amplitude": [0.4, 0.7], "angular_frequency": [2.0, 80.0]},
    {"kind": "steps", "duration": [0.1, 1.0]},
    {"kind": "held_random", "samples": [2, 6]},
]


class Seen(NamedTuple):
    """Trajectories where the bound counts.

    Absolute errors and bounds (N, n_outputs) of each, the novelty and whether inputs are in their
    ranges (N,).
    """

    errors: list[FloatArray]
    bounds: list[FloatArray]
    novelty: list[FloatArray]
    in_range: list[FloatArray]


def seen(surrogate: Surrogate, recipe: Recipe, seed: int, count: int, stages: Stages) -> Seen:
    """Simulate so many trajectories of a recipe's kinds."""
    system, found = case_of(recipe).system, Seen([], [], [], [])
    stream = Stream(TEST, seed, (1.0, 1.0), recipe.measured_duration())
    assert surrogate.bound is not None
    for index in range(count):
        drawn = draw(recipe, system, stream, index)
        truth = simulate_draw(system, drawn).outputs[1:]
        counts = slice(max(drawn.burn_in, surrogate.window.n_in), None)
        predicted = surrogate.predict_newest(drawn.inputs)
        found.errors.append(np.abs(predicted[counts] - truth[counts.start - drawn.burn_in :]))
        trust = surrogate.trust(drawn.inputs)
        found.bounds.append(trust.bounds()[counts])
        found.novelty.append(trust.novelty[counts])
        found.in_range.append(surrogate.inputs_in_range(drawn.inputs)[counts].astype(np.float64))
        stages("trajectories")(index + 1, count)
    return found


def filtered(novelty: FloatArray, k: int, m: int) -> FloatArray:
    """Return what is above a threshold where at least k of the last m values (N,) are."""
    before = np.concatenate([np.repeat(novelty[:1], m - 1), novelty])
    return np.asarray(np.sort(np.lib.stride_tricks.sliding_window_view(before, m), axis=1)[:, -k])


def told(found: Seen, k: int, m: int, threshold: float) -> list[TrustOutputs]:
    """Return what an FMU with such a filter would say."""
    rows = zip(found.bounds, found.novelty, found.in_range, strict=True)
    answers = []
    for bounds, novelty, in_range in rows:
        flag = in_range * (filtered(novelty, k, m) <= threshold)
        answers.append(TrustOutputs(bounds, novelty, flag, flag))  # the domain alone judges
    return answers


def compared(calibrating: Seen, in_range: Seen, others: Seen, false_alarms: float) -> Any:
    """Return one row of figures for each filter."""
    usual = np.quantile(np.concatenate(in_range.errors), 0.95, axis=0)
    rows = []
    for k, m in FILTERS:
        known = np.concatenate([filtered(novelty, k, m) for novelty in calibrating.novelty])
        threshold = float(np.quantile(known, 1 - false_alarms))
        harm = vars(harm_of(others.errors, told(others, k, m, threshold), usual))
        false = vars(domain_figures(told(in_range, k, m, threshold)))
        rows.append({"k": k, "m": m, "threshold": threshold, "false_alarms": false, **harm})
    return rows


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("fmu", type=Path, help="FMU with an error bound and its recipe")
    parser.add_argument("--trajectories", type=int, default=100)

    def measure(given: argparse.Namespace, stages: Stages) -> dict[str, Any]:
        surrogate, found = read_fmu(given.fmu)
        recipe = recipe_of_provenance(found, str(given.fmu))
        assert recipe.bound is not None
        kinds = tuple(
            TypeAdapter(Excitation).validate_python({**kind, "weight": 1.0}) for kind in OTHERS
        )
        data = recipe.data.model_copy(update={"excitation": kinds})
        other = recipe.model_copy(update={"data": data})
        sets = [
            seen(surrogate, one, SEED + index, given.trajectories, stages)
            for index, one in enumerate((recipe, recipe, other))
        ]
        filters = compared(*sets, recipe.bound.domain_alarms)
        return {"trajectories": given.trajectories, "filters": filters}

    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
