"""Submissions: kept as files, read by workers, withdrawn or declined; what contestants answer."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import timedelta
from functools import partial
from typing import Any

from django.conf import settings
from django.contrib.auth.models import User
from django.core.files.base import File
from django.core.files.storage import default_storage
from django.db import transaction

from augment.benchmark.report import (
    DISTANCES,
    count_statuses,
    report_from_document,
    report_to_document,
    summarise_practice,
)
from augment.benchmark.submission import check_submission
from augment.benchmark.values import EntryStatus, SubmissionReport, SubmittedEntry
from augment.errors import Conflict
from augment.models import Benchmark, Contestant, Submission
from augment.services.benchmarks.benchmarks import benchmark_set
from augment.services.clock import DATABASE_TIME
from augment.services.events import log_change
from augment.services.scenarios.uploads import keep_file, open_file, plain_name
from augment.services.texts import check_prose, make_document_storable
from augment.services.work import Lease, Settlement, WorkKind

Decision = Submission.Decision
State = Submission.State
WINDOW = timedelta(days=1)
LONGEST_REASON = 2_000


def keep_submission(
    benchmark: Benchmark, *, name: str, content: File[bytes], actor: User
) -> Submission:
    """Store a submission for a worker to read; the entry point sends the message.

    Args:
        benchmark: Whose tasks it answers.
        name: As the sender called the file; kept in plain letters.
        content: A zip of its folder.
        actor: Who sends it.

    Raises:
        Conflict: The file is empty, the benchmark is retired, or the sender has sent as many as
            may come in a day; withdrawn ones and those that can't be read count.
    """
    row = Submission(benchmark=benchmark, name=plain_name(name), uploaded_by=actor)
    keep_file(row, content, insert=partial(_insert, row, benchmark, actor))
    return row


def _insert(row: Submission, benchmark: Benchmark, actor: User) -> None:
    """Insert a row, unless it is one too many.

    The account is locked, so that of two at once one sees the other.
    """
    User.objects.select_for_update(no_key=True).get(pk=actor.pk)
    if Benchmark.objects.exclude(retired_at=None).filter(pk=benchmark.pk).exists():
        raise Conflict(f"“{benchmark}” is retired; it takes no more submissions.")
    recent = Submission.objects.filter(
        benchmark=benchmark, uploaded_by=actor, created_at__gt=DATABASE_TIME - WINDOW
    )
    if recent.count() >= settings.SUBMISSIONS_A_DAY:
        raise Conflict(
            f"You have sent {settings.SUBMISSIONS_A_DAY} submissions to “{benchmark}” within "
            "24 hours; no more are taken. `check_submission` says the same on your own machine."
        )
    row.save(force_insert=True)
    Submission.objects.filter(pk=row.pk).update(created_at=DATABASE_TIME)  # no process's clock


class Submissions(WorkKind[Submission]):
    """Submissions that were sent: what can be read of each."""

    model = Submission
    related = ("benchmark",)

    def run(self, row: Submission, held: Lease[Submission]) -> Settlement:
        """Read all of it; what can't be read of it is an entry of the report."""
        tasks = benchmark_set(row.benchmark)
        with open_file(row) as path:
            report = check_submission(tasks, path, checksum=row.benchmark.checksum)
        document = make_document_storable(report_to_document(report))
        summary = {
            "card": document["card"],
            "entries": {status.value: n for status, n in count_statuses(report).items()},
            "total": len(report.entries),
        }
        for distance in DISTANCES:
            practice = summarise_practice(report, distance).box
            summary[f"{distance}_m"] = None if practice is None else practice.mean_m
        return Settlement(state=State.CHECKED, columns={"report": document, "summary": summary})


SUBMISSIONS = Submissions()


# --- Decisions ---------------------------------------------------------------------------------


@transaction.atomic
def withdraw_submission(row: Submission, *, actor: User) -> Submission:
    """Take a submission back before it is decided; its file is removed.

    Raises:
        Conflict: It is decided.
    """
    row = lock_undecided(row)
    transaction.on_commit(partial(default_storage.delete, row.stored))
    return decide(row, Decision.WITHDRAWN, actor=actor, stored="")


@transaction.atomic
def decline_submission(row: Submission, *, reason: str, actor: User) -> Submission:
    """Decline a submission, with a reason that its sender reads.

    Raises:
        InvalidDocument: No reason is given, or a very long one.
        Conflict: It is decided, or not read yet.
    """
    check_prose("reason", reason, what="decision", longest=LONGEST_REASON)
    row = lock_undecided(row)
    if row.state not in (State.CHECKED, State.FAILED):
        raise Conflict("It has not been read yet; wait for its report.")
    return decide(row, Decision.DECLINED, actor=actor, decision_reason=reason.strip())


def lock_undecided(row: Submission) -> Submission:
    """Return the row, locked for this transaction.

    Raises:
        Conflict: It is decided.
    """
    locked = Submission.objects.select_for_update(of=("self",)).select_related("benchmark")
    row = locked.get(pk=row.pk)
    if row.is_decided:
        raise Conflict(f"It is decided already: {row.get_decision_display().lower()}.")
    return row


def decide(row: Submission, decision: Decision, *, actor: User, **columns: Any) -> Submission:
    """Write a decision and log it."""
    decided = {"decision": decision, "decided_by": actor, "decided_at": DATABASE_TIME, **columns}
    Submission.objects.filter(pk=row.pk).update(**decided)
    after = {"name": row.title, "reason": columns.get("decision_reason", "")}
    log_change(row, decision.value, actor, after=after)
    row.refresh_from_db()
    return row


# --- Reports and answers -----------------------------------------------------------------------


def get_entries(row: Submission) -> list[SubmittedEntry]:
    """Return the entries of a submission, rejections first; none before it was read."""
    if row.report is None:
        return []
    entries = report_from_document(row.report).entries
    return sorted(entries, key=lambda entry: entry.status is EntryStatus.READ)


def find_entry(contestant: Contestant, scenario: str, sample: int) -> SubmittedEntry:
    """Return a submission's entry for a scenario, by its slug.

    Raises:
        Conflict: It has no such scenario or sample.
    """
    entries = refuse_unanswered(contestant, [scenario], samples=sample).entries
    return next(entry for entry in entries if (entry.task, entry.sample) == (scenario, sample))


def refuse_unanswered(
    contestant: Contestant, scenarios: Iterable[str], *, samples: int
) -> SubmissionReport:
    """Return a submission's report, which answers these scenarios, by their slugs, and samples.

    Raises:
        Conflict: It does not answer all of them, or is not in this installation.
    """
    reports = Submission.objects.filter(contestant=contestant).values_list("report", flat=True)
    document = reports.first()
    if document is None:
        raise Conflict(f"The submission of “{contestant.slug}” is not in this installation.")
    report = report_from_document(document)
    n = report.card.samples
    if samples > n:
        text = f"“{contestant.slug}” has {n} sample{'s' * (n != 1)} a scenario, not {samples}."
        raise Conflict(text)
    answered = {entry.task for entry in report.entries}
    strange = [slug for slug in scenarios if slug not in answered]
    if strange:
        raise Conflict(
            f"“{contestant.slug}” is a submission to {report.benchmark} version {report.version} "
            f"and answers its scenarios alone, not {', '.join(strange[:8])}"
            f"{' and others' * (len(strange) > 8)}."
        )
    return report
