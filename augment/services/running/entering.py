"""A submission becomes a contestant, and if wanted runs at once on its benchmark's scenarios."""

from dataclasses import dataclass

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import Conflict
from augment.models import Contestant, GenerationJob, Submission
from augment.services.benchmarks.submissions import Decision, State, decide, lock_undecided
from augment.services.endpoints.contestants import LONGEST_NAME
from augment.services.events import log_change
from augment.services.inputs import InputKind, input_field
from augment.services.running.jobs import JobRequest, launch
from augment.services.texts import SLUG_RULE, check_slug, free_slug, one_line
from augment.variants.options import MOST_SAMPLES


@dataclass(frozen=True, kw_only=True)
class AcceptRequest:
    """Name of an accepted submission, and whether it runs at once."""

    slug: str = input_field(InputKind.TEXT, "Short name in files", SLUG_RULE, default="", most=80)
    name: str = input_field(InputKind.TEXT, "Name in results", most=LONGEST_NAME)
    runs: bool = input_field(
        InputKind.SWITCH, "Run it on all scenarios of the benchmark now", default=False
    )


@transaction.atomic
def accept_submission(
    row: Submission, request: AcceptRequest, *, actor: User
) -> tuple[Contestant, GenerationJob | None]:
    """Make a submission a contestant; the caller sends the messages of the job.

    Raises:
        InvalidDocument: The slug or the name can't be used.
        Conflict: The submission is decided, not read, or nothing of it could be; or the slug is
            taken.
    """
    name = one_line("name", request.name, what="contestant")
    slug = request.slug or free_slug(Contestant.objects, name, otherwise="contestant")
    check_slug(slug, what="contestant")
    row = lock_undecided(row)
    if row.state != State.CHECKED or row.summary is None:
        raise Conflict("It can't be accepted before its report is there.")
    if not row.summary["entries"].get("read"):
        raise Conflict("Nothing of it could be read; decline it with a reason.")
    contestant, is_new = Contestant.objects.get_or_create(
        slug=slug,
        defaults={"name": name, "kind": Contestant.Kind.SUBMISSION, "card": row.summary["card"]},
    )
    if not is_new:
        raise Conflict(f"There is another contestant called {slug!r}: choose another.")
    log_change(contestant, "add", actor, after={"slug": contestant.slug, "name": name})
    decide(row, Decision.ACCEPTED, actor=actor, contestant=contestant)
    if not request.runs:
        return contestant, None
    scenarios = row.benchmark.items.order_by("position").values_list("scenario__slug", flat=True)
    wanted = JobRequest(
        name=f"{name}, {row.benchmark}"[:120],
        contestants=[slug],
        scenarios=list(scenarios),
        samples=min(row.summary["card"]["samples"], MOST_SAMPLES),
    )
    return contestant, launch(wanted, actor)
