"""How far a rating can be trusted, as a snapshot keeps it."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import fields, replace
from typing import Any

import numpy as np

from arena.queries.votes.judged import AUTOMATIC
from arena.queries.votes.sets import VoteSet
from arena.rating.comparisons import (
    Comparisons,
    FloatArray,
    IntArray,
    restrict_to,
    select_votes,
    tally,
)
from arena.rating.influence import (
    fewest_votes_to_change_first,
    fit_test,
    rank_changes,
    without_each_expert,
)
from arena.rating.leaderboard import Intervals, Leaderboard, Line, Method, rate
from arena.rating.logistic import side_bias
from arena.rating.models import ELO_PER_LOGIT, MEAN_ELO, resample_elo
from arena.rating.planning import design_effects
from arena.rating.ranking import Separation
from arena.rating.reliability import Rater, Repeats, agreement, raters, repeat_consistency
from arena.rating.rules import Unit
from arena.rating.snapshot_document import (
    BoardRemarks,
    OnlinePlace,
    Overtaking,
    PairP,
    PanelRater,
    Precision,
    Trust,
    VotesWanted,
)
from arena.services.vote_arrays import SCORES, VoteArrays

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
            VotesWanted(half_width=wanted, votes=math.ceil(votes * (typical / wanted) ** 2))
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
    online = np.median(resample_elo(votes, rounds=ELO_ROUNDS, seed=seed), axis=1)
    places = np.argsort(np.argsort(-online, kind="stable"))
    order = np.argsort(-strengths, kind="stable")
    return tuple(
        OnlinePlace(
            slug=votes.names[index], elo=float(online[index]), place=int(places[index]) + 1
        )
        for index in order.tolist()
    )
