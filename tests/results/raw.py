"""A small study: raw votes, ratings and a page, for tests that compute every number again."""

import html
import re
from dataclasses import dataclass

import numpy as np
from django.urls import reverse

from arena.models import Matchup, Snapshot, Standing, Study, Vote
from arena.people.services import create_person
from arena.rating.snapshot_document import Results
from arena.results.services.ratings import rate_now as rate
from arena.studies.services.opening import close_study
from augment.models import Contestant
from tests.full_study import Size, contestants, draw_votes, pictures, scenarios
from tests.opening import open_study
from tests.web.cast import people, signed_in

SIZE = Size(scenarios=10, experts=5, votes_per_expert=144)
"""Twice as many votes as there are pairs of pictures: most are judged by two experts."""
REPEATS, CHECKS = 6, 3


@dataclass(frozen=True, slots=True, kw_only=True)
class RawVote:
    """A vote as the database has it; scores are those of the left one."""

    judge: str
    item: str
    type: str
    kind: str
    left: str
    right: str
    score: float

    @property
    def names(self) -> frozenset[str]:
        return frozenset((self.left, self.right))

    def score_of(self, slug: str) -> float:
        return self.score if slug == self.left else 1.0 - self.score


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """What there is to check: votes, the snapshot, its lines, and the page of its table."""

    votes: tuple[RawVote, ...]
    results: Results
    lines: dict[str, Standing]
    page: str
    planned: dict[frozenset[str], int]

    @property
    def main(self) -> list[RawVote]:
        return [vote for vote in self.votes if vote.kind == "main"]

    @property
    def slugs(self) -> list[str]:
        return sorted(self.lines)

    @property
    def said(self) -> str:
        """What the page says, without its marks."""
        return _text(self.page)

    @property
    def rows(self) -> list[list[str]]:
        """The cells of every line of every table on the page, as text."""
        return [
            [_text(cell) for cell in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", line, re.S)]
            for line in re.findall(r"<tr[^>]*>(.*?)</tr>", self.page, re.S)
        ]


def a_rated_study() -> Shown:
    """Ten scenarios, five experts, most pairs judged by two of them, repeats and checks."""
    rated, places = contestants(), scenarios(SIZE.scenarios)
    pictures(places, rated)
    experts = [f"expert-{number}" for number in range(1, SIZE.experts + 1)]
    for username in experts:
        create_person(username=username, password=None, role="expert")
    study = open_study(
        name="Round 1",
        contestants=[row.slug for row in rated],
        scenarios=[place.slug for place in places],
        experts=experts,
        votes_per_expert=SIZE.votes_per_expert,
        seed=1,
    )
    _repeat_and_check(study)
    draw_votes(study, size=SIZE, seed=3)
    study = close_study(study=study)
    Contestant.objects.filter(slug="interplan").update(kind=Contestant.Kind.REFERENCE)
    snapshot = rate(study=study, rounds=100, seed=4, intervals="closed")
    table = reverse("results-tab", args=[study.code, "table"])
    return Shown(
        votes=_votes(study),
        results=Snapshot.objects.get(pk=snapshot.pk).results,
        lines={line.slug: line for line in snapshot.standings.all()},
        page=signed_in(people()["researcher"]).get(table).content.decode(),
        planned=_planned(study),
    )


def _repeat_and_check(study: Study) -> None:
    """The first expert sees some pairs twice, and some are attention checks."""
    own = list(
        study.matchups.filter(expert__username="expert-1")
        .select_related("left__contestant", "right__contestant")
        .order_by("position")
    )
    for first, again in zip(own[:REPEATS], own[-REPEATS:], strict=True):
        Matchup.objects.filter(pk=again.pk).update(
            kind="repeat",
            repeat_of=first,
            left=first.right,
            right=first.left,
            scenario=first.scenario,
        )
    with_reference = [
        row.pk
        for row in own[REPEATS:-REPEATS]
        if "interplan" in (row.left.contestant.slug, row.right.contestant.slug)
    ]
    Matchup.objects.filter(pk__in=with_reference[:CHECKS]).update(kind="check")


def _votes(study: Study) -> tuple[RawVote, ...]:
    scores = {"left": 1.0, "equal": 0.5, "right": 0.0}
    rows = Vote.objects.filter(matchup__study=study).select_related(
        "expert__person", "matchup__scenario", "shown_left__contestant", "shown_right__contestant"
    )
    return tuple(
        RawVote(
            judge=row.expert.person.pseudonym,
            item=row.matchup.scenario.slug,
            type=row.matchup.scenario.type,
            kind=row.matchup.kind,
            left=row.shown_left.contestant.slug,
            right=row.shown_right.contestant.slug,
            score=scores[row.outcome],
        )
        for row in rows.order_by("pk")
    )


def _planned(study: Study) -> dict[frozenset[str], int]:
    found: dict[frozenset[str], int] = {}
    for row in study.matchups.filter(kind="main").select_related(
        "left__contestant", "right__contestant"
    ):
        pair = frozenset((row.left.contestant.slug, row.right.contestant.slug))
        found[pair] = found.get(pair, 0) + 1
    return found


def _text(cell: str) -> str:
    text = html.unescape(re.sub(r"<[^>]+>", " ", cell)).replace("−", "-")
    return " ".join(text.split()).replace(" .", ".").replace(" ,", ",")


def strengths_of(votes: list[RawVote], slugs: list[str]) -> np.ndarray:
    """(V, C - 1) for statsmodels: the first slug's strength is zero."""
    found = np.zeros((len(votes), len(slugs)))
    for row, vote in enumerate(votes):
        found[row, slugs.index(vote.left)] += 1.0
        found[row, slugs.index(vote.right)] -= 1.0
    return found[:, 1:]
