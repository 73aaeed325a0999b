"""What is looked for among the votes of a rating, parsed from the address once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from django import forms

from arena.models import Snapshot
from arena.models.votes import AID_LABELS
from arena.people.queries import natural_order
from arena.queries.votes.judged import AUTOMATIC, is_imported
from arena.queries.votes.search import (
    AUTOMATIC_TIE,
    COUNTED,
    EVERY,
    LEFT_OUT,
    SoughtOrder,
    SoughtOutcome,
    SoughtPart,
    VoteSearch,
)
from arena.queries.votes.sets import is_scenario_of
from augment.services.running.jobs import HIGHEST_SAMPLES
from augment.services.scenarios.scenes import type_choices

OUTCOMES = {
    SoughtOutcome.WON: "The contestant won",
    SoughtOutcome.TIED: "Tied",
    SoughtOutcome.LOST: "The contestant lost",
    SoughtOutcome.LEFT: "A is better",
    SoughtOutcome.EQUAL: "Equal",
    SoughtOutcome.RIGHT: "B is better",
    SoughtOutcome.DECIDED: "A or B is better",
    SoughtOutcome.BOTH_MISS: "Equal, both miss the instruction",
    SoughtOutcome.SKIP: "Skipped",
}
PARTS = {
    SoughtPart.COMMENTED: "With a comment",
    SoughtPart.FAST: "Under 1 s",
    SoughtPart.OWN: "By authors on their own contestants",
    SoughtPart.REPEATS: "Hidden repeats of counted votes",
    SoughtPart.ALIKE: "Hidden repeats answered alike",
    SoughtPart.CHECKS: "Attention checks answered",
    SoughtPart.PASSED: "Attention checks passed",
    SoughtPart.CHECKS_SKIPPED: "Attention checks skipped",
    SoughtPart.SHARED: "On what others judged as well",
}
ORDERS = {
    SoughtOrder.DISPUTED: "Most disputed",
    SoughtOrder.LOST: "Most often beaten",
    SoughtOrder.FAULTS: "Most faults",
    SoughtOrder.SCENARIO: "Scenarios by name",
}
MARKS = {
    COUNTED: "Counted",
    EVERY: "All",
    LEFT_OUT: "Left out",
    "superseded": "Left out: changed later",
    "check": "Left out: attention checks",
    "repeat": "Left out: hidden repeats",
    "skip": "Left out: skipped",
    "simulated": "Left out: simulated",
    "filtered": "Left out: not asked for",
    "own": "Left out: by authors on their own contestants",
    AUTOMATIC_TIE: "Not shown: nobody can tell the pictures apart",
}


class VoteSearchForm(forms.Form):
    """The filters of a list of votes, as they stand in the address."""

    contestant = forms.ChoiceField(label="Contestant", required=False)
    opponent = forms.ChoiceField(label="Against", required=False)
    outcome = forms.ChoiceField(label="Outcome", required=False)
    type = forms.ChoiceField(label="Scenario type", required=False)
    scenario = forms.CharField(label="Scenario", required=False, max_length=200)
    sample = forms.IntegerField(
        label="Sample", required=False, min_value=1, max_value=HIGHEST_SAMPLES
    )
    expert = forms.ChoiceField(label="Expert", required=False)
    mark = forms.ChoiceField(label="Counts", required=False)
    part = forms.ChoiceField(label="Only", required=False)
    aid = forms.ChoiceField(label="Looked with", required=False)
    comment = forms.CharField(label="Words in the comment", required=False, max_length=200)
    order = forms.ChoiceField(label="Begin with", required=False)

    def __init__(
        self, query: Mapping[str, str], *, snapshot: Snapshot, names: Mapping[str, str]
    ) -> None:
        """Offer what the rating has; names of contestants by slug."""
        data = {name: query.get(name, "") for name in self.base_fields}
        data["mark"] = data["mark"] or COUNTED
        super().__init__(data)
        self._snapshot = snapshot
        everybody = ("", "all")
        contestants = [everybody, *names.items()]
        self._offer("contestant", contestants)
        self._offer("opponent", contestants)
        self._offer("outcome", [everybody, *_choices(OUTCOMES)])
        self._offer("type", [everybody, *type_choices()])
        self._offer("expert", [everybody, *_experts(snapshot)])
        self._offer("mark", _choices(MARKS))
        self._offer("part", [everybody, *_choices(PARTS)])
        self._offer("aid", [everybody, *_choices(AID_LABELS)])
        self._offer("order", [("", "First votes"), *_choices(ORDERS)])
        if not snapshot.study.shows_all_samples:
            del self.fields["sample"]
        if is_imported(snapshot.study):
            for name in ("type", "part", "aid", "comment", "order"):
                del self.fields[name]

    def clean_scenario(self) -> str:
        """A scenario that occurs."""
        slug: str = self.cleaned_data["scenario"].strip()
        if slug and not is_scenario_of(self._snapshot, slug):
            raise forms.ValidationError(
                "There is no scenario “%(name)s” in this study.", params={"name": slug}
            )
        return slug

    def clean_sample(self) -> str:
        """As an address has it."""
        return str(self.cleaned_data["sample"] or "")

    def clean(self) -> dict[str, Any]:
        """Refuse what says nothing."""
        found: dict[str, Any] = super().clean() or {}
        contestant, outcome = found.get("contestant"), found.get("outcome")
        if contestant and contestant == found.get("opponent"):
            self.add_error("opponent", "Choose somebody else: nobody meets themselves.")
        if outcome and not contestant and SoughtOutcome(outcome).needs_contestant:
            if outcome == SoughtOutcome.TIED:
                found["outcome"] = SoughtOutcome.EQUAL.value
            else:
                self.add_error("outcome", "Choose the contestant who won or lost.")
        return found

    def search(self) -> VoteSearch:
        """What is looked for, once the form is valid."""
        return VoteSearch.of_query(self.cleaned_data)

    def _offer(self, name: str, choices: list[tuple[str, Any]]) -> None:
        field = self.fields[name]
        assert isinstance(field, forms.ChoiceField)
        field.choices = choices


def _choices(labels: Mapping[Any, Any]) -> list[tuple[str, Any]]:
    return [(str(value), label) for value, label in labels.items()]


def _experts(snapshot: Snapshot) -> list[tuple[str, str]]:
    """Pseudonyms as the rating kept them, and of the study's experts without a counted vote."""
    names = {
        str(code): name
        for code, name in snapshot.study.experts.values_list("person__code", "person__pseudonym")
    } | snapshot.results.judges
    if AUTOMATIC in names:
        names[AUTOMATIC] = "nobody: never shown"
    names.pop("", None)
    return sorted(names.items(), key=lambda item: natural_order(item[1]))
