"""Frames per second of pages in headless Chromium, on a processor that is slowed down.

    python tests/benchmarks/page_frames.py --json -

Each page runs live, with its machine drawn, for some seconds with CPU throttling: a rate
of 4 leaves it a quarter of the time. ``frames`` is the number of animation frames in a second, and
``drawn`` the number of frames in which the machine was drawn.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

from figures_out import measure_and_write

from slide_fmu.apps.page.page import write_page
from slide_fmu.core.progress import Stages
from tests.browser import Browser, browser

FMUS = Path(__file__).parents[2] / "fmus"
DRAWINGS = {"robot_6r": "robot", "slider_crank": "slider_crank", "duffing": "oscillator"}

COUNT = """
new Promise((done) => {
  const canvas = document.getElementById("drawing-canvas");
  const context = canvas.getContext("2d");
  const clear = context.clearRect.bind(context);
  let drawn = 0;
  let frames = 0;
  context.clearRect = (...box) => {
    drawn += 1;
    clear(...box);
  };
  const begin = performance.now();
  const frame = (now) => {
    frames += 1;
    if (now - begin < 1000 * SECONDS) {
      requestAnimationFrame(frame);
    } else {
      const seconds = (performance.now() - begin) / 1000;
      done({ frames: frames / seconds, drawn: drawn / seconds });
    }
  };
  requestAnimationFrame(frame);
})
"""


def frames_of(chromium: Browser, page: Path, rate: float, seconds: float) -> dict[str, float]:
    """Return the frames per second of a page with its inputs wandering."""
    chromium.resize(1400, 900)
    chromium.open(page)
    chromium.call("Emulation.setCPUThrottlingRate", rate=rate)
    chromium.evaluate("new Promise((done) => setTimeout(done, 3000))")
    found = chromium.evaluate(COUNT.replace("SECONDS", str(seconds)))
    chromium.call("Emulation.setCPUThrottlingRate", rate=1)
    return dict(found)


def measure(arguments: argparse.Namespace, bar: Stages) -> dict[str, Any]:
    """Return the frames per second of every page."""
    found: dict[str, Any] = {}
    show = bar("pages")
    with tempfile.TemporaryDirectory() as name, browser(Path(name) / "profile") as chromium:
        for number, (model, drawing) in enumerate(DRAWINGS.items()):
            page = write_page(
                FMUS / model / f"{model}.fmu",
                Path(name) / f"{model}.html",
                drawing=f"mbs_models.pictures.page_drawings:{drawing}",
            )
            rounds = [
                frames_of(chromium, page, arguments.rate, arguments.seconds)
                for _ in range(arguments.rounds)
            ]
            found[model] = max(rounds, key=lambda each: each["frames"])
            show(number + 1, len(DRAWINGS))
    return found


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rate", type=float, default=4.0, help="of Chromium's CPU throttling")
    parser.add_argument("--seconds", type=float, default=4.0, help="of each round")
    parser.add_argument("--rounds", type=int, default=2, help="of which the best counts")
    measure_and_write(parser, measure)


if __name__ == "__main__":
    main()
