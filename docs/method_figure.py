"""The picture on the page about the method: two motions that start apart meet within the window.

``python docs/method_figure.py`` simulates the Duffing oscillator twice under the same force, from
rest and from a state far away, and writes ``docs/method_figure.svg``.
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
    figure, (upper, lower) = plt.subplots(2, figsize=(8, 4.6), sharex=True, layout="constrained")
    upper.plot(times, rest, theme.BLUE, label="from rest")
    upper.plot(times, thrown, theme.ORANGE, label="held far away before")
    upper.set(ylabel="position / m", ylim=(-0.85, 1.0), title="Two motions under the same force")
    upper.legend(frameon=False, loc="upper right", ncols=2)
    lower.semilogy(times, apart, theme.INK, label="distance, relative to the first")
    lower.semilogy(
        times, np.exp(rate * times), "--", color=theme.RED, label="exp(Re v t) of the eigenvalue"
    )
    lower.set(xlabel="time / s", ylabel="distance", ylim=(1e-5, 3), xlim=(0, times[-1]))
    for axes in (upper, lower):
        axes.axvspan(0, window.truncation_time, color=theme.SHADE, zorder=0)
    lower.text(0.02, 3e-5, f"truncated: {window.n_truncated} samples", color=theme.INK)
    lower.legend(frameon=False, loc="upper right")
    theme.save(figure, ROOT / "docs" / "method_figure.svg")


if __name__ == "__main__":
    main()
