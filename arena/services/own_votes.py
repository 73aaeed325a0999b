"""A rating with and without the votes of authors on their own contestants, side by side.

The table counts them or leaves them out; the other version is computed here once, and kept in the
snapshot like everything else.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from arena.queries.votes.judged import AUTOMATIC
from arena.queries.votes.sets import Filters, VoteSet, is_own_vote
from arena.rating.leaderboard import Leaderboard, Line, rate
from arena.rating.snapshot_document import BothRanks, OwnVotes
from arena.services.covariates import largest_move, with_covariates
from arena.services.vote_arrays import vote_arrays

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
