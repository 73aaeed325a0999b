"""Write a study's folder: whole, or not at all."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

from django.core.files.storage import default_storage
from django.template.loader import render_to_string

from arena.errors import ArenaError
from arena.exports.study_folder.closure import Closure, close_over, travelling_rows
from arena.exports.study_folder.tables import files_for_people
from arena.models import Study
from arena.services.stored_rows import (
    applied_migrations,
    as_line,
    columns_of,
    frozen_rows,
    label_of,
)
from arena.site.services import UNFINISHED
from arena.studies.services.opening import preregistration_sha256

FORMAT, VERSION = "scenario-arena-study", 1
MANIFEST, README = "manifest.json", "README.md"
ROWS, MEDIA = "rows/", "media/"

PACKAGES = ("django", "numpy", "scipy", "pillow", "openai")
"""Whose versions may change a result."""

_NAMES = re.compile(rb"[a-z_]+/(?:[0-9a-z-]+/)?[0-9a-f]{16,64}\.png")
_DIGESTS = re.compile(rb'sha256[":= ]+([0-9a-f]{64})')
PICTURE_COLUMNS = frozenset({"image", "original_image", "left_image", "right_image"})
ASKED = "asked"
"""Where the pictures lie that reviewers were sent; a request names them by their hash."""


def write_study(study: Study, out: Path, *, say: Callable[[str], None]) -> None:
    """Write the folder.

    Args:
        study: A closed one.
        out: A folder that is not there yet.
        say: Told what was written.

    Raises:
        ArenaError: The study is not closed, a job of it still runs, a picture of it is missing, or
            the folder is there.
        Conflict: The votes of a rating are not what they were.
        OSError: It can't be written; nothing is left of it.
    """
    if out.exists():
        raise ArenaError(f"{out} is there already; an export overwrites nothing.")
    if study.state == Study.State.OPEN:
        raise ArenaError(f"The study {study.name!r} is open; close it before it is exported.")
    if study.state == Study.State.CANCELLED:
        raise ArenaError(f"The study {study.name!r} was cancelled; export its votes instead.")
    out.parent.mkdir(parents=True, exist_ok=True)
    beside = Path(tempfile.mkdtemp(dir=out.parent, prefix=f".{out.name}."))
    try:
        with frozen_rows():
            _fill(study, beside, say)
        beside.chmod(0o755)
        beside.rename(out)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _fill(study: Study, folder: Path, say: Callable[[str], None]) -> None:
    closure = close_over(study)
    _refuse_unfinished(closure)
    writer = _Folder(folder)
    counts: dict[str, int] = {}
    for rows in closure.tables():
        label = label_of(rows.model)
        lines = _lines(closure, rows, writer.named)
        counts[label] = writer.write_lines(f"{ROWS}{label}.jsonl", lines)
    say(f"rows: {sum(counts.values())} of {len(counts)} tables")
    _write_media(writer)
    for name, content in files_for_people(closure):
        writer.write(name, content)
    context = {"study": study, "tables": counts, "jobs": len(closure.jobs)}
    writer.write(README, render_to_string("exports/study_readme.md", context).encode())
    say(f"files: {len(writer.digests)}")
    (folder / MANIFEST).write_bytes(_manifest(closure, counts, writer.digests))


def _refuse_unfinished(closure: Closure) -> None:
    for rows in closure.tables():
        states = UNFINISHED.get(rows.model)
        if states and (row := rows.filter(state__in=states).first()):
            raise ArenaError(
                f"The {row._meta.verbose_name} {str(row)!r} of this study still runs "
                f"({row.state}); cancel it, or let it end."
            )


def _lines(closure: Closure, rows: Any, named: set[str]) -> Iterator[bytes]:
    """The lines of a table; the pictures that its columns name are added to `named`."""
    columns = enumerate(columns_of(rows.model))
    places = [place for place, column in columns if column.attname in PICTURE_COLUMNS]
    for row in travelling_rows(closure, rows):
        named |= {row[place] for place in places if row[place]}
        yield as_line(row)


def _write_media(writer: _Folder) -> None:
    for name in sorted(writer.media | writer.named):
        if default_storage.exists(name):
            with default_storage.open(name) as file:
                writer.write(f"{MEDIA}{name}", file.read())
        elif name in writer.named:
            raise ArenaError(f"The picture {name} of this study is missing in ARENA_MEDIA_DIR.")


def _manifest(closure: Closure, counts: dict[str, int], digests: dict[str, str]) -> bytes:
    study = closure.study
    document = {
        "format": FORMAT,
        "version": VERSION,
        "study": {
            "name": study.name,
            "code": str(study.code),
            "seed": study.seed,
            "rules": closure.renamed_rules(),
            "opened_at": study.opened_at.isoformat() if study.opened_at else None,
            "closed_at": study.closed_at.isoformat() if study.closed_at else None,
            "allow_simulated": study.allow_simulated,
            "preregistration": preregistration_sha256(study) or None,
        },
        "packages": {name: version(name) for name in PACKAGES},
        "migrations": applied_migrations(),
        "rows": counts,
        "members": dict(sorted(digests.items())),
    }
    return (json.dumps(document, indent=1, ensure_ascii=False, sort_keys=True) + "\n").encode()


class _Folder:
    """Files with their hashes, and the names of pictures in the rows.

    Those of `named` stand in columns of their own and must be there; those of `media` look like
    names wherever they stand, and may be none.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self.digests: dict[str, str] = {}
        self.media: set[str] = set()
        self.named: set[str] = set()

    def write(self, name: str, content: bytes) -> None:
        self._place(name).write_bytes(content)
        self.digests[name] = hashlib.sha256(content).hexdigest()

    def write_lines(self, name: str, lines: Iterable[bytes]) -> int:
        digest, number = hashlib.sha256(), 0
        with self._place(name).open("wb") as file:
            for line in lines:
                number += 1
                digest.update(line)
                file.write(line)
                self.media |= {found.decode() for found in _NAMES.findall(line)}
                self.media |= {f"{ASKED}/{one.decode()}.png" for one in _DIGESTS.findall(line)}
        self.digests[name] = digest.hexdigest()
        return number

    def _place(self, name: str) -> Path:
        path = self._root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path
