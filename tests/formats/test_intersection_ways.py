"""Which lanes of a map without intersections lie in one, and how wide they are."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from augment.formats.readers import READERS
from augment.formats.road_map import Segment, crossing_segments, fill_widths
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


def write_2018b(path: Path) -> Path:
    """The crossing as lanelets of the older dialect, which has no intersections."""
    numbers = {name: number for number, name in enumerate(CROSSING, start=1)}
    lanelets = []
    for name, one in CROSSING.items():
        assert one.centerline is not None
        line = one.centerline
        ways = np.gradient(line, axis=0)
        normals = np.column_stack([-ways[:, 1], ways[:, 0]]) / np.hypot(*ways.T)[:, None]
        bounds = "".join(
            f"<{tag}>"
            + "".join(f"<point><x>{x}</x><y>{y}</y></point>" for x, y in line + side * normals)
            + f"</{tag}>"
            for tag, side in (("leftBound", 1.75), ("rightBound", -1.75))
        )
        after = "".join(f'<successor ref="{numbers[key]}"/>' for key in map(str, one.successors))
        lanelets.append(f'<lanelet id="{numbers[name]}">{bounds}{after}</lanelet>')
    start = (
        "<position><point><x>-20</x><y>-2</y></point></position>"
        "<orientation><exact>0</exact></orientation><time><exact>0</exact></time>"
        "<velocity><exact>5</exact></velocity>"
    )
    path.write_text(
        '<commonRoad commonRoadVersion="2018b" benchmarkID="T" timeStepSize="0.1">'
        + "".join(lanelets)
        + f'<planningProblem id="99"><initialState>{start}</initialState></planningProblem>'
        + "</commonRoad>"
    )
    return path


def test_the_older_dialect_of_commonroad_has_connectors_with_turns(tmp_path: Path) -> None:
    file = write_2018b(tmp_path / "crossing.xml")
    scene = READERS["commonroad"].read(file, item=None, frame=None, name="crossing").scene
    turns = sorted(one.turn_type for one in scene.connectors)
    assert turns == sorted([TurnType.STRAIGHT] * 2 + [TurnType.LEFT] * 2 + [TurnType.RIGHT])
    assert all(one.from_lane and one.to_lane for one in scene.connectors)
    assert len(scene.lanes) == len(CROSSING) - 5
