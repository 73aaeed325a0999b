"""What a sentence asks for by fields: several objects, chains, and JSON both ways without loss."""

import html
import json
import re
from typing import Any

import pytest
from django.test import Client
from django.urls import reverse

from augment.errors import InvalidDocument
from augment.models import BaseScene, Scenario
from augment.scene.codec import intent_to_document
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
        ([row(kind="walk")] * 21, "at most 20"),
    ],
)
def test_what_makes_no_intent_is_said_with_its_place(
    fields: list[dict[str, str]], problem: str
) -> None:
    with pytest.raises(InvalidDocument) as caught:
        intent_of_fields(IntentFields(rows=tuple(fields)))
    assert problem in str(caught.value)


@pytest.fixture
def analyst(db: None) -> Client:
    return signed_in(people()["analyst"])


@pytest.fixture
def scene(db: None) -> BaseScene:
    return add_scenario("street").base_scene


def sent_by(page: str) -> dict[str, list[str]]:
    """The fields of the intent as a browser would send them back."""
    found: dict[str, list[str]] = {}
    part = page[page.index("data-asks") : page.index("Add the scenario")]
    pattern = (
        r'<select[^>]* name="(?P<s>[^"]+)">(?P<options>.*?)</select>'
        r'|<input[^>]* name="(?P<i>[^"]+)"[^>]* value="(?P<v>[^"]*)"'
        r'|<textarea[^>]* name="(?P<t>[^"]+)"[^>]*>(?P<text>[^<]*)</textarea>'
    )
    for match in re.finditer(pattern, part, re.S):
        if match["s"]:
            chosen = re.search(r'value="([^"]*)" selected', match["options"])
            first = re.search(r'value="([^"]*)"', match["options"])
            name, value = match["s"], (chosen or first)[1]  # type: ignore[index]
        else:
            name, value = match["i"] or match["t"], match["v"] or match["text"] or ""
        found.setdefault(name, []).append(html.unescape(value))
    return found


def test_the_page_turns_json_into_fields_and_back_and_adds_the_scenario(
    analyst: Client, scene: BaseScene
) -> None:
    url = reverse("scenario-new", args=[scene.code])
    typed = {"instruction": "Let a bus stand there.", "type": "cut_in", "slug": "my-bus"}
    given = {**typed, "type": "jaywalking_pedestrian"}
    read = analyst.post(url, {**given, "intent": json.dumps(CHAIN), "fields": "read"})
    fields = sent_by(read.content.decode())
    assert fields["i_kind"] == ["vehicles", "walk"]
    assert fields["intent"] == [""], "what is in the fields stands there alone"
    assert "Let a bus stand there." in read.content.decode(), "the rest of the form stays"
    written = analyst.post(url, {**given, **fields, "fields": "write"})
    back = sent_by(written.content.decode())
    assert json.loads(back["intent"][0]) == intent_of_fields(fields_of_intent(CHAIN))
    assert back["i_kind"] == [""]
    assert Scenario.objects.count() == 1
    analyst.post(url, {**given, **fields})
    assert Scenario.objects.get(slug="my-bus").intent == json.loads(back["intent"][0])


def test_objects_are_added_and_removed_without_a_script(analyst: Client, scene: BaseScene) -> None:
    url = reverse("scenario-new", args=[scene.code])
    fields = sent_by(analyst.get(url).content.decode())
    assert (fields["i_kind"], fields["i_count"]) == ([""], ["1"])
    fields["i_kind"] = ["walk"]
    more = sent_by(analyst.post(url, {**fields, "fields": "add"}).content.decode())
    assert more["i_kind"] == ["walk", ""]
    more["i_kind"] = ["walk", "cones"]
    less = sent_by(analyst.post(url, {**more, "fields": "drop-0"}).content.decode())
    assert less["i_kind"] == ["cones"]
    none = sent_by(analyst.post(url, {**less, "fields": "drop-0"}).content.decode())
    assert none["i_kind"] == [""]
