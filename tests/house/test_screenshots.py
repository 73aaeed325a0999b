"""The pictures of the pages in docs/images/pages: none is missing or too heavy."""

from PIL import Image

from tests.screenshots import FOLDER, SCHEMES, WIDTH

LIGHTER_THAN = 5_000_000
EACH_LIGHTER_THAN = 130_000


def test_every_page_is_there_light_and_dark() -> None:
    pictures = {path.name for path in FOLDER.iterdir()}
    names = {name.rpartition("-")[0] for name in pictures}
    assert len(names) > 50
    assert pictures == {f"{name}-{scheme}.webp" for name in names for scheme in SCHEMES}


def test_together_they_are_light_and_as_wide_as_the_window() -> None:
    sizes = {path.name: path.stat().st_size for path in FOLDER.iterdir()}
    assert sum(sizes.values()) < LIGHTER_THAN
    assert max(sizes.values()) < EACH_LIGHTER_THAN
    for path in FOLDER.iterdir():
        with Image.open(path) as picture:
            assert picture.width == WIDTH, path.name
