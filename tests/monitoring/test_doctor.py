"""`manage.py doctor` names what is wrong with an installation, and what to do."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from django.core.cache import cache
from django.core.management import CommandError, call_command
from django.db import connection
from django.db.migrations.loader import MigrationLoader
from django.db.migrations.recorder import MigrationRecorder
from pytest_django import Settings

from arena.management.commands.doctor import Level, examine
from arena.people.services import create_person
from arena.serving import readiness
from augment.models import Endpoint, GenerationJob, Worker
from augment.services.clock import DATABASE_TIME
from tests.brokers import MEMORY, broker_at

pytestmark = pytest.mark.django_db


@pytest.fixture(autouse=True)
def _sound(tmp_path: Path, settings: Settings) -> Iterator[None]:
    """An installation with nothing wrong: folders, broker, worker, admin."""
    settings.VAR_DIR = tmp_path
    settings.ALLOWED_HOSTS = ["localhost"]
    settings.MEDIA_ROOT = tmp_path / "media"
    settings.STATIC_ROOT = tmp_path / "static"
    settings.STATIC_ROOT.mkdir()
    (settings.STATIC_ROOT / "a.css").touch()
    create_person(username="root", password="a password", role="admin")
    now = dict.fromkeys(("started_at", "seen_at", "recovered_at"), DATABASE_TIME)
    Worker.objects.create(name="w 1", **now)
    with broker_at(MEMORY):
        yield


def wrong() -> dict[str, Level]:
    return {found.part: found.level for found in examine() if found.level is not Level.FINE}


def test_nothing_is_wrong_with_a_sound_installation(capsys: pytest.CaptureFixture[str]) -> None:
    assert wrong() == {}
    call_command("doctor")
    assert "workers: 1 running" in capsys.readouterr().out


def test_every_wrong_part_comes_with_a_remedy_and_the_command_ends_with_1(
    settings: Settings, capsys: pytest.CaptureFixture[str]
) -> None:
    (settings.STATIC_ROOT / "a.css").unlink()
    with pytest.raises(CommandError, match="One part is broken"):
        call_command("doctor")
    assert "manage.py prepare" in capsys.readouterr().out


def test_a_database_of_another_release(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(readiness, "find_unapplied_migrations", lambda: ["arena.0999_new"])
    cache.clear()
    assert wrong() == {"database": Level.BROKEN}


def test_a_database_of_a_later_release() -> None:
    MigrationRecorder(connection).record_applied("arena", "0999_new")
    cache.clear()
    assert wrong() == {"database": Level.BROKEN}
    assert any("later release: arena.0999_new" in found.text for found in examine())


def test_what_a_squashed_migration_replaced_is_of_no_later_release(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    load = MigrationLoader.load_disk

    def load_without(loader: MigrationLoader) -> None:
        load(loader)
        del loader.disk_migrations["arena", "0002_invitations"]

    monkeypatch.setattr(MigrationLoader, "load_disk", load_without)
    assert ("arena", "0002_invitations") in MigrationLoader(connection).applied_migrations
    assert readiness.find_later_migrations() == []


@pytest.mark.parametrize(
    ("state", "level"),
    [(GenerationJob.State.RUNNING, Level.BROKEN), (GenerationJob.State.FINISHED, Level.DOUBTFUL)],
)
def test_no_worker_is_worse_while_a_job_runs(state: str, level: Level) -> None:
    Worker.objects.all().delete()
    GenerationJob.objects.create(name="a job", state=state)
    assert wrong() == {"workers": level}


@pytest.mark.parametrize("hosts", ["", "=api.example.org"])
def test_a_key_that_is_not_set_or_not_bound_is_named(settings: Settings, hosts: str) -> None:
    settings.KEY_VARIABLES = [f"NOBODY_API_KEY{hosts}"]
    Endpoint.objects.create(
        label="vendor", base_url="https://api.example.org/v1", key_variable="NOBODY_API_KEY"
    )
    assert wrong() == {"endpoint vendor": Level.BROKEN}
    assert any("NOBODY_API_KEY" in found.text for found in examine())


def test_media_that_can_not_be_written(settings: Settings, tmp_path: Path) -> None:
    settings.MEDIA_ROOT = tmp_path / "full"
    settings.MEDIA_ROOT.write_text("a file where a folder should be")
    assert wrong() == {"media": Level.BROKEN}


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"DEBUG": True}, "ARENA_DEBUG=1"),
        ({"ALLOWED_HOSTS": ["arena.example.org"]}, "without HTTPS"),
        ({"HTTPS": True, "PROXIES": 0}, "proxy's address"),
    ],
)
def test_settings_that_will_surprise(
    settings: Settings, changes: dict[str, object], says: str
) -> None:
    for name, value in changes.items():
        setattr(settings, name, value)
    (found,) = (found for found in examine() if found.part == "settings")
    assert (found.level, says in found.text) == (Level.DOUBTFUL, True)
