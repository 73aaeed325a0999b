"""Rating a study: which votes, which method, which seed, now or by a worker, and what is kept."""

import platform
from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from typing import TypedDict, TypeVar, Unpack

import numpy
import scipy
from django.contrib.auth.models import User
from django.db import transaction
from django.utils import timezone

from arena.errors import StudyStillOpen
from arena.exports.files import sha256_hex
from arena.models import EarlyLook, ImportedVote, SharedRating, Snapshot, Standing, Study, Vote
from arena.models.ratings import snapshot_values
from arena.rating.leaderboard import Leaderboard, Method, rate
from arena.rating.rules import (
    MOST_DRAWS,
    Intervals,
    TooManyContestants,
    Unit,
    choose_rules,
    unit_for,
)
from arena.rating.snapshot_document import VERSION as RESULTS_VERSION
from arena.rating.snapshot_document import Results
from arena.rating.vote_columns import VERSION as VOTES_VERSION
from arena.results.queries import votes as vote_queries
from arena.results.services import analysis
from arena.results.services.agreement import rater_agreement
from arena.results.services.analysis import VoteArrays, vote_arrays
from arena.results.services.trust import board_remarks, remark_on_ties, trust
from arena.results.services.vote_files import vote_rows, votes_csv
from arena.studies.queries import author_pairs
from arena.studies.services.opening import product_version
from arena.voting.queries.blinding import is_imported, votes_in
from arena.voting.services.turns import in_turn
from augment.errors import Conflict, LeaseLost, check_names
from augment.services import Lease, Moment, WorkKind, log_change

CLOSED_FORM_FROZEN = "two-way over experts and scenarios, closed form"
"""In preregistrations before 2026-11-29: such studies are rated as they say."""
WHILE_WAITING = 20_000
"""Up to so many votes a person waits for the page; more are a worker's job."""

Word = TypeVar("Word", bound=StrEnum)


class Choices(TypedDict, total=False):
    """Choices of a rating; `plan_snapshot` defines each one and its default."""

    method: str
    rounds: int | None
    seed: int
    unit: str | None
    intervals: str | None
    filters: vote_queries.Filters | None
    early: bool
    actor: User | None


# --- Entry points ------------------------------------------------------------------------------


def rate_now(*, study: Study, **choices: Unpack[Choices]) -> Snapshot:
    """Rate the contestants of a study by its current votes and keep the result for good.

    The same votes, filters, method, unit, rounds and seed give the same snapshot. Choices and
    errors are those of `plan_snapshot`; after an error nothing is kept. Nothing is written before
    all is computed, so that votes come in meanwhile.
    """
    snapshot = _plan(study, choices)
    computed = compute(snapshot, lambda percent: None)
    with in_turn(), transaction.atomic():
        snapshot.save()
        _log(snapshot)
        return keep(snapshot, computed)


@transaction.atomic
def plan_snapshot(*, study: Study, **choices: Unpack[Choices]) -> Snapshot:
    """Freeze what is to be rated, for a worker to compute.

    Args:
        study: Closed, unless `early`.
        method: "bt" (Bradley-Terry), "davidson" (its tie model) or "elo" (online).
        rounds: Of the bootstrap; None for as many as the intervals need.
        seed: Of its draws, 0 or more.
        unit: By what votes are clustered: "vote", "scenario", "expert" or "two-way"; None for
            two-way where the votes name experts and scenarios, else votes.
        intervals: "bootstrap", "closed" or "resamples"; None for what was preregistered, else the
            bootstrap, but resamples of single votes and for online Elo.
        filters: Which votes count; None for all main ones. Who is author of what is added to them
            here, so that later marks do not change the rating.
        early: Rate a study that is still open; the snapshot and the log say so.
        actor: Who rates, for the log.

    Raises:
        StudyStillOpen: The study is open and nobody asked to look early.
        UnknownName: There is no such method, unit or kind of intervals, or a filter names what
            does not occur.
        Conflict: Rounds or seed are out of range, or online Elo is asked for another unit.
    """
    snapshot = _plan(study, choices)
    snapshot.save()
    _log(snapshot)
    return snapshot


class PlannedRatings(WorkKind[Snapshot]):
    """Planned ratings of many votes."""

    model = Snapshot
    related = ("study", "made_by")

    def run(self, row: Snapshot, held: Lease[Snapshot]) -> None:
        """Compute it, saying how far it is, and keep it with its lines."""
        try:
            computed = compute(row, lambda percent: held.note(progress=percent))
        except ArithmeticError as error:
            raise Conflict(str(error)) from error
        with transaction.atomic():
            if not held.is_held(lock=True):
                raise LeaseLost
            keep(row, computed)

    def on_finish(self, pk: int, end: str, reason: str, now: Moment) -> None:
        """Say in the log why there is no rating."""
        row = self.rows.select_related(*self.related).get(pk=pk)
        if row.state == Snapshot.State.FAILED:
            after = {"snapshot": str(row.code), "why": row.reason}
            log_change(row.study, "rating failed", row.made_by, after=after)


RATINGS = PlannedRatings()


def is_big(study: Study) -> bool:
    """Return whether rating takes longer than a person should wait for a page."""
    if is_imported(study):
        return ImportedVote.objects.filter(file__study=study).count() > WHILE_WAITING
    return Vote.objects.filter(matchup__study=study).count() > WHILE_WAITING


@transaction.atomic
def open_early(*, study: Study, actor: User) -> None:
    """Open the results of an open study to somebody, who no longer votes in it from then on.

    Raises:
        Conflict: The study is not open: there is nothing to open early.
    """
    if study.state != Study.State.OPEN:
        raise Conflict(f"The study '{study.name}' is {study.state}: nothing is opened early.")
    _, is_new = EarlyLook.objects.get_or_create(study=study, user=actor)
    if is_new:
        after = {"what": "results", "ends_voting": votes_in(actor, study)}
        log_change(study, "look early", actor, after=after)


def log_early_look(*, study: Study, actor: User | None, what: str) -> None:
    """Write to the log that somebody looked at results of an open study on purpose."""
    log_change(study, "look early", actor, after={"what": what})


# --- Computing and keeping ---------------------------------------------------------------------


def compute(snapshot: Snapshot, report: Callable[[int], None]) -> list[Standing]:
    """Rate the votes that a planned snapshot names, into it and its lines; nothing is stored.

    Args:
        snapshot: A planned one, stored or not.
        report: Is told how far it is, in percent.
    """
    report(5)
    votes = _vote_set(snapshot)
    arrays = vote_arrays(votes.competitors, votes.counted)
    report(20)
    try:
        board = rate(
            arrays.comparisons,
            method=Method(snapshot.method),
            rounds=snapshot.rounds,
            unit=Unit(snapshot.resampling_unit),
            intervals=Intervals(snapshot.intervals),
            seed=snapshot.seed,
        )
    except TooManyContestants as error:
        raise Conflict(f"{snapshot.study.name!r}: {error}") from error
    report(60)
    snapshot.results = results = _results(snapshot, votes, arrays, board)
    report(90)
    snapshot.votes_sha256 = sha256_hex(votes_csv(vote_rows(votes.counted, results.judges)))
    snapshot.votes_counted = len(votes.counted)
    snapshot.votes_left_out = votes.left_out
    snapshot.versions = software_versions()
    snapshot.reason = board.explanation
    snapshot.degenerate_rounds = board.degenerate_rounds
    # Whether something in the table is simulated, be it a line without votes.
    snapshot.includes_simulated = any(
        entry.is_simulated for entry in votes.competitors + votes.counted
    )
    return [
        Standing(
            snapshot=snapshot,
            contestant=row if row.pk else None,
            **{name: getattr(row, name) for name in _OF_CONTESTANT},
            **snapshot_values(line),
        )
        for row, line in zip(votes.competitors, board.lines, strict=True)
    ]


_OF_CONTESTANT = ("slug", "name", "variant", "kind", "is_simulated")


@transaction.atomic
def keep(snapshot: Snapshot, standings: list[Standing]) -> Snapshot:
    """Store what was computed."""
    snapshot.state = Snapshot.State.READY
    snapshot.progress = 100
    snapshot.claim = snapshot.heartbeat_at = None
    snapshot.finished_at = timezone.now()
    snapshot.save()
    Standing.objects.bulk_create(standings)
    return snapshot


def read_votes(snapshot: Snapshot) -> vote_queries.VoteSet:
    """The votes that a snapshot is made of, read again.

    Raises:
        Conflict: They are not what they were: somebody changed rows by hand.
    """
    votes = _vote_set(snapshot)
    rows = vote_rows(votes.counted, snapshot.results.judges)
    if sha256_hex(votes_csv(rows, votes_version(snapshot))) != snapshot.votes_sha256:
        raise Conflict(
            f"The votes of '{snapshot.study.name}' are not those of this rating any more. "
            "Rate again."
        )
    return votes


def votes_version(snapshot: Snapshot) -> int:
    """The version of the columns that its file of votes has; older ones had no word for it."""
    return int(snapshot.versions.get("votes", 1))


def software_versions() -> dict[str, str | int]:
    """The versions of what the numbers of a rating depend on."""
    return {
        "scenario-arena": product_version(),
        "python": platform.python_version(),
        "numpy": numpy.__version__,
        "scipy": scipy.__version__,
        "results": RESULTS_VERSION,
        "votes": VOTES_VERSION,
    }


@transaction.atomic
def share_rating(snapshot: Snapshot, *, is_shared: bool, actor: User) -> None:
    """Make the link by which anybody reads the table of a rating, or take it back for good.

    Raises:
        StudyStillOpen: Whoever reads the results could still vote.
    """
    study = snapshot.study
    if is_shared:
        if study.state != Study.State.CLOSED:
            raise StudyStillOpen(study.name)
        _, is_changed = SharedRating.objects.get_or_create(snapshot=snapshot)
    else:
        is_changed = bool(SharedRating.objects.filter(snapshot=snapshot).delete()[0])
    if is_changed:
        verb = "share results" if is_shared else "stop sharing results"
        log_change(study, verb, actor, after={"snapshot": str(snapshot.code)})


# --- Private -----------------------------------------------------------------------------------


def _plan(study: Study, choices: Choices) -> Snapshot:
    rounds, seed = choices.get("rounds"), choices.get("seed", 0)
    unit, intervals = choices.get("unit"), choices.get("intervals")
    if study.state == Study.State.CANCELLED:
        raise Conflict(f"The study '{study.name}' was cancelled: it is not rated.")
    is_early = study.state == Study.State.OPEN
    if is_early and not choices.get("early"):
        raise StudyStillOpen(study.name)
    if rounds is not None and not 1 <= rounds <= MOST_DRAWS:
        raise Conflict(f"Bootstrap rounds go from 1 to {MOST_DRAWS}, not {rounds}.")
    if not 0 <= seed < 2**63:
        raise Conflict(f"A seed goes from 0 to 2^63 - 1, not {seed}.")
    filters = choices.get("filters") or vote_queries.Filters()
    chosen = _read_word(Method, choices.get("method", "bt"), "method")
    wanted = _read_word(Intervals, intervals, "kind of intervals") if intervals else None
    clusters = _read_word(Unit, unit or _default_unit(study, chosen), "resampling unit")
    if CLOSED_FORM_FROZEN in study.preregistration and clusters is Unit.TWO_WAY:
        wanted = wanted or Intervals.CLOSED_FORM
    try:
        rules = choose_rules(chosen, clusters, wanted, rounds=rounds, seed=seed)
    except ValueError as error:
        raise Conflict(f"This can't be rated: {error}.") from error
    return Snapshot(
        study=study,
        state=Snapshot.State.QUEUED,
        progress=0,
        method=rules.method,
        rounds=rules.rounds,
        resampling_unit=rules.unit,
        intervals=rules.intervals,
        seed=seed,
        filters=replace(
            filters,
            authors=author_pairs(study),
            question=vote_queries.find_question(study, filters),
        ).as_document(),
        last_vote=vote_queries.last_vote_id(study),
        votes_counted=0,
        is_early=is_early,
        made_by=choices.get("actor"),
    )


def _read_word(words: type[Word], name: str, what: str) -> Word:
    check_names(what, [name], [word.value for word in words])
    return words(name)


def _default_unit(study: Study, method: Method) -> Unit:
    if method is Method.ELO:
        return Unit.VOTE
    if not is_imported(study):
        return Unit.TWO_WAY
    votes = ImportedVote.objects.filter(file__study=study)
    judges, items = (not votes.filter(**{name: ""}).exists() for name in ("judge", "item"))
    return unit_for(judges=judges, items=items)


def _log(snapshot: Snapshot) -> None:
    # Each mark of an author has a line of its own already.
    filters = {name: value for name, value in snapshot.filters.items() if name != "authors"}
    after = {"snapshot": str(snapshot.code), "method": snapshot.method, "filters": filters}
    verb = "rate early" if snapshot.is_early else "rate"
    log_change(snapshot.study, verb, snapshot.made_by, after=after)


def _vote_set(snapshot: Snapshot) -> vote_queries.VoteSet:
    filters = vote_queries.Filters.of_document(snapshot.filters)
    return vote_queries.vote_set(snapshot.study, filters=filters, last=snapshot.last_vote)


def _results(
    snapshot: Snapshot, votes: vote_queries.VoteSet, arrays: VoteArrays, board: Leaderboard
) -> Results:
    study = snapshot.study
    from_file = is_imported(study)
    filters = vote_queries.Filters.of_document(snapshot.filters)
    planned = analysis.count_planned_pairs(study, filters)
    settled = dict(analysis.count_settled_ties(votes.counted))
    remark = remark_on_ties(study, votes, left_out=filters.leave_out_settled)
    return Results(
        version=RESULTS_VERSION,
        board=replace(board_remarks(board, arrays, *filter(None, [remark])), settled=settled),
        trust=trust(arrays, votes, seed=snapshot.seed),
        pairs=analysis.pairs(arrays.comparisons, votes.counted, planned),
        types=analysis.by_type(arrays, votes.counted, board),
        displacement=() if from_file else analysis.displacement(study),
        cost=() if from_file else analysis.cost(study, votes.competitors),
        models={row.slug: row.model for row in votes.competitors if row.pk},
        judges={vote.judge: vote.judge_name for vote in votes.counted},
        agreement=rater_agreement(snapshot),
    )
