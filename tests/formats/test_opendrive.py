"""OpenDRIVE maps: lanes lie where another evaluation has them; constructs, and what is broken."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
import shapely

from augment.errors import InvalidDocument
from augment.formats.apart import UntrustedInput
from augment.formats.opendrive.reader import OpenDrive
from augment.formats.reading import Reading
from augment.scene.entities import AnyLane, AreaKind, TrafficLight, TrafficSide
from tests.formats.opendrive_maps import LANES, ROAD, WIDTH, by_hand, lane_lines, make_map, write

WITHIN_M = 0.01


def read(file: Path, item: str | None = None) -> Reading:
    return OpenDrive().read(file, item=item, frame=None, name="map")


def read_text(folder: Path, text: str, item: str | None = "@1,-1,50") -> Reading:
    file = folder / "made.xodr"
    file.write_text(text)
    return read(file, item)


@pytest.mark.parametrize("seed", range(15))
def test_lanes_lie_where_sums_over_short_steps_have_them(seed: int, tmp_path: Path) -> None:
    root = make_map(seed)
    scene = read(write(root, tmp_path / "made.xodr")).scene
    lanes: list[AnyLane] = [*scene.lanes, *scene.connectors]
    ways = [shapely.LineString(lane.centerline.points_m) for lane in lanes]
    lines = lane_lines(root)
    assert lines
    for name, line in lines.items():
        points = shapely.points(scene.origin.pose.to_local(line)[::10])
        furthest_m = min(shapely.distance(way, points).max() for way in ways)
        assert furthest_m < WITHIN_M, name
    # No lane of ours is longer than theirs, or lies elsewhere.
    lengths_m = sum(shapely.length(shapely.LineString(line)) for line in lines.values())
    assert sum(way.length for way in ways) == pytest.approx(lengths_m, rel=3e-3)


@pytest.mark.parametrize("seed", [0, 2, 3, 4])
def test_lanes_that_follow_each_other_are_joined_and_meet(seed: int, tmp_path: Path) -> None:
    scene = read(write(make_map(seed), tmp_path / "made.xodr")).scene
    lines = {lane.id: lane.centerline for lane in scene.lanes}
    joints = [(lane.centerline, lines[after]) for lane in scene.lanes for after in lane.successors]
    for way in scene.connectors:
        assert way.from_lane
        assert way.to_lane
        joints += [(lines[way.from_lane], way.centerline), (way.centerline, lines[way.to_lane])]
    for before, after in joints:
        assert math.dist(before.points_m[-1], after.points_m[0]) < 0.02
    assert len(joints) >= {0: 12, 2: 12, 3: 12, 4: 3}[seed]
    assert bool(scene.connectors) == (seed == 3)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3])
def test_an_ego_can_be_put_at_every_place_that_a_map_names(seed: int, tmp_path: Path) -> None:
    file = write(make_map(seed), tmp_path / "made.xodr")
    first = read(file)
    origin = first.scene.origin.pose
    assert len(first.places) >= 2
    for lane, rows in first.places.items():
        for s_m, *middle in (rows[len(rows) // 2], rows[-1]):
            put = read(file, f"@{lane},{s_m}").scene.origin.pose
            place = origin.to_local(np.array([[put.x_m, put.y_m]]))[0]
            assert math.dist(place, middle) < 0.1, lane


def test_an_ego_can_be_put_at_both_ends_of_a_lane(tmp_path: Path) -> None:
    outer = f'<lane id="-2" type="driving">{WIDTH}</lane>'
    first, second = (LANES.format(width=WIDTH, outer=part) for part in ("", outer))
    text = by_hand(lanes=first + second.replace('s="0"', 's="33.36"', 1))
    rows = read_text(tmp_path, text).places["1,-2"]
    for s_m in (rows[0][0], rows[-1][0]):
        assert read_text(tmp_path, text, f"@1,-2,{s_m}").scene.lanes
    assert (rows[0][0], rows[-1][0]) == pytest.approx((33.36, 100.0), abs=0.002)


SIGNAL = (
    '<signals><signal s="90" t="-4" id="7" dynamic="yes" orientation="+" type="1000001"/>'
    '<signal s="50" t="-4" id="8" dynamic="no" orientation="+" type="206"/></signals>'
)
JUNCTION = (
    ROAD.format(
        **{"id": "2", "junction": "9", "more": "", "type": "", "x": "100", "shape": "<line/>"},
        **{"offset": "", "end": "", "lanes": LANES.format(width=WIDTH, outer="")},
        link='<link><predecessor elementType="road" elementId="1" contactPoint="end"/></link>',
    )
    + '<junction id="9"><connection id="0" incomingRoad="1" connectingRoad="2" '
    'contactPoint="start"><laneLink from="-1" to="-1"/></connection></junction>'
)


def test_a_light_before_a_junction_governs_its_ways(tmp_path: Path) -> None:
    reading = read_text(tmp_path, by_hand(end=SIGNAL, rest=JUNCTION))
    (there, back) = sorted(reading.scene.connectors, key=lambda way: way.from_lane is None)
    assert there.traffic_light is TrafficLight.UNKNOWN
    assert back.traffic_light is TrafficLight.NONE
    assert any("signal 206" in note for note in reading.notes)


def test_a_construct_of_a_lane_is_read(tmp_path: Path) -> None:
    for parts, says in (
        ({"type": '<type s="0"><speed max="50" unit="km/h"/></type>'}, "speed_limit_mps=13.889"),
        ({"type": '<type s="0"><speed max="30" unit="mph"/></type>'}, "speed_limit_mps=13.411"),
        ({"width": f'{WIDTH}<speed sOffset="0" max="7" unit="m/s"/>'}, "speed_limit_mps=7.0"),
        (
            {
                "type": '<type s="0"><speed max="1.25e+01" unit="m/s"/></type>',
                "header": '<offset x="0.0e+00" y="-0.0E+00" z="0" hdg="0"/>',
            },
            "speed_limit_mps=12.5",
        ),
        ({"width": '<border sOffset="0" a="-3" b="0" c="0" d="0"/>', "x": "0"}, "width_m=3.0"),
        ({"outer": f'<lane id="-2" type="bus">{WIDTH}</lane>'}, "right_neighbor='Lane2'"),
        ({"offset": '<laneOffset s="0" a="1" b="0" c="0" d="0"/>'}, "y_m=-0.75"),
        ({"offset": '<laneOffset s="80" a="0" b="0" c="0.01" d="0"/>'}, "y_m=-1.75"),
        ({"shape": '<poly3 a="0" b="0" c="0.001" d="0"/>'}, "y_m=0.7"),
        ({"more": 'rule="LHT"'}, "heading_rad=3.14"),
    ):
        reading = read_text(tmp_path, by_hand(**parts))
        assert says in f"{reading.scene.lanes[0]}{reading.scene.origin}"
        assert not any("offset was left out" in note for note in reading.notes)


def test_a_lane_that_nobody_drives_is_an_area(tmp_path: Path) -> None:
    for kind, area in (
        *(("sidewalk", AreaKind.WALKWAY), ("shoulder", AreaKind.DRIVABLE)),
        ("parking", AreaKind.CARPARK),
    ):
        outer = f'<lane id="-2" type="{kind}">{WIDTH}</lane>'
        (only,) = read_text(tmp_path, by_hand(outer=outer)).scene.areas
        assert only.kind is area
        # From 50 m behind the ego to 50 m ahead, right of its lane, whose middle it is on.
        low, high = np.min(only.boundary_m, axis=0), np.max(only.boundary_m, axis=0)
        assert [*low, *high] == pytest.approx([-50.0, -5.25, 50.0, -1.75], abs=1e-3)


@pytest.mark.parametrize(
    "outline",
    [
        '<outlines><outline><cornerRoad s="60" t="-4"/><cornerRoad s="63" t="-4"/>'
        '<cornerRoad s="63" t="4"/><cornerRoad s="60" t="4"/></outline></outlines>',
        '<outline><cornerLocal u="-4" v="-1.5"/><cornerLocal u="4" v="-1.5"/>'
        '<cornerLocal u="4" v="1.5"/><cornerLocal u="-4" v="1.5"/></outline>',
        "",
    ],
)
def test_a_crosswalk_is_an_area_whatever_its_outline(outline: str, tmp_path: Path) -> None:
    thing = f'type="crosswalk" s="61.5" t="0" hdg="{math.pi / 2}" length="8" width="3"'
    end = f'<objects><object id="3" {thing}>{outline}</object><object type="tree"/></objects>'
    reading = read_text(tmp_path, by_hand(end=end))
    (area,) = reading.scene.areas
    assert area.kind is AreaKind.CROSSWALK
    low, high = np.min(area.boundary_m, axis=0), np.max(area.boundary_m, axis=0)
    assert [*low, *high] == pytest.approx([10.0, -2.25, 13.0, 5.75], abs=1e-3)
    assert any("object tree" in note for note in reading.notes)


def test_each_outline_of_an_object_is_an_area(tmp_path: Path) -> None:
    corner = '<cornerRoad s="{}" t="{}"/>'
    outlines = (
        "".join(corner.format(s + ds, t) for ds, t in ((0, -4), (3, -4), (3, 4), (0, 4)))
        for s in (20, 60)
    )
    parts = "".join(f"<outline>{outline}</outline>" for outline in outlines)
    end = f'<objects><object type="crosswalk" s="0" t="0">{parts}</object></objects>'
    text = by_hand(end=end).replace("<OpenDRIVE>", '<OpenDRIVE xmlns="http://asam.net/odr">')
    areas = read_text(tmp_path, text).scene.areas
    assert sorted(min(x for x, _ in area.boundary_m) for area in areas) == [-30.0, 10.0]


PARKED = (
    '<object type="parkingSpace" s="9" t="5" length="5" width="2"><repeat s="9" length="30" '
    'distance="6"/></object>'
)


@pytest.mark.parametrize(
    ("parts", "note"),
    [
        ({"end": '<lateralProfile><superelevation s="0" a="0.1" b="0" c="0" d="0"/>'
                 "</lateralProfile>"}, "slopes and superelevation were left out"),
        ({"outer": f'<lane id="-2" type="rail">{WIDTH}</lane>'}, "lane rail"),
        ({"type": '<type s="0"><speed max="fast"/></type>'}, "road 1.speed: expected a finite"),
        ({"rest": '<junction id="5" type="virtual"/>'}, "a virtual junction were left out"),
        ({"rest": ROAD.format(
            **{"id": "2", "junction": "-1", "more": "", "type": "", "link": "", "offset": ""},
            **{"x": "100", "shape": "<bezier/>", "end": "", "lanes": LANES},
        )}, "road 2.planView: unknown 'bezier'"),
        ({"link": '<link><successor elementType="roadway" elementId="2"/></link>'},
         "road 1.elementType: unknown 'roadway'"),
        ({"link": '<link><successor elementType="road" elementId="2"/></link>'},
         "road 1.contactPoint: unknown ''"),
        ({"link": '<link><successor elementType="road" elementId="2" contactPoint="mid"/></link>'},
         "road 1.contactPoint: unknown 'mid'"),
        ({"rest": '<junction id="5"><connection incomingRoad="1" connectingRoad="1" '
                  'contactPoint="mid"/></junction>'}, "junction 5.contactPoint: unknown 'mid'"),
        ({"end": SIGNAL.replace('"+"', '"-"')}, "A light governs no way"),
        ({"header": '<offset x="0.0" y="-7" z="0" hdg="0"/>'}, "The header's offset was left out"),
        ({"type": '<type s="0"/><type s="40"><speed max="9"/></type>'}, "A limit that begins in"),
        ({"width": f'{WIDTH}<speed sOffset="9" max="7"/>'}, "A limit that begins in"),
        ({"outer": f'<lane id="-2" type="bus" direction="reversed">{WIDTH}</lane>'},
         "A lane's direction was left out"),
        ({"lanes": LANES.format(width=WIDTH, outer="").replace(" s=", ' singleSide="true" s=')},
         "ended the lanes of the other"),
        ({"end": f'<objects><tunnel id="1"/>{PARKED}</objects>'}, "object tunnel"),
        ({"end": f'<objects>{PARKED}</objects>'}, "An object that is repeated was laid once"),
        ({"end": '<lanes layer="temporary"><laneSection s="0"/></lanes>'}, "Lanes of a layer"),
        ({"outer": f'<lane id="-1" type="bus">{WIDTH}</lane>'}, "Of two lanes with one id"),
        ({"rest": ROAD.format(
            **{"id": "1", "junction": "-1", "more": "", "type": "", "link": "", "offset": ""},
            **{"x": "100", "shape": "<line/>", "end": "",
               "lanes": LANES.format(width=WIDTH, outer="")},
        )}, "Of two roads with one id the last counts"),
    ],
)  # fmt: skip
def test_what_is_left_out_is_noted(parts: dict[str, str], note: str, tmp_path: Path) -> None:
    assert any(note in said for said in read_text(tmp_path, by_hand(**parts)).notes)


def test_a_fault_names_its_place(tmp_path: Path) -> None:
    for text, item, says in (
        (by_hand(), "@1,-2,5", "road 1.lane: unknown '-2'; known: 1, -1"),
        (by_hand(), "@2,-1,5", "road: unknown '2'; known: 1"),
        (by_hand(), "@1,-1,500", "road 1.s: expected a finite number from -0.01 to 100.01"),
        (by_hand(), "1,-1", "needs ROAD,LANE,S"),
        (by_hand(width=WIDTH.replace("3.5", "NaN")), None, "road 1.lane 1.a: expected a finite"),
        (by_hand(width=WIDTH.replace('"0"', '"-1"', 1)), None, "lane 1.sOffset: expected a fin"),
        (by_hand(shape=""), None, "road 1.planView: has no shape; allowed are line, arc"),
        (by_hand(shape='<arc curvature="1e9"/>'), None, "planView.curvature: expected a finite"),
        (by_hand(lanes='<laneSection s="0"/>' * 5_001), None, "has 5001 lane sections"),
        (by_hand(lanes='<laneSection s="0"/>'), None, "no lane that cars drive on"),
        (by_hand().replace('Major="1"', 'Major="2"'), None, "version '2.7' is not read"),
        ("<OpenDRIVE/>", None, "version ''"),
        ("<!DOCTYPE a><OpenDRIVE/>", None, "declares a document type"),
    ):
        with pytest.raises(InvalidDocument, match=re.escape(says)):
            read_text(tmp_path, text, item)


def test_left_hand_traffic_is_that_of_the_rule(tmp_path: Path) -> None:
    assert read_text(tmp_path, by_hand(more='rule="LHT"')).scene.traffic_side is TrafficSide.LEFT
    reading = read_text(tmp_path, by_hand(), None)
    assert reading.scene.traffic_side is TrafficSide.RIGHT
    assert reading.moment.item == "@1,1,50"


def test_a_town_is_read_within_the_sandbox_and_kept_round_the_ego(tmp_path: Path) -> None:
    # 5.3 km2 of streets 10 m apart, 23 roads of 100 m each: the sandbox gives 8 s and 1 GB.
    parts = {"junction": "-1", "shape": "<line/>", "lanes": LANES.format(width=WIDTH, outer="")}
    parts |= dict.fromkeys(("more", "link", "type", "offset", "end"), "")
    roads = "".join(
        ROAD.format(id=f"{x}-{y}", x=100 * x, **parts).replace('y="0"', f'y="{10 * y}"')
        for x in range(23)
        for y in range(230)
    )
    file = tmp_path / "town.xodr"
    file.write_text(f'<OpenDRIVE><header revMajor="1" revMinor="6"/>{roads}</OpenDRIVE>')
    town = UntrustedInput(path=file)
    _, reading = town.read(item="@11-115,-1,50", frame=None, name="town")
    nearest_m = [lane.centerline.project(0.0, 0.0).distance_m for lane in reading.scene.lanes]
    # Three to four roads in each of some thirty streets, with two lanes.
    assert 150 < len(nearest_m) < 250
    assert max(nearest_m) <= 150.0
