"""What stands in a study's folder for people: tables, documents and transcripts."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from typing import Any

from django.db.models import QuerySet

from arena.exports.bundle import MANIFEST as RATING_MANIFEST
from arena.exports.bundle import bundle_files
from arena.exports.study_folder.closure import Closure
from arena.jobs.exports.tables import object_sheet, sheet_csv
from arena.models import Matchup, Snapshot, Vote
from arena.services.cells import csv_text
from arena.studies.services.opening import FILE_NAME, preregistration_bytes
from augment.models import Augmentation, Contestant, GenerationJob, Scenario
from augment.services.running.transcript_records import Try, record_of, tries_by_augmentation

File = tuple[str, bytes]

PAIRS = (
    "matchup", "judge", "position", "kind", "repeat_of", "scenario", "contestant_a",
    "augmentation_a", "contestant_b", "augmentation_b", "outcome", "both_miss", "skip_reason",
    "aids", "ms_visible", "comment", "at", "vote", "supersedes", "simulated",
)  # fmt: skip
"""One line a vote, superseded ones and skips included, and one for each pair without a vote."""

ROWS = (
    "augmentation", "job", "scenario", "type", "contestant", "sample", "state", "reason",
    "picture", "modification_sha256", "finished_at",
)  # fmt: skip


_AT_ONCE = 100
"""So many transcripts are held in memory; each may have some hundred thousand characters."""


def files_for_people(closure: Closure) -> Iterator[File]:
    """Every file but the rows, the pictures and the README, in a fixed order."""
    yield "pairs.csv", csv_text(PAIRS, _pairs(closure)).encode()
    augmentations = _augmentations(closure)
    yield "augmentations.csv", csv_text(ROWS, map(_augmentation, augmentations)).encode()
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
        yield f"objects/{job.code}.csv", sheet_csv(object_sheet(job))
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
