"""The results of a study: its tabs, its files, a new rating, and opening them early."""

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.core.exceptions import PermissionDenied
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.utils.text import slugify
from django.views.decorators.http import require_POST, require_safe

from arena import tasks
from arena.errors import ArenaError, NoSnapshot
from arena.exports.files import CONTENT_TYPE, ZIP
from arena.exports.formats import format_named
from arena.models import Snapshot, Study
from arena.people.queries import role_of
from arena.results.exports.charts import CONTENT_TYPES, chart_bytes
from arena.results.exports.tables import EARLY_LOOK, for_experts, leaderboard_table
from arena.results.exports.votes import VOTE_FORMATS, unrated_votes, vote_table
from arena.results.exports.writers import FORMATS, bundle
from arena.results.pages.rating_form import RatingForm, rate_or_send
from arena.results.pages.tabs import TABS, show_adjustment
from arena.results.queries.access import STAFF as STAFF_ROLES
from arena.results.queries.access import (
    ResultsAccess,
    results_access,
    snapshot_to_export,
    snapshots_of,
    votes_in,
)
from arena.results.queries.evidence import count_settled
from arena.results.queries.votes import is_imported
from arena.results.services.ratings import open_early
from arena.site.access import ADMIN, ANALYST, EXPERT, STAFF, allow_only
from arena.studies.pages.studies import export_place
from augment.errors import AugmentError, Conflict, UnknownName

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
    if tab not in TABS:
        raise Http404
    if TABS[tab].staff and not is_staff:
        raise PermissionDenied
    ratings = list(snapshots_of(study).defer("results")[:SHOWN])
    snapshot = _chosen(request, study, ratings)
    context = {
        "study": study,
        "imported": is_imported(study),
        "snapshot": snapshot,
        "ratings": ratings,
        "under_way": [rating for rating in ratings if rating.state != Snapshot.State.READY],
        "tab": TABS[tab],
        "tabs": [known for known in TABS.values() if is_staff or not known.staff],
        "is_staff": is_staff,
        "query": f"?rating={snapshot.code}" if snapshot and request.GET.get("rating") else "",
    }
    if is_staff:
        context["form"] = RatingForm(snapshot=snapshot)
        # Votes from a file have no page of a study, where the files are otherwise.
        context["export"] = export_place(study, user) if is_imported(study) else None
    if snapshot is not None:
        table = leaderboard_table(snapshot)
        if not is_staff:
            table = for_experts(table)
        settled = count_settled(snapshot)
        context |= {
            "table": table,
            "early_look": EARLY_LOOK,
            "settled": settled,
            "cast": snapshot.votes_counted - settled,
            "adjusted": show_adjustment(snapshot),
            **TABS[tab].fill(snapshot, table),
        }
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
    choices = form.choices()
    choices["early"] = study.state == Study.State.OPEN
    choices["actor"] = cast(User, request.user)
    try:
        rate_or_send(request, study, **choices)
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


# --- Files -------------------------------------------------------------------------------------


@allow_only(*STAFF)
@require_safe
def export(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """The rating that the address names, else the newest, as a file or as all of them in a zip."""
    study = get_readable_study(request, code)
    snapshot = get_snapshot(request, study)
    if form == ZIP:
        try:
            return _file(study, bundle(snapshot), CONTENT_TYPE, "rating.zip")
        except Conflict as error:
            messages.error(request, str(error))
            return redirect("results", code=code)
    try:
        chosen = format_named(FORMATS, form)
    except UnknownName as error:
        raise Http404 from error
    content = chosen.write(leaderboard_table(snapshot))
    return _file(study, content, chosen.content_type, f"leaderboard.{chosen.suffix}")


@allow_only(ADMIN, ANALYST, EXPERT)
@require_safe
def export_chart(request: HttpRequest, code: uuid.UUID, name: str, form: str) -> HttpResponse:
    """A chart of a rating for whoever may read it: a picture of its page, or a file."""
    study = get_readable_study(request, code)
    snapshot = get_snapshot(request, study)
    try:
        content = chart_bytes(snapshot, name=name, file_format=form)
    except UnknownName as error:
        raise Http404 from error
    return _file(study, content, CONTENT_TYPES[form], f"{name}.{form}")


@allow_only(*STAFF)
@require_safe
def export_votes(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """The votes of a rating, with pseudonyms; of a cancelled study, which has none, all votes."""
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    is_cancelled = study.state == Study.State.CANCELLED
    if not is_cancelled:
        study = get_readable_study(request, code)
    try:
        chosen = format_named(VOTE_FORMATS, form)
        rows = unrated_votes(study) if is_cancelled else vote_table(get_snapshot(request, study))
    except UnknownName as error:
        raise Http404 from error
    except Conflict as error:
        messages.error(request, str(error))
        return redirect("results", code=code)
    content = chosen.write(rows)
    return _file(study, content, chosen.content_type, f"votes.{chosen.suffix}")


# --- What other pages of a rating share --------------------------------------------------------


def get_readable_study(request: HttpRequest, code: uuid.UUID) -> Study:
    """The study if whoever asks may read its results.

    Raises:
        PermissionDenied: They may not, or not without opening them early first.
    """
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    if results_access(user=cast(User, request.user), study=study) is not ResultsAccess.FULL:
        raise PermissionDenied
    return study


def get_snapshot(request: HttpRequest, study: Study) -> Snapshot:
    """The rating that the address names, else the newest one.

    Raises:
        Http404: There is none.
    """
    try:
        return snapshot_to_export(study, _asked_rating(request))
    except NoSnapshot as error:
        raise Http404 from error


def _asked_rating(request: HttpRequest) -> uuid.UUID | None:
    wanted = request.GET.get("rating")
    try:
        return uuid.UUID(wanted) if wanted else None
    except ValueError:
        raise Http404 from None


def _chosen(request: HttpRequest, study: Study, ratings: list[Snapshot]) -> Snapshot | None:
    """The rating that the address names, else the newest one that is ready; with its results."""
    ready = [rating.code for rating in ratings if rating.state == Snapshot.State.READY]
    code = _asked_rating(request) or next(iter(ready), None)
    if code is None:
        return None
    rows = Snapshot.objects.select_related("study", "made_by__person")
    return get_object_or_404(rows, study=study, code=code, state=Snapshot.State.READY)


def _file(study: Study, content: bytes, content_type: str, name: str) -> HttpResponse:
    disposition = f'attachment; filename="{slugify(study.name) or "study"}-{name}"'
    return HttpResponse(
        content, content_type=content_type, headers={"Content-Disposition": disposition}
    )
