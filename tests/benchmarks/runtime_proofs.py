"""What the runtime promises of its speed: ratios of medians measured in the same run.

    python tests/benchmarks/runtime_proofs.py --json -

The robot-sized network with random weights beside its baselines (``comparison.py``). Given are the
kernel, every ratio of every run, their medians, what is wanted of them, and those that fell short.
"""

from __future__ import annotations

import argparse
import statistics
from typing import Any

from comparison import compare_synthetic
from figures_out import write_figures

from slide_fmu.apps.bench.effort import Effort

WANTED = {
    "part_of_memory_bound": 0.85,
    "set_step_get_against_onnxruntime": 1.25,
    "set_step_get_against_pythonfmu": 1.25,
    "batch_against_onnxruntime": 1.0,
    "batch_against_torch": 1.0,
}
"""Smallest ratios: how many times faster, but for the part of the memory's bandwidth."""


def ratios_of(figures: dict[str, Any]) -> dict[str, float]:
    """The ratios of one run."""
    batch = figures["batch"]
    baselines = {"onnxruntime": "onnxruntime", "pythonfmu": "pythonfmu_set_step_get"}
    return {
        "part_of_memory_bound": figures["memory_bound"] / figures["kernel"],
        **{
            f"set_step_get_against_{name}": figures[key] / figures["fmu_set_step_get"]
            for name, key in baselines.items()
        },
        "batch_against_onnxruntime": batch["native"] / batch["onnxruntime"],
        "batch_against_torch": batch["native"] / batch["torch"],
    }


def measure(runs: int, effort: Effort) -> dict[str, Any]:
    """Ratios of several runs and their medians."""
    found = [compare_synthetic(effort) for _ in range(runs)]
    ratios = [ratios_of(figures) for figures in found]
    medians = {name: statistics.median(run[name] for run in ratios) for name in WANTED}
    return {
        "kernel_name": found[0]["kernel_name"],
        "wanted": WANTED,
        "median": medians,
        "runs": ratios,
        "short": [name for name, least in WANTED.items() if medians[name] < least],
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--json", default="-")
    arguments = parser.parse_args()
    figures = measure(arguments.runs, Effort(rounds=arguments.rounds))
    write_figures(figures, arguments.json)


if __name__ == "__main__":
    main()
