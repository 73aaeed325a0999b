"""Reading a drawn picture: its pixels by metres, its chunks."""

import io
import struct
from functools import lru_cache

import numpy as np
from PIL import Image

from augment.render.bev import draw
from augment.render.camera import Camera
from augment.scene.entities import Modification, Scene

Pixel = tuple[int, int, int]

WIDE = Camera(x_min_m=-15.0, x_max_m=45.0, y_min_m=-20.0, y_max_m=20.0, px_per_m=20.0)
"""A window with room on all sides, 1200 x 800."""


def draw_original(scene: Scene, camera: Camera) -> bytes:
    """The scene before any change."""
    return draw(scene, Modification(), camera)


def opened(png: bytes) -> Image.Image:
    return Image.open(io.BytesIO(png)).convert("RGB")


@lru_cache(maxsize=4)
def at_camera_size(png: bytes, camera: Camera) -> np.ndarray:
    """The pixels (H, W, 3) with one for each of the camera's, however fine the picture is."""
    image = opened(png)
    return np.asarray(image.reduce(image.width // camera.width_px))


def pixel_at(png: bytes, camera: Camera, x_m: float, y_m: float) -> Pixel:
    x, y = camera.to_pixels(np.array([[x_m, y_m]]))[0]
    red, green, blue = at_camera_size(png, camera)[int(y), int(x)].tolist()
    return red, green, blue


def patch(png: bytes, camera: Camera, x_m: float, y_m: float, half_px: int) -> np.ndarray:
    """The pixels (2h, 2h, 3) round a place."""
    x, y = camera.to_pixels(np.array([[x_m, y_m]]))[0].astype(int)
    pixels = at_camera_size(png, camera).astype(int)
    return pixels[y - half_px : y + half_px, x - half_px : x + half_px]


def chunks(png: bytes) -> list[str]:
    """The names of a PNG's chunks, in order."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    names, at = [], 8
    while at < len(png):
        (length,) = struct.unpack(">I", png[at : at + 4])
        names.append(png[at + 4 : at + 8].decode("ascii"))
        at += 12 + length
    return names


def is_red(pixel: Pixel) -> bool:
    red, green, blue = pixel
    return red > 150 and green < 90 and blue < 90


def is_blue(pixel: Pixel) -> bool:
    red, _, blue = pixel
    return blue > 120 and red < 110 and blue - red > 60


def is_grey(pixel: Pixel) -> bool:
    return max(pixel) - min(pixel) < 12
