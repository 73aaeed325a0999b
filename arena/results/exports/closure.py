"""Rows that belong to a study, and the accounts that they name."""

from collections.abc import Callable, Iterator
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
from arena.results.services.stored_rows import list_columns, model_label, read_values
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
    NuplanResult,
    Scenario,
    Simulation,
    TranscriptNote,
)

LONG_AGO = "2000-01-01T00:00:00+00:00"
"""When an account was made is nobody's business."""

Rows = QuerySet[Any]


@dataclass(slots=True)
class Closure:
    """A study and all that its rows lead to.

    Attributes:
        jobs: Whose augmentations are shown, whole, and those that they took answers from, go on
            from or correct.
        accounts: The names that accounts get instead of their own, by key.
        names: The same by their own names.
    """

    study: Study
    jobs: set[int] = field(default_factory=set)
    accounts: dict[int, str] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)

    def tables(self) -> Iterator[Rows]:
        """The rows of each table, those first that others name."""
        for model, choose in _CHOSEN.items():
            yield model._default_manager.filter(choose(self))

    @property
    def contestants(self) -> Rows:
        """Contestants of the study and of its jobs."""
        return self._of("contestants", Contestant)

    @property
    def named_scenarios(self) -> Rows:
        """Scenarios that the study shows and its jobs work on."""
        return self._of("scenarios", Scenario)

    @property
    def scenarios(self) -> Rows:
        """The same with what its paraphrases say in other words and its follow-ups follow."""
        pks = new = set(self.named_scenarios.values_list("pk", flat=True))
        while new:
            rows = Scenario.objects.filter(pk__in=new).values_list("paraphrase_of", "follows")
            new = {pk for row in rows for pk in row if pk is not None} - pks
            pks = pks | new
        return Scenario.objects.filter(pk__in=pks)

    @property
    def readings(self) -> Rows:
        """Readings of intents whose answers were taken over."""
        copied = Q(copies__attempt__augmentation__job__in=self.jobs)
        calls = ModelCall.objects.filter(copied)
        return IntentReading.objects.filter(pk__in=calls.values("reading"))

    @property
    def endpoints(self) -> list[int]:
        """Keys of the endpoints that contestants or readings ask."""
        named = set(self.contestants.exclude(endpoint=None).values_list("endpoint", flat=True))
        named |= set(self.readings.values_list("endpoint", flat=True))
        roles = self.contestants.values_list("roles", flat=True)
        labels = {role.get("endpoint") for own in roles for role in (own or {}).values()}
        named |= set(Endpoint.objects.filter(label__in=labels).values_list("pk", flat=True))
        return sorted(named)

    def rename_rules(self) -> dict[str, Any]:
        """The rules with the names that accounts get.

        Who does not travel, or is nobody any more, gets a number.
        """
        experts = self.study.rules.get("experts", [])
        former = sorted(set(experts) - self.names.keys())
        names = self.names | {
            name: f"former-{place:04}" for place, name in enumerate(former, start=1)
        }
        renamed = {"experts": [names[name] for name in experts]} if experts else {}
        return {**self.study.rules, **renamed}

    def _of(self, name: str, model: type[models.Model]) -> Rows:
        """Return the rows that the study names or its jobs work on.

        Through their keys: a join with the jobs would give one of two jobs twice.
        """
        own = getattr(self.study, name).values("pk")
        rows = model._default_manager.filter(Q(pk__in=own) | Q(jobs__in=self.jobs))
        return model._default_manager.filter(pk__in=rows.values("pk"))


_CHOSEN: dict[type[models.Model], Callable[[Closure], Q]] = {
    User: lambda it: Q(pk__in=it.accounts),
    Person: lambda it: Q(user__in=it.accounts),
    BaseScene: lambda it: Q(pk__in=it.scenarios.values("base_scene")),
    Scenario: lambda it: Q(pk__in=it.scenarios.values("pk")),
    Endpoint: lambda it: Q(pk__in=it.endpoints),
    EndpointModel: lambda it: Q(endpoint__in=it.endpoints),
    Contestant: lambda it: Q(pk__in=it.contestants.values("pk")),
    GenerationJob: lambda it: Q(pk__in=it.jobs),
    GenerationJob.contestants.through: lambda it: Q(generationjob__in=it.jobs),
    GenerationJob.scenarios.through: lambda it: Q(generationjob__in=it.jobs),
    Augmentation: lambda it: Q(job__in=it.jobs),
    Attempt: lambda it: Q(augmentation__job__in=it.jobs),
    IntentReading: lambda it: Q(pk__in=it.readings.values("pk")),
    ModelCall: lambda it: (
        Q(attempt__augmentation__job__in=it.jobs) | Q(reading__in=it.readings.values("pk"))
    ),
    TranscriptNote: lambda it: Q(attempt__augmentation__job__in=it.jobs),
    Simulation: lambda it: (
        (
            Q(augmentation__job__in=it.jobs)
            | (Simulation.OF_SCENES & Q(scenario__in=it.scenarios.values("pk")))
        )
        & ~Q(state__in=Simulation.UNDER_WAY)
    ),
    NuplanResult: lambda it: Q(augmentation__job__in=it.jobs),
    Study: lambda it: Q(pk=it.study.pk),
    Study.contestants.through: lambda it: Q(study=it.study),
    Study.scenarios.through: lambda it: Q(study=it.study),
    Study.experts.through: lambda it: Q(study=it.study),
    Matchup: lambda it: Q(study=it.study),
    Vote: lambda it: Q(matchup__study=it.study),
    Report: lambda it: Q(matchup__study=it.study),
    Authorship: lambda it: Q(study=it.study),
    EarlyLook: lambda it: Q(study=it.study),
    VoteFile: lambda it: Q(study=it.study),
    ImportedVote: lambda it: Q(file__study=it.study),
    Snapshot: lambda it: Q(study=it.study, state=Snapshot.State.READY),
    Standing: lambda it: Q(snapshot__study=it.study, snapshot__state=Snapshot.State.READY),
    LabellingRound: lambda it: Q(job__in=it.jobs),
    LabellingRound.experts.through: lambda it: Q(labellinground__job__in=it.jobs),
    LabelTask: lambda it: Q(labelling__job__in=it.jobs),
    FaultLabel: lambda it: Q(task__labelling__job__in=it.jobs),
}
"""Which rows of each table belong to a study."""

TRAVELLING = frozenset(map(model_label, _CHOSEN))
"""The tables of a study; a folder that brings others is none of ours."""


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
        jobs = set(
            sources.exclude(attempt=None).values_list("attempt__augmentation__job", flat=True)
        )
        rows = Augmentation.objects.filter(job__in=new)
        for column in ("follows", "corrects"):
            tied = rows.exclude(**{column: None})
            jobs.update(tied.values_list(f"{column}__job", flat=True))
        new = jobs - closure.jobs
    # In the order of their names, so that whatever is ordered by name stays as it is.
    # Sorted here: databases order letters each in its own way.
    named = User.objects.filter(pk__in=_people(closure)).values_list("username", "pk")
    for place, (username, pk) in enumerate(sorted(named), start=1):
        closure.accounts[pk] = closure.names[username] = f"expert-{place:04}"
    return closure


def _people(closure: Closure) -> set[int]:
    """Return the people who vote, label, wrote or looked; mere administrators stay out."""
    columns: dict[type[models.Model], str] = {
        Study.experts.through: "user",
        LabellingRound.experts.through: "user",
        **dict.fromkeys((Matchup, Vote, Report, Authorship, LabelTask), "expert"),
        EarlyLook: "user",
    }
    people: set[int] = set()
    for model, column in columns.items():
        rows = model._default_manager.filter(_CHOSEN[model](closure))
        people.update(rows.values_list(column, flat=True))
    return people


def travelling_rows(closure: Closure, rows: Rows) -> Iterator[list[Any]]:
    """The rows of one table without names of accounts, machines or addresses of people."""
    model = rows.model
    columns = list_columns(model)
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
            row["rules"] = closure.rename_rules()
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
