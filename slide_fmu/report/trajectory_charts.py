"""This module draws single trajectories: reference, surrogate, errors and inputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from slide_fmu.core.measures import percent
from slide_fmu.core.readable import quantity
from slide_fmu.core.signals import FloatArray, Signal, hold_of
from slide_fmu.core.units import behind, ratio
from slide_fmu.core.web.charts import Axis, Band, Chart, Line, Panel, Style, colour_of
from slide_fmu.recipe.model_rules import rules_of
from slide_fmu.validation.comparison import Comparison
from slide_fmu.validation.results import Validation

NOT_TRUSTED = "not trusted (trusted is false)"
"""What the FMU reports of samples that it flags, for legends."""

MOST_SAMPLES = 3000
"""Largest number of samples of a chart; of a longer trajectory it shows the worst part."""

PHASE_SAMPLES, FINER, FEWEST_OF_SPLINE = 120, 8, 4
"""Samples of a phase plot around the largest error, points of its spline per sample, and the
fewest samples that a spline needs."""

CLOSE_SECONDS, CLOSE_SAMPLES = 2.0, (60, 600)
"""Time in s around the largest error that a close-up shows, and its fewest and most samples."""

INPUT_COLOURS = 6


def panels_by_unit(
    title: str,
    names: Sequence[str],
    units: Sequence[str],
    time: FloatArray,
    values: FloatArray,
) -> list[Panel]:
    """Draw quantities over time, (N, n_quantities), with one panel for each of their units."""
    return [
        Panel(
            title,
            unit,
            [
                Line(name, time, values[:, i], colour_of(i))
                for i, (name, own) in enumerate(zip(names, units, strict=True))
                if own == unit
            ],
        )
        for unit in dict.fromkeys(units)
    ]


def trajectory_charts(validation: Validation) -> list[Chart]:
    """Draw the worst and the median trajectory of every output."""
    charts = []
    for output in range(len(validation.surrogate.outputs)):
        for title, chosen in example_motions(validation, output).items():
            charts.append(_trajectory_chart(validation, chosen, output, title))
    return charts


def example_motions(validation: Validation, output: int) -> dict[str, Comparison]:
    """Return the trajectories with the largest and the median RMS error, by their titles.

    It is not relative, since an output that hardly moves has a large relative error.
    """
    order = sorted(validation.comparisons, key=lambda c: float(np.mean(c.error[:, output] ** 2)))
    if len(order) == 1:  # of a record there is often but one block
        return {"the only trajectory": order[0]}
    return {"worst trajectory": order[-1], "median trajectory": order[len(order) // 2]}


def close_ups(validation: Validation) -> list[Chart]:
    """Draw every output around the largest error of all trajectories."""
    return [_close_up(validation, output) for output in range(len(validation.surrogate.outputs))]


def _close_up(validation: Validation, output: int) -> Chart:
    """Draw an output, its error, and the inputs around its largest error."""
    chosen = max(validation.comparisons, key=lambda c: float(np.abs(c.error[:, output]).max()))
    step = chosen.time[1] - chosen.time[0] if len(chosen.time) > 1 else 1.0
    few, most = CLOSE_SAMPLES
    part = around_worst(chosen, output, min(max(round(CLOSE_SECONDS / step), few), most))
    worst = int(np.argmax(np.abs(chosen.error[:, output])))
    signal, size = validation.surrogate.outputs[output], abs(chosen.error[worst, output])
    place = chosen.time[worst]
    return Chart(
        signal.name,
        [
            outputs_panel(validation, chosen, part, output),
            error_panel(validation, chosen, part, output),
            inputs_panel(validation, chosen.time[part], chosen.inputs[part]),
        ],
        text=(
            f"The largest error is {quantity(size, signal.unit)}, at {place:.6g} s "
            f"({name_of_motion(validation, chosen)})."
        ),
        parts=outside_parts(chosen, part),
        marks=[float(place)],
        shaded=NOT_TRUSTED,
    )


def phase_charts(validation: Validation) -> list[Chart]:
    """Draw every output over its speed, on the worst part of its worst trajectory."""
    charts = []
    for output, signal in enumerate(validation.surrogate.outputs):
        chosen = next(iter(example_motions(validation, output).values()))
        part = around_worst(chosen, output, PHASE_SAMPLES)
        if len(chosen.time[part]) < FEWEST_OF_SPLINE:
            continue
        time = chosen.time[part]
        true = _phase_of(time, chosen.reference[part, output])
        own = _phase_of(time, chosen.surrogate[part, output])
        lines = [true_line(validation, *true), own_line(*own)]
        panel = Panel("speed", ratio(signal.unit, "s"), lines, height="square")
        axis = Axis(signal.name, behind(signal.unit).strip())
        charts.append(Chart(signal.name, [panel], axis))
    return charts


def _phase_of(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return values and speeds of the cubic spline through samples, (N,) both."""
    from scipy.interpolate import CubicSpline  # slow to import

    fine = np.linspace(time[0], time[-1], FINER * (len(time) - 1) + 1)
    spline = CubicSpline(time, values)
    return np.asarray(spline(fine)), np.asarray(spline(fine, 1))


def inputs_panel(validation: Validation, time: FloatArray, inputs: FloatArray) -> Panel:
    """Draw inputs, (N, n_inputs): one in its unit, several each over half its range."""
    return signals_panel(validation.surrogate.inputs, time, inputs)


def signals_panel(signals: tuple[Signal, ...], time: FloatArray, inputs: FloatArray) -> Panel:
    """Draw the inputs of signals, (N, n_inputs), as ``inputs_panel`` does."""
    style: Style = "steps" if hold_of(signals) == "zero_order" else "line"
    if len(signals) == 1:
        line = Line(signals[0].name, time, inputs[:, 0], "input-0", style, width=1.3)
        return Panel("input", signals[0].unit, [line], height="short")
    lines = [
        Line(
            s.name,
            time,
            _over_range(s, inputs[:, i]),
            f"input-{i % INPUT_COLOURS}",
            style,
            width=1.2,
        )
        for i, s in enumerate(signals)
    ]
    return Panel("inputs over half their ranges", "1", lines, height="short")


def outputs_panel(validation: Validation, chosen: Comparison, part: slice, output: int) -> Panel:
    """Draw the reference and the surrogate of an output."""
    signal, time = validation.surrogate.outputs[output], chosen.time[part]
    truth = true_line(validation, time, chosen.reference[part, output])
    own = own_line(time, chosen.surrogate[part, output])
    return Panel(signal.name, signal.unit, [truth, own])


def error_panel(validation: Validation, chosen: Comparison, part: slice, output: int) -> Panel:
    """Draw the absolute error of an output, its estimate and its bound."""
    signal, time = validation.surrogate.outputs[output], chosen.time[part]
    error = np.abs(chosen.error[part, output])
    lines, bands = [Line("|error|", time, error, "bad", width=1.1)], []
    if chosen.estimate is not None and np.isfinite(chosen.true_error[part, output]).any():
        true = chosen.true_error[part, output]
        estimate = np.where(np.isfinite(true), chosen.estimate[part, output], np.nan)
        span = validation.surrogate.estimated_samples
        lines.append(Line(f"RMSE of {span} samples", time, true, "truth", dashed=True))
        lines.append(Line("its estimate", time, estimate, "estimate"))
    if chosen.trust is not None:
        bound = chosen.trust.bounds[part, output]
        bands.append(Band("error bound", time, np.zeros_like(bound), bound))
    return Panel("error", signal.unit, lines, bands, include=(0.0,))


def outside_parts(chosen: Comparison, part: slice) -> list[tuple[float, float]]:
    """Return the parts of a trajectory, from a time to a time in s, that are flagged."""
    if chosen.trust is None:
        return []
    return parts_of(chosen.trust.flagged[part], chosen.time[part])


def parts_of(flags: NDArray[np.bool_], time: FloatArray) -> list[tuple[float, float]]:
    """Return the parts, from a time to a time in s, in which flags of samples are set, (N,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags, [0]]))).reshape(-1, 2)
    return [(float(time[max(0, a - 1)]), float(time[b - 1])) for a, b in edges]


def around_worst(chosen: Comparison, output: int, most: int = MOST_SAMPLES) -> slice:
    """Return the samples that are drawn: all, or at most ``most`` around the largest error."""
    count = min(len(chosen.time), most)
    worst = int(np.argmax(np.abs(chosen.error[:, output])))
    first = min(max(0, worst - count // 2), len(chosen.time) - count)
    return slice(first, first + count)


def true_line(validation: Validation, x: FloatArray, y: FloatArray) -> Line:
    """Draw the reference, (N,) both."""
    return Line(rules_of(validation.recipe).words.truth, x, y, "truth", dashed=True, width=3.0)


def name_of_motion(validation: Validation, chosen: Comparison) -> str:
    """Return the name of the kind of motion that a trajectory is of."""
    return rules_of(validation.recipe).motions(validation.recipe)[chosen.kind].name


def own_line(x: FloatArray, y: FloatArray) -> Line:
    """Draw the output of the surrogate, (N,) both."""
    return Line("surrogate", x, y, "line", width=1.5)


def _over_range(signal: Signal, values: FloatArray) -> FloatArray:
    middle, half = 0.5 * (signal.low + signal.high), 0.5 * (signal.high - signal.low)
    return np.asarray((values - middle) / half)


def _trajectory_chart(
    validation: Validation, chosen: Comparison, output: int, title: str
) -> Chart:
    part = around_worst(chosen, output)
    signal, kind = validation.surrogate.outputs[output], name_of_motion(validation, chosen)
    error = validation.relative(chosen.error, chosen.reference)[output]
    panels: Sequence[Panel] = [
        outputs_panel(validation, chosen, part, output),
        error_panel(validation, chosen, part, output),
        inputs_panel(validation, chosen.time[part], chosen.inputs[part]),
    ]
    return Chart(
        f"{signal.name}: {title}",
        panels,
        text=f"{kind}, relative RMSE {percent(error)}",
        parts=outside_parts(chosen, part),
        shaded=NOT_TRUSTED,
    )
