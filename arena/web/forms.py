"""What comes in by a form, parsed once."""

from __future__ import annotations

from typing import Any

from django import forms
from django.contrib.auth.models import User

from arena.queries.profiles import Theme
from arena.queries.scenarios import TypeGroup
from augment.models import Contestant
from augment.services.caps import Caps
from augment.services.fault_guess import FaultClass


class ThemeForm(forms.Form):
    """The switch in the account menu."""

    theme = forms.ChoiceField(choices=[(theme.value, theme.value) for theme in Theme])

    def theme_value(self) -> Theme:
        """What was chosen, once the form is valid."""
        return Theme(self.cleaned_data["theme"])


class ChoiceForm(forms.Form):
    """Contestants x scenarios, under a name.

    A whole type can be chosen without a script: `types` stands for all of its scenarios.
    """

    name = forms.CharField(max_length=120, strip=True)
    contestants = forms.MultipleChoiceField(
        error_messages={"required": "Choose at least one contestant."}
    )
    types = forms.MultipleChoiceField(required=False)
    scenarios = forms.MultipleChoiceField(required=False)

    def __init__(
        self, *args: Any, contestants: list[Contestant], groups: list[TypeGroup], **kwargs: Any
    ) -> None:
        super().__init__(*args, **kwargs)
        self.offered = contestants
        self.groups = groups
        self._offer("contestants", [(row.slug, row.name) for row in contestants])
        self._offer("types", [(group.type, group.label) for group in groups])
        slugs = [row.slug for group in groups for row in group.scenarios]
        self._offer("scenarios", [(slug, slug) for slug in slugs])

    def clean(self) -> dict[str, Any]:
        """Whole types become their scenarios."""
        cleaned = super().clean() or {}
        types = set(cleaned.get("types", ()))
        chosen = set(cleaned.get("scenarios", ()))
        cleaned["scenarios"] = [
            row.slug
            for group in self.groups
            for row in group.scenarios
            if group.type in types or row.slug in chosen
        ]
        if not cleaned["scenarios"]:
            self.add_error("scenarios", "Choose at least one scenario.")
        return cleaned

    def chosen(self, field: str) -> list[str]:
        """What is ticked when the page is shown: what came in, nothing at first."""
        return list(self[field].value() or ())

    @property
    def chosen_contestants(self) -> list[str]:
        """For the template."""
        return self.chosen("contestants")

    @property
    def chosen_types(self) -> list[str]:
        """For the template."""
        return self.chosen("types")

    @property
    def chosen_scenarios(self) -> list[str]:
        """For the template."""
        return self.chosen("scenarios")

    def _offer(self, field: str, choices: list[tuple[str, str]]) -> None:
        found = self.fields[field]
        assert isinstance(found, forms.ChoiceField)
        found.choices = choices


class CapsForm(forms.Form):
    """What a job may use at most; an empty field is no cap, or one that stays."""

    cap_usd = forms.DecimalField(required=False, max_digits=16, decimal_places=9)
    cap_calls = forms.IntegerField(required=False)
    cap_tokens = forms.IntegerField(required=False)

    def caps(self) -> Caps:
        """What was entered, once the form is valid."""
        entered = self.cleaned_data
        return Caps(
            usd=entered["cap_usd"], calls=entered["cap_calls"], tokens=entered["cap_tokens"]
        )


class LaunchForm(ChoiceForm, CapsForm):
    """A new job."""

    is_fresh = forms.BooleanField(required=False)


class StudyForm(ChoiceForm):
    """A new study; its rules are fixed from the moment it opens."""

    experts = forms.MultipleChoiceField(error_messages={"required": "Choose at least one expert."})
    votes_per_expert = forms.IntegerField(min_value=1, max_value=10_000, initial=40)
    seed = forms.IntegerField(initial=1)
    allow_simulated = forms.BooleanField(required=False)

    def __init__(self, *args: Any, experts: list[User], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.accounts = experts
        self._offer("experts", [(user.get_username(), user.get_username()) for user in experts])

    @property
    def chosen_experts(self) -> list[str]:
        """For the template."""
        return self.chosen("experts")

    def rules(self) -> dict[str, Any]:
        """What the study is opened with, once the form is valid."""
        names = ("name", "contestants", "scenarios", "experts", "votes_per_expert", "seed")
        return {name: self.cleaned_data[name] for name in (*names, "allow_simulated")}


class VoteForm(forms.Form):
    """One press of one of the three buttons."""

    key = forms.UUIDField()
    matchup = forms.UUIDField()
    outcome = forms.ChoiceField(
        choices=[("left", "A is better"), ("equal", "Equal"), ("right", "B is better")]
    )
    ms_visible = forms.IntegerField(required=False, min_value=0, max_value=86_400_000)


class LabelForm(forms.Form):
    """The faults that an expert sees in one picture: any of three, or none."""

    task = forms.UUIDField()
    position = forms.BooleanField(required=False)
    heading = forms.BooleanField(required=False)
    logic = forms.BooleanField(required=False)
    note = forms.CharField(required=False, max_length=2000)

    def faults(self) -> frozenset[FaultClass]:
        """What was ticked, once the form is valid."""
        return frozenset(fault for fault in FaultClass if self.cleaned_data[fault.value])


class LabellingForm(forms.Form):
    """A new labelling of a job."""

    name = forms.CharField(max_length=120, strip=True)
    experts = forms.MultipleChoiceField(error_messages={"required": "Choose at least one expert."})
    seed = forms.IntegerField(initial=1, min_value=0, max_value=2**63 - 1)

    def __init__(self, *args: Any, experts: list[User], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.accounts = [user for user in experts if not user.person.is_simulated]
        found = self.fields["experts"]
        assert isinstance(found, forms.ChoiceField)
        found.choices = [(user.username, user.username) for user in self.accounts]

    @property
    def chosen_experts(self) -> list[str]:
        """For the template."""
        return list(self["experts"].value() or ())
