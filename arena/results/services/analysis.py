"""Votes as arrays, and a rating by pairs, scenario types, displacement and cost."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain

import numpy as np
from django.db.models import Count, Q

from arena.jobs.queries import list_shown_ids
from arena.models import Matchup, Study, Vote
from arena.rating.comparisons import (
    LOSS,
    TIE,
    WIN,
    Comparisons,
    FloatArray,
    count_wins,
    select_votes,
)
from arena.rating.leaderboard import Leaderboard, rate
from arena.rating.snapshot_document import (
    DisplacementSummary,
    PairRecord,
    ScenarioCost,
    TypeRating,
    TypeStanding,
)
from arena.results.queries.votes import AUTOMATIC, Filters, RatedVote
from arena.voting.queries.blinding import is_imported
from augment.models import Contestant, EndpointModel
from augment.services.endpoints import sum_spending
from augment.services.endpoints.known_models import CONTESTANT
from augment.services.judging.displacement import MeasuredRow, of_rows, summarise
from augment.services.scenarios import in_type_order, type_label

SCORES = {
    Vote.Outcome.LEFT.value: WIN,
    Vote.Outcome.EQUAL.value: TIE,
    Vote.Outcome.RIGHT.value: LOSS,
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VoteArrays:
    """V votes as numbers.

    Attributes:
        comparisons: `first` was shown on the left.
        judges, items: Names by their numbers.
        ms: (V,) how long each pair was on screen, not a number where unknown.
    """

    comparisons: Comparisons
    judges: tuple[str, ...]
    items: tuple[str, ...]
    ms: FloatArray


def vote_arrays(competitors: Sequence[Contestant], votes: Sequence[RatedVote]) -> VoteArrays:
    """Number everything, in the order in which it occurs.

    Args:
        competitors: The contestants, also those without votes.
        votes: Each compares two of them.
    """
    number = {competitor.slug: index for index, competitor in enumerate(competitors)}
    judges: dict[str, int] = {}
    items: dict[str, int] = {}
    whole = partial(np.array, dtype=np.int64)
    comparisons = Comparisons(
        names=tuple(competitor.slug for competitor in competitors),
        shown=tuple(competitor.name for competitor in competitors),
        first=whole([number[vote.left] for vote in votes]),
        second=whole([number[vote.right] for vote in votes]),
        score=np.array([SCORES[vote.outcome] for vote in votes], dtype=np.float64),
        expert=whole([judges.setdefault(vote.judge, len(judges)) for vote in votes]),
        scenario=whole([items.setdefault(vote.item, len(items)) for vote in votes]),
    )
    return VoteArrays(
        comparisons=comparisons,
        judges=tuple(judges),
        items=tuple(items),
        ms=np.array([vote.ms_visible for vote in votes], dtype=np.float64),
    )


FEW_VOTES = 30
"""Below so many votes of a contestant a part of the table says that they are too few."""

TYPE_ROUNDS = 2000
_OF_LINE = ("rating", "lower", "upper", "rank", "votes")


def pairs(
    comparisons: Comparisons, votes: Sequence[RatedVote], planned: Counter[frozenset[str]]
) -> tuple[PairRecord, ...]:
    """Wins, ties, losses of every pair that met or should have, from the first one's view."""
    wins, ties = count_wins(comparisons)
    names = comparisons.names
    pairs_of_votes = [(frozenset((vote.left, vote.right)), vote) for vote in votes]
    missed = Counter(pair for pair, vote in pairs_of_votes if vote.both_miss)
    settled = Counter(pair for pair, vote in pairs_of_votes if vote.kind == AUTOMATIC)
    planned = planned + settled if planned else planned
    return tuple(
        PairRecord(
            a=first,
            b=names[j],
            wins=int(wins[i, j]),
            ties=int(ties[i, j]),
            losses=int(wins[j, i]),
            both_miss=missed[frozenset((first, names[j]))],
            planned=planned[frozenset((first, names[j]))] if planned else None,
            settled=settled[frozenset((first, names[j]))],
        )
        for i, first in enumerate(names)
        for j in range(i + 1, len(names))
        if wins[i, j] or wins[j, i] or ties[i, j] or planned[frozenset((first, names[j]))]
    )


def count_planned_pairs(study: Study, filters: Filters) -> Counter[frozenset[str]]:
    """Return the planned number of each pair by the same filters; empty for votes of a file."""
    if is_imported(study):
        return Counter()
    rows = study.matchups.filter(kind__in=[Matchup.Kind(kind).value for kind in filters.kinds])
    if filters.types:
        rows = rows.filter(scenario__type__in=filters.types)
    if filters.experts:
        rows = rows.filter(expert__person__code__in=filters.experts)
    planned: Counter[frozenset[str]] = Counter()
    who = "expert__person__code", "left__contestant__slug", "right__contestant__slug"
    for judge, left, right, number in rows.order_by().values_list(*who).annotate(n=Count("pk")):
        if not (filters.leave_out_own and filters.is_own(str(judge), left, right)):
            planned[frozenset((left, right))] += number
    return planned


def count_settled_ties(votes: Iterable[RatedVote]) -> Counter[str]:
    """Return how many ties on pairs that nobody was shown count for whom, sorted by slug."""
    ties = [(vote.left, vote.right) for vote in votes if vote.kind == AUTOMATIC]
    return Counter(sorted(chain.from_iterable(ties)))


def by_type(
    arrays: VoteArrays, votes: Sequence[RatedVote], board: Leaderboard
) -> tuple[TypeRating, ...]:
    """The rating of every scenario type on its own, as the board's, in the catalogue's order.

    Args:
        arrays: The votes that count.
        votes: The same.
        board: Their rating.
    """
    types = in_type_order(dict.fromkeys(vote.type for vote in votes if vote.type))
    return tuple(_rate_type(arrays.comparisons, votes, name, board) for name in types)


def _rate_type(
    comparisons: Comparisons, given: Sequence[RatedVote], name: str, whole: Leaderboard
) -> TypeRating:
    votes = select_votes(comparisons, np.array([vote.type == name for vote in given]))
    ties = count_settled_ties(vote for vote in given if vote.type == name)
    board = rate(
        votes,
        method=whole.method,
        rounds=min(whole.rounds, TYPE_ROUNDS),
        unit=whole.unit,
        intervals=whole.intervals,
        seed=whole.seed,
    )
    return TypeRating(
        type=name,
        label=type_label(name),
        votes=len(votes),
        scenarios=board.scenarios,
        status=board.explanation,
        reasons=board.reasons,
        lines=tuple(
            TypeStanding(
                slug=line.name,
                **{field: getattr(line, field) for field in _OF_LINE},
                note=line.note or None,
                few=line.votes - ties[line.name] < FEW_VOTES,
                settled=ties[line.name],
            )
            for line in board.standings
        ),
        settled=ties.total() // 2,
    )


def displacement(study: Study) -> tuple[DisplacementSummary, ...]:
    """Return each contestant's distances of shown augmentations from references and wishes."""
    by_slug: dict[str, list[MeasuredRow]] = {}
    for row in of_rows(list_shown_ids(study)):
        if row.displacement is not None:
            by_slug.setdefault(row.row.contestant.slug, []).append(row)
    totals = (
        (
            slug,
            summarise([row.displacement for row in rows if row.displacement is not None]),
            summarise([row.wish for row in rows if row.wish is not None]).box,
        )
        for slug, rows in sorted(by_slug.items())
    )
    return tuple(
        DisplacementSummary(
            slug=slug,
            median_m=None if total.box is None else total.box.median_m,
            mean_m=None if total.box is None else total.box.mean_m,
            n=total.n,
            missing=total.missing,
            surplus=total.surplus,
            augmentations=total.augmentations,
            at_t0_m=None if total.over_time is None else total.over_time.at_t0_m,
            final_m=None if total.over_time is None else total.over_time.final_m,
            wish_median_m=None if wish is None else wish.median_m,
            wish_mean_m=None if wish is None else wish.mean_m,
        )
        for slug, total, wish in totals
    )


def cost(study: Study, contestants: Sequence[Contestant]) -> tuple[ScenarioCost, ...]:
    """Return the average use for a scenario of each contestant that asks a language model."""
    spent = sum_spending(Q(attempt__augmentation__in=list_shown_ids(study)), by=CONTESTANT)
    models = EndpointModel.objects.values_list("endpoint", "model", "model_class")
    classes = {(endpoint, model): size for endpoint, model, size in models}
    return tuple(
        ScenarioCost(
            slug=row.slug,
            model=row.model,
            model_class=classes.get((row.endpoint_id or 0, row.model), ""),
            augmentations=totals.augmentations,
            calls=totals.calls / totals.augmentations,
            tokens=None if totals.tokens is None else totals.tokens / totals.augmentations,
            usd=None if totals.nano_usd is None else totals.nano_usd / totals.augmentations / 1e9,
        )
        for row in contestants
        if (totals := spent.get(row.pk)) is not None
    )
