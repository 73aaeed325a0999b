"""The environment variables of the product and what each may hold; see docs/deploying.md."""

import os
import re
import stat
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Literal
from urllib.parse import parse_qsl, urlsplit

import dj_database_url
from django.core.exceptions import ImproperlyConfigured
from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, ValidationError

BASE_DIR = Path(__file__).resolve().parents[2]


def _like(pattern: str, allowed: str) -> AfterValidator:
    def check(text: str) -> str:
        if not re.fullmatch(pattern, text):
            raise ValueError(allowed)
        return text

    return AfterValidator(check)


def _open_folder(path: Path) -> Path:
    """Return an absolute folder that is there, or can be made."""
    path = path.expanduser().resolve()
    nearest = next(place for place in (path, *path.parents) if place.exists())
    if not nearest.is_dir() or not os.access(nearest, os.W_OK):
        raise ValueError("a folder is needed that can be written to")
    return path


def _read_database(url: str) -> dict[str, Any]:
    parts = dict(dj_database_url.parse(url)) if "://" in url else {}
    # A database in memory would be another one for every process.
    if not url.startswith(("sqlite:", "postgres")) or parts.get("NAME") in {None, "", ":memory:"}:
        raise ValueError("use sqlite:///PATH or postgresql://USER:PASSWORD@HOST:PORT/NAME")
    return parts


def _read_redis(url: str) -> str:
    address = urlsplit(url)
    pattern = r"rediss?://[^/\s]+(/\d*)?|redis\+socket://(/[^/]+)+"
    if not re.fullmatch(pattern, url) or (address.port or 1) < 1:  # raises beyond 65535
        raise ValueError("use redis://HOST:PORT/N, rediss://... or redis+socket:///PATH")
    return url


def read_media(url: str) -> dict[str, Any]:
    """Return where pictures are kept, as Django's STORAGES wants it: a folder or a bucket.

    Raises:
        ValueError: It is no address of a bucket.
    """
    if not url:
        return {"BACKEND": "arena.config.storage.WholeFiles"}
    match = re.fullmatch(r"s3://([a-z0-9][a-z0-9.-]{1,61}[a-z0-9])(/[^?]*)?(?:\?(.*))?", url)
    wanted = dict(parse_qsl(match[3])) if match and match[3] else {}
    endpoint = urlsplit(wanted.get("endpoint", "https://given"))
    is_address = endpoint.scheme in {"http", "https"} and bool(endpoint.hostname)
    if not match or not wanted.keys() <= {"endpoint", "region"} or not is_address:
        raise ValueError(
            "use s3://BUCKET/PREFIX?endpoint=https://HOST:PORT&region=REGION, all but BUCKET "
            "optional"
        )
    options = {
        "bucket_name": match[1],
        "location": (match[2] or "").strip("/"),
        "endpoint_url": wanted.get("endpoint"),
        "region_name": wanted.get("region"),
    }
    return {"BACKEND": "arena.config.s3_media.S3Media", "OPTIONS": options}


Folder = Annotated[Path, AfterValidator(_open_folder)]
Origin = Annotated[str, _like(r"https?://[^/\s]+", "use https://NAME")]
Planner = Annotated[str, _like(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)+", "use PACKAGE.MODULE.CLASS")]
_HOST = r"(\[[\da-fA-F:]+\]|[^\s/\\@?#|=:\[\]]+)(:\d{1,5})?"
KeyVariable = Annotated[
    str,
    _like(
        r"(?!ARENA_|(DATABASE|REDIS)_URL(=|$)|AWS_)[A-Za-z_]\w*"
        rf"(={_HOST}(\|{_HOST})*)?",
        "use NAME=HOST|HOST with the name of a variable that is no secret of the product itself",
    ),
]
Comma = BeforeValidator(lambda text: [part.strip() for part in text.split(",") if part.strip()])


class Environment(BaseModel):
    """The variables with their defaults; lists are separated by commas."""

    ARENA_VAR_DIR: Folder = BASE_DIR / "var"
    ARENA_SECRET_KEY: str = ""
    DATABASE_URL: Annotated[dict[str, Any], BeforeValidator(_read_database)] | None = None
    REDIS_URL: Annotated[str, AfterValidator(_read_redis)] = ""
    ARENA_MEDIA_DIR: Folder = BASE_DIR / "media"
    ARENA_MEDIA_URL: Annotated[dict[str, Any], BeforeValidator(read_media)] = read_media("")
    ARENA_UPLOAD_MB: int = Field(200, ge=1, le=4096)
    ARENA_SUBMISSIONS_A_DAY: int = Field(5, ge=1, le=1000)
    ARENA_DEBUG: bool = False
    ARENA_HOSTS: Annotated[list[str], Comma] = Field(
        ["localhost", "127.0.0.1", "[::1]"], min_length=1
    )
    ARENA_ORIGINS: Annotated[list[Origin], Comma] = []
    ARENA_HTTPS: bool = False
    ARENA_PROXIES: int = Field(0, ge=0, le=9)
    ARENA_LOGIN_FAILURES_ADDRESS: int = Field(50, ge=1, le=100_000)
    ARENA_HEARTBEAT_S: int = Field(5, ge=1, le=60)
    ARENA_STALE_AFTER_S: int = Field(20, ge=2, le=3600)
    ARENA_RECOVER_EVERY_S: int = Field(30, ge=1, le=3600)
    ARENA_PLANNERS: Annotated[list[Planner], Comma] = []
    ARENA_LLM_QUEUE_S: int = Field(1800, ge=1, le=86_400)
    ARENA_LLM_TIMEOUT_S: int = Field(120, ge=1, le=3600)
    ARENA_LLM_PROXY: Annotated[str, _like(r"(http://[^/:\s]+:\d+)?", "use http://HOST:PORT")] = ""
    ARENA_KEY_VARIABLES: Annotated[list[KeyVariable], Comma] = []
    ARENA_VOTES_PER_S: int = Field(4, ge=1, le=1000)
    ARENA_LOG_LEVEL: Literal["debug", "info", "warning", "error"] = "info"
    ARENA_LOG_FORM: Literal["line", "json"] = "line"
    ARENA_METRICS_TOKEN: str = ""


def read_environment() -> Environment:
    """Return the settings of this process; an empty text leaves a default.

    Raises:
        ImproperlyConfigured: Values can't be used; a line each names variable and what is allowed.
    """
    texts = {name: os.environ.get(name, "").strip() for name in Environment.model_fields}
    try:
        read = Environment.model_validate({n: text for n, text in texts.items() if text})
    except ValidationError as error:
        shown = {name: re.sub("//.*@", "//***@", text) for name, text in texts.items()}
        lines = [
            f"{fault['loc'][0]}={shown[str(fault['loc'][0])]!r} can't be used: "
            f"{fault['msg'].removeprefix('Value error, ')}."
            for fault in error.errors()
        ]
        raise ImproperlyConfigured("\n".join(lines)) from None
    if read.ARENA_STALE_AFTER_S < 2 * read.ARENA_HEARTBEAT_S:
        # Else every row would be taken away from the worker that is busy with it.
        raise ImproperlyConfigured(
            "ARENA_STALE_AFTER_S must be at least twice as long as ARENA_HEARTBEAT_S."
        )
    return read


def close_folder(folder: Path) -> None:
    """Make a folder that only its owner reads; one for all, or around the program, stays open."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not folder.stat().st_mode & stat.S_ISVTX and not BASE_DIR.is_relative_to(folder):
        with suppress(OSError):  # somebody else's, or on a disk without modes
            folder.chmod(0o700)


def make_sqlite_file(path: Path) -> None:
    """Make a file that only its owner reads; what SQLite puts beside it has the same mode.

    Raises:
        ImproperlyConfigured: There can't be a file at that place.
    """
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        os.close(os.open(path, os.O_RDONLY | os.O_CREAT, 0o600))
    except OSError as error:
        raise ImproperlyConfigured(
            f"DATABASE_URL: {path} can't be used: {error.strerror}. A file is needed that can be "
            "written to."
        ) from error
