"""A drawn picture made smaller, for sheets of many: a PNG's bytes in, colours out."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image


def shrink(png: bytes, widest: int) -> NDArray[np.uint8]:
    """The colours (H, W, 3) of a picture, by a whole factor so small that it is no wider.

    Args:
        png: The bytes of a picture that `bev` drew, or any other PNG.
        widest: In pixels, 1 or more; a picture that is no wider stays as it is.
    """
    with Image.open(io.BytesIO(png)) as picture:
        factor = -(-picture.width // widest)
        colours = picture.convert("RGB")
    return np.asarray(colours.reduce(factor) if factor > 1 else colours)
