"""What stands in a study's folder for people: tables, documents and transcripts."""

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
from django.db.models import QuerySet
from django.template.loader import render_to_string

from arena.errors import ArenaError
from arena.exports.jobs.displacement_objects import csv_bytes as objects_csv
from arena.exports.jobs.displacement_objects import object_rows
from arena.models import Matchup, Snapshot, Study, Vote
from arena.results.exports.closure import Closure, close_over, travelling_rows
from arena.results.exports.writers import MANIFEST as RATING_MANIFEST
from arena.results.exports.writers import bundle_files
from arena.results.services.stored_rows import (
    applied_migrations,
    as_line,
    columns_of,
    frozen_rows,
    label_of,
)
from arena.services.cells import csv_text
from arena.services.preregistration import FILE_NAME, preregistration_bytes, preregistration_sha256
from arena.services.unfinished_work import UNFINISHED
from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from augment.services.running.transcript_export import record_of
from augment.services.running.transcript_steps import Try, tries_by_augmentation

File = tuple[str, bytes]

PAIRS = (
    "matchup", "judge", "position", "kind", "repeat_of", "scenario", "contestant_a",
    "augmentation_a", "contestant_b", "augmentation_b", "outcome", "both_miss", "skip_reason",
    "aids", "ms_visible", "comment", "at", "vote", "supersedes", "simulated",
)  # fmt: skip
"""One line a vote, superseded ones and skips included, and one for each pair without a vote."""

AUGMENTATIONS = (
    "augmentation", "job", "scenario", "type", "contestant", "sample", "state", "reason",
    "picture", "modification_sha256", "finished_at",
)  # fmt: skip


_AT_ONCE = 100
"""So many transcripts are held in memory; each may have some hundred thousand characters."""


def files_for_people(closure: Closure) -> Iterator[File]:
    """Every file but the rows, the pictures and the README, in a fixed order."""
    yield "pairs.csv", csv_text(PAIRS, _pairs(closure)).encode()
    augmentations = _augmentations(closure)
    yield "augmentations.csv", csv_text(AUGMENTATIONS, map(_augmentation, augmentations)).encode()
    yield "contestants.json", _json([_contestant(found) for found in _contestants(closure)])
    if frozen := preregistration_bytes(closure.study):
        yield FILE_NAME, frozen
    scenarios = _scenarios(closure)
    for scenario in scenarios:
        yield f"scenarios/{scenario.slug}.json", _json(_scenario(scenario))
    scenes = {scenario.base_scene for scenario in scenarios}
    for scene in sorted(scenes, key=lambda one: one.slug):
        yield f"scenes/{scene.slug}.json", _json(scene.document)
    for job in GenerationJob.objects.filter(pk__in=closure.jobs).order_by("pk"):
        yield f"objects/{job.code}.csv", objects_csv(object_rows(job))
    for start in range(0, len(augmentations), _AT_ONCE):
        yield from _made(augmentations[start : start + _AT_ONCE])
    ready = closure.study.snapshots.filter(state=Snapshot.State.READY).order_by("made_at", "pk")
    for snapshot in ready:
        for name, content in sorted(bundle_files(snapshot).items()):
            if name != RATING_MANIFEST:
                yield f"ratings/{snapshot.code}/{name}", content


def _made(augmentations: list[Augmentation]) -> Iterator[File]:
    """What each has made, and the transcript of whom a model was asked for."""
    tries = tries_by_augmentation([augmentation.pk for augmentation in augmentations])
    for augmentation in augmentations:
        yield f"modifications/{augmentation.code}.json", _json(augmentation.modification)
        own = tries.get(augmentation.pk, [])
        if any(step.call for one in own for step in one.steps):
            yield f"transcripts/{augmentation.code}.json", _json(_record(augmentation, own))


def _pairs(closure: Closure) -> Iterator[tuple[object, ...]]:
    found = (
        Matchup.objects.filter(study=closure.study)
        .select_related(
            *("expert__person", "scenario", "repeat_of"),
            *("left__contestant", "right__contestant"),
        )
        .prefetch_related("votes__supersedes")
    )
    # Sorted here: databases order letters each in its own way.
    for matchup in sorted(found, key=lambda one: (one.expert.person.pseudonym, one.position)):
        shown = (
            matchup.code,
            matchup.expert.person.pseudonym,
            matchup.position,
            matchup.kind,
            matchup.repeat_of.code if matchup.repeat_of else "",
            matchup.scenario.slug,
            *(matchup.left.contestant.slug, matchup.left.code),
            *(matchup.right.contestant.slug, matchup.right.code),
        )
        votes: list[Vote | None] = [*sorted(matchup.votes.all(), key=lambda vote: vote.pk)]
        for vote in votes or [None]:
            yield tuple(_text(cell) for cell in (*shown, *_vote(vote)))


def _vote(vote: Vote | None) -> tuple[object, ...]:
    if vote is None:
        return ("",) * 10
    return (
        *(vote.outcome, vote.both_miss, vote.reason, vote.aids, vote.ms_visible, vote.comment),
        *(vote.at.isoformat(), vote.key),
        *(vote.supersedes.key if vote.supersedes else "", vote.is_simulated),
    )


def _augmentations(closure: Closure) -> list[Augmentation]:
    found: QuerySet[Augmentation] = Augmentation.objects.filter(job__in=closure.jobs)
    chosen = found.select_related("job", "scenario__base_scene", "contestant__endpoint")
    return list(chosen.order_by("pk"))


def _augmentation(row: Augmentation) -> tuple[str, ...]:
    document = _json(row.modification)
    cells = (
        *(row.code, row.job.name, row.scenario.slug, row.scenario.type, row.contestant.slug),
        *(row.sample, row.state, row.reason, row.image),
        "" if row.modification is None else hashlib.sha256(document).hexdigest(),
        row.finished_at.isoformat() if row.finished_at else "",
    )
    return tuple(_text(value) for value in cells)


def _contestants(closure: Closure) -> list[Contestant]:
    jobs = Contestant.objects.filter(jobs__in=closure.jobs)
    found = (jobs | closure.study.contestants.all()).distinct()
    return sorted(found.select_related("endpoint"), key=lambda one: one.slug)


def _contestant(found: Contestant) -> dict[str, Any]:
    return {
        "slug": found.slug,
        "name": found.name,
        "kind": found.kind,
        "variant": found.variant,
        "model": found.model,
        "endpoint": found.endpoint.base_url if found.endpoint else None,
        "roles": found.roles,
        "error_rates": found.error_rates,
        "options": found.options,
        "frozen_options": found.frozen_options,
        "sends": found.sends,
    }


def _scenarios(closure: Closure) -> list[Scenario]:
    jobs = Scenario.objects.filter(jobs__in=closure.jobs)
    found = (jobs | closure.study.scenarios.all()).distinct()
    return sorted(found.select_related("base_scene", "paraphrase_of"), key=lambda one: one.slug)


def _scenario(found: Scenario) -> dict[str, Any]:
    return {
        "slug": found.slug,
        "type": found.type,
        "type_label": found.type_label,
        "scene": found.base_scene.slug,
        "source": found.base_scene.source,
        "provenance": found.base_scene.provenance,
        "keep_traffic": found.keep_traffic,
        "traffic_density": found.traffic_density,
        "goal": found.goal,
        "spawned": found.spawned,
        "interplan": found.interplan,
        "set": found.catalogue_set,
        "language": found.language,
        "paraphrase_of": found.paraphrase_of.slug if found.paraphrase_of else None,
        "instruction": found.instruction,
        "reference": found.reference,
        "intent": found.intent,
        "intent_origin": found.intent_origin,
    }


def _record(augmentation: Augmentation, tries: list[Try]) -> dict[str, Any]:
    """The transcript without its pictures, which stand under media, and without a machine."""
    document = record_of(augmentation, tries)
    for attempt in document["attempts"]:
        attempt["worker"] = ""
    return document


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "" if value is None else str(value)


def _json(document: object) -> bytes:
    text = json.dumps(document, indent=1, ensure_ascii=False, sort_keys=True)
    return (text + "\n").encode()


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
