import json
from typing import Any

import pytest

from augment.errors import InvalidDocument
from augment.scene import intent as wish
from augment.scene.codec import INTENT, intent_from_document, intent_to_document
from augment.scene.entities import TurnType
from augment.scene.intent_parts import Amount, MotionWish, StartWish
from augment.scene.intent_statements import list_statements
from augment.scene.planned_motion import MotionPreset
from tests.fixtures.shelf import HARD_SLUGS, SLUGS, entry
from tests.intents import metres

FULL = wish.Intent(
    requests=(
        wish.VehicleRequest(
            name="bus",
            spot=wish.Spot(
                distance=metres(3.0, 4.5, about=True),
                relation=wish.Relation.BEHIND,
                lane=wish.LaneChoice.LEFT,
                lateral=wish.Lateral(
                    target=wish.LateralTarget.KERB,
                    nearness=wish.Nearness.AT_EDGE,
                    on_shoulder=True,
                ),
                settings=(wish.Setting.IN_BEND,),
            ),
            body=wish.Body.BUS,
            facing=wish.Facing.AGAINST_LANE,
            turn_deg=-12.5,
            speed_mps=3.25,
            count=2,
            spacing=metres(9.0),
        ),
        wish.WalkRequest(
            spot=wish.Spot(anchor="bus"),
            drift_m=-4.0,
            is_file=True,
            behind=(metres(2.0),),
            on_road=True,
            motion=MotionWish(
                preset=MotionPreset.LATE_PEDESTRIAN,
                start=StartWish(mark=wish.MapPlace.CROSSWALK, ego_distance=metres(10.0, 12.0)),
                speed_mps=Amount(low=2.0, high=2.0),
            ),
        ),
        wish.DoorRequest(spot=wish.Spot(anchor="bus")),
        wish.ConesRequest(
            spot=wish.Spot(mark=wish.MapPlace.CROSSWALK),
            shape=wish.Shape.TAPER,
            start=wish.Side.LEFT,
            has_worker=True,
            post=wish.Post.BEHIND,
            post_side=wish.Side.RIGHT,
        ),
        wish.CrashRequest(
            others=(wish.CrashedCar(gap=metres(4.0), bearing=wish.Bearing.LEFT, turn_deg=40.0),)
        ),
    ),
    moves=(
        wish.Move(
            who=wish.Pick(kind=wish.Sight.PARKED, ordinal=2),
            spot=wish.Spot(lane=wish.LaneChoice.OWN),
        ),
        wish.Move(
            who=wish.Pick(kind=wish.Sight.MOVING),
            motion=MotionWish(
                preset=MotionPreset.HARD_BRAKING,
                start=StartWish(after_s=Amount(low=1.0, high=2.5)),
                braking_mps2=Amount(low=6.0, high=6.0),
            ),
        ),
    ),
    removals=(wish.Pick(kind=wish.Sight.BUS, side=wish.Side.LEFT, every=True),),
    purpose=wish.Purpose(
        sight=metres(8.0, 14.0),
        passage=metres(3.0),
        braking_mps2=Amount(low=3.0, high=8.0),
        ttc_s=Amount(low=0.5, high=2.0),
    ),
    route=TurnType.RIGHT,
    beyond=("in the rain",),
)


def document(*requests: dict[str, Any], **parts: Any) -> dict[str, Any]:
    frame = INTENT.frame
    return frame | {"requests": [{"kind": "vehicles"} | one for one in requests]} | parts


def test_an_intent_comes_back_from_its_document_and_can_be_said() -> None:
    for intent in (FULL, *(entry(slug).intent for slug in (*SLUGS, *HARD_SLUGS))):
        written = json.dumps(intent_to_document(intent), allow_nan=False)
        assert intent_from_document(json.loads(written)) == intent
        assert not any("{" in statement for statement in list_statements(intent))
    assert len(list_statements(FULL)) == 38


def test_what_is_open_is_absent() -> None:
    assert intent_to_document(wish.Intent(requests=(wish.WalkRequest(),)))["requests"] == [
        {"kind": "walk"}
    ]


@pytest.mark.parametrize(
    ("broken", "at", "reason"),
    [
        (document({"speed": 1.0}), "requests[0].vehicles.speed", "is not a field"),
        (document({"body": "tram"}), "requests[0].vehicles.body", "or 'pedestrian'"),
        (document({"count": 0}), "requests[0].vehicles.count", "greater than or equal to 1"),
        (document({"count": "two"}), "requests[0].vehicles.count", "valid integer"),
        (document({"kind": "elephant"}), "requests[0]",
         "'vehicles', 'walk', 'cones', 'crash', 'door'"),
        (document(), "", "asks for nothing"),
        (document(purpose={}), "purpose", "a purpose has a window"),
        (document({"spot": {"distance": {"low_m": 20.0}}}), "requests[0].vehicles.spot",
         "a distance needs a relation: ahead or behind"),
        (document({"spot": {"relation": "ahead", "distance": {"low_m": 9.0, "high_m": 8.0}}}),
         "requests[0].vehicles.spot.distance", "high_m is below low_m"),
        (document({"turn_deg": 9.0}), "requests[0].vehicles", "turn_deg needs a facing"),
        (document({"spot": {"relation": "ahead", "anchor": "bus"}}), "requests[0].spot.anchor",
         "'bus' is the name of no earlier request; those before it: none"),
        (document({"name": "a"}, {"name": "a"}), "requests[1].name", "taken by an earlier"),
        (document({"kind": "walk", "count": 2, "behind": [{"low_m": 1.0}, {"low_m": 2.0}]}),
         "requests[0].behind", "tells of 2 further ones, but the count is 2"),
        (document({}) | {"version": 2}, "version", "this program reads version 1"),
        (document({}) | {"format": "else"}, "format", "expected 'scenario-arena/intent'"),
    ],
)  # fmt: skip
def test_what_breaks_the_format_has_a_place(broken: dict[str, Any], at: str, reason: str) -> None:
    with pytest.raises(InvalidDocument) as fault:
        intent_from_document(broken)
    ((path, text),) = fault.value.problems
    assert path == at
    assert reason in text


def test_statements_are_short_and_name_what_they_are_about() -> None:
    intent = entry("jaywalker-ferry-road").intent
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
