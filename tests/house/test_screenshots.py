"""docs/pages.md shows what there is: no picture is missing, left over or too heavy."""

from __future__ import annotations

import re

from PIL import Image

from tests.screenshots import FOLDER, INDEX, SCHEMES, WIDTH

LIGHTER_THAN = 5_000_000
EACH_LIGHTER_THAN = 130_000


def test_every_picture_is_shown_once_and_every_page_light_and_dark() -> None:
    text = INDEX.read_text()
    shown = re.findall(r"\(images/pages/([^)]+)\)", text)
    assert sorted(shown) == sorted(path.name for path in FOLDER.iterdir())
    names = re.findall(r"^## (\S+)", text, flags=re.MULTILINE)
    assert len(names) > 60
    assert shown == [f"{name}-{scheme}.webp" for name in names for scheme in SCHEMES]


def test_together_they_are_light_and_as_wide_as_the_window() -> None:
    sizes = {path.name: path.stat().st_size for path in FOLDER.iterdir()}
    assert sum(sizes.values()) < LIGHTER_THAN
    assert max(sizes.values()) < EACH_LIGHTER_THAN
    for path in FOLDER.iterdir():
        with Image.open(path) as picture:
            assert picture.width == WIDTH, path.name
