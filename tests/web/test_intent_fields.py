"""What a sentence asks for by fields: several objects, chains, and what no field holds as JSON."""

import html
import re
from typing import Any

import pytest
from django.http import QueryDict
from django.urls import reverse

from arena.scenarios.pages.forms import _entered_fields
from augment.errors import InvalidDocument
from augment.scene.codec import intent_to_document
from augment.services.scenarios import editing
from augment.services.scenarios.intent_fields import (
    FIELDS,
    IntentFields,
    fields_of_intent,
    intent_of_fields,
)
from tests.fixtures.shelf import HARD_SLUGS, SLUGS, entry
from tests.jobs.rows import add_scenario
from tests.web.cast import people, signed_in

BUS: dict[str, Any] = {
    "kind": "vehicles",
    "name": "bus",
    "spot": {
        "distance": {"low_m": 20.0, "is_approximate": True},
        "relation": "ahead",
        "lane": "own",
        "lateral": {"target": "left lane boundary", "offset": {"low_m": 1.1}},
    },
    "body": "bus",
    "speed_mps": 0.0,
    "count": 1,
}
WALK: dict[str, Any] = {
    "kind": "walk",
    "spot": {"distance": {"low_m": 4.25, "high_m": 6.0}, "relation": "ahead", "anchor": "bus"},
    "start": "left",
    "count": 2,
}
CHAIN = {
    "format": "scenario-arena/intent",
    "version": 1,
    "requests": [BUS, WALK],
    "removals": [{"kind": "parked vehicle", "side": "left", "ordinal": 1}],
    "beyond": ["the sun is low"],
}


def row(**values: str) -> dict[str, str]:
    return dict.fromkeys(FIELDS, "") | values


def test_every_intent_of_the_catalogue_comes_back_from_the_fields() -> None:
    told = {slug: entry(slug).intent for slug in (*SLUGS, *HARD_SLUGS)}
    for slug, intent in told.items():
        if intent is None:
            continue
        document = intent_to_document(intent)
        assert intent_of_fields(fields_of_intent(document)) == document, slug


@pytest.mark.parametrize(
    ("fields", "problem"),
    [
        ([row(kind="walk", shape="ring")], "shape: is not a field"),
        ([row(kind="cones", speed_mps="2")], "speed_mps: is not a field"),
        ([row(kind="walk", anchor="bus")], "is the name of no earlier request"),
        ([row(kind="walk"), row(kind="walk", count="x")], "requests[1].count: 'x' is no number"),
        ([row(kind="walk", count="inf")], "requests[0].count: 'inf' is no number"),
        ([row(kind="walk", rest="[" * 20_000)], "requests[0].rest: must be a JSON object"),
        ([row(kind="walk", rest="[1]")], "requests[0].rest: must be a JSON object"),
        ([row(kind="walk", rest="{")], "requests[0].rest: must be a JSON object"),
        ([row(rest="{}")], "requests[0]"),
        ([row(kind="walk", rest='{"colour": "red"}')], "colour"),
        ([row(kind="walk", lane="left", rest='{"spot": 3}')], "requests[0].spot"),
    ],
)
def test_what_makes_no_intent_is_said_with_its_place(
    fields: list[dict[str, str]], problem: str
) -> None:
    with pytest.raises(InvalidDocument) as caught:
        intent_of_fields(IntentFields(rows=tuple(fields)))
    assert problem in str(caught.value)


def sent_by(page: str) -> dict[str, list[str]]:
    """The fields of the intent as a browser would send them back."""
    found: dict[str, list[str]] = {}
    pattern = (
        r'<select[^>]* name="(?P<s>i_[^"]+)">(?P<options>.*?)</select>'
        r'|<input[^>]* name="(?P<i>i_[^"]+)"[^>]* value="(?P<v>[^"]*)"'
        r'|<textarea[^>]* name="(?P<t>i_[^"]+)"[^>]*>(?P<text>[^<]*)</textarea>'
    )
    for match in re.finditer(pattern, page, re.S):
        if match["s"]:
            chosen = re.search(r'value="([^"]*)" selected', match["options"])
            name, value = match["s"], chosen[1] if chosen else ""
        else:
            name, value = match["i"] or match["t"], match["v"] or match["text"] or ""
        found.setdefault(name, []).append(html.unescape(value))
    return found


@pytest.mark.django_db
def test_the_page_shows_all_of_an_intent_and_takes_further_objects() -> None:
    scenario = add_scenario("street")
    document = intent_of_fields(fields_of_intent(CHAIN))
    editing.enter_intent(scenario=scenario.slug, document=document)
    reader, url = (signed_in(people()["researcher"]), reverse("intent-edit", args=[scenario.code]))
    fields = sent_by(reader.get(url).content.decode())
    assert fields["i_kind"] == ["vehicles", "walk", "", "", ""]
    assert intent_of_fields(_entered_fields(querydict(fields))) == document
    fields["i_kind"][2], fields["i_distance_m"][2], fields["i_start"][2] = "walk", "9", "right"
    answer = reader.post(url, fields)
    assert answer.status_code == 302, answer.content.decode()
    scenario.refresh_from_db()
    assert [one["kind"] for one in scenario.intent["requests"]] == ["vehicles", "walk", "walk"]  # type: ignore[index]


def querydict(fields: dict[str, list[str]]) -> QueryDict:
    made = QueryDict(mutable=True)
    for name, values in fields.items():
        made.setlist(name, values)
    return made
