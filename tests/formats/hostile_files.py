"""Files that are made to hurt whoever reads them, one for each way that a reader could be hurt.

Each function writes into an empty folder and says what to read; none takes long or much itself.
"""

import pickle
import sqlite3
import struct
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import feather, parquet

from augment.formats.waymo.scenario import masked_crc32c
from augment.scene.codec import SCENE_FORMAT
from tests.formats import av2_logs, av2_motion, nuplan_files, waymo_files
from tests.formats.test_commonroad import HEAD, PROBLEM
from tests.formats.test_scenarionet import description

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


def av2_a_buffer_that_claims_a_terabyte(root: Path) -> Made:
    folder = av2_logs.write_log(root / "log")
    file = folder / "city_SE3_egovehicle.feather"
    names = ("tx_m", "ty_m", "tz_m", "qw", "qx", "qy", "qz")
    columns = {name: pa.array(np.arange(4096.0)) for name in names}
    columns["timestamp_ns"] = pa.array(np.arange(4096))
    feather.write_feather(pa.table(columns), file, compression="lz4")
    claim = struct.pack("<q", 4096 * 8)
    file.write_bytes(file.read_bytes().replace(claim, struct.pack("<q", 1 << 40)))
    return "av2", folder


def av2_a_table_that_is_cut_off(root: Path) -> Made:
    folder = av2_logs.write_log(root / "log")
    file = folder / "annotations.feather"
    file.write_bytes(file.read_bytes()[:900])
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


def av2_a_map_of_very_many_lanes(root: Path) -> Made:
    lanes = {}
    for number in range(12_000):
        x = float(number % 100)
        left, right = [(98 + x, 150.0), (98 + x, 190.0)], [(102 + x, 150.0), (102 + x, 190.0)]
        lanes[str(number)] = av2_logs.segment(number, left, right)
    return "av2", av2_logs.write_log(root / "log", city={"lane_segments": lanes})


def av2_an_intersection_of_ways_without_number(root: Path) -> Made:
    crossed = {"is_intersection": True}
    lanes = {}
    for number in range(40):
        left, right = [(98.0, 230.0), (98.0, 240.0)], [(102.0, 230.0), (102.0, 240.0 + number)]
        after = [one for one in range(40) if one != number]
        lanes[str(number)] = av2_logs.segment(number, left, right, *after, **crossed)
    lanes["99"] = av2_logs.segment(99, [(98, 190), (98, 230)], [(102, 190), (102, 230)], 0)
    return "av2", av2_logs.write_log(root / "log", city={"lane_segments": lanes})


def motion_rows_that_unpack_to_gigabytes(root: Path) -> Made:
    folder = av2_motion.write_scenario(root / "made")
    names = ("position_x", "position_y", "heading", "velocity_x", "velocity_y", "timestep")
    columns = dict.fromkeys((*names, "observed"), pa.array(ZEROS))
    columns |= dict.fromkeys(("track_id", "object_type"), _one_text("AV", MANY))
    table = pa.table(columns)
    with parquet.ParquetWriter(
        folder / "scenario_made.parquet", table.schema, compression="zstd"
    ) as file:
        for _ in range(50):
            file.write_table(table)
    return "av2-motion", folder


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


def motion_a_file_that_is_cut_off(root: Path) -> Made:
    folder = av2_motion.write_scenario(root / "made")
    file = folder / "scenario_made.parquet"
    block = file.read_bytes()
    file.write_bytes(block[:400] + bytes(len(block) - 900) + block[-500:])
    return "av2-motion", folder


def json_a_scene_of_empty_lists(root: Path) -> Made:
    file = root / "scene.json"
    file.write_text(f'{{"format": "{SCENE_FORMAT}", "agents": [' + "[]," * 2_000_000 + "[]]}")
    return "json", file


def json_that_is_nested_without_an_end(root: Path) -> Made:
    file = root / "scene.json"
    file.write_text("[" * 2_000_000)
    return "json", file


def commonroad_that_laughs_a_billion_times(root: Path) -> Made:
    entities = "".join(f'<!ENTITY a{n + 1} "{f"&a{n};" * 10}">' for n in range(12))
    file = root / "bomb.xml"
    file.write_text(f'<!DOCTYPE commonRoad [<!ENTITY a0 "ha">{entities}]><commonRoad>&a12;</x>')
    return "commonroad", file


def commonroad_of_too_many_elements(root: Path) -> Made:
    file = root / "many.xml"
    file.write_text(HEAD.format(version="2020a") + "<lanelet/>" * 700_000)
    return "commonroad", file


def commonroad_of_very_long_attributes(root: Path) -> Made:
    file = root / "long.xml"
    with file.open("w") as out:
        out.write(HEAD.format(version="2020a"))
        for _ in range(300):
            out.write(f'<lanelet id="{"9" * 100_000}"/>')
        out.write(f"{PROBLEM}</commonRoad>")
    return "commonroad", file


def commonroad_that_lasts_very_long(root: Path) -> Made:
    obstacle = (
        '<dynamicObstacle id="{n}"><type>car</type><initialState><position><point><x>0</x><y>0</y>'
        "</point></position><time><exact>{t}</exact></time></initialState></dynamicObstacle>"
    )
    cars = "".join(obstacle.format(n=number, t=99_999) for number in range(20_000))
    file = root / "long.xml"
    file.write_text(HEAD.format(version="2020a") + cars + f"{PROBLEM}</commonRoad>")
    return "commonroad", file


def waymo_a_record_that_claims_two_gigabytes(root: Path) -> Made:
    block = waymo_files.record(waymo_files.scenario())
    head = struct.pack("<Q", 2 << 30)
    check = struct.pack("<I", masked_crc32c(head))
    file = root / "made.tfrecord"
    file.write_bytes(head + check + block[12:])
    return "waymo", file


def waymo_a_record_of_tiny_fields(root: Path) -> Made:
    file = root / "made.tfrecord"
    waymo_files.write(file, waymo_files.message((5, b"x")) + b"\x50\x01" * 5_000_000)
    return "waymo", file


def waymo_lines_of_very_many_points(root: Path) -> Made:
    far = waymo_files.points(2, *((980.0 + 1e-3 * n, 502.0) for n in range(11_000)))
    lane = waymo_files.points(8, *((980.0 + 1e-3 * n, 500.0) for n in range(11_000)))
    bounds = [(13, waymo_files.message((1, 0), (2, 10_999), (3, 900), (4, 1)))] * 50
    file = root / "made.tfrecord"
    more = (
        waymo_files.lane(901, (2, 2), *lane, *bounds),
        (8, waymo_files.message((1, 900), (4, waymo_files.message((1, 2), *far)))),
    )
    waymo_files.write(file, waymo_files.scenario(*more))
    return "waymo", file


def scenarionet_that_runs_a_command(root: Path) -> Made:
    file = root / "made.pkl"
    file.write_bytes(b"cos\nsystem\n(S'touch /tmp/harmed'\ntR.")
    return "scenarionet", file


def scenarionet_that_doubles_a_list(root: Path) -> Made:
    lines = b"\x80\x04]\x94" + b"".join(b"](" + b"h\x00" * 0 + b"2e\x94" for _ in range(1))
    file = root / "made.pkl"
    file.write_bytes(lines + b".")
    body = bytearray(b"\x80\x04(K\x01l\x94")
    for _ in range(30):  # each list holds the one before ten times: 10**30 when written out
        body += (
            b"0(" + b"h" + bytes([_]) + b"".join(b"h" + bytes([_]) for _n in range(9)) + b"l\x94"
        )
    file.write_bytes(bytes(body) + b".")
    return "scenarionet", file


def scenarionet_of_an_array_without_bytes(root: Path) -> Made:
    made = description()
    made["tracks"]["ego"]["state"]["position"] = np.zeros((3, 3))
    block = pickle.dumps(made, protocol=4)
    file = root / "made.pkl"
    file.write_bytes(block.replace(b"K\x03K\x03\x86", b"J\xff\xff\xff\x7fK\x03\x86", 1))
    return "scenarionet", file


def scenarionet_of_very_many_steps(root: Path) -> Made:
    made = description()
    made["length"] = 100_000
    made["metadata"].pop("ts")
    made["tracks"] |= {str(number): made["tracks"]["car"] for number in range(5_000)}
    file = root / "made.pkl"
    file.write_bytes(pickle.dumps(made, protocol=4))
    return "scenarionet", file


def scenarionet_of_nested_tuples_as_a_key(root: Path) -> Made:
    """A key whose hash takes 2 ** 120 steps in C."""
    return _pickled(root, b"}K\x01" + b"\x942\x86" * 120 + b"Ns.")


def scenarionet_of_a_key_that_is_too_deep_for_the_stack(root: Path) -> Made:
    return _pickled(root, b"})" + b"\x85" * 390_000 + b"Ns.")


def scenarionet_of_a_number_for_bytes(root: Path) -> Made:
    kind = b"cnumpy\ndtype\n(X\x02\0\0\0f8tR"
    scalar = b"cnumpy.core.multiarray\nscalar\n(" + kind + b"J" + struct.pack("<i", 2_000_000_000)
    return _pickled(root, scalar + b"tR.")


def scenarionet_of_integers_of_equal_hash(root: Path) -> Made:
    block = b"".join(
        pickle.dumps(number * sys.hash_info.modulus, protocol=2)[2:-1] + b"N"
        for number in range(1, 100_000)
    )
    return _pickled(root, b"}(" + block + b"u.")


def scenarionet_of_sets_of_a_long_text(root: Path) -> Made:
    text = "".join(map(chr, range(50_000))).encode()
    head = b"c__builtin__\nset\n\x94X" + struct.pack("<I", len(text)) + text + b"\x940]\x94("
    return _pickled(root, head + b"h\x00h\x01\x85R" * 1_000 + b"e.")


def scenarionet_of_a_place_far_in_its_memory(root: Path) -> Made:
    return _pickled(root, b"Nr\xff\xff\xff\x7f.")


def scenarionet_of_a_text_of_a_terabyte(root: Path) -> Made:
    return _pickled(root, b"\x8e" + struct.pack("<Q", 1 << 40) + b".")


def zip_of_very_many_entries(root: Path) -> Made:
    return _zipped(root, 0xFFFF)


def zip_of_more_entries_than_it_says(root: Path) -> Made:
    return _zipped(root, 1)


def _zipped(root: Path, said: int) -> Made:
    """A zip whose list of contents alone has 4.2 million lines."""
    file, many = root / "many.zip", 4_200_000
    local = b"PK\3\4" + bytes(26)
    entry = b"PK\1\2" + bytes(24) + struct.pack("<H", 1) + bytes(16) + b"a"
    with file.open("wb") as out:
        out.write(local)
        for _ in range(many // 100_000):
            out.write(entry * 100_000)
        size = many * len(entry)
        out.write(b"PK\5\6" + struct.pack("<HHHHIIH", 0, 0, said, said, size, len(local), 0))
    return "json", file


def commonroad_of_one_long_text(root: Path) -> Made:
    file = root / "long.xml"
    text = "a" * 60_000_000
    file.write_text(HEAD.format(version="2020a") + f"<location>{text}</location></commonRoad>")
    return "commonroad", file


def nuplan_of_very_many_tables(root: Path) -> Made:
    made = _changed_log(root, "SELECT 1")
    base = sqlite3.connect(made[1])
    base.execute("PRAGMA writable_schema = ON")
    rows = ((f"t{number}", f"CREATE TABLE t{number}(a)") for number in range(200_000))
    base.executemany("INSERT INTO sqlite_master SELECT 'table', ?1, ?1, 2, ?2", rows)
    base.commit()
    base.close()
    return made


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


def nuplan_a_map_of_lines_without_an_end(root: Path) -> Made:
    made = _changed_log(root, "SELECT 1")
    (file,) = root.glob("maps/*/*/map.gpkg")
    base = sqlite3.connect(file)
    line = b"\1" + struct.pack("<II", 2, 0x7FFFFFFF) + bytes(64)
    head = b"GP\0\1" + struct.pack("<i", 4326)
    base.execute("UPDATE boundaries SET geom = ?", (head + line,))
    base.commit()
    base.close()
    return made


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
    in {"av2", "motion", "json", "commonroad", "waymo", "scenarionet", "nuplan", "zip"}
    and callable(made)
}
