"""What a snapshot keeps: computing it from its votes, and reading those votes again."""

from __future__ import annotations

import platform
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy
import scipy
from django.db import transaction
from django.utils import timezone

from arena.models import Snapshot, Standing
from arena.models.ratings import stored_values
from arena.queries.votes.judged import AUTOMATIC, Entrant, Judged, is_imported
from arena.queries.votes.sets import Filters, VoteSet, vote_set
from arena.rating.comparisons import Comparisons
from arena.rating.leaderboard import Intervals, Leaderboard, Method, rate
from arena.rating.rules import TooManyContestants, Unit
from arena.rating.snapshot_document import VERSION as RESULTS_VERSION
from arena.rating.snapshot_document import Results
from arena.services import breakdowns
from arena.services.covariates import adjustment, with_covariates
from arena.services.own_votes import with_and_without
from arena.services.settled_pairs import settled_remark
from arena.services.trust import board_remarks, precision, trust
from arena.services.vote_arrays import VoteArrays, vote_arrays
from arena.services.vote_rows import VERSION as VOTES_VERSION
from arena.services.vote_rows import digest_of, vote_rows, votes_csv
from augment.errors import Conflict

Report = Callable[[int], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Computed:
    """What came out beside that which the snapshot itself has: its lines."""

    board: Leaderboard
    entrants: tuple[Entrant, ...]


def compute(snapshot: Snapshot, report: Report) -> Computed:
    """Rate the votes that a planned snapshot names, into the snapshot; nothing is stored.

    Args:
        snapshot: A planned one, stored or not.
        report: Is told how far it is, in percent.
    """
    report(5)
    votes = _vote_set(snapshot)
    arrays = vote_arrays(votes.entrants, votes.counted)
    report(20)
    plain = board = _rate(snapshot, arrays.comparisons)
    if snapshot.covariates:
        names = snapshot.covariates
        board = _rate(snapshot, with_covariates(arrays.comparisons, votes.counted, names))
    report(60)
    judges = {vote.judge: vote.judge_name for vote in votes.counted}
    snapshot.results = _results(snapshot, votes, arrays, board, plain, judges)
    report(90)
    snapshot.votes_sha256 = digest_of(votes_csv(vote_rows(votes.counted, judges)))
    snapshot.votes_counted = len(votes.counted)
    snapshot.votes_left_out = votes.left_out
    snapshot.versions = {
        "python": platform.python_version(),
        "numpy": numpy.__version__,
        "scipy": scipy.__version__,
        "results": RESULTS_VERSION,
        "votes": VOTES_VERSION,
    }
    snapshot.reason = board.explanation
    snapshot.degenerate_rounds = board.degenerate_rounds
    snapshot.includes_simulated = _any_simulated(votes.counted, votes.entrants)
    return Computed(board=board, entrants=votes.entrants)


@transaction.atomic
def keep(snapshot: Snapshot, computed: Computed) -> Snapshot:
    """Store what was computed."""
    snapshot.state = Snapshot.State.READY
    snapshot.progress = 100
    snapshot.claim = snapshot.heartbeat_at = None
    snapshot.finished_at = timezone.now()
    snapshot.save()
    _store_lines(snapshot, computed.board, computed.entrants)
    return snapshot


def votes_of(snapshot: Snapshot) -> VoteSet:
    """The votes that a snapshot is made of, read again.

    Raises:
        Conflict: They are not what they were: somebody changed rows by hand.
    """
    votes = _vote_set(snapshot)
    rows = vote_rows(votes.counted, snapshot.results.judges)
    if digest_of(votes_csv(rows, votes_version_of(snapshot))) != snapshot.votes_sha256:
        raise Conflict(
            f"The votes of '{snapshot.study.name}' are not those of this rating any more. "
            "Rate again."
        )
    return votes


def votes_version_of(snapshot: Snapshot) -> int:
    """The version of the columns that its file of votes has; older ones had no word for it."""
    return int(snapshot.versions.get("votes", 1))


# --- Private -----------------------------------------------------------------------------------


def _rate(snapshot: Snapshot, comparisons: Comparisons) -> Leaderboard:
    try:
        return rate(
            comparisons,
            method=Method(snapshot.method),
            rounds=snapshot.rounds,
            unit=Unit(snapshot.resampling_unit),
            intervals=Intervals(snapshot.intervals),
            seed=snapshot.seed,
        )
    except TooManyContestants as error:
        raise Conflict(f"{snapshot.study.name!r}: {error}") from error


def _vote_set(snapshot: Snapshot) -> VoteSet:
    filters = Filters.of_document(snapshot.filters)
    return vote_set(snapshot.study, filters=filters, last=snapshot.last_vote)


def _results(
    snapshot: Snapshot,
    votes: VoteSet,
    arrays: VoteArrays,
    board: Leaderboard,
    plain: Leaderboard,
    judges: dict[str, str],
) -> Results:
    study, seed = snapshot.study, snapshot.seed
    from_file = is_imported(study)
    filters = Filters.of_document(snapshot.filters)
    planned = breakdowns.planned_pairs(study, filters)
    planned.update(
        frozenset((vote.left, vote.right)) for vote in votes.counted if vote.kind == AUTOMATIC
    )
    remark = settled_remark(study, votes, left_out=filters.leave_out_settled)
    remarks = board_remarks(board)
    if remark:
        remarks = replace(remarks, warnings=(*remarks.warnings, remark))
    return Results(
        version=RESULTS_VERSION,
        board=remarks,
        trust=trust(arrays, votes, plain, seed=seed),
        claims=precision(arrays, board, unit=board.unit, seed=seed),
        own_votes=with_and_without(votes, filters, board, snapshot.covariates),
        adjustment=adjustment(snapshot.covariates, board, plain),
        pairs=breakdowns.pairs(arrays.comparisons, votes.counted, planned),
        types=breakdowns.by_type(arrays, board),
        displacement=() if from_file else breakdowns.displacement(study),
        cost=() if from_file else breakdowns.cost(study, votes.entrants),
        models={
            entrant.slug: entrant.contestant.model
            for entrant in votes.entrants
            if entrant.contestant is not None
        },
        judges=judges,
    )


def _any_simulated(votes: tuple[Judged, ...], entrants: tuple[Entrant, ...]) -> bool:
    """Whether something in the table is simulated, be it a line without votes."""
    return any(entrant.is_simulated for entrant in entrants) or any(
        vote.is_simulated for vote in votes
    )


def _store_lines(snapshot: Snapshot, board: Leaderboard, entrants: tuple[Entrant, ...]) -> None:
    Standing.objects.bulk_create(
        Standing(
            snapshot=snapshot,
            contestant=one.contestant,
            slug=one.slug,
            name=one.name,
            variant=one.variant,
            kind=one.kind,
            is_simulated=one.is_simulated,
            **stored_values(line),
        )
        for one, line in zip(entrants, board.lines, strict=True)
    )
