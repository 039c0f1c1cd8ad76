"""A comparison of models becomes a table and charts; it says if a linear model is enough."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from slide_fmu.apps.compare.model_figures import ComparisonFigures, ModelFigures
from slide_fmu.core.measures import percent
from slide_fmu.core.readable import duration, number
from slide_fmu.core.web.charts import Axis, Chart, Line, Panel, colour_of
from slide_fmu.report.html_report import Fact, Report, ReportSection, Verdict
from slide_fmu.report.quality import LINEAR_DOES
from slide_fmu.report.table import ReportTable
from slide_fmu.validation.error_figures import worst_of

EXACT = 1e-6
"""Smallest error shown: networks round to single precision."""

CONVERGED = 0.9
"""A training has converged if its second half left more than this part of the error."""

LONGER = 1.05
"""A training took longer than the budget if its time exceeds this multiple."""

TEXT = (
    "Every model learnt from the same trajectories, in at most {budget} of CPU time. All are "
    "measured on the same {trajectories} unseen trajectories (seed {seed}), from the end of the "
    "burn-in on. They simulate freely: a model gets the inputs, and outputs only at the start of "
    "a trajectory. The error is the RMSE over the standard deviation of the true output. A step "
    "is one sample. Networks of slide-fmu are timed in their FMU (doStep by FMPy), the others "
    "in numpy or torch on one thread, in turns with the own network."
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
        f"nonlinear model, {best.title}{_unfinished(models)}"
    )


def _unfinished(models: Sequence[ModelFigures]) -> str:
    """Name the nonlinear models that the budget ended too early; the text is empty if none."""
    names = [m.title for m in models if not m.linear and m.cut and not _has_converged(m)]
    if not names:
        return ""
    return f". Not converged: {', '.join(names)}. A larger --budget may change this"


def _has_converged(model: ModelFigures) -> bool:
    """Say whether the second half of a training brought little; searches have no such course."""
    error, half_way = model.validation_error, model.error_half_way
    return error is None or (half_way is not None and error > CONVERGED * half_way)


def _error(model: ModelFigures) -> float:
    return model.error


def remark_on(model: ModelFigures, trajectories: int, budget: float | None = None) -> str:
    """Describe a model that failed, diverged, or was cut; otherwise return an empty text.

    ``budget`` is the CPU time in s of each training.
    """
    if model.failed is not None:
        return f"failed: {model.failed}"
    remarks = []
    if model.diverged:
        bounded = worst_of(output.bounded_rmse_over_deviation for output in model.outputs)
        others = "" if bounded is None else f", {percent(bounded)} off on the others"
        remarks.append(f"diverged on {model.diverged} of {trajectories} trajectories{others}")
    if model.validation_error is not None:
        remarks.append(course_of(model, model.validation_error, model.error_half_way))
    elif model.cut:
        remarks.append("its search was cut by the budget")
    time = model.cpu_seconds or 0.0
    if budget is not None and time > LONGER * budget:
        remarks.append(f"took {time / budget:.2g} times the budget")
    return "; ".join(remarks)


def course_of(model: ModelFigures, error: float, half_way: float | None) -> str:
    """Say whether the training of a network has converged, by what its second half brought."""
    if not model.cut:
        return f"trained to its end: {percent(error)} in validation"
    if half_way is None:
        return f"not converged: {percent(error)} in validation"
    word = "converged" if _has_converged(model) else "not converged"
    return (
        f"{word}: {percent(half_way)} in validation at half of its time, "
        f"{percent(error)} at the end"
    )


def model_table(figures: ComparisonFigures) -> ReportTable:
    """Return the table of a comparison."""
    names = [output.name for output in figures.models[0].outputs]
    heading = (
        "model",
        *(f"error of {name}" for name in names),
        "parameters",
        "CPU time",
        "a step",
        "step, own = 1",
        "size",
        "how the training ended",
    )

    def cells(model: ModelFigures) -> Iterator[str]:
        """Yield the cells of a model; cells of missing figures are empty."""
        yield model.title
        if model.failed is None:
            yield from (_percent(output.rmse_over_deviation) for output in model.outputs)
        else:
            yield from [""] * len(names)
        yield "" if model.parameters is None else number(model.parameters)
        yield "" if model.cpu_seconds is None else duration(model.cpu_seconds)
        yield "" if model.step_us is None else duration(1e-6 * model.step_us)
        yield "" if model.time_ratio is None else f"{float(f'{model.time_ratio:.2g}'):g}"
        yield from (model.structure, remark_on(model, figures.trajectories, figures.budget_s))

    return ReportTable.of(heading, map(cells, figures.models))


def baselines_report(figures: ComparisonFigures, summary: str) -> Report:
    """Return the report of a comparison."""
    budget, trajectories, seed = figures.budget_s, figures.trajectories, figures.seed
    text = TEXT.format(budget=duration(budget), trajectories=trajectories, seed=seed)
    if figures.remark is not None:
        text += f" Remark: {figures.remark}."
    charts = error_charts(figures.models)
    section = ReportSection("Models of other kinds", text, model_table(figures), charts=charts)
    title = f"{figures.name}: comparison of models"
    facts = _facts(figures.models)
    return Report(title, summary, figures, [section], verdict=Verdict(facts=facts))


def _facts(models: Sequence[ModelFigures]) -> list[Fact]:
    """Return the large numbers: the error of the own network, and the best ones of others."""
    own, *others = models
    facts = [Fact("Own network", _of(own), f"Relative RMSE of the worst output, {own.structure}.")]
    for name, linear in (("Best linear model", True), ("Best other nonlinear model", False)):
        alike = [m for m in others if m.linear == linear and m.failed is None]
        best = min(alike, key=_error, default=None)
        if best is not None:
            facts.append(Fact(name, _of(best), f"{best.title}."))
    return facts


def _of(model: ModelFigures) -> str:
    return _percent(None if model.error == math.inf else model.error)


def error_charts(models: Sequence[ModelFigures]) -> list[Chart]:
    """Draw every model's error against its parameters, and against the time of its steps.

    A model that has diverged is drawn at the top.
    """
    shown = [model for model in models if model.failed is None]
    bounded = [model.error for model in shown if model.error < math.inf]
    top = 2 * max(bounded, default=1.0)

    def room(places: Sequence[float | None]) -> list[Line]:
        """Return a line that is not drawn, so that no point is cut by the edge."""
        known = [place for place in places if place is not None]
        ends = np.array([min(known) / 1.3, 1.3 * max(known)]) if known else np.zeros(0)
        return [Line("", ends, np.full(len(ends), np.nan), style="points")]

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
        return Chart(
            title,
            [Panel("error of the worst output", "%", [*lines, *room(places)], log=True)],
            axis,
        )

    return [
        chart("Error by size", Axis("parameters", log=True), [m.parameters for m in shown]),
        chart(
            "Error by time of a step",
            Axis("time of a step", "µs", log=True),
            [m.step_us for m in shown],
        ),
    ]


def _percent(value: float | None) -> str:
    return "diverged" if value is None else percent(value)
