"""Votes of authors on their own contestants: left out on demand."""

import io
import json
import zipfile
from typing import Any

import pytest
from django.contrib.auth.models import User

from arena.exports.files import zip_bytes
from arena.models import Snapshot, Study
from arena.people.links import mark_author
from arena.results.exports.writers import bundle_files
from arena.results.queries.votes import Filters
from arena.results.services.ratings import rate_now as rate
from arena.results.services.ratings import read_votes
from augment.models import Event
from tests.full_study import Size, full_study

pytestmark = pytest.mark.django_db

SIZE = Size(scenarios=8, experts=4, votes_per_expert=90)
AUTHOR, OWN = "expert-1", "gpt-4o-otm"
WITHOUT = Filters(leave_out_own=True)


@pytest.fixture
def study() -> Study:
    return full_study(size=SIZE)


def mark(study: Study, username: str = AUTHOR, slug: str = OWN) -> None:
    mark_author(study=study, expert=User.objects.get(username=username), contestant=slug)


def code_of(username: str) -> str:
    return str(User.objects.get(username=username).person.code)


def table_of(snapshot: Snapshot) -> dict[str, tuple[Any, ...]]:
    return {row.slug: (row.rank, row.rating, row.votes) for row in snapshot.standings.all()}


def zipped(snapshot: Snapshot) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(zip_bytes(bundle_files(snapshot)))) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_they_count_unless_a_rating_leaves_them_out_and_are_counted_by_reason(
    study: Study,
) -> None:
    plain = rate(study=study, rounds=50)
    mark(study)
    counted = rate(study=study, rounds=50)
    assert "authors" not in str(Event.objects.filter(verb="rate").latest("pk").after)
    assert (counted.votes_sha256, table_of(counted)) == (plain.votes_sha256, table_of(plain))
    left = rate(study=study, rounds=50, filters=WITHOUT)
    own = left.votes_left_out["own"]
    assert own > 0
    assert left.votes_counted == counted.votes_counted - own
    assert left.votes_sha256 != counted.votes_sha256
    assert not any(
        vote.judge == code_of(AUTHOR) and OWN in (vote.left, vote.right)
        for vote in read_votes(left).counted
    )
    assert any(vote.judge == code_of(AUTHOR) for vote in read_votes(left).counted)


def test_the_zip_never_says_who_is_author(study: Study) -> None:
    mark(study)
    snapshot = rate(study=study, rounds=20, filters=WITHOUT)
    files = zipped(Snapshot.objects.get(pk=snapshot.pk))
    manifest = json.loads(files["manifest.json"])
    assert manifest["filters"]["leave_out_own"] is True
    assert manifest["filters"]["authors"] == 1
    assert manifest["votes"]["left_out"] == snapshot.votes_left_out
    texts = b"".join(files[name] for name in files if not name.endswith(".pdf"))
    assert code_of(AUTHOR).encode() not in texts
