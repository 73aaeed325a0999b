"""What is wrong with an installation, and what to do about it.

Each examination looks at one part and says in a sentence what it found. `broken`: something that
people need does not work; `doubtful`: it works, and will surprise somebody.
"""

import os
import shutil
import tempfile
import uuid
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from pathlib import Path

from django.conf import settings
from django.core.files.base import ContentFile
from django.core.files.storage import FileSystemStorage, default_storage
from django.db import DatabaseError, connection

from arena.models import ApiToken
from arena.people.queries import find_admins
from arena.serving.readiness import look_at_broker, look_at_database, look_at_workers
from augment.errors import KeyMissing, KeyNotAllowed, MediaFault
from augment.models import Contestant, Endpoint, EndpointModel, GenerationJob
from augment.services.clock import database_now
from augment.services.endpoints.known_endpoints import key_of

ENOUGH_BYTES = 1 << 30
FAR_APART_S = 60.0
SOON = timedelta(days=7)
RECENTLY = timedelta(days=30)


class Level(StrEnum):
    """How bad it is."""

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


def examine() -> list[Ailment]:
    """Everything; what needs the database is left out where there is none."""
    ailments = [*_folders(), *_bucket(), *_settings(), *_database()]
    if any(finding.part == "database" and finding.level is Level.BROKEN for finding in ailments):
        return [*ailments, *_broker()]
    for look in NEED_THE_DATABASE:
        try:
            ailments.extend(look())
        except DatabaseError as error:
            ailments.append(Ailment(Level.BROKEN, "database", str(error), "See its own log."))
    return ailments


def _folders() -> Ailments:
    folders = [("var", settings.VAR_DIR)]
    if isinstance(default_storage, FileSystemStorage):
        folders.append(("media", Path(settings.MEDIA_ROOT)))
    for part, folder in folders:
        if not folder.exists():
            yield Ailment(Level.FINE, part, f"{folder} is made when something is kept there")
            continue
        try:
            with tempfile.NamedTemporaryFile(dir=folder) as probe:
                probe.write(b"0" * 4096)
                probe.flush()
                os.fsync(probe.fileno())
        except OSError as error:
            text = f"{folder} can't be written to: {error.strerror}"
            yield Ailment(Level.BROKEN, part, text, "Free space, or mend its owner and mode.")
            continue
        free = shutil.disk_usage(folder).free
        text = f"{folder} can be written to, {free / 1e9:.1f} GB are free"
        if free < ENOUGH_BYTES:
            yield Ailment(Level.DOUBTFUL, part, text, "Free space: below 1 GB work stops soon.")
        else:
            yield Ailment(Level.FINE, part, text)
    if not any(settings.STATIC_ROOT.glob("*")):
        text = "no static files are collected: pages have no style"
        yield Ailment(Level.BROKEN, "static", text, "Run `manage.py prepare`.")


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
        yield Ailment(Level.BROKEN, "media", str(fault), remedy)
        return
    if is_the_same:
        yield Ailment(Level.FINE, "media", "the bucket takes files and gives them back")
    else:
        yield Ailment(Level.BROKEN, "media", "the bucket gives back something else", remedy)


def _settings() -> Ailments:
    if settings.DEBUG:
        text = "ARENA_DEBUG=1 shows the inside of the program to everybody"
        yield Ailment(Level.DOUBTFUL, "settings", text, "Leave it out where others come.")
    outside = set(settings.ALLOWED_HOSTS) - {"localhost", "127.0.0.1", "[::1]"}
    if outside and not settings.HTTPS:
        text = f"{', '.join(sorted(outside))} is served without HTTPS: sessions can be read along"
        yield Ailment(Level.DOUBTFUL, "settings", text, "Set ARENA_HTTPS=1 behind a proxy.")
    if settings.HTTPS and not settings.PROXIES:
        text = "ARENA_HTTPS=1 with ARENA_PROXIES=0: everybody has the proxy's address"
        yield Ailment(Level.DOUBTFUL, "settings", text, "Set ARENA_PROXIES, mostly to 1.")


def _database() -> Ailments:
    state = look_at_database()
    kind = connection.vendor
    if not state.is_ok:
        remedy = (
            "Run `manage.py prepare`."
            if state.state == "unprepared"
            else "Check DATABASE_URL and that the server runs."
        )
        yield Ailment(Level.BROKEN, "database", f"{state.state}: {state.detail}", remedy)
        return
    yield Ailment(Level.FINE, "database", f"{kind} answers and has the tables of this release")


def _clock() -> Ailments:
    apart = abs((datetime.now(UTC) - database_now()).total_seconds())
    if apart > FAR_APART_S:
        text = f"this machine's clock and the database's are {apart:.0f} s apart"
        yield Ailment(Level.DOUBTFUL, "clock", text, "Run NTP on both; work is not in danger.")


def _broker() -> Ailments:
    state = look_at_broker()
    if state.is_ok:
        yield Ailment(Level.FINE, "broker", "takes messages")
    elif settings.REDIS_IS_PRIVATE:
        text = "the private Redis is not running"
        yield Ailment(Level.BROKEN, "broker", text, "`manage.py serve` starts it.")
    else:
        yield Ailment(Level.BROKEN, "broker", state.detail, "Check REDIS_URL and the server.")


def _workers() -> Ailments:
    state = look_at_workers()
    if state.is_ok:
        yield Ailment(Level.FINE, "workers", state.detail)
        return
    is_needed = GenerationJob.objects.filter(state=GenerationJob.State.RUNNING).exists()
    level = Level.BROKEN if is_needed or state.state == "stuck" else Level.DOUBTFUL
    remedy = "Start `manage.py serve`, or `celery --app arena.config worker` where it is split."
    yield Ailment(level, "workers", state.detail, remedy)


def _accounts() -> Ailments:
    admins = find_admins().count()
    if not admins:
        text = "nobody is admin, so nobody can set anything up"
        yield Ailment(Level.DOUBTFUL, "accounts", text, "`manage.py add_person NAME --role admin`")
    else:
        yield Ailment(Level.FINE, "accounts", f"{admins} can administrate")


def _endpoints() -> Ailments:
    for endpoint in Endpoint.objects.all():
        try:
            key_of(endpoint)
        except (KeyMissing, KeyNotAllowed) as error:
            remedy = "Set it where the workers run."
            yield Ailment(Level.BROKEN, f"endpoint {endpoint.label}", str(error), remedy)
    asked = Contestant.objects.filter(kind=Contestant.Kind.LLM).values_list("pk", flat=True)
    unpriced = EndpointModel.objects.filter(
        endpoint__is_simulated=False, price_in_usd=None
    ).select_related("endpoint")
    for model in unpriced if asked else ():
        text = f"the price of {model.model} is unknown: caps on money can't hold it"
        remedy = "Enter it, or cap calls and tokens."
        yield Ailment(Level.DOUBTFUL, f"endpoint {model.endpoint.label}", text, remedy)


def _tokens() -> Ailments:
    """Tokens that stopped working, or soon will, and were in use."""
    now = database_now()
    used = ApiToken.objects.filter(
        revoked_at=None,
        last_used_at__gt=now - RECENTLY,
        expires_at__gt=now - RECENTLY,
        expires_at__lt=now + SOON,
    )
    for token in used.order_by("expires_at", "pk"):
        verb = "has expired" if token.expires_at <= now else "expires"
        text = f"{verb} on {token.expires_at:%Y-%m-%d}; it was used on {token.last_used_at:%m-%d}"
        remedy = "Its owner makes a new one on the page of API tokens."
        yield Ailment(Level.DOUBTFUL, f"token {token.name}", text, remedy)


NEED_THE_DATABASE: tuple[Callable[[], Ailments], ...] = (
    _clock,
    _broker,
    _workers,
    _accounts,
    _endpoints,
    _tokens,
)
