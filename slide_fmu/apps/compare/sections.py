"""A comparison of models becomes a table and charts; it says if a linear model is enough."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from slide_fmu.apps.compare.model_figures import ComparisonFigures, ModelFigures
from slide_fmu.core.measures import percent
from slide_fmu.core.web.charts import Axis, Chart, Line, Panel, colour_of
from slide_fmu.report.html_report import Report, ReportSection
from slide_fmu.report.quality import LINEAR_DOES
from slide_fmu.report.table import ReportTable
from slide_fmu.validation.error_figures import worst_of

EXACT = 1e-6
"""Smallest error shown: networks round to single precision."""

TEXT = (
    "All models learnt from the same trajectories, for about {budget:.3g} s of CPU time each or "
    "less, and are measured on the same {trajectories} unseen ones (seed {seed}), scored from the "
    "end of the burn-in on. They simulate freely: none is given an output but those at the start "
    "of a trajectory. The error is the RMSE over the standard deviation of the true output. A "
    "step is one sample: of the networks of slide-fmu doStep of their FMU through fmpy, of the "
    "others a step by numpy or torch on one thread, as the library does it; the ratio is that to "
    "the own network, timed in turns."
)


def linear_remark(models: Sequence[ModelFigures]) -> str | None:
    """Say that a linear model is enough; None if it is not."""
    linear = min((m for m in models if m.linear), key=_error, default=None)
    best = min((m for m in models if not m.linear), key=_error, default=None)
    if linear is None or best is None or linear.error == math.inf:
        return None
    if best.error == math.inf:
        return f"a linear model would do ({linear.title}): no nonlinear one stays bounded"
    ratio = max(linear.error, EXACT) / max(best.error, EXACT)
    if ratio > LINEAR_DOES:
        return None
    return (
        f"a linear model would do: {linear.title} has {ratio:.3g} times the error of the best "
        f"nonlinear model, {best.title}"
    )


def _error(model: ModelFigures) -> float:
    return model.error


def remark_on(model: ModelFigures, trajectories: int) -> str:
    """Describe a model that failed, diverged, or was cut; otherwise return an empty text."""
    if model.failed is not None:
        return f"failed: {model.failed}"
    remarks = []
    if model.diverged:
        bounded = worst_of(output.bounded_rmse_over_deviation for output in model.outputs)
        others = "" if bounded is None else f", {percent(bounded)} off on the others"
        remarks.append(f"diverged on {model.diverged} of {trajectories} trajectories{others}")
    if model.cut:
        remarks.append("cut by the budget")
    return "; ".join(remarks)


def model_table(figures: ComparisonFigures) -> ReportTable:
    """Return the table of a comparison."""
    names = [output.name for output in figures.models[0].outputs]
    heading = (
        "model",
        "size",
        *(f"relative RMSE of {name}" for name in names),
        "parameters",
        "CPU time / s",
        "step / us",
        "ratio",
        "remark",
    )

    def cells(model: ModelFigures) -> Iterator[str]:
        """Yield the cells of a model; cells of missing figures are empty."""
        yield from (model.title, model.structure)
        if model.failed is None:
            yield from (_percent(output.rmse_over_deviation) for output in model.outputs)
        else:
            yield from [""] * len(names)
        yield "" if model.parameters is None else str(model.parameters)
        yield "" if model.cpu_seconds is None else f"{model.cpu_seconds:.3g}"
        yield "" if model.step_us is None else f"{model.step_us:.3g}"
        yield "" if model.time_ratio is None else f"{model.time_ratio:.2g}"
        yield remark_on(model, figures.trajectories)

    return ReportTable.of(heading, map(cells, figures.models))


def baselines_report(figures: ComparisonFigures, summary: str) -> Report:
    """Return the report of a comparison."""
    budget, trajectories, seed = figures.budget_s, figures.trajectories, figures.seed
    text = TEXT.format(budget=budget, trajectories=trajectories, seed=seed)
    if figures.remark is not None:
        text += f" Remark: {figures.remark}."
    charts = error_charts(figures.models)
    section = ReportSection("Models of other kinds", text, model_table(figures), charts=charts)
    return Report(f"{figures.name}: comparison of models", summary, figures, [section])


def error_charts(models: Sequence[ModelFigures]) -> list[Chart]:
    """Draw every model's error against its parameters, and against the time of its steps.

    A model that has diverged is drawn at the top.
    """
    shown = [model for model in models if model.failed is None]
    bounded = [model.error for model in shown if model.error < math.inf]
    top = 2 * max(bounded, default=1.0)

    def chart(title: str, axis: Axis, places: Sequence[float | None]) -> Chart:
        lines = [
            Line(
                model.title if model.error < math.inf else f"{model.title} (diverged)",
                np.array([place], dtype=np.float64),
                np.array([100 * min(model.error, top)]),
                colour_of(index),
                "points",
                width=5.0,
            )
            for index, (model, place) in enumerate(zip(shown, places, strict=True))
        ]
        return Chart(title, [Panel("relative RMSE, worst output", "%", lines, log=True)], axis)

    return [
        chart("Error by size", Axis("parameters", log=True), [m.parameters for m in shown]),
        chart("Error by time of a step", Axis("step", "us", log=True), [m.step_us for m in shown]),
    ]


def _percent(value: float | None) -> str:
    return "diverged" if value is None else percent(value)
