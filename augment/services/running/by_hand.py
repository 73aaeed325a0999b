"""Corrections by hand: augmentations of a contestant of kind human.

The row is written with its modification and waits; a worker leases it as any other, draws it and
settles it. The one that was corrected stays as it is.
"""

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Q

from augment.errors import Conflict
from augment.models import Augmentation, Contestant, GenerationJob
from augment.scene.codec import modification_from_document, modification_to_document
from augment.scene.entities import Modification
from augment.services.events import log_change
from augment.services.scenarios.editing import read_edit
from augment.services.slugs import free_slug
from augment.services.texts import LONGEST_NOTES, check_prose, one_line

BY_HAND = "by-hand"
NAME = "Corrected by hand"

Kind = Contestant.Kind


@transaction.atomic
def keep_correction(
    original: Augmentation,
    document: object,
    *,
    slug: str = BY_HAND,
    notes: str = "",
    actor: User | None = None,
) -> Augmentation:
    """Create a waiting row of a job of its own; the caller sends its message.

    Args:
        original: What is corrected; it stays as it is.
        document: The modification as it should be.
        slug: Of the contestant that it counts for, or a person's name; made if there is none.
        notes: Why it was corrected, or nothing.
        actor: Whose hand it was.

    Raises:
        InvalidDocument: The document, the name or the notes break their format.
        InvalidModification: The modification does not fit the scene.
        Conflict: Nothing was changed, nothing is left, or the slug is that of somebody who is no
            person or retired.
    """
    modification = read_edit(original.scenario, document)
    if modification.is_empty:
        raise Conflict("Nothing is added, moved or removed: there is nothing to keep.")
    before = original.modification
    if before is not None and modification == read_edit(original.scenario, before):
        raise Conflict("Nothing was corrected: it is as it was.")
    if notes:
        check_prose("notes", notes, what="correction", longest=LONGEST_NOTES)
    contestant = _find_or_add_person(slug)
    actor_pk = actor.pk if actor else None
    job = GenerationJob.objects.create(
        name=f"By hand: {original.scenario.slug}", launched_by_id=actor_pk
    )
    job.contestants.set([contestant])
    job.scenarios.set([original.scenario])
    row = Augmentation.objects.create(
        job=job,
        scenario=original.scenario,
        contestant=contestant,
        modification=modification_to_document(modification),
        notes=notes.strip(),
        corrects=original,
        made_by_id=actor_pk,
    )
    made = {
        "augmentation": str(row.code),
        "contestant": contestant.slug,
        "modification": row.modification,
    }
    log_change(original, "correct", actor, before={"modification": before}, after=made)
    return row


def starting_document(original: Augmentation) -> dict[str, object]:
    """Return the modification that a correction begins with."""
    stored = original.modification
    return modification_to_document(
        modification_from_document(stored) if stored else Modification()
    )


def _find_or_add_person(name: str) -> Contestant:
    is_meant = Q(slug=name) | Q(name=name, kind=Kind.HUMAN)
    row = Contestant.objects.filter(is_meant).order_by("pk").first()
    if row is None:
        title = NAME if name == BY_HAND else one_line("name", name, what="contestant")
        slug = free_slug(Contestant.objects, name, otherwise="person")
        row = Contestant.objects.create(slug=slug, name=title, kind=Kind.HUMAN)
    if row.kind != Kind.HUMAN or row.retired_at:
        raise Conflict(f"“{row.name}” is no person or is retired; choose another name.")
    return row
