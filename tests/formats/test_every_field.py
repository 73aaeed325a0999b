"""No field of any reader's input, given in a wrong type, becomes a default without a word.

Each variant of a good file has one field of another type. It is refused, or a note more is there;
the fields for which neither holds are those that a scene does not use, and they are all here.
"""

import json
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import feather, parquet

from augment.errors import InvalidDocument
from augment.formats.readers import find_reader
from augment.formats.waymo.scenario import Scenario
from augment.scene.codec import scene_to_document
from tests.formats import nuplan_files, openscenario_files, waymo_files
from tests.formats.opendrive_maps import by_hand
from tests.formats.openscenario_files import BRAKES, CHANGE, GAP, OF_EGO, by_entity, by_time, event
from tests.formats.test_damaged import GOOD
from tests.formats.test_opendrive import JUNCTION, SIGNAL
from tests.formats.test_scenarionet import description, store
from tests.scenes import junction

MADE_IDS = {"lane_segments", "drivable_areas", "pedestrian_crossings"}
ODD: tuple[Any, ...] = ("odd", ["odd", "odd"], {"odd": 1}, 3.5)

_AV2 = (
    "drivable_areas.*.area_boundary.*.z drivable_areas.*.id pedestrian_crossings.*.edge1.*.z "
    "pedestrian_crossings.*.edge2.*.z pedestrian_crossings.*.id "
    "lane_segments.*.left_lane_boundary.*.z lane_segments.*.left_lane_mark_type "
    "lane_segments.*.right_lane_boundary.*.z lane_segments.*.right_lane_mark_type "
)
UNUSED = {
    "commonroad": "incoming@id intersection@id",
    "scenarionet": "length map_features.line.polyline metadata.counts",
    "av2": f"{_AV2} height_m num_interior_pts",
    "av2-motion": f"{_AV2} city end_timestamp focal_track_id num_timestamps object_category "
    "scenario_id start_timestamp",
    "opendrive": "connection@id header@revMinor junction@id lane@id laneSection/center "
    "predecessor@elementId road/link road/objects road@junction road@length signal@dynamic "
    "signal@id signal@orientation signal@s signal@t successor@elementId",
    "openscenario": "Act/ManeuverGroup Act@name Action@name Center@z "
    "Dimensions@height Event@name Maneuver/Event Maneuver@name "
    "ManeuverGroup/Actors ManeuverGroup/Maneuver ManeuverGroup@name "
    "SpeedActionDynamics@dynamicsDimension SpeedActionDynamics@dynamicsShape "
    "SpeedActionDynamics@value StartTrigger/ConditionGroup Story/Act Story@name "
    "Storyboard/Story Vehicle@name header@revMinor lane@id laneSection/center road@length",
    "nuplan": "boundaries.boundary_type_fid category.description ego_pose.log_token "
    "ego_pose.timestamp ego_pose.vz ego_pose.z intersections.boundary_type_fid "
    "lane_connectors.intersection_fid "
    "lane_connectors.lane_group_connector_fid lane_connectors.turn_type_fid "
    "lane_group_connectors.boundary_type_fid lane_group_connectors.geom "
    "lane_groups_polygons.boundary_type_fid lane_groups_polygons.geom "
    "lanes_polygons.from_edge_fid lanes_polygons.to_edge_fid lanes_polygons.width "
    "lidar_box.confidence lidar_box.height lidar_box.vz lidar_box.z lidar_pc.filename "
    "lidar_pc.lidar_token lidar_pc.scene_token log.date log.location log.logfile "
    "log.map_version log.timestamp log.vehicle_name scenario_tag.agent_track_token "
    "scenario_tag.lidar_pc_token scenario_tag.type scene.goal_ego_pose_token scene.log_token "
    "scene.name scene.roadblock_ids track.height track.length track.width "
    "walkways.boundary_type_fid ",
}
"""What a scene does not use, and parts of roads and stories that may as well be empty."""

ROADS = by_hand(
    type='<type s="0"><speed max="50" unit="km/h"/></type>',
    offset='<laneOffset s="0" a="0.5" b="0" c="0" d="0"/>',
    link='<link><successor elementType="junction" elementId="9"/></link>',
    end='<objects><object type="crosswalk" s="61.5" t="0" hdg="1.5" length="8" width="3"/>'
    f"</objects>{SIGNAL}",
    rest=JUNCTION,
)
LAST = '<LanePosition roadId="1" laneId="-1" s="120" offset="0.1"/>'
STORY = openscenario_files.scenario(
    event(BRAKES, by_time(1)),
    event(CHANGE.format("time", 3, OF_EGO), by_entity(GAP.format(30, "true"), "Other"), "goes"),
    other_does=(openscenario_files.speed(8),),
    other_at=LAST,
)
Variants = Iterator[str]
"""Writes a variant, then yields the name of its field."""


def walk(value: Any, place: str = "", *, is_id: bool = False) -> Iterator[tuple[str, Any, Any]]:
    """The name of each field of nested values, what holds it, and its key."""
    for key in [*value] if isinstance(value, dict) else range(min(len(value), 1)):
        name = f"{place}.{'*' if is_id or isinstance(key, int) else key}".lstrip(".")
        yield name, value, key
        if isinstance(value[key], dict | list):
            yield from walk(value[key], name, is_id=key in MADE_IDS)


def tree_variants(document: Any, write: Callable[[Any], object], *more: Any) -> Variants:
    for name, holder, key in walk(document):
        good = holder[key]
        kind = int | float if isinstance(good, int | float) else type(good)
        for odd in (one for one in (*ODD, *more) if not isinstance(one, kind)):
            holder[key] = odd
            write(document)
            yield name
        holder[key] = good


def xml_variants(file: Path) -> Variants:
    whole = file.read_bytes()
    root = ET.fromstring(whole)
    for element in root.iter():
        for key, good in element.attrib.items():
            element.set(key, "nan")
            file.write_bytes(ET.tostring(root))
            yield f"{element.tag}@{key}"
            element.set(key, good)
        for child in (child for child in element if len(child) or child.text):
            children, text = [*child], child.text
            child[:], child.text = [], "nan"
            file.write_bytes(ET.tostring(root))
            yield f"{element.tag}/{child.tag}"
            child[:], child.text = children, text
    file.write_bytes(whole)


def message_variants(file: Path) -> Variants:
    """Each field of each kind of message, as a number of eight bytes or a whole one."""
    good, seen = Scenario.FromString(waymo_files.scenario()), set[str]()

    def walk_messages(message: Any) -> Iterator[tuple[Any, Any]]:
        for field, _ in message.ListFields():
            yield message, field
        for field, value in message.ListFields():
            if field.message_type is not None:
                for part in value if field.is_repeated else [value]:
                    yield from walk_messages(part)

    for message, field in walk_messages(good):
        name = f"{message.DESCRIPTOR.name}.{field.name}"
        if name not in seen:
            seen.add(name)
            kept = message.SerializeToString()
            message.ClearField(field.name)
            odd = 7 if field.type == field.TYPE_DOUBLE else 7.0
            message.MergeFromString(waymo_files.message((field.number, odd)))
            waymo_files.write(file, good.SerializeToString())
            yield name
            message.Clear()
            message.MergeFromString(kept)


def table_variants(
    file: Path, read: Callable[..., pa.Table], write: Callable[..., Any]
) -> Variants:
    table = read(file)
    for index, column in enumerate(table.column_names):
        good = table[column]
        odd = ["odd"] if good.type != pa.string() else [[1]]
        gap = pa.array([None, *good.to_pylist()[1:]], type=good.type)
        for made in (pa.array(odd * len(good)), gap):
            write(table.set_column(index, column, made), file)
            yield column
    write(table, file)


def database_variants(file: Path) -> Variants:
    good, base = file.read_bytes(), sqlite3.connect(file)
    names = base.execute("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name")
    fields = [
        (table, column)
        for (table,) in names.fetchall()
        if base.execute(f"SELECT 1 FROM {table}").fetchone()
        for _, column, *_, is_key in base.execute(f"PRAGMA table_info({table})").fetchall()
        if not is_key
    ]
    base.close()
    for table, column in fields:
        file.write_bytes(good)
        base = sqlite3.connect(file)
        base.execute(f"UPDATE {table} SET {column} = 'odd'")
        base.commit()
        base.close()
        yield f"{table}.{column}"
    file.write_bytes(good)


def write_json(file: Path, document: Any) -> None:
    file.write_text(json.dumps(document))


def variants(name: str, path: Path) -> Variants:
    if name == "scenarionet":
        yield from tree_variants(description(), partial(store, path.parent), np.ones(3))
    elif name == "waymo":
        yield from message_variants(path)
    files = [path] if path.is_file() else sorted(path.rglob("*"))
    beside = path.parent.glob("*.xodr") if path.suffix == ".xosc" else ()
    for file in [*files, *path.parent.rglob("*.gpkg"), *beside]:
        if file.suffix == ".json":
            yield from tree_variants(json.loads(file.read_text()), partial(write_json, file))
        elif file.suffix == ".feather":
            yield from table_variants(file, feather.read_table, feather.write_feather)
        elif file.suffix == ".parquet":
            yield from table_variants(file, parquet.read_table, parquet.write_table)
        elif file.suffix in (".db", ".gpkg"):
            yield from database_variants(file)
        elif file.suffix in (".xml", ".xosc", ".xodr"):
            yield from xml_variants(file)


@pytest.mark.slow
@pytest.mark.parametrize("name", GOOD)
def test_no_field_of_a_wrong_type_is_passed_over_in_silence(name: str, tmp_path: Path) -> None:
    path, item = GOOD[name](tmp_path), nuplan_files.token(100).hex() if name == "nuplan" else None
    if name == "json":
        write_json(path, scene_to_document(junction()))
    elif name == "opendrive":
        path.write_text(ROADS)
    elif name == "openscenario":
        openscenario_files.write(tmp_path, STORY)

    def read_notes() -> set[str]:
        reading = find_reader(name).read(path, item=item, frame=None, name="made")
        scene_to_document(reading.scene)
        return set(reading.notes)

    notes, silent = read_notes(), set[str]()
    for field in variants(name, path):
        with suppress(InvalidDocument):
            silent |= set() if read_notes() - notes else {field}
    assert silent == set(UNUSED.get(name, "").split())
