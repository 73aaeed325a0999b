"""An installation to back up, and what lies in a backup."""

import uuid
import zipfile
from datetime import UTC, datetime
from pathlib import Path

from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.core.management import call_command

from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from augment.models import Event
from tests.study_rows import a_study, matchups_of, vote, write_changes

NOW = datetime(2026, 11, 22, 12, 0, tzinfo=UTC)
OUTCOMES = ("left", "equal", "right")
PNG = b"\x89PNG picture"
PICTURE = f"bev/{'1' * 64}.png"


def quiet(_: str) -> None:
    pass


def note(code: uuid.UUID) -> None:
    kind = {"verb": "note", "object_kind": "study"}
    Event.objects.create(**kind, object_code=str(code), after={"ü": 1.5})


def a_full_house() -> None:
    """Rows of many kinds, with times to the microsecond, JSON, decimals and a picture."""
    study = a_study()
    for matchup, outcome in zip(matchups_of(study, "eva"), OUTCOMES, strict=False):
        vote(matchup, outcome)
    for matchup in matchups_of(study, "finn"):
        vote(matchup, "left")
    close_study(study=study)
    study.refresh_from_db()
    rate(study=study, rounds=20)
    note(study.code)
    write_changes()
    default_storage.save(PICTURE, ContentFile(PNG))


def empty() -> None:
    call_command("flush", interactive=False, verbosity=0)
    default_storage.delete(PICTURE)


def contents(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}
