"""Pictures of the site that are right in a light and in a dark theme."""

from __future__ import annotations

import re
from pathlib import Path

from matplotlib.figure import Figure

INK, BLUE, ORANGE, RED, GREY, SHADE = (
    "#22303c",
    "#1f6fb2",
    "#d9730d",
    "#b3261e",
    "#9aa5ae",
    "#e6eaed",
)
"""Colours to draw with; each has a lighter or darker one for a dark theme."""
DARK = {
    INK: "#d8e0e6",
    BLUE: "#6db3ee",
    ORANGE: "#f5a04c",
    RED: "#ff8a80",
    GREY: "#6d7a85",
    SHADE: "#36424c",
}
STYLE = {
    "font.size": 10,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": INK,
    "axes.titlecolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}
"""For ``matplotlib.rcParams``."""


def save(figure: Figure, path: Path) -> None:
    """Write a figure as SVG whose colours follow the theme of the page that shows it."""
    figure.savefig(path, metadata={"Date": None}, transparent=True)
    path.write_text(themed(path.read_text(encoding="utf-8")), encoding="utf-8")


def themed(svg: str, dark: dict[str, str] = DARK) -> str:
    """Make the colours of a picture variables, with others for a dark theme."""
    names = {light: f"--c{number}" for number, light in enumerate(dark)}
    light = "".join(f"{names[at]}:{at};" for at in dark)
    night = "".join(f"{names[at]}:{dark[at]};" for at in dark)
    style = f"<style>svg{{{light}}}@media(prefers-color-scheme:dark){{svg{{{night}}}}}</style>"
    svg = re.sub("|".join(dark), lambda found: f"var({names[found[0]]})", svg)
    return re.sub(r"(<svg[^>]*>)", lambda found: found[1] + style, svg, count=1)
