"""A backup restores into the same installation, to the row and the picture, on any database."""

import os
import signal
import subprocess
import sys
import threading
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from django.core.files.storage import default_storage
from django.core.management import CommandError, call_command
from django.db import connection
from django.db.migrations.recorder import MigrationRecorder

from arena.management.backups import take_backup
from arena.models import Vote
from arena.results.services.stored_rows import frozen_rows, list_migrations
from augment.models import Event
from augment.services.endpoints.contestants import ensure_builtin
from tests.house.source import ROOT
from tests.services.backup_rows import (
    NOW,
    PICTURE,
    PNG,
    a_full_house,
    contents,
    empty,
    note,
    quiet,
)

pytestmark = [pytest.mark.django_db(transaction=True), pytest.mark.usefixtures("own_folders")]


def test_a_backup_goes_into_an_empty_installation_and_comes_out_the_same(tmp_path: Path) -> None:
    a_full_house()
    first, second = tmp_path / "first.zip", tmp_path / "second.zip"
    take_backup(first, now=NOW, say=quiet)
    votes = list(Vote.objects.order_by("pk").values())
    with pytest.raises(CommandError, match=r"empty installation.*arena\.vote"):
        call_command("restore", str(first))
    last = Event.objects.latest("pk").pk
    empty()
    ensure_builtin()  # as `prepare` and `serve` do, also where nobody has been yet
    call_command("restore", str(first))
    assert list(Vote.objects.order_by("pk").values()) == votes
    with default_storage.open(PICTURE) as picture:
        assert picture.read() == PNG
    take_backup(second, now=NOW, say=quiet)
    assert contents(second) == contents(first)
    note(uuid.uuid4())
    assert Event.objects.latest("pk").pk > last


def test_a_backup_is_for_its_owner_and_overwrites_nothing() -> None:
    path = Path(default_storage.path("b.zip"))  # among the pictures: it does not hold itself
    path.parent.mkdir(parents=True, exist_ok=True)
    call_command("backup", str(path))
    assert path.stat().st_mode & 0o777 == 0o600
    assert not [name for name in contents(path) if name.startswith("media/")]
    before = path.read_bytes()
    with pytest.raises(CommandError, match="is there already"):
        call_command("backup", str(path))
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == ["b.zip"]


def test_a_database_of_an_earlier_release_is_left_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "b.zip"
    take_backup(path, now=NOW, say=quiet)
    note(uuid.uuid4())
    recorder = MigrationRecorder(connection)
    app, name = list_migrations()[-1].split(".")
    recorder.record_unapplied(app, name)
    try:
        with pytest.raises(CommandError, match=r"rows in augment\.event"):
            call_command("restore", str(path))
        assert (app, name) not in recorder.applied_migrations()
    finally:
        recorder.record_unapplied(app, name)
        recorder.record_applied(app, name)


RESTORE_KILLED_WITHIN_A_MIGRATION = """
import os, signal, sys
import django
django.setup()
from django.core.management import call_command
from django.db.migrations import Migration
apply = Migration.apply
def apply_and_die(self, *arguments, **options):
    state = apply(self, *arguments, **options)
    if self.app_label == "arena":
        os.kill(os.getpid(), signal.SIGKILL)
    return state
Migration.apply = apply_and_die
call_command("restore", sys.argv[1])
"""


@contextmanager
def a_new_database(folder: Path) -> Iterator[str]:
    """The address of an empty database of the kind that the tests run on."""
    if connection.vendor == "sqlite":
        yield f"sqlite:///{folder / 'new.sqlite3'}"
        return
    name = f"restored_{os.getpid()}"
    with connection.cursor() as cursor:
        cursor.execute(f"CREATE DATABASE {name}")
        try:
            yield urlsplit(os.environ["DATABASE_URL"])._replace(path=f"/{name}").geturl()
        finally:
            cursor.execute(f"DROP DATABASE {name} WITH (FORCE)")


def command_on(url: str, folder: Path, *arguments: str) -> subprocess.Popen[str]:
    chosen = {"DJANGO_SETTINGS_MODULE": "arena.config.settings", "DATABASE_URL": url}
    chosen |= {"ARENA_VAR_DIR": str(folder / "new"), "ARENA_MEDIA_DIR": str(folder / "new-media")}
    return subprocess.Popen(
        [sys.executable, *arguments],
        cwd=ROOT,
        env=os.environ | chosen,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.slow
def test_a_restore_that_was_killed_while_it_made_tables_is_repeated(tmp_path: Path) -> None:
    backup = str(tmp_path / "b.zip")
    take_backup(Path(backup), now=NOW, say=quiet)
    with a_new_database(tmp_path) as url:
        killed = command_on(url, tmp_path, "-c", RESTORE_KILLED_WITHIN_A_MIGRATION, backup)
        assert (killed.communicate()[1], killed.returncode) == ("", -signal.SIGKILL)
        said, faults = command_on(url, tmp_path, "manage.py", "restore", backup).communicate()
        assert "Restored." in said, faults


@pytest.mark.slow
def test_three_prepare_an_empty_database_at_once(tmp_path: Path) -> None:
    with a_new_database(tmp_path) as url:
        started = [command_on(url, tmp_path, "manage.py", "prepare") for _ in range(3)]
        ended = [(process.communicate()[1], process.returncode) for process in started]
        assert [code for _, code in ended] == [0, 0, 0], [faults for faults, _ in ended]
        check = command_on(url, tmp_path, "manage.py", "migrate", "--check")
        assert (*check.communicate(), check.returncode) == ("", "", 0)


def test_others_write_on_while_a_backup_reads_one_moment() -> None:
    note(uuid.uuid4())
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
