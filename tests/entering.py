"""Rows for tests of submissions: a benchmark of streets, and zips of answers to it."""

from __future__ import annotations

import json
import zipfile
from io import BytesIO
from typing import Any

from django.contrib.auth.models import User
from django.core.files.base import ContentFile

from arena.people.services import create_person
from augment.models import Benchmark, Scenario, Submission
from augment.scene.codec import intent_to_document, modification_to_document
from augment.scene.entities import Modification
from augment.scene.intent import Shape
from augment.services.benchmarks import submissions
from augment.services.benchmarks.benchmarks import BenchmarkRequest, make_benchmark
from tests.intents import cones
from tests.jobs.rows import add_scenario
from tests.scenes import cone

CARD: dict[str, Any] = {
    **{"name": "DiffScene", "authors": ["A. Author"], "method": "Diffusion over vectors."},
    **{"models": ["secret-net"], "is_open": False, "samples": 1, "cost_usd": 1.5},
    "made_on": "2026-11-20",
}
ONE_CONE = modification_to_document(Modification(added=(cone("Agent9", 21.0, 0.0),)))
EMPTY = modification_to_document(Modification())


def a_benchmark(*, scenarios: int = 4) -> Benchmark:
    """A set called streets, a quarter of it for practice."""
    slugs = [_add_street(number).slug for number in range(1, scenarios + 1)]
    asked = BenchmarkRequest(slug="streets", title="Streets", scenarios=slugs, practice=25)
    return make_benchmark(asked)


def _add_street(number: int) -> Scenario:
    """What is asked differs: alike tasks would be all of one split."""
    intent = intent_to_document(cones(15.0 + 5.0 * number, 1, Shape.LINE))
    return add_scenario(f"street-{number}", intent=intent)


def packed(card: dict[str, Any] | None = None, **answers: Any) -> ContentFile[bytes]:
    """A zip of a card and answers by the names of their files, `street_1` for street-1.json."""
    made = BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        archive.writestr("card.json", json.dumps(CARD | (card or {})))
        for name, answer in answers.items():
            content = answer if isinstance(answer, str) else json.dumps(answer)
            archive.writestr(f"{name.replace('_', '-')}.json", content)
    return ContentFile(made.getvalue())


ANSWERS: dict[str, Any] = {
    **{"street_1": ONE_CONE, "street_2": ONE_CONE},
    **{"street_3": EMPTY, "street_4": "{broken"},
}


def entrant(username: str = "enno") -> User:
    return create_person(username=username, password="a password", role="entrant")


def sent(
    benchmark: Benchmark, actor: User, content: ContentFile[bytes] | None = None
) -> Submission:
    content = content or packed(**ANSWERS)
    return submissions.keep_submission(benchmark, name="ours.zip", content=content, actor=actor)


def read(row: Submission) -> Submission:
    submissions.SUBMISSIONS.perform(row.pk)
    row.refresh_from_db()
    return row
