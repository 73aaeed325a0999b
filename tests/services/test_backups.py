"""A backup restores into the same installation, to the row and the picture, on any database."""

from __future__ import annotations

import hashlib
import json
import re
import threading
import uuid
import zipfile
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.core.management import CommandError, call_command
from django.db import connection
from django.db.migrations.recorder import MigrationRecorder
from pytest_django import Settings

from arena.management.backups.archive import MANIFEST, ZipSource, read_manifest
from arena.management.backups.taking import take_backup
from arena.models import Vote
from arena.services.ratings import rate
from arena.services.scenario_files import ask_for_file, keep_file
from arena.services.stored_rows import applied_migrations, find_tables, frozen_rows, label_of
from arena.services.studies import close_study
from augment.models import Event, GenerationJob
from augment.services.events import log_event
from augment.services.judging.scenario_export import FORMATS
from tests.study_rows import a_study, matchups_of, vote

pytestmark = pytest.mark.django_db(transaction=True)

NOW = datetime(2026, 11, 22, 12, 0, tzinfo=UTC)
OUTCOMES = ("left", "equal", "right")
PNG = b"\x89PNG picture"


@pytest.fixture(autouse=True)
def _folders(tmp_path: Path, settings: Settings) -> None:
    settings.MEDIA_ROOT = tmp_path / "media"
    settings.VAR_DIR = tmp_path / "var"
    (tmp_path / "var").mkdir()


def quiet(_: str) -> None:
    pass


def note(code: uuid.UUID) -> None:
    log_event(actor=None, verb="note", object_kind="study", object_code=code, after={"ü": 1.5})


def a_full_house() -> None:
    """Rows of many kinds, with times to the microsecond, JSON, decimals and a picture."""
    study = a_study()
    for matchup, outcome in zip(matchups_of(study, "eva"), OUTCOMES, strict=False):
        vote(matchup, outcome)
    for matchup in matchups_of(study, "finn"):
        vote(matchup, "left")
    close_study(study=study)
    study.refresh_from_db()
    rate(study=study, rounds=20)
    note(study.code)
    default_storage.save("bev/one.png", ContentFile(PNG))


def empty() -> None:
    call_command("flush", interactive=False, verbosity=0)
    default_storage.delete("bev/one.png")


def contents(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_what_was_restored_backs_up_to_the_same_bytes(tmp_path: Path) -> None:
    a_full_house()
    first, second = tmp_path / "first.zip", tmp_path / "second.zip"
    take_backup(first, now=NOW, say=quiet)
    votes = list(Vote.objects.order_by("pk").values())
    empty()
    call_command("restore", str(first))
    assert list(Vote.objects.order_by("pk").values()) == votes
    with default_storage.open("bev/one.png") as picture:
        assert picture.read() == PNG
    take_backup(second, now=NOW, say=quiet)
    assert contents(second) == contents(first)


def test_after_a_restore_new_rows_get_new_keys(tmp_path: Path) -> None:
    a_full_house()
    take_backup(tmp_path / "b.zip", now=NOW, say=quiet)
    last = Event.objects.latest("pk").pk
    empty()
    call_command("restore", str(tmp_path / "b.zip"))
    note(uuid.uuid4())
    assert Event.objects.latest("pk").pk > last


def test_a_backup_is_for_its_owner_and_overwrites_nothing(tmp_path: Path) -> None:
    path = tmp_path / "b.zip"
    call_command("backup", str(path))
    assert path.stat().st_mode & 0o777 == 0o600
    before = path.read_bytes()
    with pytest.raises(CommandError, match="is there already"):
        call_command("backup", str(path))
    assert path.read_bytes() == before
    assert sorted(file.name for file in tmp_path.iterdir()) == ["b.zip", "var"]


def test_no_installation_with_rows_is_restored_into(tmp_path: Path) -> None:
    a_full_house()
    path = tmp_path / "b.zip"
    take_backup(path, now=NOW, say=quiet)
    with pytest.raises(CommandError, match=r"empty installation.*arena\.vote"):
        call_command("restore", str(path))


def test_a_database_of_an_earlier_release_is_left_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "b.zip"
    take_backup(path, now=NOW, say=quiet)
    recorder = MigrationRecorder(connection)
    app, name = applied_migrations()[-1].split(".")
    recorder.record_unapplied(app, name)
    try:
        with pytest.raises(CommandError, match="tables of another release"):
            call_command("restore", str(path))
        assert (app, name) not in recorder.applied_migrations()
    finally:
        recorder.record_unapplied(app, name)
        recorder.record_applied(app, name)


def change(path: Path, mend: Callable[[dict[str, bytes]], None]) -> None:
    found = contents(path)
    mend(found)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in found.items():
            archive.writestr(name, content)


def with_manifest(found: dict[str, bytes], **changes: object) -> None:
    found[MANIFEST] = json.dumps(json.loads(found[MANIFEST]) | changes).encode()


def a_stranger(found: dict[str, bytes]) -> None:
    members = json.loads(found[MANIFEST])["members"]
    found["media/../../evil"] = b""
    empty_digest = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
    with_manifest(found, members=members | {"media/../../evil": empty_digest})


@pytest.mark.parametrize(
    ("mend", "says"),
    [
        (lambda found: found.update({"rows/arena.vote.jsonl": b"[]\n"}), "another content"),
        (lambda found: found.pop("rows/arena.vote.jsonl"), "arena.vote.jsonl is missing"),
        (lambda found: found.update({"media/x.png": b"x"}), "media/x.png is not named"),
        (lambda found: found.pop(MANIFEST), "no manifest.json"),
        (lambda found: with_manifest(found, version=2), "version 2"),
        (lambda found: with_manifest(found, format="other"), "its format is not"),
        (lambda found: with_manifest(found, migrations=["arena.0999_x"]), "another release"),
        (a_stranger, "at a place of none"),
    ],
)
def test_what_is_no_whole_backup_of_this_release_is_refused(
    tmp_path: Path, mend: Callable[[dict[str, bytes]], None], says: str
) -> None:
    path = tmp_path / "b.zip"
    take_backup(path, now=NOW, say=quiet)
    change(path, mend)
    with pytest.raises(CommandError, match=says):
        call_command("restore", str(path))
    assert not Vote.objects.exists()


@pytest.mark.parametrize("content", [b"", b"no zip", b"PK\x03\x04 half"])
def test_another_file_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "b.zip"
    path.write_bytes(content)
    with pytest.raises(CommandError, match="no backup"):
        call_command("restore", str(path))


def test_a_row_that_does_not_fit_takes_everything_back(tmp_path: Path) -> None:
    a_full_house()
    path = tmp_path / "b.zip"
    take_backup(path, now=NOW, say=quiet)
    with path.open("rb") as file:
        manifest = read_manifest(ZipSource(file))
    manifest.rows["arena.vote"] += 1
    change(path, lambda found: with_manifest(found, rows=manifest.rows))
    empty()
    with pytest.raises(CommandError, match=r"arena\.vote has"):
        call_command("restore", str(path))
    assert not Vote.objects.exists()
    assert not default_storage.exists("bev/one.png")


def with_rows(found: dict[str, bytes], label: str, content: bytes) -> None:
    """Other rows, with their hash and number."""
    name, manifest = f"rows/{label}.jsonl", json.loads(found[MANIFEST])
    found[name] = content
    members = manifest["members"] | {name: hashlib.sha256(content).hexdigest()}
    rows = manifest["rows"] | {label: len(content.splitlines())}
    with_manifest(found, members=members, rows=rows)


def no_matchups(found: dict[str, bytes]) -> None:
    with_rows(found, "arena.matchup", b"")


def no_times(found: dict[str, bytes]) -> None:
    rows = found["rows/augment.event.jsonl"]
    with_rows(found, "augment.event", re.sub(rb'"20\d\d-[^"]+"', b'"soon"', rows))


@pytest.mark.parametrize(
    ("mend", "says"), [(no_matchups, "don't fit each other"), (no_times, "can't be stored")]
)
def test_rows_that_fit_no_table_take_everything_back(
    tmp_path: Path, mend: Callable[[dict[str, bytes]], None], says: str
) -> None:
    a_full_house()
    path = tmp_path / "b.zip"
    take_backup(path, now=NOW, say=quiet)
    change(path, mend)
    empty()
    with pytest.raises(CommandError, match=says):
        call_command("restore", str(path))
    assert not Vote.objects.exists()
    assert not default_storage.exists("bev/one.png")


def test_a_key_that_can_not_be_written_takes_everything_back(
    tmp_path: Path, settings: Settings
) -> None:
    key = settings.VAR_DIR / "secret_key"
    key.write_text("a key")
    a_full_house()
    take_backup(tmp_path / "b.zip", now=NOW, say=quiet)
    empty()
    key.unlink()
    key.mkdir()
    with pytest.raises(CommandError, match="Nothing was restored"):
        call_command("restore", str(tmp_path / "b.zip"))
    assert not Vote.objects.exists()
    assert not default_storage.exists("bev/one.png")


FLAGS, METHOD = 8, 10
"""Where they stand in the entry of a member, in bytes."""


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


@pytest.mark.parametrize(
    "harm",
    [
        lambda path: spoil(path, "rows/auth.group.jsonl", FLAGS, 1),
        lambda path: spoil(path, "rows/auth.group.jsonl", METHOD, 97),
        lambda path: break_content(path, "rows/auth.group.jsonl"),
        lambda path: spoil(path, MANIFEST, FLAGS, 1),
        lambda path: spoil(path, MANIFEST, METHOD, 97),
    ],
)
def test_what_a_zip_can_not_give_is_said(tmp_path: Path, harm: Callable[[Path], None]) -> None:
    path = tmp_path / "b.zip"
    take_backup(path, now=NOW, say=quiet)
    harm(path)
    with pytest.raises(CommandError, match=r"not whole|no backup"):
        call_command("restore", str(path))


@pytest.mark.parametrize("name", ["media/a//b.png", "media/./b.png", "/b.png", "media/../b"])
def test_a_member_has_one_way_to_be_named(tmp_path: Path, name: str) -> None:
    def add(found: dict[str, bytes]) -> None:
        found[name] = b""
        members = json.loads(found[MANIFEST])["members"]
        with_manifest(found, members=members | {name: hashlib.sha256(b"").hexdigest()})

    path = tmp_path / "b.zip"
    take_backup(path, now=NOW, say=quiet)
    change(path, add)
    with pytest.raises(CommandError, match="at a place of none"):
        call_command("restore", str(path))


def test_zips_that_can_be_made_again_stay_out(tmp_path: Path) -> None:
    job = GenerationJob.objects.create(name="a job")
    row = ask_for_file(job=job, file_format=next(iter(FORMATS)))
    keep_file(row, name="a.zip", content=b"zip", warnings=(), marked=False)
    take_backup(tmp_path / "b.zip", now=NOW, say=quiet)
    names = contents(tmp_path / "b.zip").keys()
    assert "rows/augment.generationjob.jsonl" in names
    assert not [name for name in names if "scenario-files" in name or "scenariofile" in name]


def test_every_table_is_in_it_but_those_that_mean_nothing_later() -> None:
    labels = {label_of(model) for model in find_tables()}
    assert {"arena.vote", "augment.modelcall", "auth.user_groups", "auth.user"} <= labels
    assert not {"sessions.session", "axes.accessattempt", "augment.worker"} & labels


def test_others_write_on_while_a_backup_reads_one_moment() -> None:
    a_full_house()
    before = Event.objects.count()
    written = threading.Event()

    def write() -> None:
        note(uuid.uuid4())
        connection.close()
        written.set()

    with frozen_rows():
        assert Event.objects.count() == before
        writer = threading.Thread(target=write)
        writer.start()
        writer.join(10)
        assert written.is_set()
        assert Event.objects.count() == before
    assert Event.objects.count() == before + 1
