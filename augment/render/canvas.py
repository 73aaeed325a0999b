"""The surface that everything is drawn on: shapes in pixels in, PNG bytes out.

A picture is addressed in the pixels that it takes on an ordinary screen and has twice as many
each way: on the voting page it is smooth, and when zoomed still sharp. One byte a pixel, a number
in the palette: nothing is blended, so that drawing, copying and packing are quick. Coordinates and
widths are picture pixels all the same; `Canvas.px` brings metres of the ego frame to them.
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
Spot = tuple[float, float]

# Pixels of the file for each picture pixel, each way.
DENSITY = 2
MOST_PIXELS = 16_000_000
"""Far more than is drawn; an imported study may hold any file as its picture."""

# Thinner lines show no notch where they turn; straighter ones neither.
_NOTCH_PX = 1.5
_NOTCH_COS = 0.9
# Larger files below, slower above.
_COMPRESS_LEVEL = 3
# As many colours as leave the soft edges of what is made smaller soft.
_SMALL_COLOURS = 64

_INKS = palette.inks()
_FLAT_PALETTE = [value for colour in _INKS for value in colour]
_FIRST_OF_TRAILS = _INKS[palette.TRAIL[0]]


class Canvas:
    """A picture in the making.

    Args:
        camera: The window and the scale.
        background: The colour of the empty picture.
    """

    def __init__(self, camera: Camera, background: Colour) -> None:
        self.camera = camera
        self.width_px, self.height_px = camera.width_px, camera.height_px
        self._texts: list[Callable[[Canvas], None]] = []
        size = (self.width_px * DENSITY, self.height_px * DENSITY)
        image = Image.new("P", size, _INKS[background])
        image.putpalette(_FLAT_PALETTE)
        self._draw_on(image)

    def copy(self) -> Canvas:
        """Return the same picture on a surface of its own."""
        twin = copy.copy(self)
        twin._texts = list(self._texts)
        twin._draw_on(self._image.copy())
        return twin

    def px(self, points_m: FloatArray) -> FloatArray:
        """Return points (N, 2) of the ego frame in pixels."""
        return self.camera.to_pixels(points_m)

    def at(self, x_m: float, y_m: float) -> Spot:
        """Return a point of the ego frame in pixels."""
        x, y = self.px(np.array([[x_m, y_m]]))[0].tolist()
        return x, y

    def shows(self, spot: Spot) -> bool:
        """Return whether a point lies in the picture."""
        return 0.0 <= spot[0] < self.width_px and 0.0 <= spot[1] < self.height_px

    def fill(self, points: FloatArray, colour: Colour) -> None:
        """Draw a filled polygon through points (P, 2)."""
        self._pen.polygon(_fine(points), fill=_INKS[colour])

    def stroke(
        self, points: FloatArray, colour: Colour, width: float, *, closed: bool = False
    ) -> None:
        """Draw a line through points (P, 2) with round joints."""
        points = np.vstack([points, points[:2]]) if closed else np.asarray(points)
        self._pen.line(_fine(points), fill=_INKS[colour], width=max(1, round(width * DENSITY)))
        if width > _NOTCH_PX:
            for x, y in _sharp_turns(points).tolist():
                self.disc((x, y), width / 2.0, colour)

    def draw_dashes(
        self, points: FloatArray, colour: Colour, width: float, on: float, off: float
    ) -> None:
        """Draw a dashed line through points (P, 2); what lies outside costs nothing."""
        pieces = dashes(points, on, off)
        size = np.array([self.width_px, self.height_px])
        # (K,) pieces (K, 2, 2) whose bounding box touches the picture.
        seen = ((pieces.max(axis=1) >= 0.0) & (pieces.min(axis=1) <= size)).all(axis=1)
        for piece in _in_pixels(pieces[seen]).reshape(-1, 4).tolist():
            self._pen.line(piece, fill=_INKS[colour], width=max(1, round(width * DENSITY)))

    def disc(self, centre: Spot, radius: float, colour: Colour) -> None:
        """Draw a circle."""
        x, y = centre
        box = np.array([[x - radius, y - radius], [x + radius, y + radius]])
        self._pen.ellipse(_fine(box), fill=_INKS[colour], width=0)

    def plate(self, box: Box, colour: Colour, outline: Colour | None, radius: float) -> None:
        """Draw a rectangle (left, top, right, bottom) with round corners and a thin outline."""
        self._pen.rounded_rectangle(
            [value * DENSITY - 0.5 for value in box],
            radius * DENSITY,
            fill=_INKS[colour],
            outline=_INKS[outline] if outline else None,
            width=DENSITY if outline else 0,
        )

    def text(
        self,
        at: Spot,
        text: str,
        colour: Colour,
        size: int,
        *,
        anchor: str = "mm",
        halo: Colour | None = None,
    ) -> None:
        """Write text at a point, above everything else; anchor is Pillow's ("mm" for its middle).

        Ink without a halo is smooth where it stands on paper; all other text has hard edges.
        """
        if colour == palette.INK and halo is None:
            self._texts.append(lambda on: on._smooth(at, text, size, anchor))
            return
        self._texts.append(
            lambda on: on._pen.text(
                (at[0] * DENSITY, at[1] * DENSITY),
                text,
                fill=_INKS[colour],
                font=_font(size * DENSITY),
                anchor=anchor,
                stroke_width=2 * DENSITY if halo else 0,
                stroke_fill=_INKS[halo] if halo else None,
            )
        )

    def paste(self, part: Canvas, box: Box) -> None:
        """Put a finished picture at a place, over all but texts that come later, with a frame."""
        left, top = (round(value * DENSITY) for value in box[:2])
        image = part._finish_image()
        right, bottom = left + image.width, top + image.height

        def put(on: Canvas) -> None:
            for wide, colour in ((4, palette.PAPER), (2, palette.INK)):
                edge = wide * DENSITY
                rim = [left - edge, top - edge, right + edge - 1, bottom + edge - 1]
                on._pen.rectangle(rim, fill=_INKS[colour])
            on._image.paste(image, (left, top))

        self._texts.append(put)

    def holds(self, points: FloatArray, colours: tuple[Colour, ...]) -> NDArray[np.bool_]:
        """Return at which of points (N, 2) one of the colours lies so far, (N,)."""
        cells = np.floor(np.asarray(points) * DENSITY).astype(np.int64)
        within = ((cells >= 0) & (cells < np.array(self._image.size))).all(axis=1)
        inside = np.zeros(len(cells), dtype=bool)
        # Rows are y.
        pixels = np.asarray(self._image)[cells[within, 1], cells[within, 0]]
        inside[within] = np.isin(pixels, [_INKS[colour] for colour in colours])
        return inside

    def png(self) -> bytes:
        """Return the finished picture: the same drawing gives the same bytes, and no metadata."""
        finished = self._finish_image()
        if np.asarray(finished).max() < _FIRST_OF_TRAILS:
            finished.putpalette(_FLAT_PALETTE[: 3 * _FIRST_OF_TRAILS])
        return _pack(finished)

    def _finish_image(self) -> Image.Image:
        finished = self.copy()
        for write in self._texts:
            write(finished)
        return finished._image

    def _smooth(self, at: Spot, text: str, size: int, anchor: str) -> None:
        """Write ink with soft edges: its steps towards paper are colours of the palette."""
        font = _font(size * DENSITY)
        x, y = (round(value * DENSITY) for value in at)
        box = tuple(round(value) for value in font.getbbox(text, anchor=anchor))
        left, top = box[0] - 1, box[1] - 1
        mask = Image.new("L", (box[2] - left + 2, box[3] - top + 2))
        ImageDraw.Draw(mask).text((-left, -top), text, fill=255, font=font, anchor=anchor)
        inks, is_inked = _ramps()
        self._image.paste(mask.point(inks), (x + left, y + top), mask.point(is_inked))

    def _draw_on(self, image: Image.Image) -> None:
        self._image = image
        self._pen = ImageDraw.Draw(image)
        self._pen.fontmode = "1"


def stack_png(above: Canvas, below: Canvas) -> bytes:
    """Return two pictures of one width, one above the other, at half their density."""
    # One pixel for each four, blended, in full colour: for those who pay by the pixel.
    first, second = (
        part._finish_image().convert("RGB").reduce(DENSITY) for part in (above, below)
    )
    whole = Image.new("RGB", (first.width, first.height + second.height), palette.PAPER)
    whole.paste(first, (0, 0))
    whole.paste(second, (0, first.height))
    return _pack(whole)


def text_width_px(text: str, size_px: int) -> float:
    """Return how wide a text will be in the picture."""
    return float(_font(size_px).getlength(text))


def overlap(box: Box, other: Box, gap_px: float = 0.0) -> bool:
    """Return whether two boxes come nearer to each other than a gap."""
    return (
        box[0] < other[2] + gap_px
        and other[0] < box[2] + gap_px
        and box[1] < other[3] + gap_px
        and other[1] < box[3] + gap_px
    )


def box_around(spot: Spot, half_width: float, half_height: float) -> Box:
    """Return the box with that middle."""
    x, y = spot
    return x - half_width, y - half_height, x + half_width, y + half_height


def shrink_png(png: bytes, widest: int, box: Box | None = None) -> bytes:
    """Return a picture as a PNG of few colours, by a whole factor so small that it is no wider.

    Args:
        png: The bytes of a picture that `bev` drew, or any other PNG.
        widest: In pixels, 1 or more; a picture that is no wider keeps its size.
        box: The part of it to take, in shares of its width and height; None for all.
    """
    with Image.open(io.BytesIO(png), formats=("PNG",)) as picture:
        if picture.width * picture.height > MOST_PIXELS:
            raise ValueError(f"a picture of {picture.width} x {picture.height} pixels")
        colours = picture.convert("RGB")
        if box is not None:
            width, height = picture.size
            left, upper, right, lower = box
            colours = colours.crop((left * width, upper * height, right * width, lower * height))
    factor = -(-colours.width // widest)
    small = colours.reduce(factor) if factor > 1 else colours
    few = small.quantize(
        _SMALL_COLOURS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE
    )
    return _pack(few, level=9)


# Private


def _pack(image: Image.Image, level: int = _COMPRESS_LEVEL) -> bytes:
    stream = io.BytesIO()
    image.save(stream, format="PNG", compress_level=level)
    return stream.getvalue()


@cache
def _font(size_px: int) -> ImageFont.FreeTypeFont:
    # Pillow's own embedded font: a picture must not depend on what the computer has installed.
    font = ImageFont.load_default(size_px)
    if not isinstance(font, ImageFont.FreeTypeFont):
        raise RuntimeError("Pillow was built without FreeType; the pictures need it")
    return font


@cache
def _ramps() -> tuple[list[int], list[int]]:
    """Return the ink of each shade of a text's mask, and whether the shade leaves any."""
    steps = [_INKS[colour] for colour in palette.TEXT_RAMP]
    least = 256 // (len(steps) + 1)
    inks = [steps[max(0, shade * (len(steps) + 1) // 256 - 1)] for shade in range(256)]
    return inks, [255 if shade > least else 0 for shade in range(256)]


def _sharp_turns(points: FloatArray) -> FloatArray:
    """Return the inner points (K, 2) of a line (P, 2) at which its segments leave a notch."""
    steps = np.diff(points, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    # (P - 2,) |a| |b| cos(turn) at each inner point.
    along = (steps[1:] * steps[:-1]).sum(axis=1)
    inner = points[1:-1][along < _NOTCH_COS * lengths[1:] * lengths[:-1]]
    return np.asarray(inner, dtype=np.float64)


def _in_pixels(points: FloatArray) -> FloatArray:
    """Return coordinates as Pillow's, where a whole number is the middle of a pixel."""
    return np.asarray(points, dtype=np.float64) * DENSITY - 0.5


def _fine(points: FloatArray) -> list[float]:
    # Pillow reads a flat list quickest.
    flat: list[float] = _in_pixels(points).ravel().tolist()
    return flat
