"""What a browser loads with the voting page, and how it is made small."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from django.conf import settings
from django.urls import reverse

from arena.config.static_files import as_served
from tests.web.cast import signed_in, world

STATIC = Path(settings.BASE_DIR) / "static"
MOST_BYTES = 40 * 1024
OURS = sorted([*STATIC.rglob("*.js"), *STATIC.rglob("*.css")])


def weight(name: str) -> int:
    """The bytes of a script or a style sheet as it is served."""
    return len(as_served(name, (STATIC / name).read_text()).encode())


@pytest.mark.django_db
def test_scripts_and_styles_of_the_voting_page_weigh_at_most_40_kb() -> None:
    here = world()
    shown = signed_in(here.expert).get(reverse("vote", args=[here.study.code])).content.decode()
    loaded = set(re.findall(r'(?:src|href)="/static/([^"]+\.(?:js|css))"', shown))
    assert {"js/vote.js", "css/vote.css"} <= loaded
    sizes = {name: weight(name) for name in sorted(loaded)}
    assert sum(sizes.values()) <= MOST_BYTES, sizes


@pytest.mark.django_db
def test_the_page_names_every_module_that_its_script_imports() -> None:
    here = world()
    shown = signed_in(here.expert).get(reverse("vote", args=[here.study.code])).content.decode()
    named = set(re.findall(r'modulepreload" href="/static/js/([\w-]+\.js)"', shown))
    imported: set[str] = set()
    for script in ("vote.js", *named):
        text = (STATIC / "js" / script).read_text()
        imported |= set(re.findall(r'from "\./([\w-]+\.js)"', text))
    assert named == imported


@pytest.mark.parametrize("path", [p for p in OURS if p.suffix == ".css"], ids=lambda p: p.name)
def test_no_text_of_a_style_sheet_has_braces_semicolons_or_commas(path: Path) -> None:
    # Else taking away what is around them would change it.
    assert not re.search(r"[{};,>]|: ", "".join(re.findall(r'"[^"\n]*"', path.read_text())))


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.name)
def test_no_text_of_ours_spans_lines(path: Path) -> None:
    # Else taking away the indentation would change it.
    text = path.read_text()
    assert all(line.count("`") % 2 == 0 for line in text.splitlines())
    assert all(line.count("/*") == line.count("*/") for line in text.splitlines())
