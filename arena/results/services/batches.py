"""Batches of a board: new contestants against those that are rated already.

A batch is a study like every other. Its pairs are chosen by its seed before anybody sees one, and
each has a new contestant; the opponents are spread over the newest table.
"""

from dataclasses import dataclass, replace

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import Count, QuerySet

from arena.models import Board, Study
from arena.rating.board_table import spread_over
from arena.results.services.boards import require_poolable
from arena.studies.services.opening import open_study
from arena.studies.services.plan import read_opened_plan
from arena.voting.services.pictures import find_showable
from augment.errors import Conflict, check_names
from augment.models import Contestant
from augment.services import InputKind, input_field, log_change

MOST_OPPONENTS = 8
"""More spread a newcomer's votes over more pairs, and tell no more about it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchRequest:
    """Request for a new batch; its rules are those of the board's first study."""

    newcomers: tuple[str, ...] = input_field(
        InputKind.NAMES,
        "New contestants",
        "Those with a picture of each of the board's scenarios.",
    )
    experts: tuple[str, ...] = input_field(InputKind.NAMES, "Experts", "Usernames.")
    votes_per_expert: int = input_field(InputKind.WHOLE, "Votes per expert", least=1, most=10_000)


def possible_newcomers(board: Board) -> QuerySet[Contestant]:
    """Return who is not in the newest table and has a picture of every scenario of the board."""
    table, first = board.tables.first(), board.studies.order_by("opened_at", "pk")[0]
    rated = [line.slug for line in table.document.lines] if table else []
    scenarios = first.scenarios.all()
    pictured = find_showable(scenarios).order_by().values("contestant")
    complete = pictured.annotate(n=Count("scenario", distinct=True)).filter(n=len(scenarios))
    rows = Contestant.objects.filter(pk__in=complete.values("contestant"), retired_at=None)
    return rows.exclude(kind=Contestant.Kind.CHECK).exclude(slug__in=rated).order_by("slug")


@transaction.atomic
def open_batch(board: Board, batch: BatchRequest, *, actor: User | None = None) -> Study:
    """Open the study that compares newcomers with some who are rated, and with each other.

    Those who are rated show the answers that they were rated by.

    Raises:
        Conflict: Nobody is rated yet, an earlier batch is not closed, or its votes could not be
            pooled with those of the board.
        UnknownName: A newcomer is in the table already, or lacks pictures.
        AugmentError: Those of `open_study`.
    """
    board = Board.objects.select_for_update().get(pk=board.pk)
    studies, table = require_poolable(board), board.tables.first()
    if table is None:
        raise Conflict("Publish the first table before new contestants are compared with it.")
    possible = list(possible_newcomers(board).values_list("slug", flat=True))
    check_names("new contestant", batch.newcomers, possible)
    rated = [line.slug for line in table.document.lines if line.votes]
    plans = [read_opened_plan(study) for study in studies]
    study_plan = replace(
        plans[0],
        name=f"{board.name}, batch {board.studies.count()}",
        contestants=(*batch.newcomers, *spread_over(rated, MOST_OPPONENTS)),
        experts=batch.experts,
        votes_per_expert=batch.votes_per_expert,
        hypotheses=(),
        jobs=tuple(dict.fromkeys(job for plan in plans for job in plan.jobs)),
    )
    # The first plan with somebody counts.
    jobs_of = {slug: plan.jobs for plan in reversed(plans) for slug in plan.contestants}
    study = open_study(study_plan, challengers=batch.newcomers, jobs_of=jobs_of, actor=actor)
    board.studies.add(study)
    require_poolable(board, but_open=True)
    log_change(board, "open batch", actor, after={"study": str(study.code)})
    return study
