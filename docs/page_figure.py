"""The picture on the page about pages: the robot's page, with an optimised move.

``python docs/page_figure.py`` writes the page that ``docs/page.md`` names, opens it in headless
Chromium, lets the move end, and writes ``docs/page_figure.svg``. It holds the page in a light and
in a dark theme, and names its parts.
"""

from __future__ import annotations

import base64
import io
import tempfile
from pathlib import Path

import theme
from PIL import Image

from slide_fmu.apps.motion.page_moves import solved_moves
from slide_fmu.apps.page.page import write_page
from slide_fmu.core.figures import plain
from tests.browser import Browser, browser

ROOT = Path(__file__).parents[1]
FMU = ROOT / "fmus" / "robot_6r" / "robot_6r.fmu"
TASK = ROOT / "docs" / "tutorials" / "pick_and_place.toml"
DRAWING = "mbs_models.pictures.page_drawings:robot"
SIZE = 1180, 716
"""Size of the page in pixels."""
COLOURS = 80
ENDED = "document.getElementById('play').textContent === 'Play'"
LABELS = (
    (146, 2, 178, "four ways", (236, 74)),
    (800, 2, 232, "is it known?", (600, 82)),
    (32, 594, 256, "choose a goal", (188, 548)),
    (408, 126, 284, "drag the machine", (600, 250)),
    (842, 540, 236, "the answer", (1003, 470)),
)
"""Left and upper end and width of each label, its words, and the place that it names."""


def picture(page: Browser, folder: Path, dark: bool) -> str:
    """Return the page as PNG of few colours, in base 64."""
    path = folder / "page.png"
    page.resize(*SIZE, dark=dark)
    page.open(folder / "robot.html", "#way=moves")
    page.until(ENDED)
    page.screenshot(path)
    buffer = io.BytesIO()
    with Image.open(path) as found:
        few = found.convert("RGB").quantize(
            COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE
        )
    few.save(buffer, "PNG", optimize=True)
    return base64.b64encode(buffer.getvalue()).decode()


def label(x: float, y: float, width: float, words: str, place: tuple[float, float]) -> str:
    """Return a label, and a line from it to the place that it names."""
    ends = f'x1="{x + width / 2}" y1="{y + 20}" x2="{place[0]}" y2="{place[1]}"'
    return (
        f'<line {ends} stroke="{theme.RED}" stroke-width="3"/>'
        f'<circle cx="{place[0]}" cy="{place[1]}" r="6" fill="{theme.RED}"/>'
        f'<rect x="{x}" y="{y}" width="{width}" height="39" rx="19" fill="{theme.RED}"/>'
        f'<text class="label" x="{x + width / 2}" y="{y + 30}">{words}</text>'
    )


def main() -> None:
    """Write the page, and its picture."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        moves = plain(solved_moves(FMU, TASK))
        write_page(FMU, folder / "robot.html", drawing=DRAWING, moves=moves)
        with browser(folder / "profile") as page:
            light, dark = (picture(page, folder, is_dark) for is_dark in (False, True))
    images = "".join(
        f'<image class="{name}" width="{SIZE[0]}" height="{SIZE[1]}" '
        f'href="data:image/png;base64,{data}"/>'
        for name, data in (("light", light), ("dark", dark))
    )
    style = (
        "<style>.dark{display:none}.label{font:bold 30px Helvetica,Arial,sans-serif;"
        "text-anchor:middle;fill:#fff}@media(prefers-color-scheme:dark){.light{display:none}"
        ".dark{display:inline}.label{fill:#111}}</style>"
    )
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIZE[0]} {SIZE[1]}">{style}'
        f"{images}{''.join(label(*one) for one in LABELS)}</svg>\n"
    )
    path = ROOT / "docs" / "page_figure.svg"
    path.write_text(theme.themed(svg), encoding="utf-8")
    print(f"{path}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
