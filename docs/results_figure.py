"""The picture on the page of results: errors of the paper and errors here.

``python docs/results_figure.py`` reads the first table of ``docs/results.md``, prints the pairs of
errors that it finds, and draws them to ``docs/results_figure.svg``. A row is drawn if it gives an
error in both columns.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import theme

DOCS = Path(__file__).parent
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")
NO_ERRORS = ("speed-up", "decay time")
"""Rows that begin so give no errors."""


@dataclass(frozen=True)
class Pair:
    """A Pair is a row of the table: the paper's error, from low to high, and the error here."""

    name: str
    paper: str
    here: str

    @property
    def low(self) -> float:
        """The least error of the paper."""
        return float(NUMBER.findall(self.paper)[0])

    @property
    def high(self) -> float:
        """The largest error of the paper, where it gives a range."""
        return float(NUMBER.findall(self.paper)[1]) if ".." in self.paper else self.low

    @property
    def own(self) -> float:
        """The error here; of mean and standard deviation the mean."""
        return float(NUMBER.findall(self.here)[0])


def pairs() -> list[Pair]:
    """Return the rows of the table with errors in both columns."""
    text = (DOCS / "results.md").read_text(encoding="utf-8")
    table = text[text.index("| | paper | here |") :].split("\n\n")[0]
    rows = [[cell.strip() for cell in line.split("|")[1:4]] for line in table.splitlines()[2:]]
    return [
        Pair(name, paper, here)
        for name, paper, here in rows
        if paper and here and not name.startswith(NO_ERRORS)
    ]


def main() -> None:
    """Print the pairs, and draw each as a line from the paper's error to the error here."""
    matplotlib.rcParams.update({"svg.hashsalt": "results", **theme.STYLE, "font.size": 12})
    compared = pairs()
    figure, axes = plt.subplots(figsize=(6.4, 0.62 * len(compared) + 1.1), layout="constrained")
    for row, pair in enumerate(compared):
        own = pair.own / pair.low
        axes.plot([own, 1], [row, row], color=theme.SHADE, lw=6, solid_capstyle="butt", zorder=1)
        axes.plot([1, pair.high / pair.low], [row, row], color=theme.GREY, lw=4, zorder=2)
        axes.plot(1, row, "o", color=theme.GREY, ms=9, zorder=3)
        axes.plot(own, row, "o", color=theme.BLUE, ms=11, zorder=3)
        axes.text(0.0093, row - 0.28, pair.name, size=11, va="bottom")
        axes.text(
            0.0093, row, f"{own:.2g} times", size=11, color=theme.BLUE, va="center", weight="bold"
        )
        print(f"{pair.name}: paper {pair.paper}, here {pair.here}, {own:.2g} times")
    axes.set(xscale="log", xlim=(0.009, 2.4), ylim=(len(compared) - 0.5, -0.9))
    axes.set(xlabel="error relative to that of the paper", yticks=[])
    axes.set_xticks([0.03, 0.1, 0.3, 1], ["0.03", "0.1", "0.3", "1"])
    axes.minorticks_off()
    axes.spines["left"].set_visible(False)
    for name, colour in (("here", theme.BLUE), ("paper", theme.GREY)):
        axes.plot([], [], "o", color=colour, ms=10, label=name)
    figure.legend(loc="outside upper right", ncols=2)
    theme.save(figure, DOCS / "results_figure.svg")


if __name__ == "__main__":
    main()
