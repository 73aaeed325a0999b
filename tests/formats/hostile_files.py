"""Files that are made to hurt whoever reads them, one for each way that a reader could be hurt.

Each function writes into an empty folder and says what to read; none takes long or much itself.
"""

import math
import pickle
import sqlite3
import struct
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import feather, parquet

from augment.formats.waymo.scenario import mask_crc32c
from augment.scene.codec import SCENE_FORMAT
from tests.formats import av2_logs, av2_motion, nuplan_files, openscenario_files, waymo_files
from tests.formats.opendrive_maps import LANES, ROAD, WIDTH, by_hand
from tests.formats.test_commonroad import HEAD, PROBLEM

Made = tuple[str, Path]
"""The name of the reader, and the path."""

MANY = 600_000
ZEROS = np.zeros(MANY)


def av2_rows_that_unpack_to_gigabytes(root: Path) -> Made:
    folder = av2_logs.write_log(root / "log")
    numbers = ("tx_m", "ty_m", "tz_m", "qw", "qx", "qy", "qz", "length_m", "width_m")
    columns = dict.fromkeys(numbers, pa.array(ZEROS))
    columns |= dict.fromkeys(("track_uuid", "category"), _one_text("PEDESTRIAN", MANY))
    table = pa.table(columns | {"timestamp_ns": pa.array(ZEROS.astype(np.int64))})
    packed = pa.ipc.IpcWriteOptions(compression="zstd")
    with pa.ipc.new_file(folder / "annotations.feather", table.schema, options=packed) as file:
        for _ in range(50):
            file.write_table(table)
    return "av2", folder


def av2_very_many_objects(root: Path) -> Made:
    rows = 100_000
    boxes = {name: pa.array(ZEROS[:rows]) for name in ("tx_m", "ty_m", "tz_m", "qx", "qy", "qz")}
    boxes |= {name: pa.array(ZEROS[:rows] + 1.0) for name in ("qw", "length_m", "width_m")}
    boxes["timestamp_ns"] = pa.array(np.full(rows, av2_logs.START_NS))
    boxes["track_uuid"] = pa.array(np.arange(rows).astype("U8"))
    boxes["category"] = _one_text("PEDESTRIAN", rows)
    folder = av2_logs.write_log(root / "log")
    feather.write_feather(pa.table(boxes), folder / "annotations.feather", compression="zstd")
    return "av2", folder


def av2_a_map_of_empty_lists(root: Path) -> Made:
    folder = av2_logs.write_log(root / "log")
    (file,) = (folder / "map").iterdir()
    file.write_text('{"lane_segments": [' + "[]," * 2_000_000 + "[]]}")
    return "av2", folder


def av2_an_intersection_of_ways_without_number(root: Path) -> Made:
    crossed = {"is_intersection": True}
    lanes = {}
    for number in range(40):
        left, right = [(98.0, 230.0), (98.0, 240.0)], [(102.0, 230.0), (102.0, 240.0 + number)]
        after = [one for one in range(40) if one != number]
        lanes[str(number)] = av2_logs.segment(number, left, right, *after, **crossed)
    lanes["99"] = av2_logs.segment(99, [(98, 190), (98, 230)], [(102, 190), (102, 230)], 0)
    return "av2", av2_logs.write_log(root / "log", city={"lane_segments": lanes})


def motion_a_text_told_by_its_difference(root: Path) -> Made:
    folder = av2_motion.write_scenario(root / "made")
    table = pa.Table.from_pylist(av2_motion.rows())
    long = ["x" * 6_000] * table.num_rows
    table = table.set_column(table.column_names.index("track_id"), "track_id", [long])
    file = folder / "scenario_made.parquet"
    encoding = {"track_id": "DELTA_BYTE_ARRAY"}
    plain = [name for name in table.column_names if name != "track_id"]
    parquet.write_table(table, file, use_dictionary=plain, column_encoding=encoding)
    return "av2-motion", folder


def json_a_scene_of_empty_lists(root: Path) -> Made:
    agents = "[]," * 2_000_000
    return _text(root, "json", f'{{"format": "{SCENE_FORMAT}", "agents": [{agents}[]]}}')


def json_that_is_nested_without_an_end(root: Path) -> Made:
    return _text(root, "json", "[" * 2_000_000)


def commonroad_that_laughs_a_billion_times(root: Path) -> Made:
    entities = "".join(f'<!ENTITY a{n + 1} "{f"&a{n};" * 10}">' for n in range(12))
    text = f'<!DOCTYPE commonRoad [<!ENTITY a0 "ha">{entities}]><commonRoad>&a12;</x>'
    return _text(root, "commonroad", text)


def commonroad_that_lasts_very_long(root: Path) -> Made:
    obstacle = (
        '<dynamicObstacle id="{n}"><type>car</type><initialState><position><point><x>0</x><y>0</y>'
        "</point></position><time><exact>{t}</exact></time></initialState></dynamicObstacle>"
    )
    cars = "".join(obstacle.format(n=number, t=9_999) for number in range(20_000))
    head = HEAD.format(version="2020a")
    return _text(root, "commonroad", f"{head}{cars}{PROBLEM}</commonRoad>")


def waymo_a_record_that_claims_two_gigabytes(root: Path) -> Made:
    block = waymo_files.record(waymo_files.scenario())
    head = struct.pack("<Q", 2 << 30)
    check = struct.pack("<I", mask_crc32c(head))
    file = root / "made.tfrecord"
    file.write_bytes(head + check + block[12:])
    return "waymo", file


def waymo_a_record_of_tiny_fields(root: Path) -> Made:
    file = root / "made.tfrecord"
    waymo_files.write(file, waymo_files.message((5, b"x")) + b"\x50\x01" * 5_000_000)
    return "waymo", file


def scenarionet_that_runs_a_command(root: Path) -> Made:
    file = root / "made.pkl"
    file.write_bytes(b"cos\nsystem\n(S'touch /tmp/harmed'\ntR.")
    return "scenarionet", file


def scenarionet_that_doubles_a_list(root: Path) -> Made:
    """Each list holds the one before ten times: 10**30 when written out."""
    body = bytearray(b"(K\x01l\x94")
    for number in range(30):
        body += b"0(" + (b"h" + bytes([number])) * 10 + b"l\x94"
    return _pickled(root, bytes(body) + b".")


def scenarionet_of_nested_tuples_as_a_key(root: Path) -> Made:
    """A key whose hash takes 2 ** 120 steps in C."""
    return _pickled(root, b"}K\x01" + b"\x942\x86" * 120 + b"Ns.")


def scenarionet_of_integers_of_equal_hash(root: Path) -> Made:
    block = b"".join(
        pickle.dumps(number * sys.hash_info.modulus, protocol=2)[2:-1] + b"N"
        for number in range(1, 100_000)
    )
    return _pickled(root, b"}(" + block + b"u.")


def scenarionet_of_a_text_of_a_terabyte(root: Path) -> Made:
    return _pickled(root, b"\x8e" + struct.pack("<Q", 1 << 40) + b".")


def zip_of_very_many_entries(root: Path) -> Made:
    """A zip whose list of contents alone has 4.2 million lines."""
    file, many, said = root / "many.zip", 4_200_000, 0xFFFF
    local = b"PK\3\4" + bytes(26)
    entry = b"PK\1\2" + bytes(24) + struct.pack("<H", 1) + bytes(16) + b"a"
    with file.open("wb") as out:
        out.write(local)
        for _ in range(many // 100_000):
            out.write(entry * 100_000)
        size = many * len(entry)
        out.write(b"PK\5\6" + struct.pack("<HHHHIIH", 0, 0, said, said, size, len(local), 0))
    return "json", file


def nuplan_a_view_without_an_end(root: Path) -> Made:
    return _changed_log(
        root,
        "ALTER TABLE lidar_pc RENAME TO p; CREATE VIEW lidar_pc AS WITH RECURSIVE n(i) AS "
        "(SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT p.* FROM p, n",
    )


def nuplan_a_computed_column(root: Path) -> Made:
    return _changed_log(
        root,
        "ALTER TABLE log DROP COLUMN location; ALTER TABLE log ADD COLUMN location "
        "GENERATED ALWAYS AS (hex(zeroblob(400000000))) VIRTUAL",
    )


def nuplan_a_map_of_broken_shapes(root: Path) -> Made:
    made = _changed_log(root, "SELECT 1")
    (file,) = root.glob("maps/*/*/map.gpkg")
    base = sqlite3.connect(file)
    head = b"GP\0\1" + struct.pack("<i", 4326)
    claim = head + b"\1" + struct.pack("<II", 5, 0xFFFFFFFF)
    base.execute("UPDATE baseline_paths SET geom = ?", (claim,))
    base.commit()
    base.close()
    return made


def opendrive_of_a_million_lane_sections(root: Path) -> Made:
    return _text(root, "opendrive", by_hand(lanes='<laneSection s="0"/>' * 1_000_000))


def opendrive_that_laughs_a_billion_times(root: Path) -> Made:
    _, bomb = commonroad_that_laughs_a_billion_times(root)
    return "opendrive", bomb


def opendrive_of_widths_that_are_none(root: Path) -> Made:
    return _text(root, "opendrive", by_hand(width=WIDTH.replace("3.5", "NaN")))


def opendrive_of_roads_that_follow_each_other_in_circles(root: Path) -> Made:
    """Twenty there and twenty back, each joined to all of the others: 20 ** 8 ways."""
    there, back = range(2, 22), range(22, 42)
    parts = {"junction": "9", "shape": "<line/>", "lanes": LANES.format(width=WIDTH, outer="")}
    parts |= dict.fromkeys(("more", "type", "link", "offset", "end"), "")
    roads = "".join(ROAD.format(id=n, x=0, **parts) for n in there)
    returns = "".join(ROAD.format(id=n, x=100, **parts) for n in back)
    roads += returns.replace('hdg="0"', f'hdg="{math.pi}"')
    links = "".join(
        f'<connection incomingRoad="{a}" connectingRoad="{b}" contactPoint="start"><laneLink '
        'from="-1" to="-1"/></connection>'
        for before, after in ((there, back), (back, there), ([1], back))
        for a in before
        for b in after
    )
    return _text(root, "opendrive", by_hand(rest=f'{roads}<junction id="9">{links}</junction>'))


def openscenario_whose_catalogs_lie_elsewhere(root: Path) -> Made:
    inner, entry = root / "inner", '<Vehicle name="car" vehicleCategory="car"/>'
    (root / "cars.xosc").write_text(openscenario_files.catalog(entry))
    inner.mkdir()
    (inner / "link.xosc").symlink_to(root / "cars.xosc")
    refers = '<CatalogReference catalogName="Cars" entryName="car"/>'
    text = openscenario_files.scenario(other=refers).replace(openscenario_files.CAR, refers)
    return "openscenario", openscenario_files.write(inner, text)


def openscenario_of_a_power_of_powers(root: Path) -> Made:
    at = '<LanePosition roadId="1" laneId="-1" s="${9 ** 9 ** 9 ** 9}"/>'
    text = openscenario_files.scenario().replace(openscenario_files.EGO_AT, at)
    return "openscenario", openscenario_files.write(root, text)


def openscenario_that_is_nested_without_an_end(root: Path) -> Made:
    more = "<Story>" * 200_000 + "</Story>" * 200_000
    text = openscenario_files.scenario(more=more)
    return "openscenario", openscenario_files.write(root, text)


def openscenario_of_parameters_that_name_each_other(root: Path) -> Made:
    declared = "".join(
        f'<ParameterDeclaration name="{a}" parameterType="double" value="${{${b} + 1}}"/>'
        for a, b in ("ab", "ba")
    )
    head = f"<ParameterDeclarations>{declared}</ParameterDeclarations>"
    at = openscenario_files.EGO_AT.replace('"20"', '"$a"')
    text = openscenario_files.scenario(head=head).replace(openscenario_files.EGO_AT, at)
    return "openscenario", openscenario_files.write(root, text)


def _text(root: Path, source: str, text: str) -> Made:
    suffixes = {"json": "json", "commonroad": "xml", "opendrive": "xodr"}
    file = root / f"made.{suffixes[source]}"
    file.write_text(text)
    return source, file


def _pickled(root: Path, instructions: bytes) -> Made:
    file = root / "made.pkl"
    file.write_bytes(b"\x80\x04" + instructions)
    return "scenarionet", file


def _one_text(text: str, rows: int) -> pa.Array:
    """A column of one text all the way, which takes next to nothing."""
    places = pa.array(np.zeros(rows, np.int8))
    return pa.DictionaryArray.from_arrays(places, pa.array([text]))


def _changed_log(root: Path, change: str) -> Made:
    nuplan_files.write_map(root, "sg-one-north")
    file = nuplan_files.write_log(root, "sg-one-north")
    base = sqlite3.connect(file)
    base.executescript(change)
    base.commit()
    base.close()
    return "nuplan", file


HOSTILE: dict[str, Callable[[Path], Made]] = {
    name: made
    for name, made in list(globals().items())
    if name.split("_")[0]
    in {
        *("av2", "motion", "json", "commonroad", "waymo", "scenarionet", "nuplan", "zip"),
        *("opendrive", "openscenario"),
    }
    and callable(made)
}
