"""The ratings of one study's several questions side by side, and how the answers hang together.

They are never averaged: a scene may be realistic and yet not what was asked for.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from django.db.models import F

from arena.models import Snapshot, Standing
from arena.models.ratings import snapshot_values
from arena.rating.agreement import two_way_share
from arena.rating.comparisons import Estimate
from arena.rating.lines import Line
from arena.results.queries.access import list_snapshots
from arena.results.queries.votes import Filters, select_counted_votes

FEWEST = 3
"""Fewer contestants have no correlation worth a number."""

DECIDED = ("left", "right")


@dataclass(frozen=True, slots=True, kw_only=True)
class TwoQuestions:
    """Dependence between the answers to two questions.

    Attributes:
        spearman: Of the ratings of the contestants that both rate, None for fewer than three,
            ratings that are all equal, or not all of one question rated together.
        same: The share of pairs with a preference for the same side, of those where both
            questions have one, clustered by expert and scenario.
        pairs: Where both have one.
    """

    one: str
    other: str
    spearman: float | None
    same: Estimate
    pairs: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RatedQuestions:
    """The ratings of a study's questions.

    Attributes:
        ratings: By question in the study's order, None for one that is not rated alike.
        lines: Each contestant by question, the best first in the rating that they stand beside.
    """

    ratings: dict[str, Snapshot | None]
    lines: list[tuple[str, list[Line | None]]]
    links: list[TwoQuestions]


def compare_questions(snapshot: Snapshot) -> RatedQuestions | None:
    """Return all questions of a rating's study, None where it asks only one.

    Beside the rating itself stands the newest of each other question with the same method and
    filters.
    """
    questions = snapshot.study.questions
    if len(questions) == 1:
        return None
    ratings_found = {snapshot.question: snapshot}
    for rating in (
        list_snapshots(snapshot.study).filter(state=Snapshot.State.READY).defer("results")
    ):
        if _rates_alike(rating) == _rates_alike(snapshot):
            ratings_found.setdefault(rating.question, rating)
    ratings = {question: ratings_found.get(question) for question in questions}
    rows = Standing.objects.filter(snapshot__in=ratings_found.values())
    by_rating: dict[int, dict[str, Line]] = {rating.pk: {} for rating in ratings_found.values()}
    for row in rows.order_by(F("rating").desc(nulls_last=True), "slug"):
        by_rating[row.snapshot_id][row.slug] = Line(name=row.name, **snapshot_values(row))
    standings = {key: by_rating[rating.pk] if rating else {} for key, rating in ratings.items()}
    return RatedQuestions(
        ratings=ratings,
        lines=[
            (row.name, [standings[question].get(slug) for question in questions])
            for slug, row in by_rating[snapshot.pk].items()
        ],
        links=[
            _link(pair, ratings_found, standings)
            for pair in combinations(questions, 2)
            if ratings_found.keys() >= set(pair)
        ],
    )


# --- Private -----------------------------------------------------------------------------------


def _rates_alike(snapshot: Snapshot) -> tuple[str, int | None, Filters]:
    filters = Filters.of_document(snapshot.filters)
    filters = replace(filters, question="", authors=frozenset())
    return snapshot.method, snapshot.last_vote, filters


def _link(
    pair: tuple[str, str],
    ratings: Mapping[str, Snapshot],
    standings: Mapping[str, Mapping[str, Line]],
) -> TwoQuestions:
    primary, other = pair
    first, second = (_preferences(ratings[question]) for question in pair)
    both = sorted(first.keys() & second.keys())
    hits = np.array([first[matchup][0] == second[matchup][0] for matchup in both], np.float64)
    clusters = np.array([first[matchup][1:] for matchup in both], np.int64).reshape(-1, 2)
    rated = [
        (row.rating, standings[other][slug].rating)
        for slug, row in standings[primary].items()
        if slug in standings[other]
    ]
    is_apart = any(len({*ratings[name].results.board.parts.values()}) > 1 for name in pair)
    pairs = [] if is_apart else [(x, y) for x, y in rated if x is not None and y is not None]
    return TwoQuestions(
        one=primary,
        other=other,
        spearman=_spearman(pairs),
        same=two_way_share(hits, *clusters.T),
        pairs=len(both),
    )


def _preferences(snapshot: Snapshot) -> dict[int, tuple[str, int, int]]:
    """Return the better side with expert and scenario, by matchup; ties are left out."""
    votes = select_counted_votes(snapshot).filter(outcome__in=DECIDED)
    rows = votes.values_list("matchup", "outcome", "expert", "matchup__scenario")
    return {matchup: (outcome, expert, scenario) for matchup, outcome, expert, scenario in rows}


def _spearman(rated: Sequence[tuple[float, float]]) -> float | None:
    if len(rated) < FEWEST:
        return None
    columns = [np.array(values) for values in zip(*rated, strict=True)]
    # Equal ratings share the mean of their ranks.
    ranks, other = ((v[:, None] > v).sum(1) + (v[:, None] == v).sum(1) / 2 for v in columns)
    if not ranks.std() or not other.std():
        return None
    return float(np.corrcoef(ranks, other)[0, 1])
