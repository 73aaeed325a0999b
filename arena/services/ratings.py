"""Freezing a rating of a study: which votes, which method, which seed, and what came out."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Sequence
from typing import Any

import numpy
from django.contrib.auth.models import User
from django.db import transaction

from arena.errors import StudyStillOpen
from arena.models import Snapshot, Standing, Study, Vote
from arena.queries.votes import current_votes
from arena.rating.bootstrap import Unit
from arena.rating.comparisons import LOSS, TIE, WIN, Comparison, as_arrays
from arena.rating.leaderboard import Leaderboard, Method
from arena.rating.leaderboard import rate as rate_votes
from augment.errors import Conflict, UnknownName
from augment.models import Contestant
from augment.services.events import log_event

MOST_ROUNDS = 100_000
SCORES = {Vote.Outcome.LEFT: WIN, Vote.Outcome.EQUAL: TIE, Vote.Outcome.RIGHT: LOSS}


@transaction.atomic
def rate(
    *,
    study: Study,
    method: str = "bt",
    rounds: int = 1000,
    seed: int = 0,
    unit: str = "vote",
    early: bool = False,
    actor: User | None = None,
) -> Snapshot:
    """Rate the contestants of a study by its current votes and keep the result for good.

    The same votes, method, unit, rounds and seed give the same standings.

    Args:
        study: Closed, unless `early`.
        method: "bt" (Bradley-Terry) or "elo" (online).
        rounds: Of the bootstrap.
        seed: Of its draws, 0 or more.
        unit: What the bootstrap draws: "vote", "scenario", "expert" or "two-way".
        early: Rate a study that is still open; the snapshot and the log say so.
        actor: Who rates, for the log.

    Raises:
        StudyStillOpen: The study is open and nobody asked to look early.
        UnknownName: There is no such method or unit.
        Conflict: Rounds or seed are out of range, or online Elo is asked for another unit.
    """
    is_early = study.state == Study.State.OPEN
    if is_early and not early:
        raise StudyStillOpen(study.name)
    chosen, drawn = _method(method), _unit(unit)
    _check_draws(chosen, drawn, rounds, seed)
    votes, left_out = _votes_that_count(study)
    contestants = list(study.contestants.order_by("slug"))
    names = [contestant.slug for contestant in contestants]
    comparisons = as_arrays(names, [_comparison(vote) for vote in votes])
    board = rate_votes(comparisons, method=chosen, rounds=rounds, unit=drawn, seed=seed)
    snapshot = Snapshot.objects.create(
        study=study,
        method=chosen,
        rounds=rounds,
        resampling_unit=drawn,
        seed=seed,
        votes_sha256=_digest(votes),
        votes_counted=len(votes),
        votes_left_out=left_out,
        versions={"python": platform.python_version(), "numpy": numpy.__version__},
        status=board.explanation,
        degenerate_rounds=board.degenerate_rounds,
        includes_simulated=_any_simulated(votes, contestants),
        is_early=is_early,
        made_by=actor,
    )
    _store_lines(snapshot, board, contestants)
    _log(snapshot)
    return snapshot


def log_early_look(*, study: Study, actor: User | None, what: str) -> None:
    """Write to the log that somebody looked at results of an open study on purpose."""
    log_event(
        actor=actor,
        verb="look early",
        object_kind="study",
        object_code=study.code,
        after={"what": what},
    )


# --- What was asked for ------------------------------------------------------------------------


def _method(name: str) -> Method:
    if name not in list(Method):
        raise UnknownName("method", name, [method.value for method in Method])
    return Method(name)


def _unit(name: str) -> Unit:
    if name not in list(Unit):
        raise UnknownName("resampling unit", name, [unit.value for unit in Unit])
    return Unit(name)


def _check_draws(method: Method, unit: Unit, rounds: int, seed: int) -> None:
    if not 1 <= rounds <= MOST_ROUNDS:
        raise Conflict(f"Bootstrap rounds go from 1 to {MOST_ROUNDS}, not {rounds}.")
    if not 0 <= seed < 2**63:
        raise Conflict(f"A seed goes from 0 to 2^63 - 1, not {seed}.")
    if method is Method.ELO and unit is not Unit.VOTE:
        raise Conflict(f"Online Elo resamples single votes only; {unit.value!r} needs bt.")


# --- Which votes count -------------------------------------------------------------------------


def _votes_that_count(study: Study) -> tuple[list[Vote], dict[str, int]]:
    """The current votes in a lasting order, and how many were left out, by reason."""
    found = list(
        current_votes(study)
        .select_related(
            "expert__person", "matchup__scenario", "shown_left__contestant",
            "shown_right__contestant",
        )
        .only(
            "outcome", "is_simulated", "expert__username", "expert__person__is_simulated",
            "matchup__position", "matchup__scenario__slug",
            "shown_left__contestant__slug", "shown_left__contestant__kind",
            "shown_right__contestant__slug", "shown_right__contestant__kind",
        )
        .order_by("expert__username", "matchup__position")
    )  # fmt: skip
    everything = Vote.objects.filter(matchup__study=study).count()
    counted = [vote for vote in found if study.allow_simulated or not _is_simulated(vote)]
    left_out = {
        "superseded": everything - len(found),
        "simulated": len(found) - len(counted),
    }
    return counted, {reason: number for reason, number in left_out.items() if number}


def _is_simulated(vote: Vote) -> bool:
    contestants = (vote.shown_left.contestant, vote.shown_right.contestant)
    return vote.is_simulated or any(contestant.is_simulated for contestant in contestants)


def _any_simulated(votes: Sequence[Vote], contestants: Sequence[Contestant]) -> bool:
    """Whether something in the table is simulated, be it a line without votes."""
    rated = any(contestant.is_simulated for contestant in contestants)
    return rated or any(_is_simulated(vote) for vote in votes)


def _comparison(vote: Vote) -> Comparison:
    return Comparison(
        first=vote.shown_left.contestant.slug,
        second=vote.shown_right.contestant.slug,
        score=SCORES[Vote.Outcome(vote.outcome)],
        expert=vote.expert.username,
        scenario=vote.matchup.scenario.slug,
    )


def _digest(votes: Sequence[Vote]) -> str:
    """SHA-256 over one canonical line a vote: who judged what, and how."""
    lines: list[list[Any]] = [
        [
            vote.expert.username,
            vote.matchup.position,
            vote.matchup.scenario.slug,
            vote.shown_left.contestant.slug,
            vote.shown_right.contestant.slug,
            vote.outcome,
            vote.is_simulated,
        ]
        for vote in votes
    ]
    text = "\n".join(json.dumps(line, ensure_ascii=True) for line in lines)
    return hashlib.sha256(text.encode()).hexdigest()


def _log(snapshot: Snapshot) -> None:
    log_event(
        actor=snapshot.made_by,
        verb="rate early" if snapshot.is_early else "rate",
        object_kind="study",
        object_code=snapshot.study.code,
        after={"snapshot": str(snapshot.code), "votes": snapshot.votes_counted},
    )


def _store_lines(snapshot: Snapshot, board: Leaderboard, contestants: list[Contestant]) -> None:
    Standing.objects.bulk_create(
        Standing(
            snapshot=snapshot,
            contestant=contestant,
            rank=line.rank,
            rating=line.rating,
            lower=line.lower,
            upper=line.upper,
            votes=line.votes,
            wins=line.wins,
            ties=line.ties,
            losses=line.losses,
            note=line.note,
        )
        for contestant, line in zip(contestants, board.lines, strict=True)
    )
