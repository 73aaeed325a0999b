"""Votes as the arrays that ratings are computed from."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np
from django.db.models import Count

from arena.models import Matchup, Study, Vote
from arena.queries.costs import model_classes, shown_augmentations, spent_on
from arena.rating import elo
from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT, MEAN_ELO
from arena.rating.comparisons import (
    LOSS,
    TIE,
    WIN,
    Comparisons,
    FloatArray,
    IntArray,
    restrict_to,
    select_votes,
    tally,
    win_rates,
)
from arena.rating.fit_test import fit_test
from arena.rating.influence import fewest_votes_to_change_first, rank_changes, without_each_expert
from arena.rating.leaderboard import Intervals, Leaderboard, Line, Method, rate
from arena.rating.logistic import side_bias
from arena.rating.planning import design_effects, votes_until
from arena.rating.ranking import Separation
from arena.rating.reliability import Rater, Repeats, agreement, raters, repeat_consistency
from arena.rating.snapshot_document import (
    BoardRemarks,
    BothRanks,
    DisplacementSummary,
    OnlinePlace,
    Overtaking,
    OwnVotes,
    PairP,
    PairRecord,
    PanelRater,
    Precision,
    ScenarioCost,
    Trust,
    TypeRating,
    TypeStanding,
    VotesWanted,
)
from arena.results.queries.votes import (
    AUTOMATIC,
    Entrant,
    Filters,
    Judged,
    VoteSet,
    is_imported,
    is_own_vote,
)
from arena.services.covariates import largest_move, with_covariates
from augment.services.judging.displacement import of_rows, summarise
from augment.services.scenarios.types import in_type_order, type_label

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
        judges, items, types: Names by their numbers.
        type_of: (V,) the type of each vote's scenario.
        ms: (V,) how long each pair was on screen, not a number where unknown.
    """

    comparisons: Comparisons
    judges: tuple[str, ...]
    items: tuple[str, ...]
    types: tuple[str, ...]
    type_of: IntArray
    ms: FloatArray


def vote_arrays(entrants: Sequence[Entrant], votes: Sequence[Judged]) -> VoteArrays:
    """Number everything, in the order in which it occurs.

    Args:
        entrants: The contestants, also those without votes.
        votes: Each compares two of them.
    """
    number = {entrant.slug: index for index, entrant in enumerate(entrants)}
    judges: dict[str, int] = {}
    items: dict[str, int] = {}
    types: dict[str, int] = {}
    whole = partial(np.array, dtype=np.int64)
    type_of = whole([types.setdefault(vote.type, len(types)) for vote in votes])
    comparisons = Comparisons(
        names=tuple(entrant.slug for entrant in entrants),
        shown=tuple(entrant.name for entrant in entrants),
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
        types=tuple(types),
        type_of=type_of,
        ms=np.array(
            [np.nan if vote.ms_visible is None else vote.ms_visible for vote in votes],
            dtype=np.float64,
        ),
    )


FEW_VOTES = 30
"""Below so many votes of a contestant a part of the table says that they are too few."""

TYPE_ROUNDS = 2000


def pairs(
    comparisons: Comparisons, votes: Sequence[Judged], planned: Counter[frozenset[str]]
) -> tuple[PairRecord, ...]:
    """Wins, ties, losses of every pair that met or should have, from the first one's view."""
    found = win_rates(comparisons)
    names = comparisons.names
    missed = Counter(frozenset((vote.left, vote.right)) for vote in votes if vote.both_miss)
    return tuple(
        PairRecord(
            a=one,
            b=names[j],
            wins=int(found.wins[i, j]),
            ties=int(found.ties[i, j]),
            losses=int(found.wins[j, i]),
            both_miss=missed[frozenset((one, names[j]))],
            planned=planned[frozenset((one, names[j]))] if planned else None,
        )
        for i, one in enumerate(names)
        for j in range(i + 1, len(names))
        if found.votes[i, j] or planned[frozenset((one, names[j]))]
    )


def planned_pairs(study: Study, filters: Filters) -> Counter[frozenset[str]]:
    """How often each pair was to be judged, by the same filters; nothing for votes of a file."""
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


def by_type(arrays: VoteArrays, board: Leaderboard) -> tuple[TypeRating, ...]:
    """The rating of every scenario type on its own, as the board's, in the catalogue's order.

    Args:
        arrays: The votes that count.
        board: Their rating.
    """
    known = in_type_order(name for name in arrays.types if name)
    return tuple(_one_type(arrays, name, board) for name in known)


def displacement(study: Study) -> tuple[DisplacementSummary, ...]:
    """How far each contestant's shown augmentations are from the references."""
    by_slug: dict[str, list[Any]] = {}
    for row in of_rows(shown_augmentations(study)):
        if row.displacement is not None:
            by_slug.setdefault(row.row.contestant.slug, []).append(row.displacement)
    totals = ((slug, summarise(found)) for slug, found in sorted(by_slug.items()))
    return tuple(
        DisplacementSummary(
            slug=slug,
            median_m=None if total.box is None else total.box.median_m,
            mean_m=None if total.box is None else total.box.mean_m,
            n=total.n,
            missing=total.missing,
            surplus=total.surplus,
            augmentations=total.augmentations,
        )
        for slug, total in totals
    )


def cost(study: Study, entrants: Sequence[Entrant]) -> tuple[ScenarioCost, ...]:
    """What each contestant that asks a language model takes per scenario."""
    rows = [entrant.contestant for entrant in entrants if entrant.contestant is not None]
    spent = spent_on(shown_augmentations(study))
    classes = model_classes(rows)
    return tuple(
        ScenarioCost(
            slug=row.slug,
            model=row.model,
            model_class=classes.get(row.pk, ""),
            augmentations=found.augmentations,
            calls=found.calls / found.augmentations,
            tokens=None if found.tokens is None else found.tokens / found.augmentations,
            usd=None if found.nano_usd is None else found.nano_usd / found.augmentations / 1e9,
        )
        for row in rows
        if (found := spent.get(row.pk)) is not None
    )


# --- Private -----------------------------------------------------------------------------------


def _one_type(arrays: VoteArrays, name: str, whole: Leaderboard) -> TypeRating:
    votes = select_votes(arrays.comparisons, arrays.type_of == arrays.types.index(name))
    board = rate(
        votes,
        method=whole.method,
        rounds=min(whole.rounds, TYPE_ROUNDS),
        unit=whole.unit,
        intervals=whole.intervals,
        seed=whole.seed,
        details=False,
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
                rating=line.rating,
                lower=line.lower,
                upper=line.upper,
                rank=line.rank,
                note=line.note or None,
                votes=line.votes,
                few=line.votes < FEW_VOTES,
            )
            for line in board.standings
        ),
    )


AGREEMENT_ROUNDS = 1000
FIT_ROUNDS = 200
ELO_ROUNDS = 200
CLAIM_ROUNDS = 1000
WANTED = (20.0, 15.0, 10.0, 5.0)
"""Half-widths of intervals that the page says the necessary votes of."""


def trust(arrays: VoteArrays, votes: VoteSet, board: Leaderboard, *, seed: int) -> Trust:
    """All statistics about the votes themselves; parts that the votes do not determine are None.

    Args:
        arrays: The votes that count.
        votes: The same with hidden repeats and checks.
        board: Their rating.
        seed: Of every draw.
    """
    rated = np.flatnonzero(tally(arrays.comparisons).sum(axis=1)).tolist()
    inner = restrict_to(arrays.comparisons, rated)
    strengths = _strengths(inner, board)
    if set(arrays.items) == {""}:  # nobody knows what was shown twice
        inner = replace(inner, scenario=np.arange(len(inner), dtype=np.int64))
    first = _repeats(arrays, votes)
    given = np.flatnonzero([vote.kind != AUTOMATIC for vote in votes.counted])
    by_people = select_votes(inner, given)
    found = Trust(
        tie_share=_tie_share(inner),
        agreement=agreement(by_people, rounds=AGREEMENT_ROUNDS, seed=seed),
        side=side_bias(by_people) if len(by_people) else None,
        repeats=first if first.number else None,
        raters=_panel(arrays, inner, strengths, votes, first, given),
    )
    if strengths is None:
        return found
    return replace(
        found,
        removal=_overtaking(inner, strengths),
        elo_order=_elo_order(inner, strengths, seed),
        fit=fit_test(inner, strengths, rounds=FIT_ROUNDS, seed=seed),
    )


def board_remarks(board: Leaderboard) -> BoardRemarks:
    """What a rating says beside its lines."""
    names = [line.name for line in board.lines]
    found = board.told_apart
    return BoardRemarks(
        reasons=board.reasons,
        warnings=board.warnings,
        tie_strength=board.tie_strength,
        experts=board.experts,
        scenarios=board.scenarios,
        check={
            line.name: (line.check_lower, line.check_upper)
            for line in board.lines
            if line.check_lower is not None and line.check_upper is not None
        },
        order=tuple(line.name for line in board.standings),
        parts={line.name: line.part for line in board.lines if line.part >= 0},
        above=None
        if found is None
        else tuple((names[i], names[j]) for i, j in np.argwhere(found.above).tolist()),
        p_values=None if found is None else _p_values(names, found),
    )


def _p_values(names: list[str], found: Separation) -> tuple[PairP, ...]:
    low, high = np.triu_indices(len(names), 1)
    known = ~np.isnan(found.p_value[low, high])
    difference, half = found.difference[low, high], found.half[low, high]
    columns = (low, high, found.p_value[low, high], difference, difference - half)
    rows = zip(*(column[known].tolist() for column in (*columns, difference + half)), strict=True)
    return tuple(
        PairP(a=names[i], b=names[j], p=p, difference=gap, lower=lower, upper=upper)
        for i, j, p, gap, lower, upper in rows
    )


def precision(arrays: VoteArrays, board: Leaderboard, *, unit: Unit, seed: int) -> Precision:
    """What intervals would say if votes were independent, and how many votes the real ones need.

    Args:
        arrays: The votes that count.
        board: Their rating, its intervals by `unit`.
        unit: What was resampled for them.
        seed: Of the draws of single votes.
    """
    alone = board
    if unit is not Unit.VOTE:
        alone = rate(
            arrays.comparisons,
            method=Method.DAVIDSON if board.method is Method.DAVIDSON else Method.BRADLEY_TERRY,
            rounds=CLAIM_ROUNDS,
            unit=Unit.VOTE,
            intervals=Intervals.CLOSED_FORM,
            seed=seed,
        )
    effects = design_effects(board, alone)
    known = [half for half in map(_half, board.lines) if half]
    typical = float(np.median(known)) if known else None
    votes = len(arrays.comparisons)
    return Precision(
        half_width=typical,
        independent={
            line.name: (line.lower, line.upper)
            for line in alone.lines
            if line.lower is not None and line.upper is not None
        },
        design_effect=float(np.median(effects)) if effects else None,
        planning=()
        if typical is None
        else tuple(
            VotesWanted(
                half_width=wanted,
                votes=votes_until(votes=votes, half_width=typical, wanted=wanted),
            )
            for wanted in WANTED
        ),
    )


# --- Private -----------------------------------------------------------------------------------


def _strengths(votes: Comparisons, board: Leaderboard) -> FloatArray | None:
    """(C,) by Bradley-Terry, whatever the method of the board; None where not all are rated."""
    if board.method is not Method.BRADLEY_TERRY and len(votes):
        board = rate(votes, rounds=1, unit=Unit.VOTE, details=False)
    lines = [line for line in board.lines if line.votes]
    ratings = [line.rating for line in lines if line.rating is not None]
    if len(ratings) < max(len(lines), 2) or len({line.part for line in lines}) > 1:
        return None
    return np.asarray((np.array(ratings, dtype=np.float64) - MEAN_ELO) / ELO_PER_LOGIT)


def _overtaking(votes: Comparisons, strengths: FloatArray) -> Overtaking | None:
    found = fewest_votes_to_change_first(votes, strengths)
    if found is None:
        return None
    return Overtaking(votes=found.votes, exact=found.exact, rival=votes.names[found.rival])


def _half(line: Line) -> float | None:
    if line.lower is None or line.upper is None:
        return None
    return float(line.upper - line.lower) / 2.0


def _tie_share(votes: Comparisons) -> float | None:
    return float((votes.score == 0.5).mean()) if len(votes) else None


def _repeats(arrays: VoteArrays, votes: VoteSet) -> Repeats:
    """Each hidden repeat beside the first showing, from the same contestant's point of view."""
    first = {vote.matchup: vote for vote in votes.counted}
    number = {judge: index for index, judge in enumerate(arrays.judges)}
    rows = []
    for again in votes.repeats:
        before = first.get(again.repeat_of)
        if before is None or again.judge not in number:
            continue
        score = SCORES[again.outcome]
        rows.append(
            (
                SCORES[before.outcome],
                score if again.left == before.left else 1.0 - score,
                number[again.judge],
            )
        )
    table = np.array(rows, dtype=np.float64).reshape(-1, 3)
    return repeat_consistency(table[:, 0], table[:, 1], table[:, 2].astype(np.int64))


def _panel(
    arrays: VoteArrays,
    inner: Comparisons,
    strengths: FloatArray | None,
    votes: VoteSet,
    repeats: Repeats,
    given: IntArray,
) -> tuple[PanelRater, ...]:
    """A line an expert, by the votes that people gave (V,)."""
    experts = len(arrays.judges)
    without = np.full((experts, len(inner.names)), np.nan)
    changes: list[int | None] = [None] * experts
    if strengths is not None and experts > 1:
        without = without_each_expert(inner, strengths)
        changes = rank_changes(strengths, without)
    names = {vote.judge: vote.judge_name for vote in votes.counted}
    return tuple(
        PanelRater(
            **_by_field(line),
            judge=arrays.judges[line.expert],
            name=names[arrays.judges[line.expert]],
            moves=changes[line.expert],
            repeats=repeats.by_expert.get(line.expert, (0, 0)),
            **_checks(votes, arrays.judges[line.expert]),
            aids=_aids(votes, arrays.judges[line.expert]),
        )
        for line in raters(select_votes(inner, given), ms=arrays.ms[given], without=without)
    )


def _by_field(value: Rater) -> dict[str, Any]:
    return {one.name: getattr(value, one.name) for one in fields(value)}


def _checks(votes: VoteSet, judge: str) -> dict[str, Any]:
    """How many attention checks were answered, how many for the reference, how many skipped."""
    own = [vote for vote in votes.checks if vote.judge == judge]
    answered = [vote for vote in own if vote.outcome in SCORES]
    passed = sum(vote.winner in votes.references for vote in answered)
    return {"checks": (len(answered), passed), "checks_skipped": len(own) - len(answered)}


def _aids(votes: VoteSet, judge: str) -> tuple[tuple[str, int], ...]:
    """In how many counted votes a judge looked with what, by name."""
    used = Counter(
        aid for vote in votes.counted if vote.judge == judge for aid in vote.aids.split()
    )
    return tuple(sorted(used.items()))


def _elo_order(votes: Comparisons, strengths: FloatArray, seed: int) -> tuple[OnlinePlace, ...]:
    """Contestants by Bradley-Terry, with what online Elo makes of them."""
    online = np.median(elo.resample_elo(votes, rounds=ELO_ROUNDS, seed=seed), axis=1)
    places = np.argsort(np.argsort(-online, kind="stable"))
    order = np.argsort(-strengths, kind="stable")
    return tuple(
        OnlinePlace(
            slug=votes.names[index], elo=float(online[index]), place=int(places[index]) + 1
        )
        for index in order.tolist()
    )


OTHER_ROUNDS = 10_000
"""At most so many for the version that the table does not show: about a tenth more than a rating
costs. With as many rounds as the table has and the same seed, ranks differ by the votes and hardly
by the draws."""


def with_and_without(
    votes: VoteSet, filters: Filters, board: Leaderboard, covariates: Sequence[str] = ()
) -> OwnVotes | None:
    """Rank and rating of everybody in both versions; None where no vote makes a difference.

    Args:
        votes: What is rated, and the votes of authors on their own contestants beside it.
        filters: They say who is author of what, and which version the table is.
        board: The table's rating.
        covariates: What it is adjusted for.
    """
    own = [vote for vote in votes.with_own if is_own_vote(vote, filters)]
    if not own:
        return None
    others = [vote for vote in votes.with_own if not is_own_vote(vote, filters)]
    rest = votes.with_own if filters.leave_out_own else others
    arrays = vote_arrays(votes.entrants, rest)
    other = rate(
        with_covariates(arrays.comparisons, rest, covariates),
        method=board.method,
        rounds=min(board.rounds, OTHER_ROUNDS),
        unit=board.unit,
        intervals=board.intervals,
        seed=board.seed,
        details=False,
    )
    full, fewer = (other, board) if filters.leave_out_own else (board, other)
    lines = tuple(_both_ranks(*both) for both in zip(full.lines, fewer.lines, strict=True))
    by_judge = Counter(vote.judge for vote in own)
    return OwnVotes(
        left_out=filters.leave_out_own,
        votes=len(own),
        experts=len(by_judge),
        of_experts=len({vote.judge for vote in votes.with_own if vote.kind != AUTOMATIC}),
        rounds=other.rounds,
        reasons=other.reasons,
        largest=largest_move(lines),
        lines=lines,
        by_judge=dict(by_judge),
    )


# --- Private -----------------------------------------------------------------------------------


def _both_ranks(full: Line, fewer: Line) -> BothRanks:
    return BothRanks(
        slug=full.name,
        rank_with=full.rank,
        rating_with=full.rating,
        rank_without=fewer.rank,
        rating_without=fewer.rating,
    )
