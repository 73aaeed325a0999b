"""From a number of the results to its votes, and from a vote to the pair as it was shown."""

import csv
import io
import re
from html import unescape
from urllib.parse import urlsplit

import pytest
from django.test import Client
from django.urls import reverse

from arena.models import Matchup, Snapshot, Study, Vote
from arena.results.pages.tabs import TABS
from arena.results.queries.evidence import VoteScore, scores_of_pairs, vote_page
from arena.results.queries.search import VoteSearch
from arena.results.queries.votes import Filters
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from augment.models import Augmentation
from augment.services.scenarios.pictures import store
from tests.mixed_study import mixed_study
from tests.study_rows import a_study, hang, vote
from tests.web.cast import png

pytestmark = pytest.mark.django_db


LINK = re.compile(r'<a[^>]*href="([^"]*/results/votes/\?[^"]*)"([^>]*)>(.*?)</a>', re.S)
FOUND = re.compile(r'<b id="found" data-votes="(\d+)">')


@pytest.fixture
def study() -> Study:
    study = mixed_study()
    study.allow_simulated = True
    study.save()
    return study


def listed(client: Client, study: Study, **search: str) -> str:
    answer = client.get(reverse("results-votes", args=[study.code]), search)
    assert answer.status_code == 200
    return answer.content.decode()


def number_of(page: str) -> int:
    found = FOUND.search(page)
    assert found is not None
    return int(found[1])


def links_of(page: str) -> dict[str, int | None]:
    """How many votes each link promises: by what it says, or by what it stands for."""
    found: dict[str, int | None] = {}
    for address, attributes, text in LINK.findall(page):
        stands_for = re.search(r'data-votes="(\d+)"', attributes)
        said = re.sub(r"<[^>]*>", " ", text).strip()
        if stands_for:
            found[unescape(address)] = int(stands_for[1])
            if said.isdecimal():
                assert said == stands_for[1]
        else:
            found.setdefault(unescape(address), None)
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    "filters", [Filters(), Filters(leave_out_own=True, kinds=("main", "repeat"))]
)
def test_every_number_leads_to_as_many_votes(
    study: Study, researcher: Client, filters: Filters
) -> None:
    rate(study=study, rounds=10, filters=filters)
    promised: dict[str, int | None] = {}
    for tab in TABS:
        shown = researcher.get(reverse("results-tab", args=[study.code, tab]))
        promised |= links_of(shown.content.decode())
    assert len(promised) > 50
    parts = set(re.findall(r"part=(\w+)", " ".join(promised)))
    assert "repeats" in parts
    wrong = {}
    for address, number in promised.items():
        answer = researcher.get(address)
        assert answer.status_code == 200, address
        found = number_of(answer.content.decode())
        if number is not None and found != number:
            wrong[urlsplit(address).query] = (number, found)
    assert wrong == {}


def test_the_file_has_the_votes_of_the_list(study: Study, researcher: Client) -> None:
    rate(study=study, rounds=10, filters=Filters())
    address = reverse("results-votes-file", args=[study.code])
    pseudonyms = study.experts.values_list("person__pseudonym", flat=True)
    for search in ({}, {"mark": "left_out"}, {"contestant": "ann", "outcome": "lost"}):
        answer = researcher.get(address, search)
        content = b"".join(answer).decode()
        rows = list(csv.DictReader(io.StringIO(content)))
        assert len(rows) == number_of(listed(researcher, study, **search)) > 0
        assert {row["judge"] for row in rows} <= {"", *pseudonyms}
    skipped = b"".join(researcher.get(address, {"mark": "skip"})).decode()
    assert skipped.count(",skip,cannot_judge,") == 2


def test_a_vote_shows_the_pair_as_it_was_shown(study: Study, researcher: Client) -> None:
    rate(study=study, rounds=10)
    vote = Vote.objects.filter(comment__contains="kerb").order_by("pk")[0]
    shades = {"left": 10, "right": 200}
    for side, row in (("left", vote.shown_left), ("right", vote.shown_right)):
        hang(row, store(png(shades[side])))
    vote.shown_left.refresh_from_db()
    type(vote.shown_left).objects.filter(pk=vote.shown_left_id).update(image="drawn-anew.png")
    page = listed(researcher, study, expert=str(vote.expert.person.code))
    matchup = Matchup.objects.get(pk=vote.matchup_id)
    for side, shade in shades.items():
        address = reverse("shown-picture", args=[study.code, matchup.code, side])
        assert address in page
        assert b"".join(researcher.get(address)) == png(shade)
    left, right = (page.index(f"{matchup.code}/{side}.png") for side in shades)
    assert left < page.index(vote.shown_left.contestant.name, left) < right
    assert page.index(vote.shown_right.contestant.name, right)
    for said in (vote.matchup.scenario.instruction, "The car stands on the kerb.", "0.4 s"):
        assert said in page, said
    address = reverse("shown-picture", args=[study.code, matchup.code, "upside-down"])
    assert researcher.get(address).status_code == 404


def test_ties_that_nobody_was_shown_are_told_apart_from_votes(
    study: Study, researcher: Client
) -> None:
    study.rules["identical"] = [[study.scenarios.all()[0].slug, "ann", "bob"]]
    study.save()
    snapshot = rate(study=study, rounds=10)
    head = (
        f'data-votes="{snapshot.votes_counted}">{snapshot.votes_counted - 1} votes and 1 tie that'
    )
    assert head in listed(researcher, study, rating=str(snapshot.code))


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


def grid(client: Client, snapshot: Snapshot, **query: str) -> str:
    answer = client.get(reverse("results-votes", args=[snapshot.study.code]), query)
    assert answer.status_code == 200
    return " ".join(answer.content.decode().split())


def first_card(shown: str) -> str:
    return shown.partition('<li class="card">')[2].partition("</li>")[0]


def pictures_in(shown: str) -> list[str]:
    return re.findall(r'<img[^>]* src="([^"?]*/shown/[^"?]*)[^"]*"', shown)


def test_disagreement_is_the_mean_distance_of_two_judgements() -> None:
    for (wins, ties, losses), expected in {
        **{(0, 0, 0): 0.0, (1, 0, 0): 0.0, (2, 0, 0): 0.0, (0, 5, 0): 0.0},
        **{(1, 0, 1): 1.0, (1, 1, 0): 0.5, (0, 1, 1): 0.5, (1, 1, 1): 2 / 3, (2, 0, 2): 4 / 6},
    }.items():
        score = VoteScore(wins=wins, ties=ties, losses=losses)
        assert score.disagreement == pytest.approx(expected), score


def test_the_votes_on_the_most_disputed_pair_come_first(
    rated: Snapshot, researcher: Client
) -> None:
    judged_twice = [score for score in scores_of_pairs(rated).values() if score.votes > 1]
    agreement = rated.results.trust.agreement
    assert agreement is not None
    assert len(judged_twice) == agreement.units == 18
    listed = list(vote_page(rated, VoteSearch(order="disputed"), 1))
    said = [vote.pair.disagreement for vote in listed if vote.pair]
    assert said == [1.0, 1.0, 0.5, 0.5, *[0.0] * 6]
    first = first_card(grid(researcher, rated, order="disputed"))
    assert "place-5" in first
    assert "disagreement 100 % of" in first
    assert len(pictures_in(first)) == 2
    for address in pictures_in(first):
        assert b"".join(researcher.get(address))[:4] == b"\x89PNG"
