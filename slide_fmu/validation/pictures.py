"""Small pictures: line drawings have few colours, so a palette of them takes a third of the bytes.

A released FMU carries its report; without this, its pictures were two thirds of the file.
"""

from __future__ import annotations

import base64
import io
import re

from PIL import Image

COLOURS = 24
"""Colours of a picture: about ten lines and inks, with steps between them and white."""


def with_palette(picture: bytes) -> bytes:
    """Store a picture with a palette of a few colours; one that has a palette stays as it is.

    Args:
        picture: bytes of a PNG file; what is transparent becomes white.

    Returns:
        Bytes of a PNG file of the same size in pixels. The colours are chosen by maximum
        coverage, refined by k-means, so that a rare one, such as that of a single thin line, is
        not lost; pixels are not dithered.
    """
    with Image.open(io.BytesIO(picture)) as image:
        if image.mode == "P":
            return picture
        opaque = Image.new("RGBA", image.size, "white")
        opaque.alpha_composite(image.convert("RGBA"))
    few = opaque.convert("RGB").quantize(
        COLOURS, method=Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE
    )
    buffer = io.BytesIO()
    few.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def page_with_palettes(page: str) -> str:
    """Store all pictures inside a report's page with palettes; the rest of it stays as it is."""

    def smaller(found: re.Match[str]) -> str:
        picture = with_palette(base64.b64decode(found.group(2)))
        return found.group(1) + base64.b64encode(picture).decode("ascii")

    return re.sub(r"(data:image/png;base64,)([A-Za-z0-9+/=]+)", smaller, page)
