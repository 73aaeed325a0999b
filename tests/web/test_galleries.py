"""The galleries of a rating: disputed pairs, the worst of a contestant, the contact sheet."""

from __future__ import annotations

import re

import pytest
from django.test import Client
from django.urls import reverse

from arena.models import Snapshot
from arena.queries.galleries import VoteScore, disagreement, disputed_pairs, pictures_of
from arena.services.ratings import rate
from arena.services.studies import close_study
from augment.models import Augmentation
from augment.services.scenarios.pictures import store
from tests.study_rows import a_study, hang, vote
from tests.web.cast import people, png, signed_in

pytestmark = pytest.mark.django_db

PAGES = ("results-disagreement", "results-worst", "results-sheet")


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
def analyst() -> Client:
    return signed_in(people()["analyst"])


def page(client: Client, snapshot: Snapshot, name: str, **query: str) -> str:
    answer = client.get(reverse(name, args=[snapshot.study.code]), query)
    assert answer.status_code == 200
    return " ".join(answer.content.decode().split())


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
    assert disagreement(VoteScore(wins=wins, ties=ties, losses=losses)) == pytest.approx(expected)


def test_the_most_disputed_pair_comes_first_with_both_pictures(
    rated: Snapshot, analyst: Client
) -> None:
    units = disputed_pairs(rated)
    agreement = rated.results.trust.agreement
    assert agreement is not None
    assert len(units) == agreement.units == 18
    assert [round(one.disagreement, 2) for one in units[:3]] == [1.0, 0.5, 0.0]
    shown = page(analyst, rated, "results-disagreement")
    first = shown.partition('class="card disputed"')[2].partition("</section>")[0]
    assert "place-5" in first
    assert "disagreement 100 %" in first
    assert len(pictures_in(first)) == 2
    for address in pictures_in(first):
        assert b"".join(analyst.get(address))[:4] == b"\x89PNG"


def test_the_worst_picture_is_the_one_that_lost_most(rated: Snapshot, analyst: Client) -> None:
    found = pictures_of(rated, "bob")
    assert found[0].scenario.slug == "place-0"
    assert (found[0].score.wins, found[0].score.losses) == (0, found[0].score.votes)
    standing = rated.standings.get(slug="bob")
    assert sum(one.score.wins for one in found) == standing.wins
    assert sum(one.score.losses for one in found) == standing.losses
    shown = page(analyst, rated, "results-worst", contestant="bob")
    assert pictures_in(shown)[0].endswith(f"{found[0].matchup}/{found[0].side}.png")
    assert len(pictures_in(shown)) == 6


def test_the_sheet_has_every_contestant_of_a_scenario(rated: Snapshot, analyst: Client) -> None:
    shown = page(analyst, rated, "results-sheet")
    assert len(pictures_in(shown)) == len(set(pictures_in(shown))) == 18
    for slug in (f"place-{n}" for n in range(6)):
        assert slug in shown
    answer = analyst.get(reverse("results-sheet", args=[rated.study.code]), {"type": "parade"})
    assert answer.status_code == 404


def test_the_sheet_as_pdf_is_the_same_to_the_byte(rated: Snapshot, analyst: Client) -> None:
    address = reverse("results-sheet-file", args=[rated.study.code])
    first, second = (analyst.get(address) for _ in range(2))
    assert first.headers["Content-Type"] == "application/pdf"
    assert first.content == second.content
    assert first.content.startswith(b"%PDF-")
    assert b"CreationDate" not in first.content
    assert first.content.count(b"/Subtype /Image") == 18


def test_galleries_need_an_early_look_in_an_open_study(analyst: Client) -> None:
    study = a_study()
    for matchup in study.matchups.all():
        vote(matchup)
    rate(study=study, rounds=10, early=True)
    eva = signed_in(study.experts.get(username="eva"))
    names = (*PAGES, "results-sheet-file")
    addresses = [reverse(name, args=[study.code]) for name in names]
    assert [analyst.get(address).status_code for address in addresses] == [403] * 4
    analyst.post(reverse("results-open", args=[study.code]))
    assert [analyst.get(address).status_code for address in addresses] == [200] * 4
    close_study(study=study)
    assert [eva.get(address).status_code for address in addresses] == [403] * 4
