"""The evidence of a rating: votes with their pictures, as a grid, a file, or one at a time."""

from __future__ import annotations

import uuid
from typing import Any
from urllib.parse import urlencode

from django.http import Http404, HttpRequest, HttpResponse, HttpResponseBase, StreamingHttpResponse
from django.shortcuts import get_object_or_404, render
from django.utils.text import slugify
from django.views.decorators.http import require_safe

from arena.errors import NoSnapshot
from arena.exports.tables import LeaderboardTable, leaderboard_table
from arena.exports.vote_lists import vote_list_csv
from arena.models import Matchup, Snapshot, Study
from arena.queries.studies.results import snapshot_to_export
from arena.queries.votes.judged import is_imported
from arena.queries.votes.lists import neighbours, vote_page
from arena.queries.votes.search import VoteSearch
from arena.queries.votes.single import vote_in
from arena.queries.voting.descriptions import describe_in_words
from arena.queries.voting.showings import picture_of_side
from arena.site.access import STAFF, allow_only
from arena.site.listing import page_asked
from arena.web.pictures import sized_picture_response
from arena.web.results.evidence_form import VoteSearchForm
from arena.web.results.pages import asked_rating, get_readable_study


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
