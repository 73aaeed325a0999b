"""Forms of studies, from the fields of their plans."""

from collections.abc import Sequence
from typing import Any, Self

from django import forms
from django.contrib.auth.models import User

from arena.models import Question, Study
from arena.shell.forms import ChoiceForm, form_field, offer
from arena.studies.queries import list_finished, scenario_sources
from arena.studies.services.outlook import StudyEstimate, estimate_plan
from arena.studies.services.plan import PLAN_INPUTS, SWITCHES, StudyPlan
from augment.models import GenerationJob
from augment.services import InputKind


class StudyForm(ChoiceForm):
    """A new study; its rules are fixed from the moment it opens.

    Scenarios are those of one of the sources on which all contestants are finished, or single
    ones, which replace it.
    """

    NO_SCENARIO = "No scenario has a picture of every chosen contestant. Generate them first."
    source_job = ""

    def __init__(
        self, *args: Any, experts: list[User], jobs: Sequence[GenerationJob] = (), **kwargs: Any
    ) -> None:
        super().__init__(*args, **kwargs)
        self.fields |= {
            field.name: form_field(field) for field in PLAN_INPUTS if field.name not in self.fields
        }
        self.accounts = experts
        self.all_jobs = jobs
        self.sources = scenario_sources(jobs)
        rows = [row for group in self.groups for row in group.scenarios]
        offer(self, "scenarios", [*self.sources.items(), *((row.slug, row.slug) for row in rows)])
        offer(self, "jobs", [(str(job.code), job.name) for job in jobs])
        offer(self, "questions", Question.choices)
        offer(self, "experts", [(user.get_username(), user.get_username()) for user in experts])
        self.fields["experts"].error_messages["required"] = "Choose at least one expert."

    def rules(self) -> list[forms.BoundField]:
        """Return the fields under *Advanced*, switches last; for the template."""
        kinds = (InputKind.TEXT, InputKind.NAMES)
        names = [field.name for field in PLAN_INPUTS if field.kind not in kinds]
        names.remove("votes_per_expert")
        return [self[name] for name in sorted(names, key=lambda name: name in SWITCHES)]

    @property
    def has_rule_errors(self) -> bool:
        """Return whether something under *Advanced* is wrong, for the template."""
        return any(field.errors for field in self.rules())

    def clean_scenarios(self) -> list[str]:
        """Return the single ones, or else those of the source."""
        chosen: list[str] = self.cleaned_data["scenarios"]
        singles = [name for name in chosen if name not in self.sources]
        if singles or not chosen:
            return singles
        self.source_job = chosen[0].partition("job:")[2]
        return list_finished(self.cleaned_data.get("contestants", ()), chosen[0])

    def clean_questions(self) -> list[str]:
        """Return the primary one, which may be ticked besides, and the others."""
        return list(dict.fromkeys(self.cleaned_data["questions"]))

    @property
    def singles(self) -> int:
        """Return how many single scenarios are ticked, for the template."""
        return len(set(self["scenarios"].value() or ()) - set(self.sources))

    def as_entered(self) -> Self:
        """Return the same form with what was entered, and without faults."""
        return type(self)(
            initial=self.data,
            contestants=self.offered,
            groups=self.groups,
            experts=self.accounts,
            jobs=self.all_jobs,
        )

    def estimate(self) -> StudyEstimate | None:
        """Return the estimate from the fields filled so far; None if one is missing."""
        self.is_valid()
        return estimate_plan(self.cleaned_data)

    def study_plan(self) -> StudyPlan:
        """Return the plan of a valid form; an empty number is 0."""
        entered: dict[str, Any] = {
            field.name: 0.0 if value is None else value
            for field in PLAN_INPUTS
            if (value := self.cleaned_data[field.name]) != ""
        }
        if len(entered["experts"]) < 2:
            entered["overlap"] = 0.0  # a single expert shares nothing with anybody
        if self.source_job and not entered["jobs"]:
            entered["jobs"] = [self.source_job]
        return StudyPlan.read(entered)


class HandOverForm(forms.Form):
    """Two experts, the second of whom takes over the first one's remaining pairs."""

    giver = forms.ChoiceField(error_messages={"required": "Choose whose pairs are handed over."})
    takers = forms.MultipleChoiceField(error_messages={"required": "Choose who takes over."})

    def __init__(self, *args: Any, givers: list[str], takers: list[str], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        offer(self, "giver", [(username, username) for username in givers])
        offer(self, "takers", [(username, username) for username in takers])


class AuthorForm(forms.Form):
    """Expert who made a contestant of the study."""

    expert = forms.ChoiceField()
    contestant = forms.ChoiceField()

    def __init__(self, *args: Any, study: Study, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        choose = [("", "Choose …")]
        offer(self, "expert", choose + [(row.username,) * 2 for row in study.experts.all()])
        offer(self, "contestant", choose + [(r.slug, r.name) for r in study.contestants.all()])
