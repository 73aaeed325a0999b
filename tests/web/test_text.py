"""The text description on the pages: where a study has it, and no trace where it has none."""

import json
import re

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from arena.models import Study
from tests import study_rows
from tests.described import a_described_study, said_of
from tests.web.cast import signed_in

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


def test_without_it_the_page_has_no_trace_of_it() -> None:
    study = study_rows.a_study()
    assert not study.allow_text
    client = signed_in(User.objects.get(username="eva"))
    study_rows.vote(study_rows.matchups_of(study, "eva")[0])
    for address in (page(study), f"{page(study)}help/"):
        shown = client.get(address).content.decode()
        for trace in (' id="text"', "text-", '"text"', "description", "<kbd>T</kbd>"):
            assert trace not in shown, (address, trace)
