"""The picture on the page about controllers: an FMU in an optimal-control loop.

``python docs/controllers_figure.py`` writes ``docs/controllers_figure.svg``. Nothing is measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from pathlib import Path

import theme

DOCS = Path(__file__).parent
WIDTH, HEIGHT = 640, 520
HEADS = {"blue": theme.BLUE, "orange": theme.ORANGE, "ink": theme.INK}
"""Colours of arrows by name."""


@dataclass(frozen=True)
class Box:
    """A Box has a bold first line and further lines of text."""

    x: float
    y: float
    width: float
    height: float
    colour: str
    lines: tuple[str, ...]

    def svg(self) -> str:
        """Return the box with its text in the middle."""
        middle, first = self.x + self.width / 2, self.y + self.height / 2
        first -= 11 * (len(self.lines) - 1) - 6
        texts = "".join(
            text(middle, first + 22 * k, line, bold=k == 0) for k, line in enumerate(self.lines)
        )
        return (
            f'<rect x="{self.x}" y="{self.y}" width="{self.width}" height="{self.height}" rx="8" '
            f'fill="{theme.SHADE}" stroke="{self.colour}" stroke-width="2.5"/>{texts}'
        )


def text(x: float, y: float, words: str, anchor: str = "middle", bold: bool = False) -> str:
    """Return a line of text."""
    weight = ' font-weight="bold"' if bold else ""
    return f'<text x="{x}" y="{y}" text-anchor="{anchor}"{weight}>{escape(words)}</text>'


def arrow(path: str, colour: str) -> str:
    """Return an arrow along a path."""
    return (
        f'<path d="{path}" fill="none" stroke="{HEADS[colour]}" stroke-width="2.5" '
        f'marker-end="url(#{colour})"/>'
    )


def heads() -> str:
    """Return the heads of arrows, one for each colour."""
    return "".join(
        f'<marker id="{name}" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="6" '
        f'markerHeight="6" orient="auto"><path d="M0 0L8 4L0 8z" fill="{colour}"/></marker>'
        for name, colour in HEADS.items()
    )


def parts() -> list[str]:
    """Return what is drawn: the PC above, the controller below it, and the machine."""
    return [
        text(20, 30, "on a PC, once", "start"),
        Box(20, 42, 180, 70, theme.GREY, ("slow model", "or records")).svg(),
        Box(400, 42, 220, 70, theme.GREY, ("C sources", "of the FMU")).svg(),
        arrow("M200 77H394", "ink"),
        text(297, 66, "run, then"),
        text(297, 100, "export --scalar"),
        arrow("M510 112V206", "ink"),
        f'<rect x="8" y="150" width="624" height="226" rx="12" fill="none" '
        f'stroke="{theme.GREY}" stroke-width="2" stroke-dasharray="7 6"/>',
        text(20, 176, "on the controller, in each sample", "start"),
        Box(
            28, 212, 190, 140, theme.ORANGE, ("optimiser", "adds up costs,", "keeps the best")
        ).svg(),
        Box(
            400, 212, 212, 140, theme.BLUE, ("FMU in C", "begins each time", "at its saved state")
        ).svg(),
        arrow("M218 250H394", "orange"),
        text(307, 240, "candidate inputs"),
        arrow("M400 318H224", "blue"),
        text(311, 308, "outputs, bounds"),
        Box(215, 458, 210, 50, theme.GREY, ("machine",)).svg(),
        arrow("M123 352V414H506V358", "orange"),
        arrow("M320 414V452", "orange"),
        text(136, 402, "best inputs", "start"),
        text(518, 402, "one step", "start"),
    ]


def main() -> None:
    """Draw the picture."""
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'font-family="Helvetica, Arial, sans-serif" font-size="18" fill="{theme.INK}">'
        f"<defs>{heads()}</defs>{''.join(parts())}</svg>\n"
    )
    path = DOCS / "controllers_figure.svg"
    path.write_text(theme.themed(svg), encoding="utf-8")
    print(f"{path}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
