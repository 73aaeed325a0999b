"""A skip says why there is no vote: no page counts it as one, and nobody waits for it either."""

import re

import pytest
from django.contrib.auth.models import User
from django.urls import reverse

from arena.studies.queries import count_progress
from arena.voting.queries.ballots import tallies, voting_progress
from tests import study_rows
from tests.web.ballots import page
from tests.web.cast import people, signed_in, world

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
        (line,), eva = count_progress([study]), tallies(study)[0]
        (own,) = count_progress([study], first.expert)
        return (
            (line.voted, line.skipped, line.left),
            (eva.voted, eva.skipped, eva.left),
            (own.voted, own.skipped, own.left),
        )

    assert counted() == ((1, 3, 2), (1, 2, 0), (1, 2, 0))
    state = voting_progress(study=study, expert=first.expert)
    assert (state.voted, state.skipped, state.left) == (1, 2, 0)
    shown = signed_in(people()["researcher"]).get(reverse("study", args=[study.code]))
    text = " ".join(re.sub(r"<[^>]+>", " ", shown.content.decode()).split())
    assert "1 of 6 votes, 1 of 2 experts done; 3 pairs skipped" in text
    study_rows.vote(first, "left", supersedes=skipped.key)
    assert counted() == ((2, 2, 2), (2, 1, 0), (2, 1, 0))


def test_a_skipped_pair_is_found_again_and_its_vote_stands_in_place_of_the_skip() -> None:
    here = world()
    eva, finn = signed_in(here.expert), signed_in(User.objects.get(username="finn"))
    mine = study_rows.matchups_of(here.study, "eva")
    skip = study_rows.vote(mine[0], "skip", reason="unclear", comment="Which lane?")
    for matchup in [*mine[1:], *(study_rows.shown_again(one) for one in mine[1:5])]:
        study_rows.vote(matchup)  # more than the page's last ten
    address = reverse("vote-skipped", args=[here.study.code])
    listed = eva.get(address).content.decode()
    assert "Pair 1" in listed
    assert "Instruction unclear" in listed
    assert "Which lane?" in listed
    assert f"?change={skip.key}" in listed
    assert str(skip.key) not in finn.get(address).content.decode()
    again = f"{page(here)}?change={skip.key}"
    assert f'"change": {{"key": "{skip.key}"' in eva.get(again).content.decode()
    assert '"change": null' in finn.get(again).content.decode()
    study_rows.vote(mine[0], "right", supersedes=skip.key)
    assert "You have skipped no pair" in eva.get(address).content.decode()
