"""The surface that everything is drawn on: shapes in pixels or metres in, PNG bytes out.

Pillow draws without antialiasing, so the surface is three times as fine as the picture and is
averaged down at the end. Coordinates and widths are picture pixels all the same.
"""

from __future__ import annotations

import copy
import io
from collections.abc import Callable
from functools import cache

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from augment.geometry.polyline import FloatArray
from augment.render.camera import Camera
from augment.render.palette import Colour
from augment.render.shapes import dashes

Box = tuple[float, float, float, float]

FINENESS = 3


class Canvas:
    """A picture in the making, addressed in pixels.

    Args:
        width_px: Of the finished picture.
        height_px: Of the finished picture.
        background: The colour of the empty picture.
    """

    def __init__(self, width_px: int, height_px: int, background: Colour) -> None:
        self.width_px = width_px
        self.height_px = height_px
        self._texts: list[Callable[[ImageDraw.ImageDraw], None]] = []
        self._draw_on(Image.new("RGB", (width_px * FINENESS, height_px * FINENESS), background))

    def copy(self) -> Canvas:
        """The same picture on a surface of its own."""
        made = copy.copy(self)
        made._texts = list(self._texts)
        made._draw_on(self._image.copy())
        return made

    def fill(self, points_px: FloatArray, colour: Colour) -> None:
        """A filled polygon through points (P, 2)."""
        self._pen(colour).polygon(_fine(points_px), fill=colour)

    def stroke(
        self, points_px: FloatArray, colour: Colour, width_px: float, *, closed: bool = False
    ) -> None:
        """A line through points (P, 2) with round joints."""
        points = np.vstack([points_px, points_px[:2]]) if closed else points_px
        self._pen(colour).line(
            _fine(points), fill=colour, width=max(1, round(width_px * FINENESS)), joint="curve"
        )

    def dashed(
        self, points_px: FloatArray, colour: Colour, width_px: float, on_px: float, off_px: float
    ) -> None:
        """A dashed line through points (P, 2); what lies outside the picture costs nothing."""
        pen, width = self._pen(colour), max(1, round(width_px * FINENESS))
        pieces = dashes(points_px, on_px, off_px)
        size = np.array([self.width_px, self.height_px])
        seen = ((pieces.max(axis=1) >= 0.0) & (pieces.min(axis=1) <= size)).all(axis=1)
        for piece in pieces[seen]:
            pen.line(_fine(piece), fill=colour, width=width)

    def disc(
        self,
        centre_px: tuple[float, float],
        radius_px: float,
        colour: Colour | None,
        *,
        outline: Colour | None = None,
        outline_px: float = 0.0,
    ) -> None:
        """A circle; its outline lies inside the radius."""
        x, y = centre_px
        box = [
            (x - radius_px) * FINENESS - 0.5,
            (y - radius_px) * FINENESS - 0.5,
            (x + radius_px) * FINENESS - 0.5,
            (y + radius_px) * FINENESS - 0.5,
        ]
        self._solid.ellipse(
            box, fill=colour, outline=outline, width=round(outline_px * FINENESS) if outline else 0
        )

    def plate(self, box_px: Box, colour: Colour, outline: Colour | None, radius_px: float) -> None:
        """A rectangle (left, top, right, bottom) with round corners and a thin outline."""
        box = [value * FINENESS - 0.5 for value in box_px]
        width = FINENESS if outline else 0
        pen = self._pen(colour)
        pen.rounded_rectangle(box, radius_px * FINENESS, fill=colour, outline=outline, width=width)

    def text(
        self,
        at_px: tuple[float, float],
        text: str,
        colour: Colour,
        size_px: int,
        *,
        anchor: str = "mm",
        halo: Colour | None = None,
    ) -> None:
        """Text at a point, above everything else; the anchor is Pillow's ("mm" for its middle).

        The font is smooth by itself, so text is set at the end and in the picture's own size.
        """
        self._texts.append(
            lambda pen: pen.text(
                at_px,
                text,
                fill=colour,
                font=_font(size_px),
                anchor=anchor,
                stroke_width=2 if halo else 0,
                stroke_fill=halo,
            )
        )

    def png(self) -> bytes:
        """The finished picture: the same drawing gives the same bytes, and no metadata."""
        finished = self._image.reduce(FINENESS)
        pen = ImageDraw.Draw(finished)
        for write in self._texts:
            write(pen)
        stream = io.BytesIO()
        finished.save(stream, format="PNG", compress_level=6)
        return stream.getvalue()

    def _draw_on(self, image: Image.Image) -> None:
        self._image = image
        self._solid = ImageDraw.Draw(image)
        self._glass = ImageDraw.Draw(image, "RGBA")

    def _pen(self, colour: Colour) -> ImageDraw.ImageDraw:
        # Blending is slower than covering, so only see-through colours pay for it.
        return self._glass if len(colour) == 4 else self._solid


class MetricCanvas:
    """A canvas addressed in metres of the ego frame; widths and dashes of lines stay in pixels."""

    def __init__(self, canvas: Canvas, camera: Camera) -> None:
        self.canvas = canvas
        self.camera = camera

    def copy(self) -> MetricCanvas:
        """The same on a surface of its own."""
        return MetricCanvas(self.canvas.copy(), self.camera)

    def fill(self, points_m: FloatArray, colour: Colour) -> None:
        """A filled polygon through points (P, 2)."""
        self.canvas.fill(self.camera.to_pixels(points_m), colour)

    def stroke(
        self, points_m: FloatArray, colour: Colour, width_px: float, *, closed: bool = False
    ) -> None:
        """A line through points (P, 2)."""
        self.canvas.stroke(self.camera.to_pixels(points_m), colour, width_px, closed=closed)

    def dashed(
        self, points_m: FloatArray, colour: Colour, width_px: float, on_m: float, off_m: float
    ) -> None:
        """A dashed line through points (P, 2), the dashes in metres."""
        scale = self.camera.px_per_m
        self.canvas.dashed(
            self.camera.to_pixels(points_m), colour, width_px, on_m * scale, off_m * scale
        )

    def at(self, x_m: float, y_m: float) -> tuple[float, float]:
        """A point in pixels."""
        x, y = self.camera.to_pixels(np.array([[x_m, y_m]]))[0]
        return float(x), float(y)


def text_width_px(text: str, size_px: int) -> float:
    """How wide a text will be in the picture."""
    return float(_font(size_px).getlength(text))


@cache
def _font(size_px: int) -> ImageFont.FreeTypeFont:
    # Pillow's own embedded font: a picture must not depend on what the computer has installed.
    font = ImageFont.load_default(size_px)
    if not isinstance(font, ImageFont.FreeTypeFont):
        raise RuntimeError("Pillow was built without FreeType; the pictures need it")
    return font


def _fine(points_px: FloatArray) -> list[tuple[float, float]]:
    """Continuous coordinates as Pillow's, where a whole number is the middle of a pixel."""
    fine = np.asarray(points_px, dtype=np.float64) * FINENESS - 0.5
    return [(float(x), float(y)) for x, y in fine]
