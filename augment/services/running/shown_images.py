"""Images that models were shown: which calls name them, and when none does any more."""

from __future__ import annotations

from collections.abc import Sequence

from django.core.files.storage import default_storage
from django.db.models import QuerySet

from augment.models import ModelCall
from augment.services.running.calls import IMAGES
from augment.services.running.transcript_records import images_in
from augment.variants.transcript import ModelRole

AT_ONCE = 200


def images_named_by(keys: Sequence[int]) -> set[str]:
    """The SHA-256 of every image that the viewers of these calls were shown."""
    found: set[str] = set()
    for start in range(0, len(keys), AT_ONCE):
        for request in _viewed().filter(pk__in=keys[start : start + AT_ONCE]):
            found.update(images_in(request))
    return found


def delete_unnamed(images: set[str]) -> None:
    """Delete those of these images that no call names any more."""
    unnamed = set(images)
    for request in _viewed().iterator() if unnamed else ():
        unnamed.difference_update(images_in(request))
    for digest in sorted(unnamed):
        default_storage.delete(f"{IMAGES}/{digest}.png")


def _viewed() -> QuerySet[ModelCall, dict[str, object]]:
    """Requests of viewers whose messages are there."""
    rows = ModelCall.objects.filter(role=ModelRole.VIEWER, removed_at__isnull=True)
    return rows.values_list("request", flat=True)
