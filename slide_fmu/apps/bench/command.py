"""The subcommand measures the speed of an FMU, and prints it in words and units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from slide_fmu.apps.bench.effort import Effort
from slide_fmu.cli.console import errors, figures_console, write_json
from slide_fmu.cli.options import FmuArgument, JsonOption
from slide_fmu.core.readable import duration, number
from slide_fmu.report.table import ReportTable

if TYPE_CHECKING:
    from slide_fmu.apps.bench.bench import FmuTimes

CALLS = {
    "fmu_step": "doStep alone",
    "fmu_set_step_get_without_estimates": "set inputs, doStep, get outputs",
    "fmu_set_step_get": "the same, with error estimates",
    "fmu_set_step_get_with_bounds": "the same, with error bounds and novelty",
}
"""What is done in a timed call, the cheapest first."""

BATCHES = {"native": "compiled runtime", "numpy": "numpy"}
"""What evaluates many windows at once."""


def bench(
    fmu: FmuArgument,
    json_path: JsonOption = None,
    rounds: Annotated[
        int, typer.Option(min=1, help="Number of rounds. In each round, everything is timed once.")
    ] = Effort.rounds,
    steps: Annotated[int, typer.Option(min=1, help="Number of steps in a round.")] = Effort.steps,
) -> None:
    """Measure how long an FMU takes for a step, and for many windows at once."""
    from slide_fmu.apps.bench.bench import bench_fmu
    from slide_fmu.report.console import print_table

    effort = Effort(rounds, steps)
    with errors():
        times = bench_fmu(fmu, effort)
    write_json(json_path, times)
    if json_path == "-":
        return
    out = figures_console()
    out.print(summary(times, effort))
    for table in tables(times):
        print_table(table, out)
    out.print(conclusion(times))


def summary(times: FmuTimes, effort: Effort) -> str:
    """Say what was timed, and how often."""
    figures, calls = times.figures, effort.rounds * effort.steps
    return (
        f"{times.fmu}: a network of {number(figures.n_weights)} weights, kernel "
        f"{figures.kernel_name}, one core. Times are medians of {number(calls)} calls."
    )


def tables(times: FmuTimes) -> list[ReportTable]:
    """Return the table of the times of a step, and the one of batches of windows."""
    medians, spread = times.figures.medians, times.figures.spread
    calls = [
        (CALLS[name], duration(1e-6 * medians[name]), f"{low} to {high}")
        for name in CALLS
        if name in medians and (name != "fmu_set_step_get" or times.estimates_errors)
        for low, high in [[duration(1e-6 * end) for end in spread[name]]]
    ]
    batches = [
        (words, duration(1 / times.figures.batch[name]), number(times.figures.batch[name]))
        for name, words in BATCHES.items()
    ]
    return [
        ReportTable.of(("a step of the FMU, through FMPy", "time", "80 % of the calls"), calls),
        ReportTable.of(
            ("many windows at once", "CPU time a window", "windows in a second"), batches
        ),
    ]


def conclusion(times: FmuTimes) -> str:
    """Say how much faster than real time a step is, and how much faster the runtime is."""
    call = 1e-6 * times.figures.medians["fmu_set_step_get"]
    batch = times.figures.batch
    return (
        f"A step of {times.step_s:g} s is computed {number(times.step_s / call)} times faster "
        f"than real time. In batches, the runtime is {number(batch['native'] / batch['numpy'])} "
        "times as fast as numpy."
    )
