"""The order of the grid of evidence, and what stands beside its pictures."""

import re

import pytest
from django.test import Client
from django.urls import reverse

from arena.models import Snapshot
from arena.results.queries.evidence import VoteScore, scores_of_pairs, vote_page
from arena.results.queries.search import VoteSearch
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from augment.models import Augmentation
from augment.services.scenarios.pictures import store
from tests.study_rows import a_study, hang, vote
from tests.web.cast import people, png, signed_in

pytestmark = pytest.mark.django_db


@pytest.fixture
def rated() -> Snapshot:
    """Bob loses every vote on place-0 and wins the others; eva and finn see every pair."""
    study = a_study(votes_per_expert=18)
    for number, row in enumerate(Augmentation.objects.order_by("pk")):
        hang(row, store(png(number, width=12, height=8)))
    for matchup in study.matchups.select_related("expert", "left__contestant", "scenario"):
        outcome = "equal"
        shown = [matchup.left.contestant.slug, matchup.right.contestant.slug]
        if "bob" in shown:
            won = (shown[0] == "bob") != (matchup.scenario.slug == "place-0")
            outcome = "left" if won else "right"
        elif matchup.scenario.slug == "place-5":
            first = shown[0] == "ann"
            outcome = "left" if first == (matchup.expert.username == "eva") else "right"
        elif matchup.scenario.slug == "place-4" and matchup.expert.username == "eva":
            outcome = "left"
        vote(matchup, outcome)
    return rate(study=close_study(study=study), rounds=10)


@pytest.fixture
def reader() -> Client:
    return signed_in(people()["researcher"])


def grid(client: Client, snapshot: Snapshot, **query: str) -> str:
    answer = client.get(reverse("results-votes", args=[snapshot.study.code]), query)
    assert answer.status_code == 200
    return " ".join(answer.content.decode().split())


def first_card(shown: str) -> str:
    return shown.partition('<li class="card">')[2].partition("</li>")[0]


def pictures_in(shown: str) -> list[str]:
    return re.findall(r'<img[^>]* src="([^"?]*/shown/[^"?]*)[^"]*"', shown)


@pytest.mark.parametrize(
    ("score", "expected"),
    [
        ((0, 0, 0), 0.0),
        ((1, 0, 0), 0.0),
        ((2, 0, 0), 0.0),
        ((0, 5, 0), 0.0),
        ((1, 0, 1), 1.0),
        ((1, 1, 0), 0.5),
        ((0, 1, 1), 0.5),
        ((1, 1, 1), 2 / 3),
        ((2, 0, 2), 4 / 6),
    ],
)
def test_disagreement_is_the_mean_distance_of_two_judgements(
    score: tuple[int, int, int], expected: float
) -> None:
    wins, ties, losses = score
    given = VoteScore(wins=wins, ties=ties, losses=losses)
    assert given.disagreement == pytest.approx(expected)


def test_the_votes_on_the_most_disputed_pair_come_first(rated: Snapshot, reader: Client) -> None:
    judged_twice = [score for score in scores_of_pairs(rated).values() if score.votes > 1]
    agreement = rated.results.trust.agreement
    assert agreement is not None
    assert len(judged_twice) == agreement.units == 18
    listed = list(vote_page(rated, VoteSearch(order="disputed"), 1))
    said = [vote.pair.disagreement for vote in listed if vote.pair]
    assert said == [1.0, 1.0, 0.5, 0.5, *[0.0] * 6]
    first = first_card(grid(reader, rated, order="disputed"))
    assert "place-5" in first
    assert "disagreement 100 % of" in first
    assert len(pictures_in(first)) == 2
    for address in pictures_in(first):
        assert b"".join(reader.get(address))[:4] == b"\x89PNG"
