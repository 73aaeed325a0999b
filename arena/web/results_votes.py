"""The votes on one pair of a rating, with both pictures and now with names."""

from __future__ import annotations

import uuid

from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import render
from django.views.decorators.http import require_safe

from arena.errors import NoSnapshot
from arena.exports.tables import leaderboard_table
from arena.queries.judged import is_imported
from arena.queries.result_votes import votes_on_pair
from arena.queries.results import snapshot_to_export
from arena.web.access import STAFF, allow_only
from arena.web.results import address_of, asked_rating, get_readable_study
from arena.web.results_ratings import by_slug


@allow_only(*STAFF)
@require_safe
def votes_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """What was judged of two contestants; `a` and `b` are slugs."""
    study = get_readable_study(request, code)
    try:
        snapshot = snapshot_to_export(study, asked_rating(request))
    except NoSnapshot as error:
        raise Http404 from error
    table = leaderboard_table(snapshot)
    names = by_slug(table)
    first, second = (names.get(request.GET.get(side, "")) for side in ("a", "b"))
    if first is None or second is None or first is second:
        raise Http404
    number = request.GET.get("page", "1")
    votes = votes_on_pair(
        snapshot,
        first=first.slug,
        second=second.slug,
        page=int(number) if number.isdigit() else 1,
        imported=is_imported(study),
    )
    context = {
        "study": study,
        "snapshot": snapshot,
        "first": first,
        "second": second,
        "found": votes,
        "judges": snapshot.results.judges,
        "back": address_of(study, snapshot, "pairs"),
    }
    return render(request, "results/votes.html", context)
