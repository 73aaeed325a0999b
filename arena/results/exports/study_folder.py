"""Write a study's folder: its rows, its pictures, and tables and documents for people."""

import hashlib
import json
import re
from collections.abc import Callable, Iterable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

from django.core.files import File
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.template.loader import render_to_string
from django.utils.text import slugify

from arena.errors import ArenaError
from arena.exports.cells import csv_text
from arena.exports.files import new_folder, sha256_hex, zip_bytes, zip_folder
from arena.exports.formats import Value, make_csv, read_value, sheet_csv
from arena.exports.written_files import FileWork, MadeFile
from arena.jobs.exports.displacement import object_sheet
from arena.jobs.exports.files import pack_scenarios
from arena.models import Snapshot, Study, StudyFile
from arena.results.exports.closure import Closure, close_over, travelling_rows
from arena.results.exports.writers import MANIFEST as RATING_MANIFEST
from arena.results.exports.writers import bundle_files
from arena.results.queries.access import snapshot_to_export
from arena.results.services import stored_rows
from arena.results.services.stored_rows import UNFINISHED
from arena.results.services.vote_files import faults_text
from arena.studies.services.files import why_not
from arena.studies.services.opening import FILE_NAME, preregistration_sha256, product_version
from arena.studies.services.planning import list_shown
from augment.errors import Conflict
from augment.models import Augmentation, Contestant, GenerationJob
from augment.services.judging import ExportOrigin, export_rows, measure_job
from augment.services.running import make_record, tries_by_augmentation
from augment.services.scenarios import film_document, film_name

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

_SHOWN: dict[str, Value] = {
    "matchup": "code",
    "judge": "expert.person.pseudonym",
    "position": "position",
    "kind": "kind",
    "repeat_of": "repeat_of.code",
    "scenario": "scenario.slug",
    "contestant_a": "left.contestant.slug",
    "augmentation_a": "left.code",
    "contestant_b": "right.contestant.slug",
    "augmentation_b": "right.code",
}
_JUDGED: dict[str, Value] = {
    "question": "question",
    "outcome": "outcome",
    "both_miss": "both_miss",
    "strength": "strength",
    "skip_reason": "reason",
    "aids": "aids",
    "ms_visible": "ms_visible",
    "comment": "comment",
    "at": lambda vote: vote.at.isoformat(),
    "vote": "key",
    "supersedes": "supersedes.key",
    "simulated": "is_simulated",
    "faults": lambda vote: faults_text(vote.faults),
}
"""One line a vote, superseded ones and skips included, and one for each pair without a vote."""


AUGMENTATIONS: dict[str, Value] = {
    "augmentation": "code",
    "job": "job.name",
    "scenario": "scenario.slug",
    "type": "scenario.type",
    "contestant": "contestant.slug",
    "sample": "sample",
    "state": "state",
    "reason": "reason",
    "picture": "image",
    "modification_sha256": lambda row: (
        None if row.modification is None else sha256_hex(_json(row.modification))
    ),
    "finished_at": lambda row: row.finished_at and row.finished_at.isoformat(),
}

_CONTESTANT: dict[str, str] = {
    **{name: name for name in ("slug", "name", "kind", "variant", "model", "roles")},
    **{name: name for name in ("error_rates", "options", "frozen_options", "sends")},
    "endpoint": "endpoint.base_url",
}
_SCENARIO: dict[str, str] = {
    **{name: name for name in ("slug", "type", "type_label", "keep_traffic", "traffic_density")},
    **{name: name for name in ("goal", "spawned", "interplan", "language", "instruction")},
    **{name: name for name in ("reference", "intent", "intent_origin")},
    "scene": "base_scene.slug",
    "source": "base_scene.source",
    "provenance": "base_scene.provenance",
    "set": "catalogue_set",
    "paraphrase_of": "paraphrase_of.slug",
    "follows": "follows.slug",
}

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
    if study.state == Study.State.OPEN:
        raise ArenaError(f"The study {study.name!r} is open; close it before it is exported.")
    if study.state == Study.State.CANCELLED:
        raise ArenaError(f"The study {study.name!r} was cancelled; export its votes instead.")
    for job in GenerationJob.objects.filter(pk__in=close_over(study).jobs):
        measure_job(job)  # measures are stored, which frozen rows don't allow
    with new_folder(out) as folder, stored_rows.frozen_rows():
        _fill(study, folder, say)


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
        columns = enumerate(stored_rows.list_columns(rows.model))
        places = [place for place, column in columns if column.attname in PICTURE_COLUMNS]
        written = []

        def lines() -> Iterator[bytes]:
            for row in travelling_rows(closure, rows):
                line = stored_rows.as_line(row)
                self.named |= {row[place] for place in places if row[place]}
                self.media |= {name.decode() for name in _NAMES.findall(line)}
                self.media |= {
                    f"{ASKED}/{digest.decode()}.png" for digest in _DIGESTS.findall(line)
                }
                written.append(len(line))
                yield line

        self.write(f"{ROWS}{stored_rows.model_label(rows.model)}.jsonl", lines())
        return len(written)


class StudyFiles(FileWork[StudyFile]):
    """Files of studies."""

    model = StudyFile
    related = ("study",)

    def make(self, row: StudyFile, folder: Path) -> MadeFile:
        """Make what the row's kind says, unless the study has changed since somebody asked."""
        if reason := why_not(row.study, row.kind):
            raise Conflict(reason)
        study, slug = row.study, slugify(row.study.name) or "study"
        if row.kind == StudyFile.Kind.INTERPLAN:
            origin = ExportOrigin(kind="study", name=study.name, code=str(study.code))
            rows, many = list_shown(study), study.shows_all_samples
            return pack_scenarios(export_rows(rows, origin, "interplan", many=many), slug)
        if row.kind == StudyFile.Kind.RATING:
            content = zip_bytes(bundle_files(snapshot_to_export(study)))
            return MadeFile(name=f"{slug}-rating.zip", content=ContentFile(content))
        write_study(study, folder / "study", say=lambda line: None)
        packed = folder / "study.zip"
        with packed.open("wb") as file:
            zip_folder(folder / "study", file)
        return MadeFile(name=f"{slug}-study.zip", content=File(packed.open("rb")))


STUDY_FILES = StudyFiles()


# --- Private -----------------------------------------------------------------------------------


def _fill(study: Study, root: Path, say: Callable[[str], None]) -> None:
    closure = close_over(study)
    _refuse_unfinished(closure)
    folder = _Folder(root)
    counts = {
        stored_rows.model_label(rows.model): folder.write_rows(closure, rows)
        for rows in closure.tables()
    }
    say(f"rows: {sum(counts.values())} of {len(counts)} tables")
    for name in folder.media | folder.named:
        if (film := film_document(name)) is not None:
            folder.media |= {film_name(name), film["ground"]}
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
            "rules": closure.rename_rules(),
            "opened_at": study.opened_at.isoformat() if study.opened_at else None,
            "closed_at": study.closed_at.isoformat() if study.closed_at else None,
            "allow_simulated": study.allow_simulated,
            "preregistration": preregistration_sha256(study) or None,
        },
        "product": product_version(),
        "packages": {name: version(name) for name in PACKAGES},
        "migrations": stored_rows.list_migrations(),
        "rows": counts,
        "members": digests,
    }


def _files_for_people(closure: Closure) -> Iterator[tuple[str, bytes]]:
    """Yield every file but the rows, the pictures and the README, in a fixed order."""
    study, jobs = closure.study, closure.jobs
    rows = Augmentation.objects.filter(job__in=jobs).order_by("pk")
    augmentations = list(
        rows.select_related("job", "scenario__base_scene", "contestant__endpoint")
    )
    yield "pairs.csv", _pairs(study)
    yield "augmentations.csv", make_csv(AUGMENTATIONS, augmentations)
    contestants = sorted(
        closure.contestants.select_related("endpoint"), key=lambda row: str(row.slug)
    )
    yield "contestants.json", _json([_contestant_document(row) for row in contestants])
    if frozen := study.preregistration.encode():
        yield FILE_NAME, frozen
    named = closure.named_scenarios.select_related("base_scene", "paraphrase_of", "follows")
    scenarios = sorted(named, key=lambda row: str(row.slug))
    for scenario in scenarios:
        yield f"scenarios/{scenario.slug}.json", _json(_document(scenario, _SCENARIO))
    scenes = {scenario.base_scene for scenario in scenarios}
    for scene in sorted(scenes, key=lambda row: str(row.slug)):
        yield f"scenes/{scene.slug}.json", _json(scene.document)
    for job in GenerationJob.objects.filter(pk__in=jobs).order_by("pk"):
        yield f"objects/{job.code}.csv", sheet_csv(object_sheet(job))
    for start in range(0, len(augmentations), _AT_ONCE):
        yield from _contestant_files(augmentations[start : start + _AT_ONCE])
    ready = study.snapshots.filter(state=Snapshot.State.READY).order_by("made_at", "pk")
    for snapshot in ready:
        for name, content in sorted(bundle_files(snapshot).items()):
            if name != RATING_MANIFEST:
                yield f"ratings/{snapshot.code}/{name}", content


def _contestant_files(augmentations: list[Augmentation]) -> Iterator[tuple[str, bytes]]:
    """Yield each contestant's results, and the transcripts of those that asked a model.

    Transcripts come without their pictures, which stand under media, and without a machine.
    """
    tries = tries_by_augmentation([augmentation.pk for augmentation in augmentations])
    for augmentation in augmentations:
        yield f"modifications/{augmentation.code}.json", _json(augmentation.modification)
        own = tries.get(augmentation.pk, [])
        if any(step.call for attempt in own for step in attempt.steps):
            document = make_record(augmentation, own)
            for attempt in document["attempts"]:
                attempt["worker"] = ""
            yield f"transcripts/{augmentation.code}.json", _json(document)


def _pairs(study: Study) -> bytes:
    related = ("expert__person", "scenario", "repeat_of", "left__contestant", "right__contestant")
    matchups = study.matchups.select_related(*related).prefetch_related("votes__supersedes")
    rows = []
    # Sorted here: databases order letters each in its own way.
    for matchup in sorted(matchups, key=lambda row: (row.expert.person.pseudonym, row.position)):
        shown = [read_value(matchup, value) for value in _SHOWN.values()]
        votes = sorted(matchup.votes.all(), key=lambda vote: vote.pk)
        judged = [[read_value(vote, value) for value in _JUDGED.values()] for vote in votes]
        rows += [[*shown, *cells] for cells in judged or [[None] * len(_JUDGED)]]
    return csv_text([*_SHOWN, *_JUDGED], rows).encode()


def _contestant_document(row: Contestant) -> dict[str, Any]:
    """Return a contestant; of a submission with its card."""
    return _document(row, _CONTESTANT) | ({"card": row.card} if row.card else {})


def _document(row: Any, columns: dict[str, str]) -> dict[str, Any]:
    """Return values of a row by name, as they are."""
    return {name: read_value(row, path, None) for name, path in columns.items()}


def _json(document: object) -> bytes:
    text = json.dumps(document, indent=1, ensure_ascii=False, sort_keys=True)
    return (text + "\n").encode()
