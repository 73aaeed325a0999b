"""Whatever is done to the bytes of a good file, it is read or refused in our own words."""

import shutil
import sqlite3
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.errors import InvalidDocument
from augment.formats.readers import READERS, find_reader
from augment.scene.codec import SCENE_FORMAT, scene_to_document
from tests.formats import av2_logs, av2_motion, nuplan_files, waymo_files
from tests.formats.opendrive_maps import by_hand
from tests.formats.openscenario_files import scenario
from tests.formats.openscenario_files import write as write_scenario
from tests.formats.test_commonroad import newer
from tests.formats.test_scenarionet import description, store
from tests.properties import examples


def _nuplan(root: Path) -> Path:
    nuplan_files.write_map(root, "us-ma-boston")
    return nuplan_files.write_log(root, "us-ma-boston", steps=3)


def _text(root: Path, name: str, text: str) -> Path:
    (root / name).write_text(text)
    return root / name


GOOD: dict[str, Callable[[Path], Path]] = {
    "av2": lambda root: av2_logs.write_log(root / "log"),
    "av2-motion": lambda root: av2_motion.write_scenario(root / "made"),
    "commonroad": lambda root: _text(root, "made.xml", newer()),
    "waymo": lambda root: waymo_files.write(root / "made.tfrecord", waymo_files.scenario()),
    "scenarionet": lambda root: store(root, description()),
    "nuplan": _nuplan,
    "openscenario": lambda root: write_scenario(root, scenario()),
    "opendrive": lambda root: _text(root, "made.xodr", by_hand()),
    "json": lambda root: _text(root, "made.json", f'{{"format": "{SCENE_FORMAT}", "lanes": []}}'),
}


def test_every_reader_is_tried() -> None:
    assert set(GOOD) == set(READERS)


@pytest.fixture(scope="module")
def good() -> Iterator[dict[str, Path]]:
    with tempfile.TemporaryDirectory() as root:
        made = {}
        for name, write in GOOD.items():
            (Path(root) / name).mkdir()
            made[name] = write(Path(root) / name)
        yield made


def read_whole(name: str, path: Path, item: str | None = None) -> None:
    reading = find_reader(name).read(path, item=item, frame=None, name="damaged")
    scene_to_document(reading.scene)


@pytest.mark.parametrize("name", GOOD)
@examples(15)
@given(data=st.data())
def test_damaged_bytes_end_in_a_scene_or_in_our_own_error(
    good: dict[str, Path], name: str, data: st.DataObject
) -> None:
    with tempfile.TemporaryDirectory() as root:
        folder = Path(root) / "all"
        shutil.copytree(good[name] if good[name].is_dir() else good[name].parent, folder)
        files = sorted(file for file in folder.rglob("*") if file.is_file())
        file = data.draw(st.sampled_from(files))
        file.write_bytes(_damaged(file.read_bytes(), data))
        path = folder if good[name].is_dir() else folder / good[name].name
        with suppress(InvalidDocument, MemoryError):  # how `sandbox` says it has its own test
            read_whole(name, path)


def _damaged(block: bytes, data: st.DataObject) -> bytes:
    places = st.integers(0, max(len(block) - 1, 0))
    made = bytearray(block)
    for place in data.draw(st.lists(places, max_size=6)):
        made[place] = data.draw(st.sampled_from((0, 1, 0x7F, 0x80, 0xFF, made[place] ^ 0x10)))
    start = data.draw(places)
    match data.draw(st.sampled_from(("as it is", "cut off", "a hole", "twice"))):
        case "cut off":
            del made[start:]
        case "a hole":
            del made[start : start + data.draw(st.integers(1, 400))]
        case "twice":
            made[start:start] = made[start : start + 200]
    return bytes(made)


VALUES = ("NULL", "''", "'x'", "-1", "1e400", "1e15", "9223372036854775807", "x'ff'", "0.5")


@examples(30)
@given(data=st.data())
def test_any_value_in_any_column_of_a_database_is_read_or_refused(
    good: dict[str, Path], data: st.DataObject
) -> None:
    with tempfile.TemporaryDirectory() as root:
        folder = Path(root) / "all"
        shutil.copytree(good["nuplan"].parent, folder)
        files = sorted(folder.rglob("*.db")) + sorted(folder.rglob("*.gpkg"))
        file = data.draw(st.sampled_from(files))
        base = sqlite3.connect(file)
        named = "SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name"
        table = data.draw(st.sampled_from([name for (name,) in base.execute(named)]))
        columns = [row[1] for row in base.execute(f"PRAGMA table_info({table})")]
        change = f"UPDATE {table} SET {data.draw(st.sampled_from(columns))} = "
        # A column may refuse a value itself.
        with suppress(sqlite3.IntegrityError, sqlite3.OperationalError):
            base.execute(change + data.draw(st.sampled_from(VALUES)))
        base.commit()
        base.close()
        with suppress(InvalidDocument):
            read_whole("nuplan", folder / "made.db", item=nuplan_files.token(100).hex())
