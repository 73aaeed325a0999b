"""The text description on the pages: where a study has it, and no trace where it has none."""

from __future__ import annotations

import json
import re

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from arena.models import Study, Vote
from tests import study_rows
from tests.described import a_described_study, said_of
from tests.web.cast import people, signed_in
from tests.web.test_weight import MOST_BYTES, weight

pytestmark = pytest.mark.django_db


@pytest.fixture
def study() -> Study:
    return a_described_study()


@pytest.fixture
def eva(study: Study) -> Client:
    return signed_in(User.objects.get(username="eva"))


def page(study: Study) -> str:
    return reverse("vote", args=[study.code])


def given_to_the_script(shown: str) -> dict[str, dict[str, dict[str, list[str]]]]:
    found = re.search(r'<script id="given" [^>]*>(.*?)</script>', shown)
    assert found is not None
    given: dict[str, dict[str, dict[str, list[str]]]] = json.loads(found.group(1))
    return given


def test_the_page_has_both_lists_in_a_part_that_opens_without_a_script(
    eva: Client, study: Study
) -> None:
    first = study_rows.matchups_of(study, "eva")[0]
    shown = eva.get(page(study)).content.decode()
    lists = re.findall(r'<ul id="text-(\w)">(.*?)</ul>', shown)
    assert lists == [
        ("a", f"<li>{said_of(first.left)[0]}</li>"),
        ("b", f"<li>{said_of(first.right)[0]}</li>"),
    ]
    assert '<details class="text" id="text">' in shown, "closed at first"
    assert 'data-do="text"' in shown
    assert 'data-key="text"' in shown
    assert given_to_the_script(shown)["preferences"]["keys"]["text"] == ["t"]
    assert eva.get(f"{page(study)}help/").content.decode().count("<kbd>T</kbd>") == 1


def test_a_former_pair_brings_its_own_lists(eva: Client, study: Study) -> None:
    first = study_rows.matchups_of(study, "eva")[0]
    old = study_rows.vote(first)
    shown = eva.get(page(study), {"change": str(old.key)}).content.decode()
    assert f"<li>{said_of(first.left)[0]}</li>" in shown


def test_the_lists_are_german_where_the_page_is(eva: Client, study: Study) -> None:
    shown = eva.get(page(study), headers={"accept-language": "de"}).content.decode()
    assert "Textbeschreibung" in shown
    assert "<li>Fahrzeug, " in shown


def test_without_it_the_page_has_no_trace_of_it() -> None:
    study = study_rows.a_study()
    assert not study.allow_text
    client = signed_in(User.objects.get(username="eva"))
    study_rows.vote(study_rows.matchups_of(study, "eva")[0])
    for address in (page(study), f"{page(study)}help/"):
        shown = client.get(address).content.decode()
        for trace in (' id="text"', "text-", '"text"', "description", "<kbd>T</kbd>"):
            assert trace not in shown, (address, trace)


def test_it_is_off_unless_the_form_asks_for_it() -> None:
    cast = study_rows.cast_of()
    admin = signed_in(people()["admin"])
    assert (
        "Experts may read a text description" in admin.get(reverse("study-new")).content.decode()
    )
    sent = {"name": "Round 1", **cast, "votes_per_expert": 9, "seed": 4, "sure": "1"}
    admin.post(reverse("study-new"), sent)
    study = Study.objects.get()
    assert not study.allow_text
    shown = admin.get(reverse("study", args=[study.code])).content.decode()
    assert re.search(r"<dt>Text description</dt><dd>none</dd>", shown)


def test_the_form_opens_a_study_with_it_and_its_page_says_so(study: Study) -> None:
    rows = {name: list(getattr(study, name).all()) for name in ("contestants", "scenarios")}
    sent = {
        **{name: [row.slug for row in found] for name, found in rows.items()},
        **{"name": "Round 2", "experts": ["eva"], "votes_per_expert": 9, "seed": 4},
    }
    admin = signed_in(people()["admin"])
    answer = admin.post(
        reverse("study-new"), sent | {"allow_text": "on", "sure": "1"}, follow=True
    )
    assert Study.objects.get(name="Round 2").allow_text
    assert re.search(r"<dt>Text description</dt><dd>may be read</dd>", answer.content.decode())


def test_a_vote_by_the_form_counts_with_it_too(eva: Client, study: Study) -> None:
    shown = eva.get(page(study)).content.decode()
    key, matchup = (re.search(rf'name="{n}" value="(.*?)"', shown) for n in ("key", "matchup"))
    assert key is not None
    assert matchup is not None
    eva.post(page(study), {"key": key[1], "matchup": matchup[1], "outcome": "left"})
    assert Vote.objects.get().outcome == "left"


def test_it_loads_no_script_and_one_small_style_of_its_own(eva: Client, study: Study) -> None:
    shown = eva.get(page(study)).content.decode()
    loaded = set(re.findall(r'(?:src|href)="/static/([^"]+\.(?:js|css))"', shown))
    Study.objects.update(allow_text=False)
    study.matchups.update(descriptions=None)
    bare = eva.get(page(study)).content.decode()
    without = set(re.findall(r'(?:src|href)="/static/([^"]+\.(?:js|css))"', bare))
    assert (loaded - without, without - loaded) == ({"css/text.css"}, set())
    assert sum(weight(name) for name in loaded) <= MOST_BYTES
