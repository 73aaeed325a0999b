"""Rating a study: which votes, which method, which seed, now or by a worker."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypedDict, Unpack

from django.contrib.auth.models import User
from django.db import transaction

from arena.errors import StudyStillOpen
from arena.models import ImportedVote, Snapshot, Study, Vote
from arena.queries.votes.judged import is_imported, last_vote_of
from arena.queries.votes.sets import Filters
from arena.rating.leaderboard import Method
from arena.rating.rules import Intervals, Unit, default_intervals, unit_for
from arena.services.covariates import COVARIATES, WITHOUT_PICTURES
from arena.services.snapshots import compute, keep
from arena.services.turns import in_turn
from arena.studies.queries import authors_of
from augment.errors import Conflict, LeaseLost, UnknownName
from augment.services.clock import Moment
from augment.services.events import log_event
from augment.services.work import Lease, WorkKind

DEFAULT_ROUNDS = 10_000
MOST_ROUNDS = 100_000
WHILE_WAITING = 20_000
"""Up to so many votes a person waits for the page; more are a worker's job."""


class Choices(TypedDict, total=False):
    """How to rate; `plan_snapshot` says what each means and what holds where it is left out."""

    method: str
    rounds: int
    seed: int
    unit: str | None
    intervals: str | None
    covariates: Sequence[str]
    filters: Filters | None
    early: bool
    actor: User | None


def rate(*, study: Study, **choices: Unpack[Choices]) -> Snapshot:
    """Rate the contestants of a study by its current votes and keep the result for good.

    The same votes, filters, method, unit, rounds and seed give the same snapshot. Choices and
    errors are those of `plan_snapshot`; after an error nothing is kept. Nothing is written before
    all is computed, so that votes come in meanwhile.
    """
    snapshot = _planned(study=study, **choices)
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
        rounds: Of the bootstrap.
        seed: Of its draws, 0 or more.
        unit: What the bootstrap draws: "vote", "scenario", "expert" or "two-way"; None for
            two-way where the votes name experts and scenarios, else votes.
        intervals: "closed" or "resamples"; None for the closed form, but resamples of single
            votes and for online Elo.
        covariates: What to adjust for: "side", "objects", "vehicles".
        filters: Which votes count; None for all main ones. Who is author of what is added to them
            here, so that later marks do not change the rating.
        early: Rate a study that is still open; the snapshot and the log say so.
        actor: Who rates, for the log.

    Raises:
        StudyStillOpen: The study is open and nobody asked to look early.
        UnknownName: There is no such method, unit or kind of intervals, or a filter names what
            does not occur.
        Conflict: Rounds or seed are out of range, online Elo is asked for another unit, or
            covariates for another method than Bradley-Terry in closed form.
    """
    snapshot = _planned(study=study, **choices)
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

    def ended(self, pk: int, end: str, reason: str, now: Moment) -> None:
        """Say in the log why there is no rating."""
        row = self.rows.select_related(*self.related).get(pk=pk)
        if row.state != Snapshot.State.FAILED:
            return
        log_event(
            actor=row.made_by,
            verb="rating failed",
            object_kind="study",
            object_code=row.study.code,
            after={"snapshot": str(row.code), "why": row.reason},
        )


RATINGS = PlannedRatings()


def is_big(study: Study) -> bool:
    """Whether rating takes longer than a person should wait for a page."""
    if is_imported(study):
        return ImportedVote.objects.filter(file__study=study).count() > WHILE_WAITING
    return Vote.objects.filter(matchup__study=study).count() > WHILE_WAITING


# --- Private -----------------------------------------------------------------------------------


def _planned(
    *,
    study: Study,
    method: str = "bt",
    rounds: int = DEFAULT_ROUNDS,
    seed: int = 0,
    unit: str | None = None,
    intervals: str | None = None,
    covariates: Sequence[str] = (),
    filters: Filters | None = None,
    early: bool = False,
    actor: User | None = None,
) -> Snapshot:
    if study.state == Study.State.CANCELLED:
        raise Conflict(f"The study '{study.name}' was cancelled: it is not rated.")
    is_early = study.state == Study.State.OPEN
    if is_early and not early:
        raise StudyStillOpen(study.name)
    chosen = _method(method)
    drawn = _default_unit(study, chosen) if unit is None else _unit(unit)
    _check_draws(chosen, drawn, rounds, seed)
    return Snapshot(
        study=study,
        state=Snapshot.State.QUEUED,
        progress=0,
        method=chosen,
        rounds=rounds,
        resampling_unit=drawn,
        intervals=_intervals(intervals, chosen, drawn, covariates),
        covariates=_covariates(study, covariates),
        seed=seed,
        filters=replace(filters or Filters(), authors=authors_of(study)).as_document(),
        last_vote=last_vote_of(study),
        votes_counted=0,
        is_early=is_early,
        made_by=actor,
    )


def _log(snapshot: Snapshot) -> None:
    log_event(
        actor=snapshot.made_by,
        verb="rate early" if snapshot.is_early else "rate",
        object_kind="study",
        object_code=snapshot.study.code,
        after={
            "snapshot": str(snapshot.code),
            "method": snapshot.method,
            "filters": _asked(snapshot),
        },
    )


def _asked(snapshot: Snapshot) -> dict[str, object]:
    """The filters for the log, where each mark of an author has a line of its own already."""
    return {name: value for name, value in snapshot.filters.items() if name != "authors"}


def _method(name: str) -> Method:
    if name not in list(Method):
        raise UnknownName("method", name, [method.value for method in Method])
    return Method(name)


def _unit(name: str) -> Unit:
    if name not in list(Unit):
        raise UnknownName("resampling unit", name, [unit.value for unit in Unit])
    return Unit(name)


def _covariates(study: Study, names: Sequence[str]) -> list[str]:
    """In the order in which they are known, each once."""
    known = WITHOUT_PICTURES if is_imported(study) else COVARIATES
    for name in names:
        if name not in known:
            raise UnknownName("covariate", name, list(known))
    return [name for name in known if name in names]


def _intervals(
    name: str | None, method: Method, unit: Unit, covariates: Sequence[str]
) -> Intervals:
    if covariates:
        if method is not Method.BRADLEY_TERRY or name == Intervals.RESAMPLES:
            raise Conflict(
                "Only Bradley-Terry with intervals in closed form can be adjusted for what "
                "was shown."
            )
        return Intervals.CLOSED_FORM
    if name is None:
        return default_intervals(method, unit)
    if name not in list(Intervals):
        raise UnknownName("kind of intervals", name, [one.value for one in Intervals])
    if method is Method.ELO and name != Intervals.RESAMPLES:
        raise Conflict("Online Elo has no intervals in closed form, only resamples.")
    return Intervals(name)


def _default_unit(study: Study, method: Method) -> Unit:
    if method is Method.ELO:
        return Unit.VOTE
    if not is_imported(study):
        return Unit.TWO_WAY
    votes = ImportedVote.objects.filter(file__study=study)
    judges, items = (not votes.filter(**{name: ""}).exists() for name in ("judge", "item"))
    return unit_for(judges=judges, items=items)


def _check_draws(method: Method, unit: Unit, rounds: int, seed: int) -> None:
    if not 1 <= rounds <= MOST_ROUNDS:
        raise Conflict(f"Bootstrap rounds go from 1 to {MOST_ROUNDS}, not {rounds}.")
    if not 0 <= seed < 2**63:
        raise Conflict(f"A seed goes from 0 to 2^63 - 1, not {seed}.")
    if method is Method.ELO and unit is not Unit.VOTE:
        raise Conflict(f"Online Elo resamples single votes only; '{unit.value}' needs bt.")
