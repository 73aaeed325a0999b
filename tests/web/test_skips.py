"""A skip says why there is no vote: no page counts it as one, and nobody waits for it either."""

from __future__ import annotations

import re

import pytest
from django.urls import reverse

from arena.queries import progress
from arena.queries.coverage import coverage
from arena.queries.inventory import take_inventory
from arena.queries.votes import tallies
from tests import study_rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


def test_a_skip_is_counted_apart_everywhere_and_a_vote_instead_of_it_counts() -> None:
    study = study_rows.a_study(votes_per_expert=3)
    first, second, third = study_rows.matchups_of(study, "eva")
    skipped = study_rows.vote(first, "skip", reason="unclear")
    study_rows.vote(second, "skip", reason="unclear")
    study_rows.vote(third)
    before = study_rows.vote(study_rows.matchups_of(study, "finn")[0])
    study_rows.vote(before.matchup, "skip", reason="other", supersedes=before.key)

    def counted() -> tuple[object, ...]:
        line, eva = progress.of_study(study), tallies(study)[0]
        own = progress.of_expert(first.expert)[0]
        (main,) = coverage(study).kinds
        return (
            (line.voted, line.skipped, line.left),
            (eva.voted, eva.skips, eva.left),
            (own.voted, own.skipped, own.left),
            (main.decided, take_inventory().votes, progress.of_studies()[0].voted),
        )

    assert counted() == ((1, 3, 2), (1, 2, 0), (1, 2, 0), (1, 1, 1))
    shown = signed_in(people()["analyst"]).get(reverse("study", args=[study.code]))
    text = " ".join(re.sub(r"<[^>]+>", " ", shown.content.decode()).split())
    assert "1 of 6 votes , 3 skipped" in text or "1 of 6 votes, 3 skipped" in text
    assert "Votes: 1 of 6." in text
    study_rows.vote(first, "left", supersedes=skipped.key)
    assert counted() == ((2, 2, 2), (2, 1, 0), (2, 1, 0), (2, 2, 2))
