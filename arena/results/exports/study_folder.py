"""Write a study's folder: its rows, its pictures, and tables and documents for people."""

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
from arena.exports.cells import csv_text
from arena.jobs.exports.tables import object_sheet, sheet_csv
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
from arena.site.services import UNFINISHED
from arena.studies.services.opening import FILE_NAME, preregistration_sha256
from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from augment.services.running.transcript_records import record_of, tries_by_augmentation

File = tuple[str, bytes]

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

PAIRS = (
    "matchup",
    "judge",
    "position",
    "kind",
    "repeat_of",
    "scenario",
    "contestant_a",
    "augmentation_a",
    "contestant_b",
    "augmentation_b",
    "outcome",
    "both_miss",
    "skip_reason",
    "aids",
    "ms_visible",
    "comment",
    "at",
    "vote",
    "supersedes",
    "simulated",
)
"""One line a vote, superseded ones and skips included, and one for each pair without a vote."""

AUGMENTATIONS = (
    "augmentation",
    "job",
    "scenario",
    "type",
    "contestant",
    "sample",
    "state",
    "reason",
    "picture",
    "modification_sha256",
    "finished_at",
)

_CONTESTANT = (
    "slug",
    "name",
    "kind",
    "variant",
    "model",
    "roles",
    "error_rates",
    "options",
    "frozen_options",
    "sends",
)
_SCENARIO = (
    "slug",
    "type",
    "type_label",
    "keep_traffic",
    "traffic_density",
    "goal",
    "spawned",
    "interplan",
    "language",
    "instruction",
    "reference",
    "intent",
    "intent_origin",
)

_AT_ONCE = 100
"""So many transcripts are held in memory; each may have some hundred thousand characters."""


def write_study(study: Study, out: Path, *, say: Callable[[str], None]) -> None:
    """Write the folder: whole, or not at all.

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

    def write(self, name: str, pieces: Iterable[bytes]) -> None:
        path = self._root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        digest = hashlib.sha256()
        with path.open("wb") as file:
            for piece in pieces:
                digest.update(piece)
                file.write(piece)
        self.digests[name] = digest.hexdigest()

    def write_rows(self, closure: Closure, rows: Any) -> int:
        """Write the rows of a table and note the pictures that they name; how many there are."""
        columns = enumerate(columns_of(rows.model))
        places = [place for place, column in columns if column.attname in PICTURE_COLUMNS]
        written = []

        def lines() -> Iterator[bytes]:
            for row in travelling_rows(closure, rows):
                line = as_line(row)
                self.named |= {row[place] for place in places if row[place]}
                self.media |= {name.decode() for name in _NAMES.findall(line)}
                self.media |= {f"{ASKED}/{found.decode()}.png" for found in _DIGESTS.findall(line)}
                written.append(len(line))
                yield line

        self.write(f"{ROWS}{label_of(rows.model)}.jsonl", lines())
        return len(written)


# --- Private -----------------------------------------------------------------------------------


def _fill(study: Study, root: Path, say: Callable[[str], None]) -> None:
    closure = close_over(study)
    _refuse_unfinished(closure)
    folder = _Folder(root)
    counts = {label_of(rows.model): folder.write_rows(closure, rows) for rows in closure.tables()}
    say(f"rows: {sum(counts.values())} of {len(counts)} tables")
    for name in sorted(folder.media | folder.named):
        if default_storage.exists(name):
            with default_storage.open(name) as file:
                folder.write(f"{MEDIA}{name}", file.chunks())
        elif name in folder.named:
            raise ArenaError(f"The picture {name} of this study is missing in ARENA_MEDIA_DIR.")
    for name, content in _files_for_people(closure):
        folder.write(name, [content])
    context = {"study": study, "tables": counts, "jobs": len(closure.jobs)}
    folder.write(README, [render_to_string("exports/study_readme.md", context).encode()])
    say(f"files: {len(folder.digests)}")
    (root / MANIFEST).write_bytes(_json(_manifest(closure, counts, folder.digests)))


def _refuse_unfinished(closure: Closure) -> None:
    for rows in closure.tables():
        states = UNFINISHED.get(rows.model)
        if states and (row := rows.filter(state__in=states).first()):
            raise ArenaError(
                f"The {row._meta.verbose_name} {str(row)!r} of this study still runs "
                f"({row.state}); cancel it, or let it end."
            )


def _manifest(closure: Closure, counts: dict[str, int], digests: dict[str, str]) -> dict[str, Any]:
    study = closure.study
    return {
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
        "members": digests,
    }


def _files_for_people(closure: Closure) -> Iterator[File]:
    """Every file but the rows, the pictures and the README, in a fixed order."""
    study, jobs = closure.study, closure.jobs
    augmentations = list(
        Augmentation.objects.filter(job__in=jobs)
        .select_related("job", "scenario__base_scene", "contestant__endpoint")
        .order_by("pk")
    )
    yield "pairs.csv", csv_text(PAIRS, _pairs(study)).encode()
    yield "augmentations.csv", csv_text(AUGMENTATIONS, map(_cells_of, augmentations)).encode()
    contestants = Contestant.objects.filter(jobs__in=jobs) | study.contestants.all()
    rows = contestants.distinct().select_related("endpoint")
    documents = [_contestant(row) for row in sorted(rows, key=lambda row: row.slug)]
    yield "contestants.json", _json(documents)
    if frozen := study.preregistration.encode():
        yield FILE_NAME, frozen
    places = Scenario.objects.filter(jobs__in=jobs) | study.scenarios.all()
    related = places.distinct().select_related("base_scene", "paraphrase_of")
    scenarios = sorted(related, key=lambda row: row.slug)
    for scenario in scenarios:
        yield f"scenarios/{scenario.slug}.json", _json(_scenario(scenario))
    scenes = {scenario.base_scene for scenario in scenarios}
    for scene in sorted(scenes, key=lambda row: row.slug):
        yield f"scenes/{scene.slug}.json", _json(scene.document)
    for job in GenerationJob.objects.filter(pk__in=jobs).order_by("pk"):
        yield f"objects/{job.code}.csv", sheet_csv(object_sheet(job))
    for start in range(0, len(augmentations), _AT_ONCE):
        yield from _made(augmentations[start : start + _AT_ONCE])
    ready = study.snapshots.filter(state=Snapshot.State.READY).order_by("made_at", "pk")
    for snapshot in ready:
        for name, content in sorted(bundle_files(snapshot).items()):
            if name != RATING_MANIFEST:
                yield f"ratings/{snapshot.code}/{name}", content


def _made(augmentations: list[Augmentation]) -> Iterator[File]:
    """What each has made, and the transcript of whom a model was asked for.

    Transcripts come without their pictures, which stand under media, and without a machine.
    """
    tries = tries_by_augmentation([augmentation.pk for augmentation in augmentations])
    for augmentation in augmentations:
        yield f"modifications/{augmentation.code}.json", _json(augmentation.modification)
        own = tries.get(augmentation.pk, [])
        if any(step.call for attempt in own for step in attempt.steps):
            document = record_of(augmentation, own)
            for attempt in document["attempts"]:
                attempt["worker"] = ""
            yield f"transcripts/{augmentation.code}.json", _json(document)


def _pairs(study: Study) -> Iterator[list[str]]:
    matchups = (
        Matchup.objects.filter(study=study)
        .select_related(
            *("expert__person", "scenario", "repeat_of"),
            *("left__contestant", "right__contestant"),
        )
        .prefetch_related("votes__supersedes")
    )
    # Sorted here: databases order letters each in its own way.
    for matchup in sorted(matchups, key=lambda row: (row.expert.person.pseudonym, row.position)):
        shown = [
            matchup.code,
            matchup.expert.person.pseudonym,
            matchup.position,
            matchup.kind,
            matchup.repeat_of and matchup.repeat_of.code,
            matchup.scenario.slug,
            *(matchup.left.contestant.slug, matchup.left.code),
            *(matchup.right.contestant.slug, matchup.right.code),
        ]
        votes = sorted(matchup.votes.all(), key=lambda vote: vote.pk)
        for cells in [_cells_of_vote(vote) for vote in votes] or [[None] * 10]:
            yield [_text(cell) for cell in (*shown, *cells)]


def _cells_of_vote(vote: Vote) -> list[object]:
    return [
        *(vote.outcome, vote.both_miss, vote.reason, vote.aids, vote.ms_visible, vote.comment),
        *(vote.at.isoformat(), vote.key, vote.supersedes and vote.supersedes.key),
        vote.is_simulated,
    ]


def _cells_of(row: Augmentation) -> list[str]:
    document = None if row.modification is None else _json(row.modification)
    cells = (
        *(row.code, row.job.name, row.scenario.slug, row.scenario.type, row.contestant.slug),
        *(row.sample, row.state, row.reason, row.image),
        document and hashlib.sha256(document).hexdigest(),
        row.finished_at and row.finished_at.isoformat(),
    )
    return [_text(cell) for cell in cells]


def _contestant(row: Contestant) -> dict[str, Any]:
    document = {name: getattr(row, name) for name in _CONTESTANT}
    return document | {"endpoint": row.endpoint.base_url if row.endpoint else None}


def _scenario(row: Scenario) -> dict[str, Any]:
    return {name: getattr(row, name) for name in _SCENARIO} | {
        "scene": row.base_scene.slug,
        "source": row.base_scene.source,
        "provenance": row.base_scene.provenance,
        "set": row.catalogue_set,
        "paraphrase_of": row.paraphrase_of.slug if row.paraphrase_of else None,
    }


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "" if value is None else str(value)


def _json(document: object) -> bytes:
    text = json.dumps(document, indent=1, ensure_ascii=False, sort_keys=True)
    return (text + "\n").encode()
