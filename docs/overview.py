"""The picture on the front page: from a system to its FMU, drawn with the released Duffing FMU.

``python docs/overview.py`` simulates the FMU and its reference model under the same force and
writes ``docs/overview.svg``, and ``docs/overview_narrow.svg`` for phones.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import matplotlib
import numpy as np
import theme
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Rectangle

import slide_fmu as slide
from mbs_models.oscillators import DuffingOscillator
from slide_fmu.core.window import Window

ROOT = Path(__file__).parents[1]
FMU = ROOT / "fmus" / "duffing" / "duffing.fmu"
DARK, BLUE, ORANGE, GREY = theme.INK, theme.BLUE, theme.ORANGE, theme.GREY
SHOWN = 120
"""So many samples are drawn of the response."""


def sketch_system(axes: Axes) -> None:
    """Draw a mass between a wall and a force, on a spring and a damper."""
    axes.plot([0, 0], [-1, 1], color=DARK, lw=4)
    turns = np.linspace(0, 1, 13)
    axes.plot(0.1 + 1.3 * turns, 0.45 + 0.18 * np.sin(np.pi * 6 * turns), color=DARK)
    axes.plot([0, 0.1], [0.45, 0.45], color=DARK)
    axes.plot([1.4, 1.6], [0.45, 0.45], color=DARK)
    axes.plot([0, 0.7], [-0.45, -0.45], color=DARK)
    axes.plot([0.95, 0.7, 0.7, 0.95], [-0.28, -0.28, -0.62, -0.62], color=DARK)
    axes.plot([0.85, 0.85, 0.85, 1.6], [-0.58, -0.32, -0.45, -0.45], color=DARK)
    axes.add_patch(Rectangle((1.6, -0.8), 0.9, 1.6, facecolor=theme.SHADE, edgecolor=DARK, lw=1.5))
    arrow = {"arrowstyle": "-|>", "color": BLUE, "lw": 2}
    axes.annotate("", (3.4, 0), (2.5, 0), arrowprops=arrow)
    axes.text(2.95, 0.2, "force", color=BLUE, ha="center")
    axes.set(xlim=(-0.1, 3.5), ylim=(-1.6, 1.6))


def sketch_network(axes: Axes) -> None:
    """Draw three layers of units with all lines between them."""
    layers = [np.linspace(-1, 1, 5), np.linspace(-0.8, 0.8, 4), np.array([-0.3, 0.3])]
    for place, (left, right) in enumerate(pairwise(layers)):
        for low in left:
            for high in right:
                axes.plot([place, place + 1], [low, high], color=GREY, lw=0.6, zorder=1)
    for place, layer in enumerate(layers):
        axes.scatter([place] * len(layer), layer, s=70, color=DARK, zorder=2)
    axes.text(2.15, 0.3, "output", va="center", color=ORANGE)
    axes.text(2.15, -0.3, "its error", va="center", color=ORANGE)
    axes.set(xlim=(-0.3, 3.1), ylim=(-1.6, 1.6))


def draw_window(axes: Axes, force: np.ndarray, truncated: int) -> None:
    """Draw the window of the force; the part that only lets the past be forgotten is shaded."""
    axes.axvspan(0, truncated, color=theme.SHADE)
    axes.step(np.arange(len(force)), force, where="post", color=BLUE, lw=1)
    axes.text(truncated / 2, 1250, "past fades", ha="center", color=DARK, fontsize=9)
    axes.text((truncated + len(force)) / 2, 1250, "force", ha="center", color=BLUE, fontsize=9)
    axes.set(xlim=(0, len(force)), ylim=(-1150, 1600))


def answers() -> tuple[Window, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the window, times, force, and the responses of the slow model and of the FMU."""
    window = slide.load(FMU).window
    rng = np.random.default_rng(20261122)
    force = rng.uniform(-900, 900, (window.n_in + SHOWN) // 6 + 2).repeat(6)
    force = force[: window.n_in + SHOWN, None]
    times = window.step * np.arange(len(force))
    true = DuffingOscillator(step=window.step, substeps=12).simulate(force[:-1])[:, 0]
    return window, times, force[:, 0], true, slide.simulate(FMU, times, force)[:, 0]


def draw_response(axes: Axes, times: np.ndarray, true: np.ndarray, of_fmu: np.ndarray) -> None:
    """Draw the last part of both responses."""
    times, true, of_fmu = times[-SHOWN:], true[-SHOWN:], of_fmu[-SHOWN:]
    axes.plot(times, true, color=DARK, lw=1.2, label="position of the slow model")
    axes.plot(times, of_fmu, color=ORANGE, lw=3.5, alpha=0.6, label="of the FMU")
    axes.set(xlim=(times[0], times[-1]), ylim=(-0.9, 1.1))
    axes.legend(loc="upper center", ncols=2, frameon=False, fontsize=9)


def draw_arrows(figure: Figure, panels: list[Axes], down: bool) -> None:
    """Draw an arrow from each panel to the next one, which is on the right of it or below it."""
    for first, second in pairwise(panels):
        one, other = first.get_position(), second.get_position()
        if down:
            middle = (one.y0 + other.y1) / 2 + 0.016
            ends = (0.5, middle + 0.016), (0.5, middle - 0.016)
        else:
            middle = (one.x1 + other.x0) / 2 + 0.006
            ends = (middle - 0.014, 0.42), (middle + 0.014, 0.42)
        arrow = {"arrowstyle": "-|>", "mutation_scale": 16, "color": DARK}
        figure.add_artist(FancyArrowPatch(*ends, transform=figure.transFigure, **arrow))


def draw(path: Path, down: bool) -> None:
    """Draw the four panels in a row, or one below the other for narrow screens."""
    window, times, force, true, found = answers()
    figure = Figure(figsize=(4, 8.4) if down else (11, 2.6), layout="constrained")
    if down:
        panels = figure.subplots(4, 1, height_ratios=(1, 0.9, 1, 0.9))
    else:
        panels = figure.subplots(1, 4, width_ratios=(1, 1.5, 1, 1.6))
    one, two, three, four = panels
    sketch_system(one)
    draw_window(two, force[-window.n_in :], window.n_truncated)
    sketch_network(three)
    draw_response(four, times, true, found)
    titles = ("a damped system", "its recent inputs", "a small network", "the FMU")
    for axes, title in zip(panels, titles, strict=True):
        axes.set_title(title, color=DARK, weight="bold")
        axes.set(xticks=[], yticks=[])
        axes.spines[:].set_visible(False)
    engine = figure.get_layout_engine()
    assert engine is not None
    engine.set(**({"hspace": 0.16} if down else {"wspace": 0.12}))
    if down:  # sketches keep their proportions
        one.set_aspect("equal")
        three.set_aspect(0.7)
    figure.draw_without_rendering()
    draw_arrows(figure, list(panels), down)
    theme.save(figure, path)


def main() -> None:
    """Draw both pictures."""
    matplotlib.rcParams.update({"svg.hashsalt": "overview", **theme.STYLE})
    draw(ROOT / "docs" / "overview.svg", down=False)
    draw(ROOT / "docs" / "overview_narrow.svg", down=True)


if __name__ == "__main__":
    main()
