"""`manage.py doctor`: what is wrong with this installation, and what to do.

Each examination looks at one part and says in a sentence what it found. `broken`: something that
people need does not work; `doubtful`: it works, and will surprise somebody.
"""

import json
import os
import shutil
import tempfile
import uuid
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Any

from django.conf import settings
from django.core.files.base import ContentFile
from django.core.files.storage import FileSystemStorage, default_storage
from django.core.management.base import CommandError
from django.db import DatabaseError, connection

from arena.people.queries import find_admins
from arena.serving.readiness import look_at_broker, look_at_database, look_at_workers
from augment.errors import KeyMissing, KeyNotAllowed, MediaFault
from augment.models import Endpoint, GenerationJob
from augment.services import TerminalCommand
from augment.services.endpoints import read_key

ENOUGH_BYTES = 1 << 30


class Level(StrEnum):
    """Severity of a fault."""

    FINE = "fine"
    DOUBTFUL = "doubtful"
    BROKEN = "broken"


@dataclass(frozen=True, slots=True)
class Ailment:
    """One sentence about one part, and what to do where something is to be done."""

    level: Level
    part: str
    text: str
    remedy: str = ""


Ailments = Iterator[Ailment]
fine = partial(Ailment, Level.FINE)
doubtful = partial(Ailment, Level.DOUBTFUL)
broken = partial(Ailment, Level.BROKEN)


class Command(TerminalCommand):
    """Look at every part and say what is wrong with it."""

    help = "Say what is wrong with this installation, and what to do. Ends with 1 where it is bad."
    requires_system_checks: list[str] = []

    arguments = {"--json": {"action": "store_true", "help": "for programs"}}

    def handle(self, *args: Any, **options: Any) -> None:
        """Examine and tell."""
        findings = examine()
        if options["json"]:
            self.stdout.write_data(json.dumps([asdict(finding) for finding in findings], indent=1))
            self.stdout.write_data("\n")
        else:
            for finding in findings:
                self.stdout.write(f"{finding.level:9}{finding.part}: {finding.text}")
                if finding.remedy:
                    self.stdout.write(f"         -> {finding.remedy}")
        broken = sum(finding.level is Level.BROKEN for finding in findings)
        if broken:
            raise CommandError(f"{broken} broken." if broken > 1 else "One part is broken.")


def examine() -> list[Ailment]:
    """Return all findings; what needs the database is left out where there is none."""
    ailments = [*_folders(), *_bucket(), *_settings(), *_broker(), *_database()]
    if ailments[-1].level is Level.BROKEN:
        return ailments
    for look in NEED_THE_DATABASE:
        try:
            ailments.extend(look())
        except DatabaseError as error:
            ailments.append(broken("database", str(error), "See its own log."))
    return ailments


def _folders() -> Ailments:
    folders = [("var", settings.VAR_DIR)]
    if isinstance(default_storage, FileSystemStorage):
        folders.append(("media", Path(settings.MEDIA_ROOT)))
    for part, folder in folders:
        if not folder.exists():
            yield fine(part, f"{folder} is made when something is kept there")
            continue
        try:
            with tempfile.NamedTemporaryFile(dir=folder) as probe:
                probe.write(b"0" * 4096)
                probe.flush()
                os.fsync(probe.fileno())
        except OSError as error:
            text = f"{folder} can't be written to: {error.strerror}"
            yield broken(part, text, "Free space, or mend its owner and mode.")
            continue
        free = shutil.disk_usage(folder).free
        text = f"{folder} can be written to, {free / 1e9:.1f} GB are free"
        if free < ENOUGH_BYTES:
            yield doubtful(part, text, "Free space: below 1 GB work stops soon.")
        else:
            yield fine(part, text)
    if not any(settings.STATIC_ROOT.glob("*")):
        text = "no static files are collected: pages have no style"
        yield broken("static", text, "Run `manage.py prepare`.")


def _bucket() -> Ailments:
    """Write, read and delete a small file where pictures lie in no folder of this machine."""
    if isinstance(default_storage, FileSystemStorage):
        return
    remedy = "Check ARENA_MEDIA_URL, AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and the bucket."
    content = os.urandom(16)
    try:
        name = default_storage.save(f"doctor/{uuid.uuid4()}", ContentFile(content))
        with default_storage.open(name) as file:
            is_the_same = file.read() == content
        default_storage.delete(name)
    except (MediaFault, FileNotFoundError) as fault:
        yield broken("media", str(fault), remedy)
        return
    if is_the_same:
        yield fine("media", "the bucket takes files and gives them back")
    else:
        yield broken("media", "the bucket gives back something else", remedy)


def _settings() -> Ailments:
    outside = sorted(set(settings.ALLOWED_HOSTS) - {"localhost", "127.0.0.1", "[::1]"})
    surprises = (
        (
            settings.DEBUG,
            "ARENA_DEBUG=1 shows the inside of the program to everybody",
            "Leave it out where others come.",
        ),
        (
            outside and not settings.HTTPS,
            f"{', '.join(outside)} is served without HTTPS: sessions can be read along",
            "Set ARENA_HTTPS=1 behind a proxy.",
        ),
        (
            settings.HTTPS and not settings.PROXIES,
            "ARENA_HTTPS=1 with ARENA_PROXIES=0: everybody has the proxy's address",
            "Set ARENA_PROXIES, mostly to 1.",
        ),
    )
    for holds, text, remedy in surprises:
        if holds:
            yield doubtful("settings", text, remedy)


def _database() -> Ailments:
    state = look_at_database()
    if state.is_ok:
        yield fine("database", f"{connection.vendor} answers and has the tables of this release")
        return
    remedies = {
        "unprepared": "Run `manage.py prepare`.",
        "later": "Install that release, or restore a backup of this one into a new database.",
    }
    remedy = remedies.get(state.state, "Check DATABASE_URL and that the server runs.")
    yield broken("database", f"{state.state}: {state.detail}", remedy)


def _broker() -> Ailments:
    state = look_at_broker()
    if state.is_ok:
        yield fine("broker", "takes messages")
    elif settings.REDIS_IS_PRIVATE:
        text = "the private Redis is not running"
        yield broken("broker", text, "`manage.py serve` starts it.")
    else:
        yield broken("broker", state.detail, "Check REDIS_URL and the server.")


def _workers() -> Ailments:
    state = look_at_workers()
    if state.is_ok:
        yield fine("workers", state.detail)
        return
    is_needed = GenerationJob.objects.filter(state=GenerationJob.State.RUNNING).exists()
    say = broken if is_needed or state.state == "stuck" else doubtful
    remedy = "Start `manage.py serve`, or `celery --app arena.config worker` where it is split."
    yield say("workers", state.detail, remedy)


def _accounts() -> Ailments:
    if admins := find_admins().count():
        yield fine("accounts", f"{admins} can administrate")
    else:
        text = "nobody is admin, so nobody can set anything up"
        yield doubtful("accounts", text, "`manage.py add_person NAME --role admin`")


def _endpoints() -> Ailments:
    for endpoint in Endpoint.objects.all():
        try:
            read_key(endpoint)
        except (KeyMissing, KeyNotAllowed) as error:
            remedy = "Set it where the workers run."
            yield broken(f"endpoint {endpoint.label}", str(error), remedy)


NEED_THE_DATABASE: tuple[Callable[[], Ailments], ...] = (_workers, _accounts, _endpoints)
