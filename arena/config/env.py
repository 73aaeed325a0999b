"""Typed readers of the environment; a wrong value stops the start with a sentence."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import parse_qsl, urlsplit

import dj_database_url
from django.core.exceptions import ImproperlyConfigured

from arena.config import private

T = TypeVar("T")

_OWN = ("DATABASE_URL", "REDIS_URL", "AWS_SECRET_ACCESS_KEY", "AWS_SESSION_TOKEN")
"""Secrets of the product itself, beside those called ARENA_..."""

_TRUE, _FALSE = {"1", "true", "yes", "on"}, {"0", "false", "no", "off", ""}


def read(name: str, default: T, parse: Callable[[str], T], allowed: str) -> T:
    """The value of an environment variable, or the default where it is not set.

    Raises:
        ImproperlyConfigured: The value can't be parsed; the sentence names variable and choices.
    """
    raw = os.environ.get(name)
    if raw is None:
        return default
    try:
        return parse(raw.strip())
    except (ValueError, KeyError) as error:
        raise ImproperlyConfigured(f"{name}={raw!r} can't be used: {allowed}.") from error


def boolean(name: str, *, default: bool) -> bool:
    """A switch: 1/true/yes/on or 0/false/no/off."""

    def parse(raw: str) -> bool:
        word = raw.lower()
        if word not in _TRUE | _FALSE:
            raise ValueError(word)
        return word in _TRUE

    return read(name, default, parse, "use 1 or 0 (true, yes, on; false, no, off)")


def integer(name: str, *, default: int, low: int, high: int) -> int:
    """A whole number from low to high."""

    def parse(raw: str) -> int:
        number = int(raw)
        if not low <= number <= high:
            raise ValueError(raw)
        return number

    return read(name, default, parse, f"a whole number from {low} to {high} is needed")


def names(name: str, *, default: tuple[str, ...]) -> list[str]:
    """A list of at least one name, separated by commas."""

    def parse(raw: str) -> tuple[str, ...]:
        parts = tuple(part.strip() for part in raw.split(",") if part.strip())
        if not parts:
            raise ValueError(raw)
        return parts

    return list(read(name, default, parse, "names separated by commas are needed"))


def dotted_paths(name: str) -> tuple[str, ...]:
    """Dotted paths of Python classes, separated by commas; none by default."""

    def parse(raw: str) -> tuple[str, ...]:
        paths = tuple(path.strip() for path in raw.split(",") if path.strip())
        for path in paths:
            if "." not in path or not all(part.isidentifier() for part in path.split(".")):
                raise ValueError(path)
        return paths

    return read(name, (), parse, "use PACKAGE.MODULE.CLASS, more than one separated by commas")


def origins(name: str) -> list[str]:
    """Addresses of other servers with their scheme, separated by commas; none by default."""

    def parse(raw: str) -> list[str]:
        parts = [part.strip() for part in raw.split(",") if part.strip()]
        for part in parts:
            address = urlsplit(part)
            if address.scheme not in {"http", "https"} or not address.hostname:
                raise ValueError(part)
        return parts

    return read(name, [], parse, "use https://NAME, more than one separated by commas")


def proxy(name: str) -> str:
    """The address of an HTTP proxy; none by default."""

    def parse(raw: str) -> str:
        address = urlsplit(raw)
        if raw and (address.scheme != "http" or not address.hostname or not address.port):
            raise ValueError(raw)
        return raw

    return read(name, "", parse, "use http://HOST:PORT")


def key_variables(name: str) -> list[str]:
    """Names of environment variables with keys of language models, separated by commas."""

    def parse(raw: str) -> list[str]:
        parts = [part.strip() for part in raw.split(",") if part.strip()]
        for part in parts:
            if not part.isidentifier() or part.startswith("ARENA_") or part in _OWN:
                raise ValueError(part)
        return parts

    own = ", ".join(_OWN)
    return read(name, [], parse, f"names are needed, none of ARENA_*, {own}, separated by commas")


def at_least_twice(longer: str, longer_s: int, shorter: str, shorter_s: int) -> None:
    """Two settings that only work together.

    Raises:
        ImproperlyConfigured: The longer time is not twice the shorter one.
    """
    if longer_s < 2 * shorter_s:
        raise ImproperlyConfigured(
            f"{longer}={longer_s} can't be used with {shorter}={shorter_s}: it must be at least "
            "twice as long."
        )


def choice(name: str, *, default: str, allowed: tuple[str, ...]) -> str:
    """One word of a closed set."""
    table = {word: word for word in allowed}
    return read(
        name, default, lambda raw: table[raw.lower()], f"one of {', '.join(allowed)} is needed"
    )


def folder(name: str, *, default: Path) -> Path:
    """An absolute folder; it need not exist yet, but it must be possible to make it."""

    def parse(raw: str) -> Path:
        path = Path(raw).expanduser().resolve()
        nearest = next(place for place in (path, *path.parents) if place.exists())
        if not raw or not nearest.is_dir() or not os.access(nearest, os.W_OK):
            raise ValueError(raw)
        return path

    return read(name, default, parse, "a folder is needed that can be written to")


def media(name: str) -> dict[str, Any]:
    """Where pictures are kept, as Django's STORAGES wants it: a folder unless a bucket is named.

    s3://BUCKET, s3://BUCKET/PREFIX, both with ?endpoint=https://HOST:PORT&region=REGION.
    """
    folder: dict[str, Any] = {"BACKEND": "arena.config.storage.WholeFiles"}

    def parse(raw: str) -> dict[str, Any]:
        if not raw:  # what a compose file passes on where nothing is set
            return folder
        address = urlsplit(raw)
        wanted = dict(parse_qsl(address.query, strict_parsing=True)) if address.query else {}
        endpoint = urlsplit(wanted.get("endpoint", "https://given"))
        if (
            address.scheme != "s3"
            or not re.fullmatch(r"[a-z0-9][a-z0-9.-]{1,61}[a-z0-9]", address.netloc)
            or not wanted.keys() <= {"endpoint", "region"}
            or endpoint.scheme not in {"http", "https"}
            or not endpoint.hostname
        ):
            raise ValueError(raw)
        options = {
            "bucket_name": address.netloc,
            "location": address.path.strip("/"),
            "endpoint_url": wanted.get("endpoint"),
            "region_name": wanted.get("region"),
        }
        return {"BACKEND": "arena.config.s3_media.S3Media", "OPTIONS": options}

    allowed = (
        "use s3://BUCKET/PREFIX?endpoint=https://HOST:PORT&region=REGION, all but BUCKET optional"
    )
    return read(name, folder, parse, allowed)


def database(name: str, *, default: Path) -> dict[str, object]:
    """A database by its URL: sqlite:///PATH or postgresql://USER:PASSWORD@HOST:PORT/NAME.

    The default is an SQLite file, given as a path: not every path can be written as a URL.
    """

    def parse(raw: str) -> dict[str, object]:
        if urlsplit(raw).scheme not in {"sqlite", "postgres", "postgresql"}:
            raise ValueError(raw)
        parts = dict(dj_database_url.parse(raw))
        if parts["NAME"] in {"", ":memory:"}:  # every process would have one of its own
            raise ValueError(raw)
        return parts

    allowed = "use sqlite:///PATH or postgresql://USER:PASSWORD@HOST:PORT/NAME"
    standard: dict[str, object] = {"ENGINE": "django.db.backends.sqlite3", "NAME": str(default)}
    return read(name, standard, parse, allowed)


def sqlite_file(name: str, path: Path) -> None:
    """Make an SQLite file that only its owner reads, or mend one that others could read.

    Raises:
        ImproperlyConfigured: There can't be a file at that place.
    """
    try:
        private.make_folder(path.parent)
        private.make_database(path)
    except OSError as error:
        raise ImproperlyConfigured(
            f"{name}: {path} can't be used: {error.strerror}. A file is needed that can be "
            "written to."
        ) from error


def redis(name: str, *, default: str) -> str:
    """The URL of a Redis: redis://HOST:PORT/N, rediss:// or unix (redis+socket:///PATH)."""

    def parse(raw: str) -> str:
        address = urlsplit(raw)
        if address.scheme == "redis+socket":
            place = address.path
        elif address.scheme in {"redis", "rediss"}:
            place = address.hostname or ""
            int(address.path.strip("/") or 0)
            _ = address.port  # raises where it is no port
        else:
            place = ""
        if not place:
            raise ValueError(raw)
        return raw

    return read(
        name, default, parse, "use redis://HOST:PORT/N, rediss://... or redis+socket:///PATH"
    )
