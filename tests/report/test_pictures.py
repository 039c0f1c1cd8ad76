"""Pictures with palettes: smaller, and still the same drawing."""

from __future__ import annotations

import io

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from slide_fmu.report.chart_pictures import COLOURS, with_palette

RARE = "#2ca02c"
APART = 16
"""Largest difference of a colour in its palette, of 255: not to be seen on a thin line."""


def drawing() -> bytes:
    """Lines in the colours of the report, one of them thin and short."""
    figure = Figure(figsize=(6, 4))
    ax = figure.subplots()
    time = np.linspace(0, 20, 800)
    for shift, colour in enumerate(("#222222", "#1f77b4", "#d62728", "#ff7f0e")):
        ax.plot(time, np.sin(3 * time + shift), color=colour, label=colour)
    ax.plot([1, 4], [1.5, 1.5], color=RARE, lw=1.5)
    ax.legend()
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100)
    return buffer.getvalue()


def shaded() -> bytes:
    """A picture of many colours."""
    buffer = io.BytesIO()
    Image.radial_gradient("L").convert("RGB").save(buffer, "PNG")
    return buffer.getvalue()


def pixels(picture: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(picture)).convert("RGB"), dtype=int)


def test_drawing_with_palette_takes_less_than_half() -> None:
    before = drawing()
    assert len(with_palette(before)) < 0.5 * len(before)


def test_drawing_with_palette_has_its_size_and_its_rare_colour() -> None:
    before, after = pixels(drawing()), pixels(with_palette(drawing()))
    assert after.shape == before.shape
    assert len(np.unique(after.reshape(-1, 3), axis=0)) <= COLOURS
    rare = np.array([int(RARE[i : i + 2], 16) for i in (1, 3, 5)])
    line = (np.abs(before - rare) <= 2).all(axis=2)
    assert line.sum() > 50
    assert np.abs(after[line] - rare).max() <= APART
    assert np.abs(after - before).mean() < 2


def test_picture_that_has_a_palette_stays_as_it_is() -> None:
    once = with_palette(drawing())
    assert with_palette(once) is once


def test_what_is_transparent_becomes_white() -> None:
    buffer = io.BytesIO()
    Image.new("RGBA", (4, 4), (255, 0, 0, 0)).save(buffer, "PNG")
    assert (pixels(with_palette(buffer.getvalue())) == 255).all()
