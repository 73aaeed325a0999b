"""What the voting page gives its script."""

import gzip
import json
import re
from pathlib import Path
from typing import Any

import pytest
from django.conf import settings
from django.urls import reverse

from tests import study_rows
from tests.web.ballots import page
from tests.web.cast import World, signed_in, world

pytestmark = pytest.mark.django_db
BASE = Path(settings.BASE_DIR)
NUMBERS = ("one", "many")


def given_to_the_script(here: World) -> dict[str, Any]:
    shown = signed_in(here.expert).get(page(here)).content.decode()
    found = re.search(r'<script id="given" [^>]*>(.*?)</script>', shown)
    assert found is not None
    given: dict[str, Any] = json.loads(found.group(1))
    return given


def test_the_script_gets_the_pair_on_the_page_and_four_more() -> None:
    here = world()
    given = given_to_the_script(here)
    mine = study_rows.matchups_of(here.study, "eva")[:5]
    assert [pair["matchup"] for pair in given["pairs"]] == [str(one.code) for one in mine]
    assert (given["saved"], given["total"], given["last"]) == (0, 9, [])


def test_the_script_gets_the_last_ten_votes_the_latest_first() -> None:
    here = world()
    for matchup in study_rows.matchups_of(here.study, "eva")[:3]:
        study_rows.vote(matchup, "equal")
    given = given_to_the_script(here)
    assert [vote["position"] for vote in given["last"]] == [3, 2, 1]
    assert {vote["outcome"] for vote in given["last"]} == {"E"}
    assert given["last"][0]["shown"]["matchup"] in {
        str(one.code) for one in study_rows.matchups_of(here.study, "eva")
    }


def test_the_outbox_of_two_people_or_studies_is_never_the_same() -> None:
    here = world()
    given = given_to_the_script(here)
    assert str(here.study.code) in given["outbox"]
    assert str(here.expert.person.code) in given["outbox"]


def test_every_text_that_the_script_says_is_on_the_page() -> None:
    here = world()
    shown = signed_in(here.expert).get(page(here)).content.decode()
    offered = set(re.findall(r'data-text="([\w-]+)"', shown))
    scripts = "".join(path.read_text() for path in (BASE / "static/js").glob("vote*.js"))
    said = set(re.findall(r'(?<!\.)\b(?:text|note|say)\("([\w-]+)"', scripts))
    said |= {f"{name}-{n}" for name in re.findall(r'counted\("(\w+)"', scripts) for n in NUMBERS}
    said |= {f"{name}-{n}" for name in re.findall(r'data-kept="(\w+)"', shown) for n in NUMBERS}
    assert said <= offered


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
