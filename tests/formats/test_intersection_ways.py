"""Which lanes of a map without intersections lie in one, and how wide they are."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from augment.formats.road_map import (
    NO_INTERSECTIONS,
    RoadMap,
    Segment,
    complete_map,
    crossing_segments,
    fill_widths,
)
from augment.formats.roads import road_around
from augment.geometry.frames import Pose
from augment.scene.entities import TurnType

Points = Sequence[tuple[float, float]]


def segment(name: str, points: Points, *after: str) -> Segment:
    return Segment(name=name, centerline=np.array(points), successors=after, width_m=3.5)


CROSSING = {
    one.name: one
    for one in (
        segment("west in", [(-50.0, -2.0), (-10.0, -2.0)], "straight", "left", "right"),
        segment("straight", [(-10.0, -2.0), (10.0, -2.0)], "east out"),
        segment("left", [(-10.0, -2.0), (-3.0, 0.0), (2.0, 10.0)], "north out"),
        segment("right", [(-10.0, -2.0), (-4.0, -4.0), (-2.0, -10.0)], "south out"),
        segment("north in", [(-2.0, 50.0), (-2.0, 10.0)], "south", "east"),
        segment("south", [(-2.0, 10.0), (-2.0, -10.0)], "south out"),
        segment("east", [(-2.0, 10.0), (0.0, 0.0), (10.0, -2.0)], "east out"),
        segment("east out", [(10.0, -2.0), (50.0, -2.0)]),
        segment("north out", [(2.0, 10.0), (2.0, 50.0)]),
        segment("south out", [(-2.0, -10.0), (-2.0, -50.0)]),
        segment("bridge", [(-40.0, -30.0), (-40.0, 30.0)]),
    )
}


def test_lanes_of_forks_and_merges_that_cross_others_lie_in_an_intersection() -> None:
    """The right turn crosses nothing, but leads from the fork to a merge beside those that do."""
    inside = {"straight", "left", "right", "south", "east"}
    assert crossing_segments(CROSSING) == inside


@pytest.mark.parametrize(
    "names",
    [
        (),
        ("west in", "straight", "bridge"),
        ("west in", "left", "straight", "north out", "east out"),
        ("straight", "east", "east out"),
    ],
    ids=["nothing", "a bridge over a road", "a fork alone", "a merge alone"],
)
def test_no_other_lanes_do(names: Sequence[str]) -> None:
    assert crossing_segments({name: CROSSING[name] for name in names}) == set()


def filled(*segments: Segment) -> tuple[tuple[Segment, ...], int]:
    return fill_widths({one.name: one for one in segments})


def test_an_assumed_width_inside_becomes_the_mean_of_its_ends() -> None:
    wide = replace(CROSSING["west in"], width_m=4.0)
    narrow = replace(CROSSING["north out"], width_m=3.0)
    left = replace(CROSSING["left"], crosses=True, width_m=None)
    made, still = filled(wide, left, narrow)
    assert ([one.width_m for one in made], still) == ([4.0, 3.5, 3.0], 0)
    made, still = filled(left, replace(narrow, width_m=2.8))
    assert ([one.width_m for one in made], still) == ([2.8, 2.8], 0)
    _, still = filled(wide, replace(left, crosses=False))
    assert still == 1, "a lane that lies in no intersection keeps what was assumed"


def test_a_map_that_does_not_tell_has_connectors_with_turns() -> None:
    told = RoadMap(place="map", segments=tuple(CROSSING.values()), tells_crossings=False)
    city, notes = complete_map(told)
    road = road_around(city, Pose(x_m=-20.0, y_m=-2.0, heading_rad=0.0))
    turns = sorted(one.turn_type for one in road.connectors)
    assert turns == sorted([TurnType.STRAIGHT] * 2 + [TurnType.LEFT] * 2 + [TurnType.RIGHT])
    assert all(one.from_lane and one.to_lane for one in road.connectors)
    assert len(road.lanes) == len(CROSSING) - 5
    assert NO_INTERSECTIONS not in notes
