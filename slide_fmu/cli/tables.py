"""Figures are printed as people read them."""

from __future__ import annotations

from typing import Any

from rich.table import Table

from slide_fmu.cli.console import console


def show_validation(figures: dict[str, Any], title: str) -> None:
    # Not as the table's title, which rich wraps to the width of the table.
    """Print the accuracy of every output, in its unit, and of the error estimate."""
    console.print(f"{title}: {figures['trajectories']} trajectories, seed {figures['seed']}")
    table = Table("output", "RMS of the reference", "RMSE", "relative RMSE", "largest error")
    for output in figures["outputs"]:
        unit = output["unit"]
        table.add_row(
            output["name"],
            f"{output['rms_reference']:.4g} {unit}",
            f"{output['rmse']:.4g} {unit}",
            f"{100 * output['relative_rmse']:.3g} %",
            f"{output['max_error']:.4g} {unit}",
        )
    console.print(table)
    estimate = figures["error_estimate"]
    if estimate is not None:
        console.print(
            f"error estimate: mean relative deviation "
            f"{100 * estimate['mean_relative_deviation']:.3g} %, 95 % within "
            f"{100 * estimate['p95_relative_deviation']:.3g} %",
        )


def show_remark(remark: str | None) -> None:
    """Print what the user should know about a result, if there is anything."""
    if remark is not None:
        console.print(f"remark: {remark}", style="yellow")
