"""The pictures on the page about the method: two motions meet, and what a window holds.

``python docs/method_figure.py`` simulates the Duffing oscillator twice under the same force, from
rest and from a state far away. It writes ``docs/method_figure.svg`` and, with one window of the
released FMU, ``docs/window.svg``.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import theme

import slide_fmu as slide
from mbs_models.oscillators import DuffingOscillator

ROOT = Path(__file__).parents[1]


def main() -> None:
    """Simulate, and draw both motions and how far they are apart."""
    matplotlib.rcParams.update({"svg.hashsalt": "method", **theme.STYLE})
    window = slide.load(ROOT / "fmus" / "duffing" / "duffing.fmu").window
    system = DuffingOscillator(step=window.step, substeps=12)
    rng = np.random.default_rng(20261122)
    force = rng.uniform(-500, 500, 20).repeat(6)[:, None]
    rest = system.simulate(np.vstack([np.zeros((40, 1)), force]))[40:, 0]
    thrown = system.simulate(np.vstack([np.full((40, 1), 900.0), force]))[40:, 0]
    times = window.step * np.arange(len(rest))
    apart = np.maximum(np.abs(thrown - rest), 1e-9) / abs(thrown[0] - rest[0])
    # m x'' + d x' + k x: the slowest eigenvalue of the linear part has the real part -d / (2 m)
    rate = -8.0 / 2.0
    figure, (upper, lower) = plt.subplots(2, figsize=(6.6, 4.2), sharex=True, layout="constrained")
    upper.plot(times, rest, theme.BLUE, label="from rest")
    upper.plot(times, thrown, theme.ORANGE, label="held far away before")
    upper.set(ylabel="position / m", ylim=(-0.85, 1.0), title="Two motions under the same force")
    upper.legend(frameon=False, loc="upper right", ncols=2)
    lower.semilogy(times, apart, theme.INK, label="distance, relative to the first")
    lower.semilogy(
        times, np.exp(rate * times), "--", color=theme.RED, label="exp(Re λ t) of the eigenvalue"
    )
    lower.set(xlabel="time / s", ylabel="distance", ylim=(1e-5, 3), xlim=(0, times[-1]))
    for axes in (upper, lower):
        axes.axvspan(0, window.truncation_time, color=theme.SHADE, zorder=0)
    lower.text(0.02, 3e-5, f"truncated: {window.n_truncated} samples", color=theme.INK)
    lower.legend(frameon=False, loc="upper right")
    theme.save(figure, ROOT / "docs" / "method_figure.svg")
    draw_window(window)


def draw_window(window: slide.Window) -> None:
    """Draw the inputs that a window holds, and the outputs that it gives."""
    rng = np.random.default_rng(20261125)
    force = rng.uniform(-700, 700, window.n_in // 6 + 1).repeat(6)[: window.n_in]
    system = DuffingOscillator(step=window.step, substeps=12)
    position = system.simulate(force[:, None])[1:, 0]
    at, cut = np.arange(window.n_in), window.n_truncated
    figure, (upper, lower) = plt.subplots(2, figsize=(6.6, 3.2), sharex=True, layout="constrained")
    upper.step(at, force / 1000, where="post", color=theme.BLUE, lw=1)
    lower.plot(at[cut:], position[cut:], color=theme.ORANGE, lw=1.2)
    for axes in (upper, lower):
        axes.axvspan(0, cut, color=theme.SHADE, zorder=0, lw=0)
    text = {"ha": "center", "color": theme.INK}
    for axes, name in ((upper, "the past dies out"), (lower, "truncated:\nno output")):
        axes.text(cut / 2, axes.get_ylim()[1], name, va="top", size=9, **text)
    upper.set(ylabel="force / kN", xlim=(0, window.n_in), title="inputs that the network sees")
    lower.set(ylabel="position / m", xlabel=f"sample of the window, of {window.n_in}")
    lower.set_title("outputs that it gives")
    theme.save(figure, ROOT / "docs" / "window.svg")


if __name__ == "__main__":
    main()
