"""A wrong setting stops the start with a sentence that names the variable."""

import os
import sqlite3
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest
from django.core.exceptions import ImproperlyConfigured

from arena.config.env import close_folder, read_environment
from arena.exports.files import write_once
from tests.house.source import ROOT


def start(**environment: str | None) -> subprocess.CompletedProcess[str]:
    """With these variables; None leaves one out."""
    wanted = {**os.environ, **environment}
    return subprocess.run(
        [sys.executable, "manage.py", "diffsettings"],
        cwd=ROOT,
        env={name: value for name, value in wanted.items() if value is not None},
        capture_output=True,
        text=True,
    )


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("ARENA_DEBUG", "maybe", "valid boolean"),
        ("DATABASE_URL", "mysql://root@localhost/arena", "postgresql://USER"),
        ("REDIS_URL", "http://localhost:6379", "redis://HOST:PORT/N"),
        ("DATABASE_URL", "sqlite:///", "sqlite:///PATH"),
        ("REDIS_URL", "redis://localhost:99999/0", "out of range"),
        ("REDIS_URL", "redis://localhost:6379/first", "redis://HOST:PORT/N"),
        ("REDIS_URL", "redis://", "redis://HOST:PORT/N"),
        ("ARENA_HOSTS", " , ", "at least 1 item"),
        ("ARENA_ORIGINS", "arena.example.org", "https://NAME"),
        ("ARENA_HEARTBEAT_S", "60", "at least twice as long"),
        ("ARENA_STALE_AFTER_S", "soon", "valid integer"),
        ("ARENA_STALE_AFTER_S", "1", "greater than or equal to 2"),
        ("ARENA_LOG_LEVEL", "loud", "'debug', 'info', 'warning' or 'error'"),
        ("ARENA_MEDIA_DIR", str(ROOT / "manage.py"), "a folder is needed"),
        ("ARENA_MEDIA_DIR", str(ROOT / "manage.py" / "below"), "a folder is needed"),
        ("ARENA_PLANNERS", "planner", "use PACKAGE.MODULE.CLASS"),
        ("ARENA_KEY_VARIABLES", "ARENA_SECRET_KEY", "no secret of the product"),
        ("ARENA_KEY_VARIABLES", "REDIS_URL=a.example", "no secret of the product"),
        ("ARENA_KEY_VARIABLES", "MY_TOKEN=https://a.example", "use NAME=HOST|HOST"),
        ("ARENA_KEY_VARIABLES", "MY_TOKEN=a.example|", "use NAME=HOST|HOST"),
        ("ARENA_MEDIA_URL", "https://bucket", "use s3://BUCKET/PREFIX"),
        ("ARENA_MEDIA_URL", "s3://", "use s3://BUCKET/PREFIX"),
        ("ARENA_MEDIA_URL", "s3://Bucket_1", "use s3://BUCKET/PREFIX"),
        ("ARENA_MEDIA_URL", "s3://bucket?zone=eu", "use s3://BUCKET/PREFIX"),
        ("ARENA_MEDIA_URL", "s3://bucket?endpoint=minio:9000", "use s3://BUCKET/PREFIX"),
    ],
)
def test_a_wrong_value_is_named_with_what_is_allowed(
    name: str, value: str, allowed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, value)
    with pytest.raises(ImproperlyConfigured, match=name) as refused:
        read_environment()
    assert allowed in str(refused.value).splitlines()[-1]


def test_a_wrong_value_is_named_without_its_password(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (
        ("REDIS_URL", "redis://:{}@localhost:99999/0"),
        ("DATABASE_URL", "mysql://root:{}@localhost/arena"),
        ("ARENA_LLM_PROXY", "http://me:{}@proxy:80"),
    ):
        monkeypatch.setenv(name, value.format("s3@cr:t"))
        with pytest.raises(ImproperlyConfigured, match=name) as refused:
            read_environment()
        assert "***@" in str(refused.value)
        assert "s3" not in str(refused.value)
        assert "cr" not in str(refused.value)
        monkeypatch.delenv(name)


@pytest.mark.parametrize("place", [ROOT, ROOT / "manage.py" / "below"])
def test_a_wrong_value_stops_the_start(place: Path) -> None:
    finished = start(DATABASE_URL=f"sqlite:///{place}")
    assert finished.returncode != 0
    last = finished.stderr.strip().splitlines()[-1]
    assert "DATABASE_URL" in last
    assert "A file is needed" in last


def test_the_secret_key_is_made_once_and_kept_private(tmp_path: Path) -> None:
    environment = {"ARENA_VAR_DIR": str(tmp_path / "var")}
    assert start(**environment).returncode == 0
    kept = tmp_path / "var" / "secret_key"
    first = kept.read_text()
    assert kept.stat().st_mode & 0o077 == 0
    assert start(**environment).returncode == 0
    assert kept.read_text() == first


def modes(folder: Path) -> dict[str, int]:
    return {
        str(path.relative_to(folder)): path.stat().st_mode & 0o777 for path in folder.rglob("*")
    }


def test_what_is_kept_is_readable_by_its_owner_alone(tmp_path: Path) -> None:
    var, elsewhere = tmp_path / "var", tmp_path / "rows" / "db.sqlite3"
    at = {"ARENA_VAR_DIR": str(var), "DATABASE_URL": f"sqlite:///{elsewhere}"}
    assert start(**at).returncode == 0
    with closing(sqlite3.connect(elsewhere)) as rows:
        rows.execute("PRAGMA journal_mode=WAL")
        rows.execute("CREATE TABLE votes (outcome TEXT)")
        assert modes(tmp_path) == {
            **{"var": 0o700, "var/secret_key": 0o600, "rows": 0o700},
            **{f"rows/db.sqlite3{more}": 0o600 for more in ("", "-wal", "-shm")},
        }


def test_what_stood_open_is_closed_at_the_next_start(tmp_path: Path) -> None:
    var, media = tmp_path / "var", tmp_path / "media"
    for folder in (var, media):
        folder.mkdir(mode=0o755)
    at = {"ARENA_VAR_DIR": str(var), "ARENA_MEDIA_DIR": str(media)}
    assert start(**at, DATABASE_URL=None).returncode == 0
    assert {path: mode for path, mode in modes(tmp_path).items() if "/" not in path} == {
        "var": 0o700,
        "media": 0o700,
    }


def test_a_folder_that_is_not_ours_alone_stays_open(tmp_path: Path) -> None:
    for_all = tmp_path / "tmp"
    for_all.mkdir()
    for_all.chmod(0o1777)
    close_folder(for_all)
    assert modes(tmp_path) == {"tmp": 0o777}


def test_processes_that_start_at_once_share_the_key_of_the_first(tmp_path: Path) -> None:
    kept = tmp_path / "secret_key"
    together = threading.Barrier(8)

    def make(number: int) -> str:
        together.wait()
        write_once(kept, f"key {number}".encode())
        return kept.read_text()

    with ThreadPoolExecutor(8) as pool:
        assert len(set(pool.map(make, range(8)))) == 1
    assert list(tmp_path.iterdir()) == [kept]


def test_a_folder_may_have_signs_that_mean_something_in_addresses(tmp_path: Path) -> None:
    folder = tmp_path / "my 100%25 #1?é"
    program = (
        "from django.conf import settings as s; import arena.config;"
        "from kombu.utils.url import parse_url;"
        "print(s.DATABASES['default']['NAME']);"
        "print(s.PRIVATE_REDIS_SOCKET, s.REDIS_URL);"
        "print(parse_url(s.REDIS_URL)['virtual_host'])"
    )
    said = subprocess.run(
        [sys.executable, "-c", program],
        cwd=ROOT,
        env={
            **{k: v for k, v in os.environ.items() if k not in {"DATABASE_URL", "REDIS_URL"}},
            "ARENA_VAR_DIR": str(folder),
            "DJANGO_SETTINGS_MODULE": "arena.config.settings",
        },
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    assert said[0] == str(folder / "arena.sqlite3")
    socket, address = said[1].split(" ")
    assert address == f"redis+socket://{socket}"
    assert said[2] == socket.removeprefix("/")
