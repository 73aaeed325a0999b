"""What is looked for among the votes of a rating, parsed from the address once."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from typing import Any
from urllib.parse import urlencode

from django import forms
from django.http import Http404, HttpRequest, HttpResponse, HttpResponseBase, StreamingHttpResponse
from django.shortcuts import get_object_or_404, render
from django.utils.text import slugify
from django.views.decorators.http import require_safe

from arena.errors import NoSnapshot
from arena.models import Matchup, Snapshot, Study
from arena.models.votes import AID_LABELS
from arena.queries.people import natural_order
from arena.results.exports.tables import LeaderboardTable, leaderboard_table
from arena.results.exports.votes import vote_list_csv
from arena.results.pages.ratings import asked_rating, get_readable_study
from arena.results.queries.access import snapshot_to_export
from arena.results.queries.evidence import neighbours, vote_in, vote_page
from arena.results.queries.search import (
    AUTOMATIC_TIE,
    COUNTED,
    EVERY,
    LEFT_OUT,
    SoughtOrder,
    SoughtOutcome,
    SoughtPart,
    VoteSearch,
)
from arena.results.queries.votes import AUTOMATIC, is_imported, is_scenario_of
from arena.voting.queries.showings import describe_in_words, picture_of_side
from arena.web.access import STAFF, allow_only
from arena.web.listing import page_asked
from arena.web.pictures import sized_picture_response
from augment.services.running.jobs import HIGHEST_SAMPLES
from augment.services.scenarios.types import type_choices

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


@allow_only(*STAFF)
@require_safe
def votes_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """One page of the votes that the address looks for, with their pictures."""
    study, snapshot, table = _rating(request, code)
    form = _form(request, snapshot, table)
    context = _context(study, snapshot, form) | {"search": None}
    if not form.is_valid():
        return render(request, "results/votes.html", context, status=422)
    search = form.search()
    context |= {
        "search": search,
        "page": vote_page(snapshot, search, page_asked(request)),
        "query": _query(snapshot, search),
    }
    return render(request, "results/votes.html", context)


@allow_only(*STAFF)
@require_safe
def votes_file(request: HttpRequest, code: uuid.UUID) -> HttpResponseBase:
    """All votes that the address looks for, as CSV."""
    study, snapshot, table = _rating(request, code)
    form = _form(request, snapshot, table)
    if not form.is_valid():
        context = _context(study, snapshot, form) | {"search": None}
        return render(request, "results/votes.html", context, status=422)
    name = f"{slugify(study.name) or 'study'}-votes-list.csv"
    return StreamingHttpResponse(
        vote_list_csv(snapshot, form.search()),
        content_type="text/csv; charset=utf-8",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


@allow_only(*STAFF)
@require_safe
def single_vote_page(request: HttpRequest, code: uuid.UUID, vote: uuid.UUID) -> HttpResponse:
    """One vote: the pair as it was shown, what was decided how, and who drew what."""
    study, snapshot, table = _rating(request, code)
    form = _form(request, snapshot, table)
    search = form.search() if form.is_valid() else VoteSearch()
    found = vote_in(snapshot, vote)
    if found is None:
        raise Http404
    matchup = found.vote.matchup
    described = matchup.descriptions and [describe_in_words(side) for side in matchup.descriptions]
    context = _context(study, snapshot, form) | {
        "search": search,
        "query": _query(snapshot, search),
        "found": found,
        "vote": found.vote,
        "matchup": matchup,
        "described": described,
        "beside": neighbours(snapshot, search, found.vote),
    }
    return render(request, "results/vote.html", context)


@allow_only(*STAFF)
@require_safe
def shown_picture(
    request: HttpRequest, code: uuid.UUID, matchup: uuid.UUID, side: str
) -> HttpResponseBase:
    """A picture as an expert of the study was shown it: left, right, or before the change."""
    study = get_readable_study(request, code)
    rows = Matchup.objects.select_related("left", "right").only(
        "left_image", "right_image", "original_image", "left__image", "right__image"
    )
    shown = get_object_or_404(rows, study=study, code=matchup)
    if side not in ("left", "right", "original"):
        raise Http404
    return sized_picture_response(request, picture_of_side(shown, side))


# --- Private -----------------------------------------------------------------------------------


def _rating(request: HttpRequest, code: uuid.UUID) -> tuple[Study, Snapshot, LeaderboardTable]:
    study = get_readable_study(request, code)
    try:
        snapshot = snapshot_to_export(study, asked_rating(request))
    except NoSnapshot as error:
        raise Http404 from error
    return study, snapshot, leaderboard_table(snapshot)


def _form(request: HttpRequest, snapshot: Snapshot, table: LeaderboardTable) -> VoteSearchForm:
    names = {row.slug: row.model for row in table.rows}
    return VoteSearchForm(request.GET.dict(), snapshot=snapshot, names=names)


def _context(study: Study, snapshot: Snapshot, form: VoteSearchForm) -> dict[str, Any]:
    return {
        "study": study,
        "snapshot": snapshot,
        "form": form,
        "imported": is_imported(study),
        "is_staff": True,
    }


def _query(snapshot: Snapshot, search: VoteSearch) -> str:
    """What an address says of the rating and of what is looked for."""
    return urlencode({"rating": str(snapshot.code), **search.as_query()})
