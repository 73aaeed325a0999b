"""Forms of studies, from the fields of their plans."""

from collections.abc import Sequence
from typing import Any

from django import forms
from django.contrib.auth.models import User

from arena.site.forms import ChoiceForm, form_field, offer
from arena.studies.services.drafts import SWITCHES
from arena.studies.services.outlook import ESTIMATE_INPUTS, StudyEstimate
from arena.studies.services.plan import PLAN_INPUTS, StudyPlan
from augment.models import GenerationJob
from augment.services.inputs import InputKind


class StudyForm(ChoiceForm):
    """A new study; its rules are fixed from the moment it opens."""

    def __init__(
        self, *args: Any, experts: list[User], jobs: Sequence[GenerationJob] = (), **kwargs: Any
    ) -> None:
        super().__init__(*args, **kwargs)
        self.fields |= {
            one.name: form_field(one) for one in PLAN_INPUTS if one.name not in self.fields
        }
        self.accounts = experts
        self.all_jobs = jobs
        offer(self, "jobs", [(str(job.code), job.name) for job in jobs])
        offer(self, "experts", [(user.get_username(), user.get_username()) for user in experts])
        self.fields["experts"].error_messages["required"] = "Choose at least one expert."

    def rules(self) -> list[forms.BoundField]:
        """Return what is entered beside names, switches last; for the template."""
        names = [
            one.name for one in PLAN_INPUTS if one.kind not in (InputKind.TEXT, InputKind.NAMES)
        ]
        return [self[name] for name in sorted(names, key=lambda name: name in SWITCHES)]

    def study_plan(self) -> StudyPlan:
        """Return what is to be opened, once the form is valid; an empty number is 0."""
        entered: dict[str, Any] = {
            one.name: 0.0 if value is None else value
            for one in PLAN_INPUTS
            if (value := self.cleaned_data[one.name]) != ""
        }
        if len(entered["experts"]) < 2:
            entered["overlap"] = 0.0  # a single expert shares nothing with anybody
        return StudyPlan.read(entered)


class HandOverForm(forms.Form):
    """Whose remaining pairs go to whom."""

    giver = forms.ChoiceField(error_messages={"required": "Choose whose pairs are handed over."})
    takers = forms.MultipleChoiceField(error_messages={"required": "Choose who takes over."})

    def __init__(self, *args: Any, givers: list[str], takers: list[str], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        offer(self, "giver", [(username, username) for username in givers])
        offer(self, "takers", [(username, username) for username in takers])


class PlanningForm(forms.Form):
    """A study in mind, and what it is to tell; shares in percent."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.fields |= {field.name: form_field(field) for field in ESTIMATE_INPUTS}

    def clean(self) -> dict[str, Any]:
        """Refuse more ties than contestants so far apart can have."""
        cleaned = super().clean() or {}
        if not self.errors:
            possible = StudyEstimate(**cleaned).most_ties
            if cleaned["ties"] >= possible:
                problem = "Contestants so far apart can tie in less than {:.0f} % of votes."
                self.add_error("ties", problem.format(possible))
        return cleaned
