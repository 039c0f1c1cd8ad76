"""Small pictures: line drawings have few colours, so they take a fifth of the bytes.

A released FMU carries its report; without this, pictures were two thirds of the file.
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
        Bytes of a PNG file of the same size in pixels.
    """
    with Image.open(io.BytesIO(picture)) as image:
        if image.mode == "P":
            return picture
        few = _few_colours(image)
    buffer = io.BytesIO()
    few.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def as_webp(picture: bytes) -> bytes:
    """Store a picture with few colours as WebP, which takes a quarter less than PNG.

    Args:
        picture: bytes of a PNG file; one that has a palette keeps its colours.

    Returns:
        Bytes of a lossless WebP file of the same size in pixels; every browser shows it.
    """
    with Image.open(io.BytesIO(picture)) as image:
        few = image if image.mode == "P" else _few_colours(image)
        buffer = io.BytesIO()
        few.convert("RGB").save(buffer, "WEBP", lossless=True, quality=60, method=3)
    return buffer.getvalue()


def in_page(picture: bytes) -> str:
    """A picture (bytes of a PNG file) as the address that a self-contained page shows it by."""
    return "data:image/webp;base64," + base64.b64encode(as_webp(picture)).decode("ascii")


def with_small_pictures(page: str) -> str:
    """The page of a report with all PNG pictures in it as ``in_page`` has them; text stays."""
    return re.sub(
        r"data:image/png;base64,([A-Za-z0-9+/=]+)",
        lambda found: in_page(base64.b64decode(found.group(1))),
        page,
    )


def _few_colours(image: Image.Image) -> Image.Image:
    """The picture with a palette, on white.

    The colours are chosen by maximum coverage and refined by k-means, so that a rare one, such as
    that of a single thin line, is not lost; pixels are not dithered.
    """
    opaque = Image.new("RGBA", image.size, "white")
    opaque.alpha_composite(image.convert("RGBA"))
    return opaque.convert("RGB").quantize(
        COLOURS, method=Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE
    )
