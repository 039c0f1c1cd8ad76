"""The figures of a benchmark become tables in words and units."""

from __future__ import annotations

import math

from slide_fmu.apps.bench.bench import FmuTimes
from slide_fmu.apps.bench.effort import Effort
from slide_fmu.report.table import ReportTable

CALLS = {
    "fmu_step": "doStep alone",
    "fmu_set_step_get_without_estimates": "set inputs, doStep, get outputs",
    "fmu_set_step_get": "the same, with error estimates",
    "fmu_set_step_get_with_bounds": "the same, with error bounds and novelty",
}
"""What is done in a timed call, the cheapest first."""

BATCHES = {"native": "compiled runtime", "numpy": "numpy"}
"""What evaluates many windows at once."""

UNITS = ((1e-6, "us"), (1e-3, "ms"), (1.0, "s"))


def summary(found: FmuTimes, effort: Effort) -> str:
    """Say what was timed, and how often."""
    figures, calls = found.figures, effort.rounds * effort.steps
    return (
        f"{found.fmu}: a network of {number(figures.n_weights)} weights, kernel "
        f"{figures.kernel_name}, one core. Times are medians of {number(calls)} calls."
    )


def tables(found: FmuTimes) -> list[ReportTable]:
    """Return the table of the times of a step, and the one of batches of windows."""
    times, spread = found.figures.medians, found.figures.spread
    calls = [
        (CALLS[name], duration(1e-6 * times[name]), f"{low} to {high}")
        for name in CALLS
        if name in times and (name != "fmu_set_step_get" or found.estimates_errors)
        for low, high in [[duration(1e-6 * end) for end in spread[name]]]
    ]
    batches = [
        (words, duration(1 / found.figures.batch[name]), number(found.figures.batch[name]))
        for name, words in BATCHES.items()
    ]
    return [
        ReportTable.of(("a step of the FMU, through FMPy", "time", "80 % of the calls"), calls),
        ReportTable.of(
            ("many windows at once", "CPU time a window", "windows in a second"), batches
        ),
    ]


def conclusion(found: FmuTimes) -> str:
    """Say how much faster than real time a step is, and how much faster the runtime is."""
    call = 1e-6 * found.figures.medians["fmu_set_step_get"]
    batch = found.figures.batch
    return (
        f"A step of {found.step_s:g} s is computed {number(found.step_s / call)} times faster "
        f"than real time. In batches, the runtime is {number(batch['native'] / batch['numpy'])} "
        "times as fast as numpy."
    )


def duration(seconds: float) -> str:
    """Write a time with three digits, in the largest unit in which it is at least 1."""
    factor, unit = next((u for u in reversed(UNITS) if seconds >= 0.9995 * u[0]), UNITS[0])
    return f"{number(seconds / factor)} {unit}"


def number(value: float) -> str:
    """Write a number with three digits, without an exponent, in groups of thousands."""
    rounded = float(f"{value:.3g}")
    if rounded >= 100 or value == int(value):
        count = int(value) if value == int(value) < 1e6 else round(rounded)
        return f"{count:,}".replace(",", " ")
    return f"{rounded:.{2 - math.floor(math.log10(rounded))}f}"
