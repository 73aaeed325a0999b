"""Backups that were changed, harmed or made elsewhere: each is refused and nothing is kept."""

import hashlib
import json
import re
import sys
import uuid
import zipfile
from collections.abc import Callable
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from django.apps import apps
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.core.management import CommandError, call_command
from django.test import override_settings

from arena.management.backups import MANIFEST, take_backup
from arena.models import Vote
from arena.results.services.stored_rows import as_line, list_columns
from augment.models import GenerationJob, Scenario, Simulation
from augment.services.driving.simulations import DRIVES
from augment.services.running.runner import AUGMENTATIONS
from tests.services.backup_rows import NOW, PICTURE, a_full_house, contents, empty, quiet

pytestmark = [pytest.mark.django_db(transaction=True), pytest.mark.usefixtures("own_folders")]


Mend = Callable[[dict[str, bytes]], object]
STRANGE = ("media/../../evil", "media/../b", "media/a//b.png", "media/./b.png", "/b.png")


def change(path: Path, mend: Mend) -> None:
    found = contents(path)
    mend(found)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in found.items():
            archive.writestr(name, content)


def with_manifest(found: dict[str, bytes], **changes: object) -> None:
    found[MANIFEST] = json.dumps(json.loads(found[MANIFEST]) | changes).encode()


def with_member(name: str) -> Mend:
    """Add an empty member that the manifest names."""

    def add(found: dict[str, bytes]) -> None:
        found[name] = b""
        members = json.loads(found[MANIFEST])["members"]
        with_manifest(found, members=members | {name: hashlib.sha256(b"").hexdigest()})

    return add


@pytest.fixture(scope="module")
def taken(django_db_setup: None, django_db_blocker: Any, tmp_path_factory: Any) -> list[bytes]:
    """Backups of an empty installation and of a full one."""
    folder: Path = tmp_path_factory.mktemp("backups")
    own = {"MEDIA_ROOT": folder / "media", "VAR_DIR": folder}
    with django_db_blocker.unblock(), override_settings(**own):
        take_backup(folder / "empty.zip", now=NOW, say=quiet)
        a_full_house()
        take_backup(folder / "full.zip", now=NOW, say=quiet)
        empty()
    return [(folder / name).read_bytes() for name in ("empty.zip", "full.zip")]


@pytest.fixture
def path(taken: list[bytes], tmp_path: Path) -> Path:
    """A backup without rows."""
    (tmp_path / "b.zip").write_bytes(taken[0])
    return tmp_path / "b.zip"


def refuse(path: Path, says: str) -> None:
    with pytest.raises(CommandError, match=says):
        call_command("restore", str(path))
    assert not Vote.objects.exists()


NOT_WHOLE: list[tuple[Mend, str]] = [
    (lambda found: found.update({"rows/arena.vote.jsonl": b"[]\n"}), "another content"),
    (lambda found: found.pop("rows/arena.vote.jsonl"), "arena.vote.jsonl is missing"),
    (lambda found: found.update({"media/x.png": b"x"}), "media/x.png is not named"),
    (lambda found: found.pop(MANIFEST), "no manifest.json"),
    (lambda found: with_manifest(found, version=2), "version 2"),
    (lambda found: with_manifest(found, format="other"), "its format is not"),
    (lambda found: with_manifest(found, migrations=["arena.0999_x"]), "another release"),
    *((with_member(name), "at a place of none") for name in STRANGE),
]


def test_what_is_no_whole_backup_of_ours_is_refused(path: Path) -> None:
    whole = path.read_bytes()
    for mend, says in NOT_WHOLE:
        path.write_bytes(whole)
        change(path, mend)
        refuse(path, says)


def with_rows(found: dict[str, bytes], label: str, content: bytes) -> None:
    """Other rows, with their hash and number."""
    name, manifest = f"rows/{label}.jsonl", json.loads(found[MANIFEST])
    found[name] = content
    members = manifest["members"] | {name: hashlib.sha256(content).hexdigest()}
    rows = manifest["rows"] | {label: len(content.splitlines())}
    with_manifest(found, members=members, rows=rows)


def changed(found: dict[str, bytes], label: str, **columns: object) -> None:
    """Other values in every row of a table."""
    names = [column.attname for column in list_columns(apps.get_model(label))]
    rows = [json.loads(line) for line in found[f"rows/{label}.jsonl"].splitlines()]
    lines = [
        as_line(list((dict(zip(names, row, strict=True)) | columns).values())) for row in rows
    ]
    with_rows(found, label, b"".join(lines))


def no_matchups(found: dict[str, bytes]) -> None:
    with_rows(found, "arena.matchup", b"")


def one_vote_more(found: dict[str, bytes]) -> None:
    rows = json.loads(found[MANIFEST])["rows"]
    with_manifest(found, rows=rows | {"arena.vote": rows["arena.vote"] + 1})


def no_times(found: dict[str, bytes]) -> None:
    rows = found["rows/augment.event.jsonl"]
    with_rows(found, "augment.event", re.sub(rb'"20\d\d-[^"]+"', b'"soon"', rows))


def test_rows_that_fit_no_table_take_everything_back(taken: list[bytes], path: Path) -> None:
    rows: list[tuple[Mend, str]] = [
        (no_matchups, "don't fit each other"),
        (one_vote_more, r"arena\.vote has"),
        (no_times, "can't be stored: line 1: at: "),
        (lambda found: changed(found, "arena.vote", key=999999), "line 1: key: 999999"),
        (
            lambda found: changed(found, "augment.augmentation", image="../secret.png"),
            "line 1: .*must be bev/",
        ),
    ]
    for mend, says in rows:
        path.write_bytes(taken[1])
        change(path, mend)
        refuse(path, says)
        assert not default_storage.exists(PICTURE)


FLAGS, METHOD = 8, 10
"""Where they stand in the entry of a member, in bytes."""
NO_ZIP = (b"", b"no zip", b"PK\x03\x04 half")


def spoil(path: Path, member: str, at: int, value: int) -> None:
    content = bytearray(path.read_bytes())
    entry = content.rindex(member.encode()) - 46
    assert content[entry : entry + 4] == b"PK\x01\x02"
    content[entry + at] = value
    path.write_bytes(content)


def break_content(path: Path, member: str) -> None:
    with zipfile.ZipFile(path) as archive:
        found = archive.getinfo(member)
    content = bytearray(path.read_bytes())
    start = found.header_offset + 30 + len(member) + 20  # the 20: sizes of a large file
    content[start : start + 8] = b"\xff" * 8
    path.write_bytes(content)


def test_what_a_zip_can_not_give_is_said(path: Path) -> None:
    rows: list[tuple[Callable[[Path], object], str]] = [
        (lambda path: spoil(path, "rows/auth.group.jsonl", FLAGS, 1), "not whole"),
        (lambda path: spoil(path, "rows/auth.group.jsonl", METHOD, 97), "not whole"),
        (lambda path: break_content(path, "rows/auth.group.jsonl"), "not whole"),
        (lambda path: spoil(path, MANIFEST, FLAGS, 1), "no backup"),
        (lambda path: spoil(path, MANIFEST, METHOD, 97), "no backup"),
        *((partial(Path.write_bytes, data=one), "no backup") for one in NO_ZIP),
    ]
    whole = path.read_bytes()
    for harm, says in rows:
        path.write_bytes(whole)
        harm(path)
        refuse(path, says)


def test_no_work_of_a_backup_goes_on_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "evil_planner.py").write_text("raise SystemExit('imported')")
    monkeypatch.syspath_prepend(tmp_path)
    a_full_house()
    first = GenerationJob.objects.earliest("pk")
    second = GenerationJob.objects.create(name="another")
    moved = first.augmentations.latest("pk")
    first.augmentations.filter(pk=moved.pk).update(job=second)
    first.augmentations.update(state="running", claim=uuid.uuid4(), heartbeat_at=NOW)
    GenerationJob.objects.exclude(pk=first.pk).update(state="finished")
    second.augmentations.update(state="queued")
    drive = Simulation.objects.create(
        scenario=Scenario.objects.all()[0],
        subject=Simulation.Subject.UNMODIFIED,
        planner="evil_planner.Planner",
        offsets="paper",
    )
    default_storage.save("evil/x.png", ContentFile(b"no picture"))
    take_backup(tmp_path / "b.zip", now=NOW, say=quiet)
    empty()
    default_storage.delete("evil/x.png")
    call_command("restore", str(tmp_path / "b.zip"))
    assert AUGMENTATIONS.find_unsent(older_than=timedelta(0)) == []
    assert DRIVES.find_unsent(older_than=timedelta(0)) == []
    assert not DRIVES.perform(drive.pk)
    assert "Start it again" in Simulation.objects.get().reason
    held = GenerationJob.objects.filter(augmentations__state="queued")
    assert set(held.values_list("pk", "state")) == {(first.pk, "paused"), (second.pk, "paused")}
    assert "evil_planner" not in sys.modules
    assert not default_storage.exists("evil/x.png")
