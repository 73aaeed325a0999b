"""What the pages of the results say, of tiny studies too."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from html import unescape

import pytest
from django.test import Client
from django.urls import reverse

from arena.models import Snapshot, Study
from arena.services.ratings import rate
from arena.services.studies import close_study
from arena.web.results_tabs import TABS
from tests.study_rows import a_study, matchups_of, vote
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

ONE_OF_MANY = re.compile(  # the name of the study is Round 1
    r"(?<!Round )\b1 (votes|ties|scenarios|points|places|ranks|pairs|experts|rounds|resamples"
    r"|degrees|triples|judgements)\b"
)
HYPHEN_FOR_MINUS = re.compile(r"(?<![\w\d)]) ?-\d")


@pytest.fixture
def analyst() -> Client:
    return signed_in(people()["analyst"])


def a_vote() -> Study:
    """One vote, on the one pair of two contestants."""
    study = a_study(votes_per_expert=1, contestants=("ann", "bob"), experts=("eva",))
    vote(matchups_of(study, "eva")[0], "left")
    return close_study(study=study)


def all_ties() -> Study:
    study = a_study(votes_per_expert=6)
    for matchup in study.matchups.all():
        vote(matchup, "equal")
    return close_study(study=study)


def mixed_votes() -> Study:
    study = a_study(votes_per_expert=12)
    for number, matchup in enumerate(study.matchups.order_by("pk")):
        vote(matchup, ("left", "right", "equal", "left", "right")[number % 5])
    return close_study(study=study)


def texts(client: Client, study: Study) -> dict[str, str]:
    """What each tab says to people, without marks and pictures."""
    found = {}
    for tab in TABS:
        page = client.get(reverse("results-tab", args=[study.code, tab.name])).content.decode()
        main = re.sub(r"<(svg|form|nav)\b.*?</\1>", " ", page[page.index("<main") :], flags=re.S)
        found[tab.name] = " ".join(unescape(re.sub(r"<[^>]*>", " ", main)).split())
    return found


@pytest.mark.parametrize("make", [a_vote, all_ties, mixed_votes])
def test_one_is_singular_and_minus_is_a_minus(analyst: Client, make: Callable[[], Study]) -> None:
    study = make()
    rate(study=study, rounds=10)
    said = texts(analyst, study)
    for tab, text in said.items():
        assert not ONE_OF_MANY.search(text), (tab, ONE_OF_MANY.findall(text))
        assert not HYPHEN_FOR_MINUS.search(text), (tab, HYPHEN_FOR_MINUS.findall(text))


def test_the_interval_has_a_minus_sign(analyst: Client) -> None:
    study = mixed_votes()
    rate(study=study, rounds=10, intervals="resamples")
    assert re.search(r"\N{MINUS SIGN}\d+/\+\d+", texts(analyst, study)["table"])


def test_what_votes_cannot_say_is_left_unsaid_where_all_are_ties(analyst: Client) -> None:
    study = all_ties()
    rate(study=study, rounds=10)
    said = texts(analyst, study)
    assert said["table"].count("Every vote is a tie") == 1
    for empty in ("Method check", "Test of fit", "Leaving any one expert out", "X² 0.0"):
        assert empty not in said["table"], empty
    for empty in ("unknown", "(0 to 0)", "Does the side matter"):
        assert empty not in said["raters"], empty


@pytest.mark.parametrize(
    ("effect", "said"),
    [
        (0.98, "do not hang together noticeably here"),
        (1.04, "do not hang together noticeably here"),
        (1.06, "make 1.1 votes weigh as much as one"),
        (2.0, "make 2.0 votes weigh as much as one"),
    ],
)
def test_one_vote_never_weighs_as_much_as_one(analyst: Client, effect: float, said: str) -> None:
    study = mixed_votes()
    snapshot = rate(study=study, rounds=10)
    claims = replace(
        snapshot.results.claims, design_effect=effect, half_width=50.0,
        independent={"ann": (960.0, 1040.0)},
    )  # fmt: skip
    results = replace(snapshot.results, claims=claims)
    Snapshot.objects.filter(pk=snapshot.pk).update(results=results)
    table = texts(analyst, study)["table"]
    assert said in table
    assert "1.0 votes weigh" not in table


def test_a_note_stands_once_on_the_table(analyst: Client) -> None:
    study = a_vote()
    rate(study=study, rounds=10)
    for tab in TABS:
        page = analyst.get(reverse("results-tab", args=[study.code, tab.name])).content.decode()
        assert page.count('class="alert is-warn"') == (1 if tab.name == "table" else 0), tab.name


def test_the_log_is_words_not_code(analyst: Client) -> None:
    study = mixed_votes()
    snapshot = rate(study=study, rounds=10)
    said = texts(analyst, study)["log"]
    for part in ("pairs: 24", "state: open, then closed", f"rating: {str(snapshot.code)[:8]}"):
        assert part in said
    assert "which votes: all" in said
    assert not re.search(r'[{}"\[\]]', said)
