"""The results of a study: its tabs, its files, a new rating, and opening them early."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.core.exceptions import PermissionDenied
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.views.decorators.http import require_POST, require_safe

from arena import tasks
from arena.errors import ArenaError
from arena.exports.tables import EARLY_LOOK, for_experts, leaderboard_table
from arena.models import Snapshot, Study
from arena.people.queries import role_of
from arena.queries.studies.results import STAFF as STAFF_ROLES
from arena.queries.studies.results import ResultsAccess, results_access, snapshots_of, votes_in
from arena.queries.votes.judged import is_imported
from arena.queries.votes.lists import settled_counted
from arena.services.early_looks import open_early
from arena.site.access import ADMIN, ANALYST, EXPERT, STAFF, allow_only
from arena.studies.pages.studies import export_place
from arena.web.results.adjustment import show_adjustment
from arena.web.results.authors import both_versions
from arena.web.results.rating import rate_or_send
from arena.web.results.rating_form import RatingForm
from arena.web.results.tabs import TABS, Tab
from augment.errors import AugmentError

SHOWN = 12
"""So many ratings can be chosen on the page; the log lists all."""


@allow_only(ADMIN, ANALYST, EXPERT)
@require_safe
def results_page(request: HttpRequest, code: uuid.UUID, tab: str = "table") -> HttpResponse:
    """One tab of a rating; of an open study only for staff who opened its results."""
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    user = cast(User, request.user)
    role = role_of(user)
    access = results_access(user=user, study=study, role=role)
    if access is ResultsAccess.NONE:
        raise PermissionDenied
    if access is ResultsAccess.EARLY:
        context = {"study": study, "is_expert": votes_in(user, study)}
        return render(request, "results/gate.html", context)
    is_staff = role in STAFF_ROLES
    chosen = _tab(tab, is_staff=is_staff)
    ratings = list(snapshots_of(study).defer("results")[:SHOWN])
    snapshot = _chosen(request, study, ratings)
    context = {
        "study": study,
        "imported": is_imported(study),
        "snapshot": snapshot,
        "ratings": ratings,
        "under_way": [rating for rating in ratings if rating.state != Snapshot.State.READY],
        "tab": chosen,
        "tabs": [one for one in TABS if is_staff or not one.staff],
        "is_staff": is_staff,
        "query": f"?rating={snapshot.code}" if snapshot and request.GET.get("rating") else "",
    }
    if is_staff:
        context["form"] = RatingForm(snapshot=snapshot)
        # Votes from a file have no page of a study, where the files are otherwise.
        context["export"] = export_place(study, user) if is_imported(study) else None
    if snapshot is not None:
        table = leaderboard_table(snapshot)
        if is_staff:
            context["own_votes"] = both_versions(snapshot, table)
        else:
            table = for_experts(table)
        settled = settled_counted(snapshot)
        context |= {"table": table, "early_look": EARLY_LOOK}
        context |= {"settled": settled, "cast": snapshot.votes_counted - settled}
        context["adjusted"] = show_adjustment(snapshot, table)
        context |= chosen.fill(snapshot, table)
    return render(request, "results/page.html", context)


@allow_only(*STAFF)
@require_POST
def rate_study(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Freeze a new rating of the votes as they are now; a big one is left to a worker."""
    study = get_readable_study(request, code)
    form = RatingForm(request.POST)
    if not form.is_valid():
        for faults in form.errors.values():
            messages.error(request, " ".join(str(fault) for fault in faults))
        return redirect("results", code=code)
    try:
        rate_or_send(
            request,
            study,
            **form.wanted(),
            early=study.state == Study.State.OPEN,
            actor=cast(User, request.user),
        )
    except (ArenaError, AugmentError) as error:
        messages.error(request, str(error))
    return redirect("results", code=code)


@allow_only(*STAFF)
@require_POST
def compute_again(request: HttpRequest, code: uuid.UUID, rating: uuid.UUID) -> HttpResponse:
    """Send a rating that waits or failed to the workers once more; twice does no harm."""
    study = get_readable_study(request, code)
    snapshot = get_object_or_404(Snapshot, study=study, code=rating)
    snapshot.wait_again(progress=0)
    try:
        tasks.send_snapshot(snapshot.pk)
    except AugmentError as error:
        messages.error(request, str(error))
    return redirect("results", code=code)


@allow_only(*STAFF)
@require_POST
def open_results_early(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The explicit, logged act; who votes in the study votes no longer."""
    study = get_object_or_404(Study, code=code)
    try:
        open_early(study=study, actor=cast(User, request.user))
    except AugmentError as error:
        messages.error(request, str(error))
    return redirect("results", code=code)


def get_readable_study(request: HttpRequest, code: uuid.UUID) -> Study:
    """The study if whoever asks may read its results.

    Raises:
        PermissionDenied: They may not, or not without opening them early first.
    """
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    if results_access(user=cast(User, request.user), study=study) is not ResultsAccess.FULL:
        raise PermissionDenied
    return study


def asked_rating(request: HttpRequest) -> uuid.UUID | None:
    """The code of the rating in the address, None for the newest.

    Raises:
        Http404: It is no code.
    """
    wanted = request.GET.get("rating")
    try:
        return uuid.UUID(wanted) if wanted else None
    except ValueError:
        raise Http404 from None


# --- Private -----------------------------------------------------------------------------------


def _tab(name: str, *, is_staff: bool) -> Tab:
    known = next((tab for tab in TABS if tab.name == name), None)
    if known is None:
        raise Http404
    if known.staff and not is_staff:
        raise PermissionDenied
    return known


def _chosen(request: HttpRequest, study: Study, ratings: list[Snapshot]) -> Snapshot | None:
    """The rating that the address names, else the newest one that is ready; with its results."""
    code = asked_rating(request)
    if code is None:
        ready = [rating for rating in ratings if rating.state == Snapshot.State.READY]
        code = ready[0].code if ready else None
    if code is None:
        return None
    rows = Snapshot.objects.select_related("study", "made_by__person")
    snapshot = rows.filter(study=study, code=code, state=Snapshot.State.READY).first()
    if snapshot is None:
        raise Http404
    return snapshot
