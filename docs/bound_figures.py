"""The pictures on the pages about error bounds, drawn with the released Duffing FMU.

``python docs/bound_figures.py`` simulates the oscillator under a random force, within the range of
the FMU and beyond it, and writes ``docs/bound_over_time.svg``, ``docs/bound_parts.svg`` and
``docs/bound_scatter.svg``. It prints the shares that the pages name.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import theme
from matplotlib.patches import FancyBboxPatch

import slide_fmu as slide
from mbs_models.oscillators import DuffingOscillator

ROOT = Path(__file__).parents[1]
COUNT, SHOWN, DOTS = 6000, 300, 500
"""Samples that are simulated in range; samples on each side of the change; dots of a scatter."""
BEYOND = 1.6
"""Factor on the force behind the change."""

Series = dict[str, np.ndarray]


def simulated() -> Series:
    """Return error, bound and disagreement in m, and the flag, with a change in the middle."""
    surrogate = slide.load(ROOT / "fmus" / "duffing" / "duffing.fmu")
    step, bound = surrogate.window.step, surrogate.bound
    assert bound is not None
    force = np.random.default_rng(20261125).uniform(-1000, 1000, (COUNT + SHOWN, 1))
    force[COUNT:] *= BEYOND
    true = DuffingOscillator(step=step, substeps=12).simulate(force)[1:]
    trust = surrogate.trust(force)
    return {
        "time": step * (np.arange(len(force)) + 1 - COUNT),
        "error": np.abs(surrogate.predict_newest(force) - true)[:, 0],
        "bound": trust.bounds()[:, 0],
        "disagreement": (trust.local.disagreement * surrogate.output_scaling.scale)[:, 0],
        "trusted": trust.trusted(),
    }


def draw_over_time(series: Series) -> None:
    """Draw error and bound around the change, and the time in which the FMU is not trusted."""
    at = slice(COUNT - SHOWN, COUNT + SHOWN)
    time, outside = series["time"][at], ~series["trusted"][at]
    figure, axes = plt.subplots(figsize=(6.6, 3), layout="constrained")
    axes.fill_between(
        time, 0, 1, where=outside, color=theme.SHADE, lw=0, transform=axes.get_xaxis_transform()
    )
    axes.semilogy(time, series["error"][at], color=theme.BLUE, lw=0.9, label="error")
    axes.semilogy(time, series["bound"][at], color=theme.ORANGE, lw=1.8, label="error bound, 95 %")
    axes.axvline(0, color=theme.INK, lw=1, ls=":")
    text = {"color": theme.INK, "ha": "center", "transform": axes.get_xaxis_transform()}
    axes.text(time[0] / 2, 1.02, "force in range", **text)
    axes.text(time[-1] / 2, 1.02, f"force {BEYOND:g} times as large: trusted is false", **text)
    axes.set(xlabel="time / s", ylabel="m", xlim=(time[0], time[-1]), ylim=(1e-6, 0.3))
    axes.legend(loc="lower right", ncols=2)
    theme.save(figure, ROOT / "docs" / "bound_over_time.svg")


def draw_scatter(series: Series) -> None:
    """Draw the errors in range over what both networks disagree by, and over the bound."""
    chosen = np.linspace(300, COUNT - 1, DOTS).astype(int)
    figure, both = plt.subplots(1, 2, figsize=(6.6, 3), sharey=True, layout="constrained")
    for axes, name in zip(both, ("disagreement", "bound"), strict=True):
        over, error = series[name][chosen], np.maximum(series["error"][chosen], 1e-7)
        above = error > over
        axes.loglog(over[~above], error[~above], ".", color=theme.BLUE, ms=3)
        axes.loglog(over[above], error[above], ".", color=theme.RED, ms=3)
        ends = (2e-5, 3e-3)
        axes.plot(ends, ends, color=theme.INK, lw=1)
        axes.set(xlim=ends, ylim=(1e-6, 3e-3), xlabel=f"{name} / m")
        axes.set_title(f"{100 * above.mean():.0f} % of the errors are above the line", size=10)
    both[0].set(ylabel="error / m")
    theme.save(figure, ROOT / "docs" / "bound_scatter.svg")


def draw_parts() -> None:
    """Draw how the bound and the novelty follow from two networks."""
    figure, axes = plt.subplots(figsize=(6.6, 2.7), layout="constrained")
    boxes = {
        "inputs": (0, 1.5, "inputs", theme.INK),
        "surrogate": (2, 2.3, "surrogate", theme.BLUE),
        "companion": (2, 0.7, "companion", theme.BLUE),
        "difference": (4, 1.5, "disagreement", theme.INK),
        "head": (6, 2.3, "head: scale", theme.INK),
        "means": (6, 0.7, "mean squares", theme.INK),
        "bound": (8.1, 2.3, "error bound", theme.ORANGE),
        "novelty": (8.1, 0.7, "novelty", theme.ORANGE),
    }
    for x, y, name, colour in boxes.values():
        box = FancyBboxPatch(
            (x - 0.7, y - 0.28), 1.4, 0.56, "round,pad=0.02", fc=theme.SHADE, ec=colour, lw=1.5
        )
        axes.add_patch(box)
        axes.text(x, y, name, ha="center", va="center", color=theme.INK, size=8.5)
    arrows = [("inputs", "surrogate"), ("inputs", "companion"), ("surrogate", "difference")]
    arrows += [("companion", "difference"), ("difference", "head"), ("difference", "means")]
    arrows += [("head", "bound"), ("means", "novelty"), ("companion", "means")]
    for start, end in arrows:
        (x0, y0, *_), (x1, y1, *_) = boxes[start], boxes[end]
        line = {"arrowstyle": "-|>", "color": theme.INK, "lw": 1.2}
        axes.annotate("", (x1 - 0.74, y1), (x0 + 0.74, y0), arrowprops=line)
    for y, text in (
        (2.95, "times the factor\nof the calibration"),
        (1.35, "over the limits\nof the domain"),
    ):
        axes.text(7.05, y, text, ha="center", va="center", color=theme.INK, size=8.5)
    axes.set(xlim=(-0.8, 8.9), ylim=(0.2, 3.3), aspect="equal")
    axes.axis("off")
    theme.save(figure, ROOT / "docs" / "bound_parts.svg")


def main() -> None:
    """Simulate, draw all pictures, and print what they show."""
    matplotlib.rcParams.update({"svg.hashsalt": "bound", **theme.STYLE})
    series = simulated()
    draw_over_time(series)
    draw_scatter(series)
    draw_parts()
    ranges = {"in range": slice(300, COUNT), "beyond": slice(COUNT + 20, None)}
    for name, at in ranges.items():
        covered = 100 * np.mean(series["error"][at] <= series["bound"][at])
        flagged = 100 * np.mean(~series["trusted"][at])
        print(f"{name}: {covered:.1f} % covered, {flagged:.1f} % not trusted")


if __name__ == "__main__":
    main()
