"""Which rows a study is made of, and how people stand in them."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from django.contrib.auth.models import User
from django.db import models
from django.db.models import Q, QuerySet

from arena.models import (
    Authorship,
    EarlyLook,
    FaultLabel,
    ImportedVote,
    LabellingRound,
    LabelTask,
    Matchup,
    Person,
    Report,
    Snapshot,
    Standing,
    Study,
    Vote,
    VoteFile,
)
from arena.results.services.stored_rows import columns_of, read_values
from augment.models import (
    Attempt,
    Augmentation,
    BaseScene,
    Contestant,
    Endpoint,
    EndpointModel,
    GenerationJob,
    IntentReading,
    ModelCall,
    Scenario,
    Simulation,
    TranscriptNote,
)

LONG_AGO = "2000-01-01T00:00:00+00:00"
"""When an account was made is nobody's business."""

TRAVELLING = frozenset(
    {
        *("auth.user", "arena.person", "augment.basescene", "augment.scenario"),
        *("augment.endpoint", "augment.endpointmodel", "augment.contestant"),
        *("augment.generationjob", "augment.generationjob_contestants"),
        *("augment.generationjob_scenarios", "augment.augmentation", "augment.attempt"),
        *("augment.intentreading", "augment.modelcall", "augment.transcriptnote"),
        *("augment.simulation", "arena.study", "arena.study_contestants"),
        *("arena.study_scenarios", "arena.study_experts", "arena.matchup", "arena.vote"),
        *("arena.report", "arena.authorship", "arena.earlylook", "arena.votefile"),
        *("arena.importedvote", "arena.snapshot", "arena.standing"),
        *("arena.labellinground", "arena.labellinground_experts", "arena.labeltask"),
        "arena.faultlabel",
    }
)
"""The tables of a study; a folder that brings others is none of ours."""

Rows = QuerySet[Any]


@dataclass(slots=True)
class Closure:
    """A study and all that its rows lead to.

    Attributes:
        study: Which.
        jobs: Whose augmentations are shown, whole, and those that they took answers from.
        accounts: The names that accounts get instead of their own, by key.
        names: The same by their own names.
    """

    study: Study
    jobs: set[int] = field(default_factory=set)
    accounts: dict[int, str] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)

    def tables(self) -> Iterator[Rows]:
        """The rows of each table, those first that others name."""
        # Through their keys: a join with the jobs would give one of two jobs twice.
        taking_part = Contestant.objects.filter(self._of("contestants"))
        contestants = Contestant.objects.filter(pk__in=taking_part.values("pk"))
        named = Scenario.objects.filter(self._of("scenarios"))
        # A paraphrase comes with what it says in other words.
        originals = named.exclude(paraphrase_of=None).values("paraphrase_of")
        scenarios = Scenario.objects.filter(Q(pk__in=named.values("pk")) | Q(pk__in=originals))
        attempts = Attempt.objects.filter(augmentation__job__in=self.jobs)
        readings = IntentReading.objects.filter(
            pk__in=ModelCall.objects.filter(copies__attempt__in=attempts).values("reading")
        )
        endpoints = self._endpoints(contestants, readings)
        experts = User.objects.filter(pk__in=self.accounts)
        labellings = LabellingRound.objects.filter(job__in=self.jobs)
        matchups = self.study.matchups.all()
        snapshots = self.study.snapshots.filter(state=Snapshot.State.READY)
        files = VoteFile.objects.filter(study=self.study)
        yield experts
        yield Person.objects.filter(user__in=self.accounts)
        yield BaseScene.objects.filter(pk__in=scenarios.values("base_scene"))
        yield scenarios
        yield endpoints
        yield EndpointModel.objects.filter(endpoint__in=endpoints)
        yield contestants
        yield GenerationJob.objects.filter(pk__in=self.jobs)
        yield GenerationJob.contestants.through._default_manager.filter(
            generationjob__in=self.jobs
        )
        yield GenerationJob.scenarios.through._default_manager.filter(generationjob__in=self.jobs)
        yield Augmentation.objects.filter(job__in=self.jobs)
        yield attempts
        yield readings
        yield ModelCall.objects.filter(Q(attempt__in=attempts) | Q(reading__in=readings))
        yield TranscriptNote.objects.filter(attempt__in=attempts)
        yield Simulation.objects.filter(
            Q(augmentation__job__in=self.jobs)
            | Q(augmentation=None, scenario__in=scenarios.values("pk"))
        ).exclude(state__in=Simulation.UNDER_WAY)
        yield Study.objects.filter(pk=self.study.pk)
        yield Study.contestants.through._default_manager.filter(study=self.study)
        yield Study.scenarios.through._default_manager.filter(study=self.study)
        yield Study.experts.through._default_manager.filter(study=self.study)
        yield matchups
        yield Vote.objects.filter(matchup__in=matchups)
        yield Report.objects.filter(matchup__in=matchups)
        yield Authorship.objects.filter(study=self.study)
        yield EarlyLook.objects.filter(study=self.study)
        yield files
        yield ImportedVote.objects.filter(file__in=files)
        yield snapshots
        yield Standing.objects.filter(snapshot__in=snapshots)
        yield labellings
        yield LabellingRound.experts.through._default_manager.filter(labellinground__in=labellings)
        yield LabelTask.objects.filter(labelling__in=labellings)
        yield FaultLabel.objects.filter(task__labelling__in=labellings)

    def renamed_rules(self) -> dict[str, Any]:
        """The rules with the names that accounts get."""
        names = self._names_in_plans()
        experts = [names[name] for name in self.study.rules.get("experts", [])]
        return {**self.study.rules, **({"experts": experts} if experts else {})}

    def renamed_votes_to_plan(self) -> dict[str, int]:
        """How many votes are planned later, by the names that accounts get."""
        names = self._names_in_plans()
        return {names[name]: votes for name, votes in self.study.votes_to_plan.items()}

    def _names_in_plans(self) -> dict[str, str]:
        """Whom the plan names; who does not travel, or is nobody any more, gets a number."""
        named = {*self.study.rules.get("experts", []), *self.study.votes_to_plan}
        former = sorted(named - self.names.keys())
        numbered = {name: f"former-{place:04}" for place, name in enumerate(former, start=1)}
        return self.names | numbered

    def _of(self, name: str) -> Q:
        """What the study names, its jobs work on, or its pairs show."""
        return Q(pk__in=getattr(self.study, name).values("pk")) | Q(jobs__in=self.jobs)

    def _endpoints(self, contestants: Rows, readings: Rows) -> Rows:
        named = set(contestants.exclude(endpoint=None).values_list("endpoint", flat=True))
        named |= set(readings.values_list("endpoint", flat=True))
        for roles in contestants.values_list("roles", flat=True):
            labels = [one.get("endpoint") for one in (roles or {}).values()]
            named |= set(Endpoint.objects.filter(label__in=labels).values_list("pk", flat=True))
        return Endpoint.objects.filter(pk__in=named)


def close_over(study: Study) -> Closure:
    """Follow a study to everything that its rows name."""
    closure = Closure(study)
    shown = Augmentation.objects.filter(
        Q(shown_left__study=study) | Q(shown_right__study=study)
    ).distinct()
    new = set(shown.values_list("job", flat=True))
    while new:
        closure.jobs |= new
        sources = ModelCall.objects.filter(copies__attempt__augmentation__job__in=new)
        found = sources.exclude(attempt=None).values_list("attempt__augmentation__job", flat=True)
        new = set(found) - closure.jobs
    people = _people(closure)
    # In the order of their names, so that whatever is ordered by name stays as it is.
    # Sorted here: databases order letters each in its own way.
    named = User.objects.filter(pk__in=people).values_list("pk", "username")
    in_order = sorted(named, key=lambda one: one[1])
    for place, (pk, username) in enumerate(in_order, start=1):
        closure.accounts[pk] = closure.names[username] = f"expert-{place:04}"
    return closure


def _people(closure: Closure) -> set[int]:
    """Who votes, labels, has written or has looked; whoever only administered stays at home."""
    study, labellings = closure.study, LabellingRound.objects.filter(job__in=closure.jobs)
    people: list[QuerySet[Any, Any]] = [
        study.experts.values_list("pk", flat=True),
        labellings.exclude(experts=None).values_list("experts", flat=True),
    ]
    columns: list[tuple[QuerySet[Any], str]] = [
        (Matchup.objects.filter(study=study), "expert"),
        (Vote.objects.filter(matchup__study=study), "expert"),
        (Report.objects.filter(matchup__study=study), "expert"),
        (Authorship.objects.filter(study=study), "expert"),
        (EarlyLook.objects.filter(study=study), "user"),
        (LabelTask.objects.filter(labelling__in=labellings), "expert"),
    ]
    people += [rows.values_list(column, flat=True) for rows, column in columns]
    return {pk for keys in people for pk in keys}


def travelling_rows(closure: Closure, rows: Rows) -> Iterator[list[Any]]:
    """The rows of one table without names of accounts, machines or addresses of people."""
    model = rows.model
    columns = columns_of(model)
    names = [column.attname for column in columns]
    accounts = [
        column.attname
        for column in columns
        if isinstance(column, models.ForeignKey) and column.related_model is User and column.null
    ]
    for values in read_values(rows):
        row = dict(zip(names, values, strict=True))
        row |= {name: None for name in accounts if row[name] not in closure.accounts}
        row |= _HIDDEN.get(model, {})
        if model is User:
            row["username"] = closure.accounts[row["id"]]
        elif model is Study:
            row["rules"] = closure.renamed_rules()
            row["votes_to_plan"] = closure.renamed_votes_to_plan()
        yield list(row.values())


_HIDDEN: dict[type[models.Model], dict[str, Any]] = {
    User: {
        **{"password": "!", "first_name": "", "last_name": "", "email": ""},
        **{"is_staff": False, "is_superuser": False, "last_login": None},
        "date_joined": LONG_AGO,
    },
    Endpoint: {"key_variable": ""},  # whose keys are sent where is for each host to say
    Person: {"preferences": {}},
    Attempt: {"worker": ""},
    Augmentation: {"claim": None, "heartbeat_at": None},
}
"""What stands in columns whose values stay at home."""
