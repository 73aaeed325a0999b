"""What admins enter about studies, parsed once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from django import forms
from django.contrib.auth.models import User

from arena.errors import NothingToPlan
from arena.pairing.target_lines import Appearances, PairVotes, read_targets
from arena.services.shown_pictures import SampleRule
from arena.services.studies import PlanOptions
from arena.web.forms import ChoiceForm
from augment.models import GenerationJob


def _percent(*, initial: int, most: int) -> forms.FloatField:
    """A share in percent; an empty field is none."""
    return forms.FloatField(required=False, min_value=0, max_value=most, initial=initial)


class StudyForm(ChoiceForm):
    """A new study; its rules are fixed from the moment it opens."""

    experts = forms.MultipleChoiceField(error_messages={"required": "Choose at least one expert."})
    votes_per_expert = forms.IntegerField(min_value=1, max_value=10_000, initial=40)
    seed = forms.IntegerField(initial=1)
    repeats = _percent(initial=5, most=50)
    checks = _percent(initial=0, most=50)
    overlap = _percent(initial=10, most=80)
    adaptive = _percent(initial=0, most=90)
    hypotheses = forms.CharField(required=False, max_length=60_000)
    targets = forms.CharField(required=False, max_length=20_000)
    allow_both_miss = forms.BooleanField(required=False)
    allow_text = forms.BooleanField(required=False)
    show_alike = forms.BooleanField(required=False)
    allow_replay = forms.BooleanField(required=False)
    no_measures = forms.BooleanField(required=False)
    practice = forms.BooleanField(required=False)
    allow_simulated = forms.BooleanField(required=False)
    samples = forms.ChoiceField(
        choices=[(one.value, one.value) for one in SampleRule], required=False
    )
    jobs = forms.MultipleChoiceField(required=False)

    def __init__(
        self,
        *args: Any,
        experts: list[User],
        jobs: Sequence[GenerationJob] = (),
        **kwargs: Any,
    ) -> None:
        super().__init__(*args, **kwargs)
        self.accounts = experts
        self.all_jobs = jobs
        self._offer("jobs", [(str(job.code), job.name) for job in jobs])
        self._offer("experts", [(user.get_username(), user.get_username()) for user in experts])

    @property
    def chosen_experts(self) -> list[str]:
        """For the template."""
        return self.chosen("experts")

    @property
    def chosen_jobs(self) -> list[str]:
        """For the template."""
        return self.chosen("jobs")

    def clean_targets(self) -> tuple[Appearances, PairVotes]:
        """The targets, read."""
        try:
            return read_targets(self.cleaned_data["targets"].splitlines())
        except NothingToPlan as error:
            raise forms.ValidationError(str(error)) from error

    def rules(self) -> dict[str, Any]:
        """What the study is opened with, once the form is valid."""
        entered = self.cleaned_data
        names = ("name", "contestants", "scenarios", "experts", "votes_per_expert", "seed")
        appearances, pair_votes = entered["targets"]
        options = PlanOptions(
            repeat_share=(entered["repeats"] or 0) / 100,
            check_share=(entered["checks"] or 0) / 100,
            # A single expert shares nothing with anybody: what the form offers is no wish then.
            overlap_share=(entered["overlap"] or 0) / 100 if len(entered["experts"]) > 1 else 0.0,
            adaptive_share=(entered["adaptive"] or 0) / 100,
            appearances=appearances,
            pair_votes=pair_votes,
            allow_both_miss=entered["allow_both_miss"],
            allow_text=entered["allow_text"],
            settle_alike=not entered["show_alike"],
            allow_replay=entered["allow_replay"],
            allow_measures=not entered["no_measures"],
            practice=entered["practice"],
            hypotheses=tuple(entered["hypotheses"].splitlines()),
            samples=SampleRule(entered["samples"] or SampleRule.ONE),
            jobs=tuple(entered["jobs"]),
        )
        given = {name: entered[name] for name in (*names, "allow_simulated")}
        return given | {"options": options}


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
