"""The picture of inputs that move: what an importer gets that knows only their present values.

``python docs/moving_inputs_figure.py`` runs the released slider-crank with its inputs known, and
as an ordinary importer does, and writes ``docs/moving_inputs.svg``.
"""

from __future__ import annotations

from pathlib import Path

import fmpy
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import theme

import slide_fmu as slide

ROOT = Path(__file__).parents[1]
FMU = ROOT / "fmus" / "slider_crank" / "slider_crank.fmu"
SHOWN = (4.0, 4.9)
"""Times in s between which outputs are shown."""


def main() -> None:
    """Simulate three times, and draw."""
    matplotlib.rcParams.update(theme.STYLE | {"svg.hashsalt": "moving", "font.size": 11})
    step = slide.load(FMU).window.step
    time = step * np.arange(round(SHOWN[1] / step) + 2)
    angle = 3.0 * np.sin(2.5 * time)
    director = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    table = np.empty(len(time), [("time", float), ("director_x", float), ("director_y", float)])
    table["time"], table["director_x"], table["director_y"] = time, *director.T
    known = slide.simulate(FMU, time, director)[:, 0]
    figure, axes = plt.subplots(figsize=(7, 3.4), layout="constrained")
    axes.plot(time, 1e3 * known, color=theme.GREY, lw=6, alpha=0.6, label="input known")
    looks = ((0, theme.BLUE, "0: forecast"), (1, theme.ORANGE, "1: one step late"))
    for at_step_end, colour, label in looks:
        outputs = fmpy.simulate_fmu(
            str(FMU),
            stop_time=time[-1],
            output_interval=step,
            input=table,
            start_values={"inputs_at_step_end": at_step_end},
        )
        axes.plot(outputs["time"], 1e3 * outputs["deflection"], ".-", color=colour, label=label)
    axes.set(xlim=SHOWN, ylim=(-60, 60), xlabel="time / s", ylabel="deflection of the rod / mm")
    figure.legend(title="inputs_at_step_end", loc="outside upper center", ncols=3)
    theme.save(figure, ROOT / "docs" / "moving_inputs.svg")


if __name__ == "__main__":
    main()
