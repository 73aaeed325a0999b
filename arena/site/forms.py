"""What comes in by a form, parsed once."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from django import forms
from django.contrib.auth.models import User
from django.utils.translation import gettext_lazy as _

from arena.models import Report, Vote
from arena.scenarios.queries import TypeGroup
from arena.services.decisions import LONGEST_COMMENT, Decision, decision_of
from arena.studies.services.experts import SIDES, Complaint
from augment.errors import Conflict
from augment.models import Contestant
from augment.services.inputs import Input, InputKind
from augment.services.judging.findings import FaultClass
from augment.services.running.budget import Caps


@dataclass(frozen=True, slots=True, kw_only=True)
class Offer:
    """A contestant to choose, or why it can't be.

    Attributes:
        keys_missing: Environment variables that its workers need and this process lacks.
    """

    row: Contestant
    obstacle: str = ""
    keys_missing: tuple[str, ...] = ()


class ChoiceForm(forms.Form):
    """Contestants x scenarios, under a name.

    A whole type can be chosen without a script: `types` stands for all of its scenarios.
    """

    name = forms.CharField(max_length=120, strip=True)
    contestants = forms.MultipleChoiceField(
        error_messages={"required": _("Choose at least one contestant.")}
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

    @property
    def offers(self) -> list[Offer]:
        """For the template: whom there is to choose."""
        return [Offer(row=row) for row in self.offered]

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
            self.add_error("scenarios", _("Choose at least one scenario."))
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

    @property
    def opened_types(self) -> list[str]:
        """For the template: types of which some scenarios are ticked, so that one sees which."""
        chosen = set(self.chosen_scenarios)
        ticked = {g.type: [row.slug in chosen for row in g.scenarios] for g in self.groups}
        return [one for one, marks in ticked.items() if any(marks) and not all(marks)]

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


class VoteForm(forms.Form):
    """One press of one button: an answer, or a reason to skip."""

    key = forms.UUIDField()
    matchup = forms.UUIDField()
    outcome = forms.ChoiceField(
        required=False, choices=[(name, name) for name in ("left", "equal", "both_miss", "right")]
    )
    skip = forms.ChoiceField(required=False, choices=Vote.SkipReason.choices)
    supersedes = forms.UUIDField(required=False)
    comment = forms.CharField(required=False, max_length=LONGEST_COMMENT)

    def clean(self) -> dict[str, Any]:
        """Exactly one of answer and skip."""
        cleaned = super().clean() or {}
        if bool(cleaned.get("outcome")) == bool(cleaned.get("skip")):
            raise forms.ValidationError(_("One answer is needed."))
        return cleaned

    def decision(self) -> Decision:
        """What was decided, once the form is valid.

        Raises:
            InvalidVote: Parts do not go together.
        """
        given = self.cleaned_data
        both_miss = given["outcome"] == "both_miss"
        return decision_of(
            matchup_code=given["matchup"],
            key=given["key"],
            outcome="equal" if both_miss else given["outcome"] or "skip",
            both_miss=both_miss,
            reason=given["skip"],
            comment=given["comment"],
            supersedes=given["supersedes"],
        )


class ReportForm(forms.Form):
    """What is wrong with a pair."""

    key = forms.UUIDField()
    matchup = forms.UUIDField()
    report = forms.ChoiceField(choices=Report.Reason.choices)
    report_side = forms.ChoiceField(required=False, choices=[(name, name) for name in SIDES])
    report_comment = forms.CharField(required=False, max_length=LONGEST_COMMENT)

    def said(self) -> Complaint:
        """What is wrong, once the form is valid; without a side it is about both."""
        given = self.cleaned_data
        return Complaint(
            reason=given["report"],
            side=SIDES[given["report_side"] or "both"],
            comment=given["report_comment"],
        )


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
    experts = forms.MultipleChoiceField(
        error_messages={"required": _("Choose at least one expert.")}
    )
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


LONGEST_LINES = 60_000


class LinesField(forms.CharField):
    """A text whose lines are the values."""

    widget = forms.Textarea(attrs={"class": "input", "rows": 3})

    def clean(self, value: Any) -> list[str]:
        """Return the lines."""
        return str(super().clean(value)).splitlines()


def form_field(asked: Input) -> forms.Field:
    """Return the field of a form; an empty number is 0 where one need not be given.

    The choices of a field of names are the caller's.
    """
    given: dict[str, Any] = {"label": asked.title, "help_text": asked.help}
    given |= {"required": asked.is_required}
    given |= {} if asked.is_required else {"initial": asked.default}
    bounds: dict[str, Any] = {"min_value": asked.least, "max_value": asked.most}
    look = {"class": "input"}
    match asked.kind:
        case InputKind.TEXT:
            words: dict[str, Any] = given | {"max_length": asked.most}
            return forms.CharField(**words, widget=forms.TextInput(attrs=look))
        case InputKind.WHOLE:
            widget = forms.NumberInput(attrs=look)
            return forms.IntegerField(
                **given | bounds | {"required": asked.default is not None}, widget=widget
            )
        case InputKind.NUMBER:
            widget = forms.NumberInput(attrs={**look, "step": "any"})
            return forms.FloatField(**given | bounds, widget=widget)
        case InputKind.SWITCH:
            return forms.BooleanField(**given | {"required": False})
        case InputKind.CHOICE:
            choices = list(asked.choices.items())
            return forms.ChoiceField(**given, choices=choices, widget=forms.Select(attrs=look))
        case InputKind.LINES:
            return LinesField(**given | {"initial": ""}, max_length=LONGEST_LINES)
        case InputKind.NAMES:
            return forms.MultipleChoiceField(**given)


def read_json(text: str | bytes, *, otherwise: str) -> Any:
    """The value.

    Args:
        text: All of it.
        otherwise: What somebody is told whose text is no JSON.

    Raises:
        Conflict: It is none, or nested too deeply.
    """
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        raise Conflict(otherwise) from None
