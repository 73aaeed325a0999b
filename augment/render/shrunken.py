"""A drawn picture made smaller, for sheets of many: a PNG's bytes in, colours or a PNG out."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

# As many colours as leave the soft edges of what is made smaller soft.
_COLOURS = 64
MOST_PIXELS = 16_000_000
"""Far more than is drawn; an imported study may hold any file as its picture."""


def shrink(png: bytes, widest: int) -> NDArray[np.uint8]:
    """The colours (H, W, 3) of a picture, by a whole factor so small that it is no wider.

    Args:
        png: The bytes of a picture that `bev` drew, or any other PNG.
        widest: In pixels, 1 or more; a picture that is no wider stays as it is.
    """
    return np.asarray(_smaller(png, widest))


def shrink_png(png: bytes, widest: int) -> bytes:
    """The same as a PNG of few colours; the same bytes for the same picture."""
    few = _smaller(png, widest).quantize(
        _COLOURS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE
    )
    stream = io.BytesIO()
    few.save(stream, format="png", compress_level=9)
    return stream.getvalue()


def _smaller(png: bytes, widest: int) -> Image.Image:
    with Image.open(io.BytesIO(png), formats=("PNG",)) as picture:
        if picture.width * picture.height > MOST_PIXELS:
            raise ValueError(f"a picture of {picture.width} x {picture.height} pixels")
        factor = -(-picture.width // widest)
        colours = picture.convert("RGB")
    return colours.reduce(factor) if factor > 1 else colours
