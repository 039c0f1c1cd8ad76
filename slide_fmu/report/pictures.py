"""Pictures are made small: line drawings have few colours, so they take a fifth of the bytes.

A released FMU carries its report; without this, pictures were two thirds of the file.
"""

from __future__ import annotations

import base64
import io

from matplotlib.figure import Figure
from PIL import Image

COLOURS = 24
"""Colours of a picture: about ten lines and inks, with steps between them and white."""
DPI = 96
"""Pixels per inch: the widest picture is as wide as the report's page."""


def png(figure: Figure) -> bytes:
    """Store a figure as a PNG with a palette of a few colours."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    return with_palette(buffer.getvalue())


def with_palette(picture: bytes) -> bytes:
    """Store a PNG with a palette of a few colours, on white; one with a palette stays as it is.

    The size in pixels stays.
    """
    with Image.open(io.BytesIO(picture)) as image:
        if image.mode == "P":
            return picture
        few = _few_colours(image)
    buffer = io.BytesIO()
    few.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def as_webp(picture: bytes) -> bytes:
    """Store a PNG with few colours as lossless WebP, which takes a quarter less; browsers show it.

    A picture that has a palette keeps its colours; the size in pixels stays.
    """
    with Image.open(io.BytesIO(picture)) as image:
        few = image if image.mode == "P" else _few_colours(image)
        buffer = io.BytesIO()
        few.convert("RGB").save(buffer, "WEBP", lossless=True, quality=60, method=3)
    return buffer.getvalue()


def in_page(picture: bytes) -> str:
    """Return a PNG as the address by which a self-contained page shows it."""
    return "data:image/webp;base64," + base64.b64encode(as_webp(picture)).decode("ascii")


def _few_colours(image: Image.Image) -> Image.Image:
    """Return the picture with a palette, on white.

    The colours are chosen by maximum coverage and refined by k-means, so that a rare one, such as
    that of a single thin line, is not lost; pixels are not dithered.
    """
    opaque = Image.new("RGBA", image.size, "white")
    opaque.alpha_composite(image.convert("RGBA"))
    return opaque.convert("RGB").quantize(
        COLOURS, method=Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE
    )
