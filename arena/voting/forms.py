"""Forms of the voting page."""

from typing import Any

from django import forms
from django.utils.translation import gettext_lazy as _

from arena.models import Report, Vote
from arena.studies.services.experts import SIDES, Complaint
from arena.voting.services.casting import LONGEST_COMMENT, Decision, decision_of


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
        """Ask for exactly one of answer and skip."""
        cleaned = super().clean() or {}
        if bool(cleaned.get("outcome")) == bool(cleaned.get("skip")):
            raise forms.ValidationError(_("One answer is needed."))
        return cleaned

    def decision(self) -> Decision:
        """Return what was decided, once the form is valid.

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
        """Return what is wrong, once the form is valid; without a side it is about both."""
        given = self.cleaned_data
        return Complaint(
            reason=given["report"],
            side=SIDES[given["report_side"] or "both"],
            comment=given["report_comment"],
        )
