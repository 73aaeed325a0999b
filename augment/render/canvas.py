"""The surface that everything is drawn on: shapes in pixels or metres in, PNG bytes out.

A picture is addressed in the pixels that it takes on an ordinary screen and has twice as many
each way: on the voting page it is smooth, and when zoomed still sharp. One byte a pixel, a number
in the palette: nothing is blended, so that drawing, copying and packing are quick. Coordinates and
widths are picture pixels all the same.
"""

from __future__ import annotations

import copy
import io
from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.camera import Camera
from augment.render.palette import Colour
from augment.render.shapes import dashes

Box = tuple[float, float, float, float]

DENSITY = 2
# Thinner lines show no notch where they turn; straighter ones neither.
_NOTCH_PX = 1.5
_NOTCH_COS = 0.9
# Larger files below, slower above.
_COMPRESS_LEVEL = 3

_INKS = palette.inks()
_FLAT_PALETTE = [value for colour in _INKS for value in colour]


class Canvas:
    """A picture in the making, addressed in pixels.

    Args:
        width_px: Of the picture on an ordinary screen.
        height_px: Of the same.
        background: The colour of the empty picture.
    """

    def __init__(self, width_px: int, height_px: int, background: Colour) -> None:
        self.width_px = width_px
        self.height_px = height_px
        self._texts: list[Callable[[Canvas], None]] = []
        size = (width_px * DENSITY, height_px * DENSITY)
        image = Image.new("P", size, _INKS[background])
        image.putpalette(_FLAT_PALETTE)
        self._draw_on(image)

    def copy(self) -> Canvas:
        """The same picture on a surface of its own."""
        twin = copy.copy(self)
        twin._texts = list(self._texts)
        twin._draw_on(self._image.copy())
        return twin

    def fill(self, points_px: FloatArray, colour: Colour) -> None:
        """A filled polygon through points (P, 2)."""
        self._pen.polygon(_fine(points_px), fill=_INKS[colour])

    def stroke(
        self, points_px: FloatArray, colour: Colour, width_px: float, *, closed: bool = False
    ) -> None:
        """A line through points (P, 2) with round joints."""
        points = np.vstack([points_px, points_px[:2]]) if closed else np.asarray(points_px)
        width = max(1, round(width_px * DENSITY))
        self._pen.line(_fine(points), fill=_INKS[colour], width=width)
        if width_px > _NOTCH_PX:
            for x, y in _sharp_turns(points).tolist():
                self.disc((x, y), width_px / 2.0, colour)

    def dashed(
        self, points_px: FloatArray, colour: Colour, width_px: float, on_px: float, off_px: float
    ) -> None:
        """A dashed line through points (P, 2); what lies outside the picture costs nothing."""
        ink, width = _INKS[colour], max(1, round(width_px * DENSITY))
        pieces = dashes(points_px, on_px, off_px)
        size = np.array([self.width_px, self.height_px])
        seen = ((pieces.max(axis=1) >= 0.0) & (pieces.min(axis=1) <= size)).all(axis=1)
        for piece in _in_pixels(pieces[seen]).reshape(-1, 4).tolist():
            self._pen.line(piece, fill=ink, width=width)

    def disc(
        self,
        centre_px: tuple[float, float],
        radius_px: float,
        colour: Colour,
        *,
        outline: Colour | None = None,
        outline_px: float = 0.0,
    ) -> None:
        """A circle; its outline lies inside the radius."""
        x, y = centre_px
        box = [
            (x - radius_px) * DENSITY - 0.5,
            (y - radius_px) * DENSITY - 0.5,
            (x + radius_px) * DENSITY - 0.5,
            (y + radius_px) * DENSITY - 0.5,
        ]
        self._pen.ellipse(
            box,
            fill=_INKS[colour],
            outline=_INKS[outline] if outline else None,
            width=round(outline_px * DENSITY) if outline else 0,
        )

    def plate(self, box_px: Box, colour: Colour, outline: Colour | None, radius_px: float) -> None:
        """A rectangle (left, top, right, bottom) with round corners and a thin outline."""
        self._pen.rounded_rectangle(
            [value * DENSITY - 0.5 for value in box_px],
            radius_px * DENSITY,
            fill=_INKS[colour],
            outline=_INKS[outline] if outline else None,
            width=DENSITY if outline else 0,
        )

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

        Ink without a halo is smooth where it stands on paper; all other text has hard edges.
        """
        if colour == palette.INK and halo is None:
            self._texts.append(lambda on: on._smooth(at_px, text, size_px, anchor))
            return
        self._texts.append(
            lambda on: on._pen.text(
                (at_px[0] * DENSITY, at_px[1] * DENSITY),
                text,
                fill=_INKS[colour],
                font=_font(size_px * DENSITY),
                anchor=anchor,
                stroke_width=2 * DENSITY if halo else 0,
                stroke_fill=_INKS[halo] if halo else None,
            )
        )

    def holds(self, points_px: FloatArray, colours: tuple[Colour, ...]) -> NDArray[np.bool_]:
        """At which of points (N, 2) one of the colours lies, (N,); nowhere outside the picture."""
        cells = np.floor(np.asarray(points_px) * DENSITY).astype(np.int64)
        size = np.array(self._image.size)
        within = ((cells >= 0) & (cells < size)).all(axis=1)
        inside = np.zeros(len(cells), dtype=bool)
        pixels = np.asarray(self._image)[cells[within, 1], cells[within, 0]]
        inside[within] = np.isin(pixels, [_INKS[colour] for colour in colours])
        return inside

    def png(self, *, halved: bool = False) -> bytes:
        """The finished picture: the same drawing gives the same bytes, and no metadata.

        Args:
            halved: Give one pixel for each of the picture's, blended, in full colour: for those
                who pay by the pixel.
        """
        image = self._finished()
        if halved:
            image = image.convert("RGB").reduce(DENSITY)
        return _packed(image)

    def _finished(self) -> Image.Image:
        """With its texts."""
        finished = self.copy()
        for write in self._texts:
            write(finished)
        return finished._image

    def _smooth(self, at_px: tuple[float, float], text: str, size_px: int, anchor: str) -> None:
        """Ink with soft edges: its steps towards paper are colours of the palette."""
        font = _font(size_px * DENSITY)
        x, y = (round(value * DENSITY) for value in at_px)
        box = tuple(round(value) for value in font.getbbox(text, anchor=anchor))
        left, top = box[0] - 1, box[1] - 1
        mask = Image.new("L", (box[2] - left + 2, box[3] - top + 2))
        ImageDraw.Draw(mask).text((-left, -top), text, fill=255, font=font, anchor=anchor)
        self._image.paste(mask.point(_ramp()), (x + left, y + top), mask.point(_is_inked()))

    def _draw_on(self, image: Image.Image) -> None:
        self._image = image
        self._pen = ImageDraw.Draw(image)
        self._pen.fontmode = "1"


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

    def holds(self, points_m: FloatArray, colours: tuple[Colour, ...]) -> NDArray[np.bool_]:
        """At which of points (N, 2) one of the colours lies so far, (N,)."""
        return self.canvas.holds(self.camera.to_pixels(points_m), colours)

    def at(self, x_m: float, y_m: float) -> tuple[float, float]:
        """A point in pixels."""
        x, y = self.camera.to_pixels(np.array([[x_m, y_m]]))[0]
        return float(x), float(y)


def stack_png(above: Canvas, below: Canvas) -> bytes:
    """Two pictures of one width as one, one above the other, halved as `Canvas.png` says."""
    images = [one._finished().convert("RGB").reduce(DENSITY) for one in (above, below)]
    height_px = sum(image.height for image in images)
    whole = Image.new("RGB", (images[0].width, height_px), palette.PAPER)
    whole.paste(images[0], (0, 0))
    whole.paste(images[1], (0, images[0].height))
    return _packed(whole)


def _packed(image: Image.Image) -> bytes:
    stream = io.BytesIO()
    image.save(stream, format="PNG", compress_level=_COMPRESS_LEVEL)
    return stream.getvalue()


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


@cache
def _ramp() -> list[int]:
    steps = len(palette.TEXT_RAMP)
    return [
        _INKS[palette.TEXT_RAMP[max(0, value * (steps + 1) // 256 - 1)]] for value in range(256)
    ]


@cache
def _is_inked() -> list[int]:
    least = 256 // (len(palette.TEXT_RAMP) + 1)
    return [255 if value > least else 0 for value in range(256)]


def _sharp_turns(points_px: FloatArray) -> FloatArray:
    """The inner points (K, 2) of a line (P, 2) at which its segments leave a notch."""
    steps = np.diff(points_px, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    along = (steps[1:] * steps[:-1]).sum(axis=1)
    inner = points_px[1:-1][along < _NOTCH_COS * lengths[1:] * lengths[:-1]]
    return np.asarray(inner, dtype=np.float64)


def _in_pixels(points_px: FloatArray) -> FloatArray:
    """Continuous coordinates as Pillow's, where a whole number is the middle of a pixel."""
    return np.asarray(points_px, dtype=np.float64) * DENSITY - 0.5


def _fine(points_px: FloatArray) -> list[float]:
    # Pillow reads a flat list quickest.
    flat: list[float] = _in_pixels(points_px).ravel().tolist()
    return flat


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
