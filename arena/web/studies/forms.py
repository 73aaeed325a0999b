"""What admins enter about studies, parsed once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from django import forms
from django.contrib.auth.models import User

from arena.errors import NothingToPlan
from arena.pairing.rules import read_targets
from arena.services.study_drafts import SWITCHES
from arena.services.study_plan import PLAN_INPUTS, StudyPlan
from arena.web.forms import ChoiceForm
from arena.web.input_fields import form_field
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
        self._offer("jobs", [(str(job.code), job.name) for job in jobs])
        self._offer("experts", [(user.get_username(), user.get_username()) for user in experts])
        self.fields["experts"].error_messages["required"] = "Choose at least one expert."

    def rules(self) -> list[forms.BoundField]:
        """Return what is entered beside names, switches last; for the template."""
        kinds = {one.name: one.kind for one in PLAN_INPUTS}
        shown = [
            name for name, kind in kinds.items() if kind not in (InputKind.TEXT, InputKind.NAMES)
        ]
        return [self[name] for name in sorted(shown, key=lambda name: name in SWITCHES)]

    @property
    def chosen_experts(self) -> list[str]:
        """For the template."""
        return self.chosen("experts")

    @property
    def chosen_jobs(self) -> list[str]:
        """For the template."""
        return self.chosen("jobs")

    def clean_targets(self) -> list[str]:
        """Refuse targets that can't be read beside their field."""
        lines: list[str] = self.cleaned_data["targets"]
        try:
            read_targets(lines)
        except NothingToPlan as error:
            raise forms.ValidationError(str(error)) from error
        return lines

    def study_plan(self) -> StudyPlan:
        """Return what is to be opened, once the form is valid; an empty number is 0."""
        cleaned = {one.name: self.cleaned_data[one.name] for one in PLAN_INPUTS}
        entered: dict[str, Any] = {
            name: 0.0 if value is None else value for name, value in cleaned.items() if value != ""
        }
        if len(entered["experts"]) < 2:
            # A single expert shares nothing with anybody: what the form offers is no wish then.
            entered["overlap"] = 0.0
        return StudyPlan.read(entered)


class HandOverForm(forms.Form):
    """Whose remaining pairs go to whom."""

    giver = forms.ChoiceField(error_messages={"required": "Choose whose pairs are handed over."})
    takers = forms.MultipleChoiceField(error_messages={"required": "Choose who takes over."})

    def __init__(self, *args: Any, givers: list[str], takers: list[str], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        for name, offered in (("giver", givers), ("takers", takers)):
            found = self.fields[name]
            assert isinstance(found, forms.ChoiceField)
            found.choices = [(username, username) for username in offered]
