"""Draw the icon of FMUs; ``python -m slide_fmu.fmu.attachments.draw_icon`` writes it again.

It shows a response that dies out within a window, and the window.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import style
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

ICON = Path(__file__).parent / "icon.png"
PIXELS = 100
"""Width and height."""


def draw_icon(path: Path) -> None:
    """Write the icon to a file, without the version of matplotlib.

    It does not depend on the settings of matplotlib. Lines are not snapped to pixels: for a line
    on the border of two pixels, rounding would differ between machines.
    """
    with style.context("default"):
        figure = Figure(figsize=(1, 1), dpi=PIXELS)
        FigureCanvasAgg(figure)
        axes = figure.add_axes((0.04, 0.04, 0.92, 0.92))
        time = np.linspace(0.0, 1.0, 400)
        axes.axvspan(0.25, 0.97, color="#cfd8dc")
        axes.axhline(0.0, color="#90a4ae", lw=1)
        axes.plot(time, np.exp(-4 * time) * np.cos(24 * time), color="#455a64", lw=2)
        axes.plot(time[-1], 0.0, "o", color="#d84315", ms=6, clip_on=False)
        axes.set(xlim=(0, 1), ylim=(-1.1, 1.1), xticks=[], yticks=[])
        for spine in axes.spines.values():
            spine.set_color("#455a64")
        for artist in figure.findobj(Artist):
            artist.set_snap(False)
        figure.savefig(path, metadata={"Software": None})


if __name__ == "__main__":
    draw_icon(ICON)
    print(ICON)
