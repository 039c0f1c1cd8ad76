"""All pictures of the report share their colours, their panels and how inputs are drawn."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slide_fmu.core.signals import FloatArray, Signal
from slide_fmu.core.units import labelled

REFERENCE, SURROGATE, ERROR, ESTIMATE = "#222222", "#1f77b4", "#d62728", "#ff7f0e"


def panels_in_a_row(count: int, height: float) -> tuple[Figure, list[Axes]]:
    """Return a figure with a number of panels beside each other, each with a grid."""
    figure = Figure(figsize=(5.5 * count, height), layout="constrained")
    axes = list(figure.subplots(1, count, squeeze=False)[0])
    for ax in axes:
        ax.grid(alpha=0.3)
    return figure, axes


def draw_inputs(ax: Axes, signals: Sequence[Signal], time: FloatArray, values: FloatArray) -> None:
    """Draw inputs, (N, n_inputs), that led to the samples at times in s, (N,)."""
    for index, signal in enumerate(signals):
        ax.step(time, values[:, index], where="pre", lw=0.9, label=signal.name)
    units = ", ".join(dict.fromkeys(signal.unit for signal in signals))
    names = f"{signals[0].name} .. {signals[-1].name}" if len(signals) > 1 else signals[0].name
    ax.set_ylabel(labelled(names, units))
