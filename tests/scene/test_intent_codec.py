import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.errors import InvalidDocument
from augment.scene.codec import INTENT, intent_from_document, intent_to_document
from augment.scene.intent import (
    Bearing,
    Body,
    ConesRequest,
    CrashedCar,
    CrashRequest,
    Facing,
    Intent,
    LaneChoice,
    Lateral,
    LateralTarget,
    Length,
    Nearness,
    Post,
    Relation,
    Setting,
    Shape,
    Side,
    Spot,
    VehicleRequest,
    WalkRequest,
)
from augment.scene.intent_statements import list_statements
from tests.fixtures.shelf import SLUGS, entry

METRES = st.floats(0.0, 500.0)
LENGTHS = st.builds(
    lambda low, more, about: Length(low_m=low, high_m=low + more, is_approximate=about),
    METRES,
    METRES,
    st.booleans(),
)
LATERALS = st.builds(
    Lateral,
    target=st.sampled_from(LateralTarget),
    offset=st.none() | LENGTHS,
    nearness=st.none() | st.sampled_from(Nearness),
    on_shoulder=st.booleans(),
)
SPOTS = st.builds(
    Spot,
    distance=LENGTHS,
    relation=st.sampled_from(Relation),
    lane=st.none() | st.sampled_from(LaneChoice),
    lateral=st.none() | LATERALS,
    settings=st.lists(st.sampled_from(Setting), max_size=2).map(tuple),
) | st.builds(Spot, relation=st.none() | st.sampled_from(Relation))
FACINGS = st.none() | st.sampled_from(Facing)
SIDES = st.none() | st.sampled_from(Side)
REQUESTS = st.one_of(
    st.builds(
        VehicleRequest,
        spot=SPOTS,
        body=st.sampled_from(Body),
        facing=st.sampled_from(Facing),
        turn_deg=st.floats(-180.0, 180.0),
        speed_mps=st.none() | st.floats(0.0, 100.0),
        count=st.none() | st.integers(1, 100),
        spacing=st.none() | LENGTHS,
    ),
    st.builds(
        WalkRequest,
        spot=SPOTS,
        start=SIDES,
        drift_m=st.none() | st.floats(-100.0, 100.0),
        is_file=st.booleans(),
        behind=st.lists(LENGTHS, max_size=3).map(tuple),
        on_road=st.booleans(),
    ),
    st.builds(
        ConesRequest,
        spot=SPOTS,
        shape=st.none() | st.sampled_from(Shape),
        spacing=st.none() | LENGTHS,
        start=SIDES,
        has_worker=st.booleans(),
        post=st.none() | st.sampled_from(Post),
        post_side=SIDES,
    ),
    st.builds(
        CrashRequest,
        spot=SPOTS,
        body=st.sampled_from(Body),
        facing=FACINGS,
        others=st.lists(
            st.builds(
                CrashedCar,
                gap=st.none() | LENGTHS,
                bearing=st.none() | st.sampled_from(Bearing),
                turn_deg=st.none() | st.floats(-180.0, 180.0),
                is_signed=st.booleans(),
            ),
            max_size=3,
        ).map(tuple),
    ),
)
INTENTS = st.builds(Intent, requests=st.lists(REQUESTS, min_size=1, max_size=3).map(tuple))


def document(*requests: dict[str, Any], **parts: Any) -> dict[str, Any]:
    frame = INTENT.frame
    return frame | {"requests": [{"kind": "vehicles"} | one for one in requests]} | parts


@given(INTENTS)
def test_an_intent_comes_back_from_its_document(intent: Intent) -> None:
    written = json.dumps(intent_to_document(intent), allow_nan=False)
    assert intent_from_document(json.loads(written)) == intent


@given(INTENTS)
def test_every_intent_can_be_said_in_statements(intent: Intent) -> None:
    assert all("%" not in one for one in list_statements(intent))


def test_what_is_open_is_absent() -> None:
    assert intent_to_document(Intent(requests=(WalkRequest(),)))["requests"] == [{"kind": "walk"}]


@pytest.mark.parametrize(
    ("broken", "at", "reason"),
    [
        (document({"speed": 1.0}), "requests[0].vehicles.speed", "is not a field"),
        (document({"body": "tram"}), "requests[0].vehicles.body", "or 'construction sign'"),
        (document({"count": 0}), "requests[0].vehicles.count", "greater than or equal to 1"),
        (document({"count": "two"}), "requests[0].vehicles.count", "valid integer"),
        (document({"kind": "elephant"}), "requests[0]", "'vehicles', 'walk', 'cones', 'crash'"),
        (document(), "", "asks for nothing"),
        (
            document({"spot": {"distance": {"low_m": 20.0}}}),
            "requests[0].vehicles.spot",
            "a distance needs a relation: ahead or behind",
        ),
        (
            document({"spot": {"relation": "ahead", "distance": {"low_m": 9.0, "high_m": 8.0}}}),
            "requests[0].vehicles.spot.distance",
            "high_m is below low_m",
        ),
        (document({"turn_deg": 9.0}), "requests[0].vehicles", "turn_deg needs a facing"),
        (
            document({"spot": {"relation": "ahead", "anchor": "bus"}}),
            "requests[0].spot.anchor",
            "'bus' is the name of no earlier request; those before it: none",
        ),
        (document({"name": "a"}, {"name": "a"}), "requests[1].name", "taken by an earlier"),
        (
            document({"kind": "walk", "count": 2, "behind": [{"low_m": 1.0}, {"low_m": 2.0}]}),
            "requests[0].behind",
            "tells of 2 further ones, but the count is 2",
        ),
        (document({}) | {"version": 2}, "version", "this program reads version 1"),
        (document({}) | {"format": "else"}, "format", "expected 'scenario-arena/intent'"),
    ],
)
def test_what_breaks_the_format_is_named_with_its_place(
    broken: dict[str, Any], at: str, reason: str
) -> None:
    with pytest.raises(InvalidDocument) as fault:
        intent_from_document(broken)
    ((path, text),) = fault.value.problems
    assert path == at
    assert reason in text


@pytest.mark.parametrize("slug", SLUGS)
def test_every_scenario_of_the_catalogue_has_an_intent(slug: str) -> None:
    intent = entry(slug).intent
    assert intent is not None
    assert intent_from_document(intent_to_document(intent)) == intent


def test_statements_are_short_and_name_what_they_are_about() -> None:
    intent = entry("jaywalker-ferry-road").intent
    assert intent is not None
    assert [str(one) for one in list_statements(intent)] == [
        "bus: number 1",
        "bus: 20 m ahead of the ego",
        "bus: in the own lane",
        "bus: 1.1 m from the lane centre towards the left lane boundary",
        "bus: stands",
        "pedestrian: number 1",
        "pedestrian: 26 m ahead of the ego",
        "pedestrian: crosses from the left to the right",
    ]
