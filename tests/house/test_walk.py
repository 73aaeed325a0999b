"""A newcomer's walk: the file to open first of each stage says what comes in and what goes out."""

import ast
import re

import pytest

from tests.house.source import ROOT

DOCS = ROOT / "docs"
NAMED = r"`((?:arena|augment|bench|docs|tests|templates)/[\w./+-]+)`(\s\(new\))?"
"""A file in docs/extending.md; "(new)" stands after one that whoever follows it is to make."""


def opened_first() -> dict[str, str]:
    """The file to open first by the name of the stage, from the picture of the way."""
    rows = re.findall(
        r"^\| \d+ \| ([^|]+) \|.*\| `([^`|]+)` \|$", (DOCS / "architecture.md").read_text(), re.M
    )
    return dict(rows)


@pytest.mark.parametrize("path", opened_first().values(), ids=lambda path: str(path))
def test_it_says_what_comes_in_and_what_goes_out(path: str) -> None:
    words = ast.get_docstring(ast.parse((ROOT / path).read_text())) or ""
    first = words.splitlines()[:7]
    assert [line for line in first if line.startswith("In: ")]
    assert [line for line in first if re.search(r"\bOut: ", line)]


def test_the_page_on_extending_names_files_that_are_there_and_folders_for_new_ones() -> None:
    page = (DOCS / "extending.md").read_text()
    named = re.findall(NAMED, page)
    assert len(named) > 40
    missing = {
        path
        for path, new in named
        if not ((ROOT / path).parent.is_dir() if new else (ROOT / path).exists())
    }
    assert missing == set()


def test_every_name_that_the_page_on_extending_speaks_of_is_in_the_source() -> None:
    page = re.sub(r"```.*?```", "", (DOCS / "extending.md").read_text(), flags=re.S)
    spoken = set(re.findall(r"`([A-Za-z_]\w*)`", page))
    assert len(spoken) > 60
    paths = [
        path
        for folder in ("arena", "augment", "bench", "tests")
        for path in (ROOT / folder).rglob("*.py")
    ]
    known = {word for path in paths for word in re.findall(r"\w+", path.read_text())}
    assert spoken - known == set()
