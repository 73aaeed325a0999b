"""Pictures made smaller for pages of many: each made once, when it is first asked for, and kept.

A thumbnail's name says of which picture and how wide it is. A stored picture never changes, so
neither does its thumbnail; all of them can be made again, and a backup leaves them out.
"""

from __future__ import annotations

from django.core.files.storage import default_storage

from augment.render.canvas import shrink_png
from augment.services.scenarios.pictures import store_as

FOLDER = "thumbnails"
WIDTHS_PX = (400, 800)
"""How wide they are at most: for a cell of a grid, and for one of a gallery; twice that on fine
screens."""
# Raised whenever the same picture is made smaller in another way.
_LOOK = 1


def thumbnail_of(name: str, widest_px: int) -> str:
    """The name of a stored picture made smaller; "" where there is no such picture.

    Args:
        name: Of the picture.
        widest_px: One of `WIDTHS_PX`.

    Raises:
        ValueError: There are no thumbnails of that width.
    """
    if widest_px not in WIDTHS_PX:
        raise ValueError(f"thumbnails are {WIDTHS_PX} pixels wide, not {widest_px}")
    small = f"{FOLDER}/{_LOOK}-{widest_px}/{name}"
    if not name or default_storage.exists(small):
        return small if name else ""
    if not default_storage.exists(name):
        return ""
    with default_storage.open(name) as file:
        store_as(small, shrink_png(file.read(), widest_px))
    return small
