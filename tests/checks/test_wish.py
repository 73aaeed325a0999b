"""Distance to the wish, against values worked out by hand, and its properties."""

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from augment.baselines.rule_placer import place
from augment.checks import Ground
from augment.checks.wish import WishDistance, measure_wish
from augment.scene import intent as wish
from augment.scene.entities import Area, AreaKind, Modification, Scene, TrafficAgent
from tests.intents import (
    CENTRED,
    LEFT_EDGE,
    RIGHT_EDGE,
    cones,
    crash,
    metres,
    parked,
    spot,
    towards,
    walk,
)
from tests.scenes import cone, curve, junction, pedestrian, scene, vehicle

STREET, BEND = scene(), curve()
_STRIPES = Area(
    id="Area9",
    kind=AreaKind.CROSSWALK,
    boundary_m=((30.0, -1.75), (34.0, -1.75), (34.0, 5.25), (30.0, 5.25)),
)
ZEBRA = replace(
    STREET,
    areas=(*STREET.areas, _STRIPES),
    agents=(vehicle("Agent8", 16.0, -3.0), vehicle("Agent9", 24.0, -3.0)),
)
"""Lanes are 3.5 m wide. The bend begins 10 m ahead, on 40 m to the left. The zebra crossing is
30 to 34 m ahead; before it two cars of 4.8 m are parked on the right."""


def bent(ahead_m: float, left_m: float = 0.0) -> tuple[float, float]:
    """A place on the bend: so far along the lane, left of it."""
    turn = (ahead_m - 10.0) / 40.0
    return 10.0 + (40.0 - left_m) * math.sin(turn), 40.0 - (40.0 - left_m) * math.cos(turn)


def car(ahead_m: float, left_m: float, number: int = 2) -> TrafficAgent:
    return vehicle(f"Agent{number}", ahead_m, left_m)


def standing(where: wish.Spot) -> wish.Intent:
    """One car at a spot."""
    car = wish.VehicleRequest(spot=where, body=wish.Body.CAR, speed_mps=0.0, count=1)
    return wish.Intent(requests=(car,))


def named(*settings: wish.Setting) -> wish.Intent:
    """One car in the ego's lane at a named place."""
    return standing(wish.Spot(lane=wish.LaneChoice.OWN, settings=settings))


def by_zebra(relation: wish.Relation | None, *, about: bool = False) -> wish.Intent:
    """One car 5 m from the zebra, or on it."""
    five = metres(5.0, about=about) if relation else None
    return standing(wish.Spot(distance=five, relation=relation, mark=wish.MapPlace.CROSSWALK))


def two(*spots: wish.Spot) -> wish.Intent:
    """A car at each."""
    return wish.Intent(requests=tuple(standing(spot).requests[0] for spot in spots))


def crash_at(ahead_m: float, lateral: wish.Lateral, *others: wish.CrashedCar) -> wish.Intent:
    """Two cars, the first of them off the middle of the lane."""
    (request,) = crash(ahead_m, 2, *others).requests
    return wish.Intent(requests=(replace(request, spot=spot(ahead_m, lateral=lateral)),))


def file_of_cones(*places: tuple[float, float]) -> tuple[TrafficAgent, ...]:
    return tuple(cone(f"Agent{number}", *place) for number, place in enumerate(places, start=2))


AT_20 = parked(20.0)
SIDE = parked(20.0, lateral=towards(LEFT_EDGE, 1.2))
RANGE = parked(20.0, lateral=towards(LEFT_EDGE, how=wish.Nearness.SLIGHTLY))
OUTSIDE = parked(20.0, lateral=towards(RIGHT_EDGE, how=wish.Nearness.OUTSIDE))
ONCOMING = parked(20.0, lane=wish.LaneChoice.ONCOMING)
LINE = cones(20.0, 3, wish.Shape.LINE, lateral=towards(RIGHT_EDGE), spacing=metres(2.0, 3.0))
ROW = cones(20.0, 3, wish.Shape.ROW, spacing=metres(1.2))
TAPER = cones(
    20.0, 3, wish.Shape.TAPER, spacing=metres(2.5), start=wish.Side.LEFT, ends_in_middle=True
)
RING = cones(20.0, 4, wish.Shape.RING, spacing=metres(2.0), has_worker=True)
WORKED = cones(
    20.0, 2, wish.Shape.ROW, spacing=metres(1.0), has_worker=True, post=wish.Post.BEHIND
)
PAIR = crash(20.0, 2, wish.CrashedCar(gap=metres(4.0), bearing=wish.Bearing.LEFT))
WALK = walk(20.0, wish.Side.LEFT)
QUEUE = parked(20.0, count=3, spacing=metres(6.0, 8.0))
ABOUT = parked(20.0, count=2, spacing=metres(10.0, about=True), lateral=CENTRED)
KERB = towards(wish.LateralTarget.KERB, 1.0)
OTHER_KERB = parked(20.0, lane=wish.LaneChoice.ONCOMING, lateral=KERB)
CRASHED = crash_at(20.0, towards(LEFT_EDGE, 1.2))
EDGED = crash_at(20.0, towards(RIGHT_EDGE, 0.8), wish.CrashedCar(gap=metres(5.0)))
SHIFTED = cones(20.0, 4, wish.Shape.LINE, spacing=metres(2.0), lateral=towards(LEFT_EDGE, 0.6))
ASIDE = cones(20.0, 3, wish.Shape.ROW, spacing=metres(0.8), lateral=towards(RIGHT_EDGE, 0.5))
PAST_ZEBRA = standing(
    wish.Spot(relation=wish.Relation.AHEAD, mark=wish.MapPlace.CROSSWALK, lane=wish.LaneChoice.OWN)
)
BOTH = two(spot(32.0), wish.Spot(distance=metres(10.0, 50.0), relation=wish.Relation.AHEAD))
FILE = walk(20.0, wish.Side.LEFT, count=2, is_file=True, behind=(metres(3.0),), on_road=True)

HAND_COMPUTED: list[tuple[Scene, wish.Intent, tuple[TrafficAgent, ...], list[float]]] = [
    # One object along the lane and across it.
    (STREET, AT_20, (car(20.0, 1.5),), [0.0]),
    (STREET, AT_20, (car(23.0, 0.0),), [3.0]),
    (STREET, AT_20, (car(23.0, 5.75),), [5.0]),  # 3 m on, 4 m past the lane's edge
    (STREET, parked(20.0, about=True), (car(20.9, 0.0),), [0.0]),
    (STREET, parked(20.0, about=True), (car(23.0, 0.0),), [2.0]),
    (STREET, parked(20.0, lateral=CENTRED), (car(20.0, -0.4),), [0.4]),
    (STREET, SIDE, (car(20.0, 0.9),), [0.3]),
    (STREET, SIDE, (car(20.3, 0.8),), [0.5]),
    (STREET, RANGE, (car(20.0, 1.5),), [0.0]),
    (STREET, RANGE, (car(20.0, -0.5),), [0.5]),
    (STREET, OUTSIDE, (car(20.0, -2.75),), [0.0]),  # the box touches the lane
    (STREET, OUTSIDE, (car(20.0, -2.5),), [0.25]),
    (STREET, ONCOMING, (car(20.0, 2.0),), [0.0]),
    (STREET, ONCOMING, (car(20.0, 0.75),), [1.0]),
    (STREET, AT_20, (), []),
    # Where the lane bends.
    (BEND, parked(40.0), (vehicle("Agent2", *bent(40.0, 1.0)),), [0.0]),
    (BEND, parked(40.0, lateral=CENTRED), (vehicle("Agent2", *bent(40.0, 0.8)),), [0.8]),
    (BEND, parked(40.0, lateral=CENTRED), (vehicle("Agent2", 40.0, 0.0),), [11.07]),
    # About: 5 % of what is said, also of a gap and of what is counted from elsewhere.
    (STREET, ABOUT, (car(20.0, 0.0), car(30.5, 0.0, 3)), [0.0, 0.0]),
    (ZEBRA, by_zebra(wish.Relation.AHEAD, about=True), (car(39.75, 0.0),), [0.5]),
    # The kerb of the oncoming lane, whose centre is 3.5 m left, is on the ego's left.
    (STREET, OTHER_KERB, (car(20.0, 4.5),), [0.0]),
    (STREET, OTHER_KERB, (car(20.0, 2.5),), [2.0]),
    # Without a number past it is anywhere past it.
    (ZEBRA, PAST_ZEBRA, (car(50.0, 0.0),), [0.0]),
    (ZEBRA, PAST_ZEBRA, (car(20.0, 0.0),), [14.0]),
    # Of two requests each object answers the one that it is nearer to, all in all.
    (STREET, BOTH, (car(14.0, 0.0), car(31.0, 0.0, 3)), [1.0, 0.0]),
    (STREET, two(spot(20.0), spot(24.0)), (car(22.1, 0.0), car(27.0, 0.0, 3)), [2.1, 3.0]),
    # Objects of one request together.
    (STREET, SHIFTED, file_of_cones((20, 0.6), (22, 0.6), (24, 0.6), (26, 0.6)), [0.0] * 4),
    (STREET, ASIDE, file_of_cones((20, 0.8), (20, 0.0), (20, -0.8)), [0.5] * 3),
    (STREET, LINE, file_of_cones((20, -1.75), (22.5, -1.75), (25, -1.75)), [0.0, 0.0, 0.0]),
    (STREET, LINE, file_of_cones((20, -1.75), (23, -1.75), (27, -1.75)), [0.0, 0.0, 1.0]),
    (STREET, LINE, file_of_cones((20, 1.75), (22, 1.75), (24, 1.75)), [3.2, 3.2, 3.2]),
    (STREET, ROW, file_of_cones((20, 1.2), (20, 0.0), (20, -1.2)), [0.0, 0.0, 0.0]),
    (STREET, ROW, file_of_cones((21, 1.2), (21, 0.0), (21, -1.2)), [1.0, 1.0, 1.0]),
    # 0.75 m across and 2.385 m along are 2.5 m.
    (STREET, TAPER, file_of_cones(*((20 + 2.385 * n, 1.5 - 0.75 * n) for n in range(3))),
     [0.0] * 3),
    (STREET, RING, (*file_of_cones((18.586, 0), (20, -1.414), (21.414, 0), (20, 1.414)),
                    pedestrian("Agent6", 20.0, 2.414)), [0.0, 0.0, 0.0, 0.0, 1.0]),
    (STREET, WORKED, (*file_of_cones((20, 0.5), (20, -0.5)), pedestrian("Agent4", 18.0, 0.0)),
     [0.0, 0.0, 2.0]),
    (STREET, PAIR, (car(20.0, 0.0), car(20.0, 4.0, 3)), [0.0, 0.0]),
    (STREET, PAIR, (car(20.0, 0.0), car(20.0, 4.5, 3)), [0.0, 0.5]),
    # People: where they begin, or where they meet the ego's way.
    (STREET, WALK, (pedestrian("Agent2", 20.0, 6.0, (20.0, -3.0)),), [0.0]),
    (STREET, WALK, (pedestrian("Agent2", 18.0, 4.0, (22.0, -4.0)),), [0.0]),
    (STREET, WALK, (pedestrian("Agent2", 17.0, 6.0, (17.0, -3.0)),), [3.0]),
    (STREET, FILE, (pedestrian("Agent2", 20.0, 1.0, (20.0, -3.0)),
                    pedestrian("Agent3", 20.0, 4.4, (20.0, -3.0))), [0.0, 0.4]),
    # Abreast is no file: the second belongs within 45 degrees of behind the first.
    (STREET, FILE, (pedestrian("Agent2", 20.0, 1.0, (20.0, -3.0)),
        pedestrian("Agent3", 23.0, 1.0, (23.0, -3.0))), [0.0, 3.0 * math.sqrt(2.0 - 2.0**0.5)]),
    # Named places: the junction lies 20 to 36 m ahead.
    (junction(), named(wish.Setting.BEFORE_INTERSECTION), (car(10.0, 0.0),), [0.0]),
    (junction(), named(wish.Setting.BEFORE_INTERSECTION), (car(22.0, 0.0),), [2.0]),
    (junction(), named(wish.Setting.IN_INTERSECTION), (car(30.0, 0.0),), [0.0]),
    (junction(), named(wish.Setting.IN_INTERSECTION), (car(17.5, 0.0),), [2.5]),
    (junction(), named(wish.Setting.AFTER_INTERSECTION), (car(30.0, 0.0),), [6.0]),
    (ZEBRA, by_zebra(wish.Relation.BEHIND), (car(25.0, 0.0),), [0.0]),  # before its near edge
    (ZEBRA, by_zebra(wish.Relation.AHEAD), (car(40.0, 0.0),), [1.0]),  # past its far edge
    (ZEBRA, by_zebra(None), (car(33.0, 0.0),), [0.0]),
    (ZEBRA, named(wish.Setting.ON_CROSSWALK), (car(37.0, 0.0),), [3.0]),
    (ZEBRA, named(wish.Setting.OFF_CROSSWALK), (car(31.0, 0.0),), [1.0]),
    (ZEBRA, named(wish.Setting.BY_PARKED_RIGHT), (car(21.0, 0.0),), [0.0]),
    (ZEBRA, named(wish.Setting.BY_PARKED_RIGHT), (car(30.0, 0.0),), [3.6]),
    (ZEBRA, named(wish.Setting.BY_PARKED_LEFT), (car(30.0, 0.0),), [0.0]),  # nobody is: it is open
    (BEND, named(wish.Setting.IN_BEND), (car(-10.0, 0.0),), [6.0]),
]  # fmt: skip


@pytest.mark.parametrize(("where", "intent", "added", "distances_m"), HAND_COMPUTED)
def test_the_distance_is_the_way_to_the_nearest_admitted_placement(
    where: Scene, intent: wish.Intent, added: tuple[TrafficAgent, ...], distances_m: list[float]
) -> None:
    found = measure_wish(Ground.of(where), Modification(added=added), intent)
    assert found.distances_m == pytest.approx(distances_m, abs=0.01)
    assert (found.missing, found.surplus) == (0 if added else 1, ())


INTENTS = {
    **{"side": SIDE, "range": RANGE, "oncoming": ONCOMING, "walk": WALK},
    **{"line": LINE, "row": ROW, "taper": TAPER, "ring": RING, "worked": WORKED},
    **{"pair": PAIR, "file": FILE, "queue": QUEUE, "about": ABOUT, "kerb": OTHER_KERB},
    **{"crash": CRASHED, "gap": EDGED, "shifted": SHIFTED, "aside": ASIDE},
}
PLACED = {
    name: place(STREET, intent, seed=7).modification.added for name, intent in INTENTS.items()
}
"""What the rule placer makes of each intent."""


def shifted(added: Sequence[TrafficAgent], shifts: Sequence[tuple[float, float]]) -> Modification:
    moved = [
        replace(one, x_m=one.x_m + dx_m, y_m=one.y_m + dy_m, walk_to_m=None)
        for one, (dx_m, dy_m) in zip(added, shifts, strict=False)
    ]
    return Modification(added=tuple(moved))


def measured(intent: wish.Intent, change: Modification) -> WishDistance:
    return measure_wish(Ground.of(STREET), change, intent)


@pytest.mark.parametrize("name", PLACED)
def test_what_the_rule_placer_places_is_what_was_asked_for(name: str) -> None:
    found = measured(INTENTS[name], Modification(added=PLACED[name]))
    assert found.distances_m == pytest.approx([0.0] * len(PLACED[name]), abs=0.002)


@pytest.mark.parametrize(
    ("where", "setting"),
    [
        (junction(), wish.Setting.BEFORE_INTERSECTION),
        (junction(), wish.Setting.IN_INTERSECTION),
        (junction(), wish.Setting.AFTER_INTERSECTION),
        (ZEBRA, wish.Setting.ON_CROSSWALK),
        (ZEBRA, wish.Setting.BY_PARKED_RIGHT),
        (STREET, wish.Setting.OFF_CROSSWALK),
    ],
)
def test_what_has_a_named_place_alone_is_placed_there(where: Scene, setting: wish.Setting) -> None:
    added = place(where, named(setting), seed=3).modification.added
    found = measure_wish(Ground.of(where), Modification(added=added), named(setting))
    assert found.distances_m == pytest.approx([0.0], abs=0.002)


@pytest.mark.slow
@given(
    name=st.sampled_from(sorted(PLACED)),
    shifts=st.lists(st.tuples(*[st.floats(-3.0, 3.0)] * 2), min_size=8, max_size=8),
)
@settings(max_examples=60, deadline=None)
def test_the_distance_is_never_above_that_to_a_placement_that_meets_the_intent(
    name: str, shifts: list[tuple[float, float]]
) -> None:
    change = shifted(PLACED[name], shifts)
    found = measured(INTENTS[name], change)
    displaced_m = sum(math.hypot(*shift) for shift, _ in zip(shifts, change.added, strict=False))
    assert sum(found.distances_m) <= displaced_m + 0.01


@given(
    name=st.sampled_from(["side", "range", "oncoming"]),
    shift=st.tuples(*[st.floats(-9.0, 9.0)] * 2),
    further_m=st.floats(0.1, 9.0),
)
@settings(max_examples=60, deadline=None)
@pytest.mark.slow
def test_the_distance_grows_by_as_much_as_one_goes_further_away(
    name: str, shift: tuple[float, float], further_m: float
) -> None:
    change = shifted(PLACED[name], [shift])
    (match,) = measured(INTENTS[name], change).matches
    (one,) = change.added
    assume(match.distance_m > 0.01)
    share = further_m / match.distance_m
    away = [((one.x_m - match.nearest_m[0]) * share, (one.y_m - match.nearest_m[1]) * share)]
    (further,) = measured(INTENTS[name], shifted([one], away)).matches
    assert further.distance_m == pytest.approx(match.distance_m + further_m, abs=0.002)
