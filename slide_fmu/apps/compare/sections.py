"""A comparison of models is shown as a table and a picture; it says if a linear one would do."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slide_fmu.pipeline.quality import LINEAR_DOES
from slide_fmu.report.panels import REFERENCE, SURROGATE
from slide_fmu.report.pictures import png
from slide_fmu.report.report import Report, Section

EXACT = 1e-6
"""Errors below this count as this: networks round to single precision."""

TEXT = (
    "All models learnt from the same trajectories, for about {budget:.3g} s of CPU time each or "
    "less, and are measured on the same {trajectories} unseen ones (seed {seed}), scored from the "
    "end of the burn-in on. They simulate freely: none is given an output but those at the start "
    "of a trajectory. The error is the RMSE over the standard deviation of the true output. A "
    "step is one sample: of the networks of slide-fmu doStep of their FMU through fmpy, of the "
    "others a step by numpy or torch on one thread, as the library does it; the ratio is that to "
    "the own network, timed in turns."
)

Model = Mapping[str, Any]
"""The figures of one model, as ``slide_fmu.apps.compare.compare`` gives them."""


def error_of(model: Model) -> float:
    """Return a model's error, of several outputs the largest; infinite if it has diverged."""
    errors = [output["rmse_over_deviation"] for output in model.get("outputs", ())]
    return max(errors) if errors and None not in errors else math.inf


def linear_remark(models: Sequence[Model]) -> str | None:
    """Say that a linear model would do; None where none would."""
    linear = min((m for m in models if m["linear"]), key=error_of, default=None)
    best = min((m for m in models if not m["linear"]), key=error_of, default=None)
    if linear is None or best is None or error_of(linear) == math.inf:
        return None
    if error_of(best) == math.inf:
        return f"a linear model would do ({linear['title']}): no nonlinear one stays bounded"
    ratio = max(error_of(linear), EXACT) / max(error_of(best), EXACT)
    if ratio > LINEAR_DOES:
        return None
    return (
        f"a linear model would do: {linear['title']} errs {ratio:.3g} times as much as the best "
        f"nonlinear model, {best['title']}"
    )


def remark_on(model: Model, trajectories: int) -> str:
    """Say what is to be known about a model: failed, diverged, or cut; nothing otherwise."""
    if model["failed"] is not None:
        return f"failed: {model['failed']}"
    remarks = []
    if model["diverged"]:
        bounded = [output["bounded_rmse_over_deviation"] for output in model["outputs"]]
        others = ""
        if None not in bounded:
            others = f", {100 * max(bounded):.3g} % off on the others"
        remarks.append(f"diverged on {model['diverged']} of {trajectories} trajectories{others}")
    if model["cut"]:
        remarks.append("cut by the budget")
    return "; ".join(remarks)


def baseline_rows(figures: Mapping[str, Any]) -> list[Sequence[str]]:
    """Return the table of a comparison, its heading first."""
    models = figures["models"]
    names = [output["name"] for output in models[0]["outputs"]]
    rows: list[Sequence[str]] = [
        (
            "model",
            "size",
            *(f"relative RMSE of {name}" for name in names),
            "parameters",
            "CPU time / s",
            "step / us",
            "ratio",
            "remark",
        )
    ]
    for model in models:
        seconds = model["cpu_seconds"]
        measured = model["failed"] is None
        errors = [_percent(o["rmse_over_deviation"]) for o in model["outputs"]] if measured else []
        rows.append(
            (
                model["title"],
                model["structure"],
                *(errors or [""] * len(names)),
                str(model["parameters"]) if measured else "",
                "" if seconds is None else f"{seconds:.3g}",
                f"{model['step_us']:.3g}" if measured else "",
                f"{model['time_ratio']:.2g}" if measured else "",
                remark_on(model, figures["trajectories"]),
            )
        )
    return rows


def baselines_report(figures: dict[str, Any], summary: str) -> Report:
    """Return the report of a comparison."""
    budget, trajectories, seed = (figures[k] for k in ("budget_s", "trajectories", "seed"))
    text = TEXT.format(budget=budget, trajectories=trajectories, seed=seed)
    if figures["remark"] is not None:
        text += f" Remark: {figures['remark']}."
    section = Section(
        "Models of other kinds", text, baseline_rows(figures), [error_and_cost(figures["models"])]
    )
    return Report(f"{figures['name']}: comparison of models", summary, figures, [section])


def error_and_cost(models: Sequence[Model]) -> bytes:
    """Draw every model's error against its parameters, and against the time of its steps."""
    shown = [model for model in models if model["failed"] is None]
    bounded = [error_of(model) for model in shown if error_of(model) < math.inf]
    top = 2 * max(bounded, default=1.0)
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    panels = zip(
        figure.subplots(1, 2, sharey=True),
        (("parameters", "parameters"), ("step_us", "time per step / us")),
        strict=True,
    )
    for ax, (key, label) in panels:
        for model in shown:
            _mark(ax, model, (model[key], min(100 * error_of(model), 100 * top)))
        ax.set(xscale="log", yscale="log", xlabel=label)
        ax.margins(0.35, 0.1)
        ax.grid(alpha=0.3, which="both")
    figure.axes[0].set_ylabel("relative RMSE / %, worst output")
    return png(figure)


def _mark(ax: Axes, model: Model, place: tuple[float, float]) -> None:
    """Draw a model's mark with its name; a diverged one lies at the top."""
    gone = error_of(model) == math.inf
    own = model["title"].startswith("own")
    ax.plot(*place, "^" if gone else "o", color=SURROGATE if own else REFERENCE)
    name = f"{model['title']} (diverged)" if gone else model["title"]
    ax.annotate(name, place, (5, 4), textcoords="offset points", fontsize=8)


def _percent(value: float | None) -> str:
    return "diverged" if value is None else f"{100 * value:.3g} %"
