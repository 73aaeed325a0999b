"""How far a rating can be trusted, and what the votes of authors change in it."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from arena.rating import models
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
from arena.rating.leaderboard import Intervals, Leaderboard, Method, rate
from arena.rating.logistic import side_bias
from arena.rating.models import ELO_PER_LOGIT, MEAN_ELO
from arena.rating.planning import design_effects
from arena.rating.ranking import Separation
from arena.rating.reliability import Repeats, agreement, raters, repeat_consistency
from arena.rating.rules import Unit
from arena.rating.snapshot_document import (
    BoardRemarks,
    OnlinePlace,
    Overtaking,
    OwnVotes,
    PairP,
    PanelRater,
    Precision,
    Trust,
    VotesWanted,
)
from arena.results.queries.votes import AUTOMATIC, Filters, VoteSet, is_own_vote
from arena.results.services.analysis import SCORES, VoteArrays, vote_arrays
from arena.results.services.covariates import both_ranks, largest_move, with_covariates

AGREEMENT_ROUNDS = 1000
FIT_ROUNDS = 200
ELO_ROUNDS = 200
CLAIM_ROUNDS = 1000
WANTED = (20.0, 15.0, 10.0, 5.0)
"""Half-widths of intervals that the page says the necessary votes of."""

OTHER_ROUNDS = 10_000
"""At most so many for the version that the table does not show: about a tenth more than a rating
costs. With as many rounds as the table has and the same seed, ranks differ by the votes and hardly
by the draws."""


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
    repeats = _repeats(arrays, votes)
    given = np.flatnonzero([vote.kind != AUTOMATIC for vote in votes.counted])
    by_people = select_votes(inner, given)
    about_votes = Trust(
        tie_share=float((inner.score == 0.5).mean()) if len(inner) else None,
        agreement=agreement(by_people, rounds=AGREEMENT_ROUNDS, seed=seed),
        side=side_bias(by_people) if len(by_people) else None,
        repeats=repeats if repeats.number else None,
        raters=_panel(arrays, inner, given, strengths, votes, repeats),
    )
    if strengths is None:
        return about_votes
    change = fewest_votes_to_change_first(inner, strengths)
    return replace(
        about_votes,
        removal=None
        if change is None
        else Overtaking(votes=change.votes, exact=change.exact, rival=inner.names[change.rival]),
        elo_order=_elo_order(inner, strengths, seed),
        fit=fit_test(inner, strengths, rounds=FIT_ROUNDS, seed=seed),
    )


def board_remarks(board: Leaderboard, *more_warnings: str) -> BoardRemarks:
    """What a rating says beside its lines."""
    names = [line.name for line in board.lines]
    apart = board.told_apart
    return BoardRemarks(
        reasons=board.reasons,
        warnings=(*board.warnings, *more_warnings),
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
        if apart is None
        else tuple((names[i], names[j]) for i, j in np.argwhere(apart.above).tolist()),
        p_values=None if apart is None else _p_values(names, apart),
    )


def precision(arrays: VoteArrays, board: Leaderboard, *, seed: int) -> Precision:
    """What intervals would say if votes were independent, and how many votes the real ones need.

    Args:
        arrays: The votes that count.
        board: Their rating.
        seed: Of the draws of single votes.
    """
    alone = board
    if board.unit is not Unit.VOTE:
        alone = rate(
            arrays.comparisons,
            method=Method.DAVIDSON if board.method is Method.DAVIDSON else Method.BRADLEY_TERRY,
            rounds=CLAIM_ROUNDS,
            unit=Unit.VOTE,
            intervals=Intervals.CLOSED_FORM,
            seed=seed,
        )
    effects = design_effects(board, alone)
    halves = [(upper - lower) / 2.0 for lower, upper in _bounds(board).values() if upper > lower]
    typical = float(np.median(halves)) if halves else None
    votes = len(arrays.comparisons)
    return Precision(
        half_width=typical,
        independent=_bounds(alone),
        design_effect=float(np.median(effects)) if effects else None,
        planning=tuple(
            VotesWanted(half_width=wanted, votes=math.ceil(votes * (typical / wanted) ** 2))
            for wanted in WANTED
            if typical is not None
        ),
    )


def with_and_without(
    votes: VoteSet, filters: Filters, board: Leaderboard, covariates: Sequence[str] = ()
) -> OwnVotes | None:
    """Rank and rating with and without the votes of authors on their own contestants.

    The table counts them or leaves them out; the other version is computed here. None where no
    vote makes a difference.

    Args:
        votes: What is rated, and the votes of authors on their own contestants beside it.
        filters: They say who is author of what, and which version the table is.
        board: The table's rating.
        covariates: What it is adjusted for.
    """
    own = [vote for vote in votes.with_own if is_own_vote(vote, filters)]
    if not own:
        return None
    rest = votes.with_own
    if not filters.leave_out_own:
        rest = tuple(vote for vote in rest if not is_own_vote(vote, filters))
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
    lines = both_ranks(other, board) if filters.leave_out_own else both_ranks(board, other)
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


def _p_values(names: list[str], apart: Separation) -> tuple[PairP, ...]:
    low, high = np.triu_indices(len(names), 1)
    p_value, gap, half = (
        matrix[low, high] for matrix in (apart.p_value, apart.difference, apart.half)
    )
    known = ~np.isnan(p_value)
    columns = (low, high, p_value, gap, gap - half, gap + half)
    return tuple(
        PairP(a=names[i], b=names[j], p=p, difference=difference, lower=lower, upper=upper)
        for i, j, p, difference, lower, upper in zip(
            *(column[known].tolist() for column in columns), strict=True
        )
    )


def _bounds(board: Leaderboard) -> dict[str, tuple[float, float]]:
    """The intervals that are closed on both sides."""
    return {
        line.name: (line.lower, line.upper)
        for line in board.lines
        if line.lower is not None and line.upper is not None
    }


def _strengths(votes: Comparisons, board: Leaderboard) -> FloatArray | None:
    """(C,) by Bradley-Terry, whatever the method of the board; None where not all are rated."""
    if board.method is not Method.BRADLEY_TERRY and len(votes):
        board = rate(votes, rounds=1, unit=Unit.VOTE, details=False)
    lines = [line for line in board.lines if line.votes]
    ratings = [line.rating for line in lines if line.rating is not None]
    if len(ratings) < max(len(lines), 2) or len({line.part for line in lines}) > 1:
        return None
    return np.asarray((np.array(ratings, dtype=np.float64) - MEAN_ELO) / ELO_PER_LOGIT)


def _repeats(arrays: VoteArrays, votes: VoteSet) -> Repeats:
    """Each hidden repeat beside the first showing, from the same contestant's point of view."""
    first = {vote.matchup: vote for vote in votes.counted}
    number = {judge: index for index, judge in enumerate(arrays.judges)}
    rows = []
    for again in votes.repeats:
        before = first.get(again.repeat_of)
        if before is not None and again.judge in number:
            score = SCORES[again.outcome]
            same_side = score if again.left == before.left else 1.0 - score
            rows.append((SCORES[before.outcome], same_side, number[again.judge]))
    table = np.array(rows, dtype=np.float64).reshape(-1, 3)
    return repeat_consistency(table[:, 0], table[:, 1], table[:, 2].astype(np.int64))


def _panel(
    arrays: VoteArrays,
    inner: Comparisons,
    given: IntArray,
    strengths: FloatArray | None,
    votes: VoteSet,
    repeats: Repeats,
) -> tuple[PanelRater, ...]:
    """A line an expert, by the votes that people gave (V,)."""
    experts = len(arrays.judges)
    without = np.full((experts, len(inner.names)), np.nan)
    changes: list[int | None] = [None] * experts
    if strengths is not None and experts > 1:
        without = without_each_expert(inner, strengths)
        changes = rank_changes(strengths, without)
    names = {vote.judge: vote.judge_name for vote in votes.counted}
    panel = []
    for line in raters(select_votes(inner, given), ms=arrays.ms[given], without=without):
        judge = arrays.judges[line.expert]
        checks = [vote for vote in votes.checks if vote.judge == judge]
        answered = [vote for vote in checks if vote.outcome in SCORES]
        own = (vote for vote in votes.counted if vote.judge == judge)
        aids = Counter(aid for vote in own for aid in vote.aids.split())
        panel.append(
            PanelRater(
                **{field.name: getattr(line, field.name) for field in fields(line)},
                judge=judge,
                name=names[judge],
                moves=changes[line.expert],
                repeats=repeats.by_expert.get(line.expert, (0, 0)),
                checks=(len(answered), sum(vote.winner in votes.references for vote in answered)),
                checks_skipped=len(checks) - len(answered),
                aids=tuple(sorted(aids.items())),
            )
        )
    return tuple(panel)


def _elo_order(votes: Comparisons, strengths: FloatArray, seed: int) -> tuple[OnlinePlace, ...]:
    """Contestants by Bradley-Terry, with what online Elo makes of them."""
    online = np.median(models.resample_elo(votes, rounds=ELO_ROUNDS, seed=seed), axis=1)
    places = np.argsort(np.argsort(-online, kind="stable"))
    return tuple(
        OnlinePlace(
            slug=votes.names[index], elo=float(online[index]), place=int(places[index]) + 1
        )
        for index in np.argsort(-strengths, kind="stable").tolist()
    )
