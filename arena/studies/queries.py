"""Reads of studies: which there are, how far their experts are, who takes part, drafts."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, TypeVar

from django.contrib.auth.models import User
from django.db.models import Count, F, Model, Q, QuerySet
from django.utils import timezone

from arena.models import Authorship, Enrolment, Invitation, Matchup, Report, Study, StudyDraft
from arena.people.links import lets_in
from arena.people.queries import experts, may_be_let_in, natural_order
from arena.voting.queries import ballots
from augment.errors import UnknownName
from augment.models import (
    Augmentation,
    Benchmark,
    BenchmarkItem,
    Contestant,
    GenerationJob,
    Scenario,
)
from augment.services import read_code
from augment.services.benchmarks import Split

Row = TypeVar("Row", bound=Model)

# --- Studies -----------------------------------------------------------------------------------


def study_named(name_or_code: str) -> Study:
    """Return a study by its name or its code.

    Raises:
        UnknownName: There is none.
    """
    return find_by_name_or_code(Study.objects.all(), "study", name_or_code)


def find_by_name_or_code(rows: QuerySet[Row], what: str, name_or_code: str) -> Row:
    """Return the row of that name or code.

    Raises:
        UnknownName: There is none.
    """
    row = rows.filter(Q(name=name_or_code) | Q(code=read_code(name_or_code))).first()
    if row is None:
        raise UnknownName(what, name_or_code, sorted(rows.values_list("name", flat=True)))
    return row


def expert_named(study: Study, username: str) -> User:
    """Return an expert of a study.

    Raises:
        UnknownName: Nobody who takes part is called so.
    """
    expert = study.experts.filter(username=username).first()
    if expert is None:
        names = study.experts.values_list("username", flat=True)
        raise UnknownName("expert of this study", username, sorted(names))
    return expert


def list_studies(expert: User | None = None) -> QuerySet[Study]:
    """Return every study, or those of one expert, without the columns that no list needs."""
    studies = Study.objects.all() if expert is None else Study.objects.filter(experts=expert)
    return studies.select_related("vote_file").defer("rules", "preregistration")


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyProgress(ballots.VotingProgress):
    """Number of a study's matchups with a vote."""

    study: Study


def count_progress(studies: Iterable[Study], expert: User | None = None) -> list[StudyProgress]:
    """Count some studies in their order, over all experts or for one; three queries."""
    studies = list(studies)
    matchups = Matchup.objects.filter(study__in=[study.pk for study in studies])
    if expert is not None:
        matchups = matchups.filter(expert=expert)
    count = ballots.count_votes(matchups, by="study")
    return [StudyProgress(study=one, **count(one.pk, one.questions)) for one in studies]


def list_reports(study: Study) -> QuerySet[Report]:
    """Return the reports of experts, the youngest first."""
    reports = Report.objects.filter(matchup__study=study).order_by("-at", "-pk")
    return reports.select_related("expert__person", "matchup__scenario").defer(
        "matchup__scenario__reference"
    )


def list_authorships(study: Study) -> list[Authorship]:
    """Return every mark of a study with its people and contestants, by pseudonym."""
    rows = study.authorships.select_related("expert__person", "contestant", "marked_by__person")
    return sorted(
        rows, key=lambda row: (natural_order(row.expert.person.pseudonym), row.contestant.name)
    )


def author_pairs(study: Study) -> frozenset[tuple[str, str]]:
    """Return an expert's code with a contestant's slug for every mark of a study."""
    rows = study.authorships.order_by().values_list("expert__person__code", "contestant__slug")
    return frozenset((str(code), slug) for code, slug in rows)


# --- What a new study can be of ----------------------------------------------------------------

FINISHED = "finished"
"""The source of a study's scenarios that most take: whatever is there."""


def list_offered() -> QuerySet[Contestant]:
    """Return whom a study can be of."""
    return Contestant.objects.exclude(kind=Contestant.Kind.CHECK).filter(retired_at=None)


def latest_contestants(job: GenerationJob | None = None) -> list[str]:
    """Return the offered contestants with pictures of a job, by default of the latest with any."""
    made = _with_pictures().filter(contestant__in=list_offered())
    latest: Any = [job] if job else made.order_by("-job__created_at").values("job")[:1]
    return sorted(set(made.filter(job__in=latest).values_list("contestant__slug", flat=True)))


def scenario_sources(jobs: Iterable[GenerationJob]) -> dict[str, str]:
    """Return where the scenarios of a study can come from, by what forms and drafts call it."""
    sets = {f"set:{name}": f"Finished, {name} set" for name in Scenario.SETS}
    of_jobs = {f"job:{job.code}": f"Finished in {job.name}" for job in jobs}
    splits = {
        f"benchmark:{row.code}": f"Finished, test split of {row}"
        for row in Benchmark.objects.filter(retired_at=None)
    }
    own = {"set:": "Finished, our own"}
    return {FINISHED: "All that are finished", **sets, **own, **splits, **of_jobs}


def list_finished(contestants: Collection[str], source: str) -> list[str]:
    """Return the scenarios of a source of which each of the contestants has a picture."""
    rows = _with_pictures().filter(contestant__slug__in=contestants)
    kind, _, name = source.partition(":")
    if kind == "job":
        rows = rows.filter(job__code=name)
    elif kind == "set":
        rows = rows.filter(scenario__catalogue_set=name)
    elif kind == "benchmark":
        items = BenchmarkItem.objects.filter(benchmark__code=name, split=Split.TEST)
        rows = rows.filter(scenario__benchmark_items__in=items)
    counted = rows.order_by().values_list("scenario__slug")
    finished = counted.annotate(n=Count("contestant", distinct=True)).filter(
        n=len(set(contestants))
    )
    return [slug for slug, _ in finished]


def _with_pictures() -> QuerySet[Augmentation]:
    return Augmentation.objects.filter(state__in=Augmentation.SHOWABLE).exclude(image="")


# --- Drafts ------------------------------------------------------------------------------------


def find_drafts(search: str = "") -> QuerySet[StudyDraft]:
    """Return drafts, those that were changed last first."""
    drafts = StudyDraft.objects.select_related("changed_by__person")
    return drafts.filter(entered__name__icontains=search) if search else drafts


def find_missing(draft: StudyDraft) -> list[str]:
    """Return the names that the draft chooses and nobody could choose now."""
    jobs = GenerationJob.objects.only("code", "name")
    scenarios = Scenario.objects.values_list("slug", flat=True)
    choices = {
        "contestants": set(list_offered().values_list("slug", flat=True)),
        "experts": {user.username for user in experts()},
        "scenarios": {*scenarios, *scenario_sources(jobs)},
        "jobs": {str(job.code) for job in jobs},
    }
    return [
        name
        for field, allowed in choices.items()
        for name in draft.entered.get(field, ())
        if name not in allowed
    ]


# --- Experts -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpertLine:
    """One expert of a study, for the people who run it.

    Attributes:
        invitation: The newest link, None if there never was one.
        link: Its state, None without one.
        has_live_link: Whether somebody can come in by it.
        may_be_invited: Whether a link may be made for this account.
    """

    tally: ballots.ExpertTally
    invitation: Invitation | None
    link: Invitation.State | None
    has_live_link: bool
    may_be_invited: bool

    @property
    def waits_for_link(self) -> bool:
        """Return whether the expert can't have begun: no vote yet, and no link to come in by."""
        return self.may_be_invited and not self.has_live_link and not self.tally.voted


def expert_lines(study: Study) -> list[ExpertLine]:
    """Return one line per expert of the study, by pseudonym."""
    now = timezone.now()
    invitations = study.invitations.select_related("expert__person").order_by("made_at", "pk")
    newest = {row.expert_id: row for row in invitations.prefetch_related("expert__groups")}
    is_cancelled = study.state == Study.State.CANCELLED
    lines = []
    for tally in ballots.tallies(study):
        invitation = newest.get(tally.expert.pk)
        lines.append(
            ExpertLine(
                tally=tally,
                invitation=invitation,
                link=None if invitation is None else invitation.state(now),
                has_live_link=invitation is not None and lets_in(invitation),
                may_be_invited=not is_cancelled and may_be_let_in(tally.expert),
            )
        )
    return lines


# --- Enrolments --------------------------------------------------------------------------------


def find_unfinished(study: Study) -> ballots.Voters:
    """Return who has a place and pairs without an answer."""
    return ballots.list_voters(study).filter(dropped_at=None, answered__lt=F("planned"))


def find_silent(enrolment: Enrolment, *, now: datetime) -> ballots.Voters:
    """Return who is not done and was not heard for as long as the enrolment allows."""
    unfinished = find_unfinished(enrolment.study)
    if enrolment.drop_out_after_h is None:
        return unfinished.none()
    since = now - timedelta(hours=enrolment.drop_out_after_h)
    is_quiet = Q(last_vote_at=None) | Q(last_vote_at__lte=since)
    return unfinished.filter(is_quiet, enrolled_at__lte=since)


def state_of(enrolment: Enrolment) -> dict[str, int]:
    """Count places, and what became of them."""
    is_in = Q(dropped_at=None)
    state: dict[str, int] = ballots.list_voters(enrolment.study).aggregate(
        taken=Count("pk", filter=is_in),
        done=Count("pk", filter=Q(is_done=True)),
        dropped=Count("pk", filter=~is_in),
    )
    return state | {"free": max(enrolment.places - state["taken"], 0)}


CHECK_PERCENT = 2


def usual_checks() -> int:
    """Return the usual share of attention checks in percent: none before any are drawn."""
    is_drawn = Augmentation.objects.filter(contestant__kind=Contestant.Kind.CHECK).exists()
    return CHECK_PERCENT if is_drawn else 0
