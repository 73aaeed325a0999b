"""What a browser loads with the voting page."""

import gzip
import re
from pathlib import Path

import pytest
from django.conf import settings
from django.urls import reverse

from tests.web.cast import signed_in, world

STATIC = Path(settings.BASE_DIR) / "static"
MOST_BYTES = 40 * 1024


@pytest.mark.django_db
def test_the_voting_page_loads_at_most_40_kb_and_names_every_module_of_its_script() -> None:
    here = world()
    shown = signed_in(here.expert).get(reverse("vote", args=[here.study.code])).content.decode()
    loaded = set(re.findall(r'(?:src|href)="/static/([^"]+\.(?:js|css))"', shown))
    assert {"js/vote.js", "css/vote.css"} <= loaded
    sizes = {name: len(gzip.compress((STATIC / name).read_bytes())) for name in sorted(loaded)}
    assert sum(sizes.values()) <= MOST_BYTES, sizes
    named = set(re.findall(r'modulepreload" href="/static/js/([\w-]+\.js)"', shown))
    imported: set[str] = set()
    for script in ("vote.js", *named):
        text = (STATIC / "js" / script).read_text()
        imported |= set(re.findall(r'from "\./([\w-]+\.js)"', text))
    assert named == imported
