"""Hostile files in a submission: each is refused by name, and the rest is read."""

import json
import os
import pickle
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest

from augment.benchmark.submission import check_submission
from augment.benchmark.values import EntryStatus, SubmittedEntry
from augment.errors import InvalidDocument
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from tests.benchmark.sets import street_set
from tests.benchmark.test_report import CARD_PARTS
from tests.formats.hostile_files import HOSTILE
from tests.scenes import cone

GOOD = modification_to_document(Modification(added=(cone("Agent40", 12.0, 2.0),)))
QUICK = (
    *("json_that_is_nested_without_an_end", "commonroad_that_laughs_a_billion_times"),
    *("commonroad_that_lasts_very_long", "scenarionet_that_runs_a_command"),
    *("scenarionet_of_a_text_of_a_terabyte", "waymo_a_record_that_claims_two_gigabytes"),
)
"""Those that take little time, of them two that end the process."""


def submission(folder: Path, names: tuple[str, ...]) -> Path:
    """Each hostile file for a task of its name, between two good ones."""
    made = folder / "mine"
    made.mkdir()
    (made / "card.json").write_text(json.dumps(CARD_PARTS))
    for name in ("a-first", "z-last"):
        (made / f"{name}.json").write_text(json.dumps(GOOD))
    for name in names:
        scratch = folder / name
        scratch.mkdir()
        _, path = HOSTILE[name](scratch)
        shutil.move(path, made / f"{slug(name)}{path.suffix}")
    return made


def slug(name: str) -> str:
    return name.replace("_", "-")


def check(path: Path, names: tuple[str, ...]) -> dict[str, SubmittedEntry]:
    """The refused entries; the good ones must have been read."""
    benchmark = street_set("a-first", *map(slug, names), "z-last")
    report = check_submission(benchmark, path, checksum="ab" * 32)
    entries = {entry.task: entry for entry in report.entries}
    for name in ("a-first", "z-last"):
        assert entries.pop(name).status is EntryStatus.READ
    for entry in entries.values():
        assert entry.status is EntryStatus.UNREADABLE, entry
        assert entry.file.startswith(entry.task), entry
        assert entry.reason, entry
    return entries


@pytest.mark.slow
def test_hostile_files_in_a_zip_are_refused_and_the_rest_is_read(tmp_path: Path) -> None:
    packed = shutil.make_archive(str(tmp_path / "mine"), "zip", submission(tmp_path, QUICK))
    found = check(Path(packed), QUICK)
    assert "os.system is not on the list" in found["scenarionet-that-runs-a-command"].reason
    assert "1024 MB of memory" in found["scenarionet-of-a-text-of-a-terabyte"].reason


@pytest.mark.slow
def test_too_many_agents_numbers_that_are_none_and_links_are_refused(tmp_path: Path) -> None:
    made = submission(tmp_path, ())
    agent = json.dumps(GOOD["add"][0])
    head = json.dumps(GOOD | {"add": []})
    many = head.replace('"add": []', f'"add": [{",".join([agent] * 1_000_000)}]')
    (made / "million.json").write_text(many)
    (made / "nan.json").write_text(json.dumps(GOOD).replace("12.0", "NaN"))
    np.savez_compressed(made / "bomb.npz", agent=np.zeros((20_000_000, 7)))
    path = {"kind": "points", "points_m": [[1.0, 1.0]] * 500_000}
    led = agent.replace("}", f', "motion": {json.dumps({"path": path})}}}')
    (made / "path.json").write_text(json.dumps(GOOD).replace(agent, led))
    crowd = [cone(f"Agent{number}", 9.0, 2.0) for number in range(100, 1200)]
    crowded = modification_to_document(Modification(added=tuple(crowd)))
    (made / "crowd.json").write_text(json.dumps(crowded))
    for name, key in {"huge": 10**5000, "nul": "a\0b"}.items():
        metadata = {"sdc_id": "x\0y"} if name == "nul" else {}
        parts = {"tracks": {key: {"type": "?"}}, "map_features": {}, "metadata": metadata}
        (made / f"{name}.pkl").write_bytes(pickle.dumps(parts | {"length": 2}))
    os.symlink("/etc/passwd", made / "link.json")
    found = check(made, ("million", "nan", "bomb", "crowd", "nul", "huge", "link", "path"))
    assert "at most 200 items" in found["path"].reason
    assert "bytes; at most" in found["million"].reason
    assert "finite number" in found["nan"].reason
    assert "memory" in found["bomb"].reason
    assert "1100 agents; at most 1010 are taken" in found["crowd"].reason
    assert r"metadata.sdc_id: unknown 'x\x00y'" in found["nul"].reason
    assert "makes its reader fail: ValueError: Exceeds the limit" in found["huge"].reason
    assert found["link"].reason.endswith("link.json: is a link")


@pytest.mark.slow
def test_a_zip_with_links_or_of_too_much_is_refused_as_a_whole(tmp_path: Path) -> None:
    link = zipfile.ZipInfo("near.json")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(tmp_path / "links.zip", "w") as file:
        file.writestr(link, "/etc/passwd")
    _, crowd = HOSTILE["zip_of_very_many_entries"](tmp_path)
    for path in (tmp_path / "links.zip", crowd):
        with pytest.raises(InvalidDocument):
            check(path, ())
