"""The picture on the page about parameters: one FMU with an open mass over its whole range.

``python docs/parameters_figure.py`` simulates the slider-crank with ten masses of its slider under
the same drive, asks the released FMU with an open mass and the one for 1 kg for the same motions,
and writes ``docs/parameters_figure.svg``. The errors are printed.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import theme

import slide_fmu as slide
from mbs_models.slider_crank import SliderCrank

ROOT = Path(__file__).parents[1]
STEP = 1 / 32
SHOWN = (0.5, 1.0, 1.5)
"""Masses in kg whose motions are drawn."""
MASSES = np.array([0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.35, 1.5])


def main() -> None:
    """Simulate, ask both FMUs, and draw motions and errors."""
    matplotlib.rcParams.update({"svg.hashsalt": "parameters", **theme.STYLE, "font.size": 12})
    fmus = (
        ROOT / "fmus" / name / f"{name}.fmu" for name in ("slider_crank_payload", "slider_crank")
    )
    open_mass, fixed = map(slide.load, fmus)
    t = STEP * np.arange(1, 641)
    angle = 4 * t + 0.8 * np.sin(2.5 * t) + 0.6 * np.sin(0.9 * t)
    u = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    figure, (upper, lower) = plt.subplots(2, figsize=(6.4, 6), layout="constrained")
    errors, kept = [], slice(max(open_mass.window.n_in, fixed.window.n_in), None)
    colours = iter((theme.BLUE, theme.ORANGE, theme.RED))
    for mass in MASSES:
        true = SliderCrank(step=STEP, slider_mass=mass).simulate(u)[1:, 0]
        predicted = open_mass.predict_newest(u, {"slider_mass": mass})[:, 0]
        ways = predicted, fixed.predict_newest(u)[:, 0]
        errors.append([100 * np.std((way - true)[kept]) / np.std(true[kept]) for way in ways])
        if mass in SHOWN:
            upper.plot(t, 1e3 * true, theme.GREY, lw=5, alpha=0.7)
            upper.plot(t, 1e3 * predicted, next(colours), lw=2, label=f"{mass} kg")
    upper.set(xlim=(12.6, 13.5), xlabel="time / s", ylabel="deflection of the rod / mm")
    upper.set(title="One FMU, three masses of the slider (model in grey)")
    upper.legend()
    lower.semilogy(MASSES, errors, lw=2, marker="o", ms=5)
    for line, colour, name in zip(
        lower.lines,
        (theme.BLUE, theme.ORANGE),
        ("FMU with open mass", "FMU for 1 kg"),
        strict=True,
    ):
        line.set(color=colour, label=name)
    lower.set(xlabel="mass of the slider / kg", ylabel="error / %", title="Errors at ten masses")
    lower.set(ylim=(0.03, 150))
    lower.legend(loc="upper center", ncols=2)
    theme.save(figure, ROOT / "docs" / "parameters_figure.svg")
    for mass, (opened, of_one) in zip(MASSES, errors, strict=True):
        print(f"{mass} kg: {opened:.3f} % with the mass open, {of_one:.2f} % for 1 kg")


if __name__ == "__main__":
    main()
