"""The demo's study with its simulated votes: its table, its measurements and its folder.

What contestants made is put in by hand, because the demo's own results come from workers and
change with the catalogue; plan, votes, rating and files are the demo's.
"""

import datetime as standard
import hashlib
import itertools
import json
import re
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from django.apps import apps
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.utils import timezone
from pytest_django import Settings

from arena.jobs.exports.displacement import FORMATS as DISPLACEMENT
from arena.jobs.exports.displacement import displacement_table
from arena.management.commands.demo import open_for_votes, vote_and_rate
from arena.models import Person, Study
from arena.models.people import fresh_token
from arena.results.exports.study_folder import MANIFEST, write_study
from arena.site.demo import JOB, RATED, SIMULATED_EXPERTS, SIMULATED_STUDY
from augment.models import Augmentation, GenerationJob
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification, ScenarioType
from augment.services.judging.displacement import By
from tests.golden.conftest import Check
from tests.render.pictures import opened
from tests.scenes import vehicle
from tests.study_rows import contestant, expert, scenario

pytestmark = pytest.mark.django_db(transaction=True, reset_sequences=True)

PLACES = 24
PNG = b"\x89PNG picture"
TOGETHER = ("media", "modifications", "scenarios")
"""Parts of the folder with so many files that one line tells of all."""

ROWS = "rows"
"""The part of the folder that has the shape of the tables: of these the numbers of rows count."""

NOW = standard.datetime(2026, 1, 5, 12, tzinfo=standard.UTC)
OFF_M = dict(zip(RATED, (0.0, 0.8, 1.6, 4.0), strict=True))
"""How far from the reference each contestant places its car, on the average scenario."""

LONG_NUMBER = re.compile(r"-?\d+\.\d{7,}(?:e-?\d+)?")


class Noon(standard.datetime):
    """A clock that stands still."""

    @classmethod
    def now(cls, tz: standard.tzinfo | None = None) -> standard.datetime:  # type: ignore[override]
        return NOW.astimezone(tz)


def counted(name: str, kind: Callable[[str], object]) -> Iterator[object]:
    """Codes by their number, the same in every run."""
    for number in itertools.count():
        yield kind(str(uuid.uuid5(uuid.NAMESPACE_URL, f"{name}/{number}")))


@pytest.fixture
def steady_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give rows the same codes and times in every run."""
    monkeypatch.setattr(timezone, "datetime", Noon)
    for model in apps.get_models():
        for field in model._meta.local_fields:
            if field.default in (uuid.uuid4, fresh_token):
                values = counted(f"{model.__name__}.{field.name}", type(field.default()))
                monkeypatch.setattr(field, "default", values.__next__)
                monkeypatch.setattr(field, "_get_default", values.__next__)


@pytest.fixture
def demo_folder(steady_rows: None, tmp_path: Path, settings: Settings) -> Path:
    """Where the demo wrote the table of its study."""
    settings.MEDIA_ROOT = tmp_path / "media"
    job = GenerationJob.objects.create(name=JOB, state=GenerationJob.State.FINISHED)
    makers = {slug: contestant(slug) for slug in RATED}
    for number in range(PLACES):
        place = scenario(f"place-{number:02d}")
        place.type = list(ScenarioType)[number % len(list(ScenarioType))]
        place.reference = document(20.0 + number)
        place.save()
        for slug, maker in makers.items():
            image = f"bev/{hashlib.sha256(f'{slug}{number}'.encode()).hexdigest()}.png"
            default_storage.save(image, ContentFile(PNG))
            Augmentation.objects.create(
                job=job,
                scenario=place,
                contestant=maker,
                state=Augmentation.State.DONE,
                modification=document(20.0 + number + OFF_M[slug] * (0.5 + number / PLACES)),
                image=image,
                finished_at=NOW,
            )
    for username in SIMULATED_EXPERTS:
        expert(username, is_simulated=True)
    expert("expert")
    for person in Person.objects.all():
        person.code = uuid.uuid5(uuid.NAMESPACE_URL, person.user.username)
        person.save()
    scenarios = [f"place-{number:02d}" for number in range(PLACES)]
    vote_and_rate(scenarios, tmp_path / "tables")
    open_for_votes(scenarios)
    return tmp_path / "tables"


def document(ahead_m: float) -> dict[str, object]:
    return modification_to_document(Modification(added=(vehicle("Agent2", ahead_m, -0.7),)))


def digest(path: Path) -> str:
    """A hash that is the same on every machine: of pixels, and of numbers without their end.

    What a PDF or Parquet file holds stands beside it in a file of text.
    """
    content = path.read_bytes()
    if path.suffix in (".pdf", ".parquet"):
        content = b""
    elif path.suffix == ".png" and content != PNG:
        content = opened(content).tobytes()
    elif path.suffix != ".png":
        text = LONG_NUMBER.sub(lambda number: f"{float(number[0]):.6g}", content.decode())
        content = text.encode()
    return hashlib.sha256(content).hexdigest()


@pytest.mark.slow
def test_tables_and_folder_of_the_study_are_what_they_were(
    demo_folder: Path, check: Check, tmp_path: Path
) -> None:
    for suffix in ("csv", "json", "tex"):
        check(f"leaderboard.{suffix}", (demo_folder / f"leaderboard.{suffix}").read_text())
    job = GenerationJob.objects.get()
    for by in (By.TYPE, By.VARIANT):
        table = displacement_table(job, by=by)
        check(f"displacement-{by.value}.csv", DISPLACEMENT["csv"].write(table).decode())
    check_folder(tmp_path / "study", check)


def check_folder(out: Path, check: Check) -> None:
    write_study(Study.objects.get(name=SIMULATED_STUDY), out, say=print)
    manifest = json.loads((out / MANIFEST).read_text())
    del manifest["study"]["rules"]["entries"]  # all pictures, which `media` has as well
    check("study_manifest.json", {name: manifest[name] for name in ("study", "rows")})
    digests: dict[str, list[str]] = {}
    for path in sorted(out.rglob("*")):
        name = path.relative_to(out)
        # The manifest of the folder has versions, and the hashes of the same files.
        if path.is_file() and name.name != MANIFEST and name.parts[0] != ROWS:
            key = name.parts[0] if name.parts[0] in TOGETHER else name.as_posix()
            digests.setdefault(key, []).append(f"{name} {digest(path)}")
    check(
        "study_folder.json",
        {
            key: f"{len(each)} {hashlib.sha256(' '.join(each).encode()).hexdigest()}"
            for key, each in digests.items()
        },
    )
