"""The evidence of a rating: votes with their pictures, as a grid and as a file."""

import uuid
from collections.abc import Mapping
from typing import Any
from urllib.parse import urlencode

from django import forms
from django.http import Http404, HttpRequest, HttpResponse, HttpResponseBase, StreamingHttpResponse
from django.shortcuts import get_object_or_404, render
from django.utils.text import slugify

from arena.exports.cells import show_name
from arena.models import Matchup, Snapshot, Study
from arena.people.queries import natural_order
from arena.results.exports.votes import vote_list_csv
from arena.results.pages.ratings import get_readable_study, get_snapshot
from arena.results.queries.evidence import vote_page
from arena.results.queries.search import MARKS, ORDERS, OUTCOMES, PARTS, VoteSearch
from arena.results.queries.votes import AUTOMATIC, COUNTED, RatedVote
from arena.shell.access import STAFF, page_for
from arena.shell.listing import page_asked
from arena.shell.pictures import resize_picture
from arena.voting.queries.blinding import is_imported
from arena.voting.queries.showings import picture_of_side
from augment.services.scenarios import type_choices

_ALL = ("", "all")


class VoteSearchForm(forms.Form):
    """The filters of a list of votes, as they stand in the address."""

    contestant = forms.ChoiceField(label="Contestant", required=False)
    opponent = forms.ChoiceField(label="Against", required=False)
    outcome = forms.ChoiceField(label="Outcome", required=False, choices=[_ALL, *OUTCOMES.items()])
    type = forms.ChoiceField(
        label="Scenario type", required=False, choices=lambda: [_ALL, *type_choices()]
    )
    scenario = forms.CharField(label="Scenario", required=False, max_length=200)
    expert = forms.ChoiceField(label="Expert", required=False)
    mark = forms.ChoiceField(label="Counts", required=False, choices=[*MARKS.items()])
    part = forms.ChoiceField(label="Only", required=False, choices=[_ALL, *PARTS.items()])
    order = forms.ChoiceField(
        label="Begin with", required=False, choices=[("", "First votes"), *ORDERS.items()]
    )

    def __init__(self, query: Mapping[str, str], *, snapshot: Snapshot) -> None:
        """Offer what the rating has."""
        data = {name: query.get(name, "") for name in self.base_fields}
        super().__init__(data | {"mark": data["mark"] or COUNTED})
        lines = snapshot.standings.order_by("name")
        shown = [(line.slug, show_name(line)) for line in lines]
        fields: dict[str, Any] = self.fields
        fields["contestant"].choices = fields["opponent"].choices = [_ALL, *shown]
        fields["expert"].choices = [_ALL, *_experts(snapshot)]

    def search(self) -> VoteSearch:
        """Return the search; everything that counts if the form is not valid."""
        return VoteSearch.of_query(self.cleaned_data) if self.is_valid() else VoteSearch()


@page_for(*STAFF)
def votes_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """One page of the votes that the address looks for, with their pictures."""
    snapshot, form, context = _read_search(request, code)
    if not form.is_valid():
        return render(request, "results/votes.html", context, status=422)
    page = vote_page(snapshot, form.search(), page_asked(request))
    unshown = sum(isinstance(line, RatedVote) for line in page.paginator.object_list)
    context |= {"page": page, "unshown": unshown, "cast": page.paginator.count - unshown}
    return render(request, "results/votes.html", context)


@page_for(*STAFF)
def votes_file(request: HttpRequest, code: uuid.UUID) -> HttpResponseBase:
    """All votes that the address looks for, as CSV."""
    snapshot, form, context = _read_search(request, code)
    if not form.is_valid():
        return render(request, "results/votes.html", context, status=422)
    name = f"{slugify(snapshot.study.name) or 'study'}-votes-list.csv"
    return StreamingHttpResponse(
        vote_list_csv(snapshot, form.search()),
        content_type="text/csv; charset=utf-8",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


@page_for(*STAFF)
def show_vote_picture(
    request: HttpRequest, code: uuid.UUID, matchup: uuid.UUID, side: str
) -> HttpResponseBase:
    """A picture as an expert of the study was shown it, left or right."""
    study = get_readable_study(request, code)
    rows = Matchup.objects.select_related("left", "right").only(
        "left_image", "right_image", "left__image", "right__image"
    )
    shown = get_object_or_404(rows, study=study, code=matchup)
    if side not in ("left", "right"):
        raise Http404
    return resize_picture(request, picture_of_side(shown, side))


# --- Private -----------------------------------------------------------------------------------


def _read_search(
    request: HttpRequest, code: uuid.UUID
) -> tuple[Snapshot, VoteSearchForm, dict[str, Any]]:
    """The rating, what is looked for, and what the page needs of them; no votes from a file."""
    study: Study = get_readable_study(request, code)
    if is_imported(study):
        raise Http404
    snapshot = get_snapshot(request, study)
    form = VoteSearchForm(request.GET.dict(), snapshot=snapshot)
    query = {"rating": str(snapshot.code), **form.search().as_query()}
    context = {
        "study": study,
        "snapshot": snapshot,
        "form": form,
        "search": form.search() if form.is_valid() else None,
        "query": urlencode(query),
        "has_evidence": True,
    }
    return snapshot, form, context


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
