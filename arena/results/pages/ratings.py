"""The results of a study: its tabs, its files, a new rating, and opening them early."""

import uuid
from collections.abc import Callable

from django.core.exceptions import PermissionDenied
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.text import slugify

from arena.errors import NoSnapshot
from arena.exports.formats import download
from arena.models import Snapshot, Study
from arena.results.exports.votes import VOTE_FORMATS, list_unrated
from arena.results.exports.writers import CHART_FORMATS, download_rating
from arena.results.pages.rating_form import RatingForm, rate_or_send
from arena.results.pages.tabs import FOR_EXPERTS, MAIN, TABS, describe
from arena.results.queries.access import list_snapshots, snapshot_to_export
from arena.results.services.rating_request import RatingRequest
from arena.results.services.ratings import open_early
from arena.results.services.sharing import share_rating, stop_sharing
from arena.shell import sending
from arena.shell.access import ADMIN, EXPERT, RESEARCHER, STAFF, act_for, get_user, page_for
from arena.shell.accounts import top_role
from arena.shell.acts import refusals_told, tell_errors, wait_for_workers
from arena.shell.pictures import charts_for_pages
from arena.studies.pages.studies import export_place
from arena.voting.queries.blinding import ResultsAccess, is_imported, results_access, votes_in
from augment.services import read_request

SHOWN = 12
"""So many ratings can be chosen on the page; the log lists all."""


@page_for(ADMIN, RESEARCHER, EXPERT)
def results_page(request: HttpRequest, code: uuid.UUID, tab: str = "table") -> HttpResponse:
    """One tab of a rating; of an open study only for staff who opened its results."""
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    user = get_user(request)
    role = top_role(user)
    access = results_access(user=user, study=study, role=role)
    if access is ResultsAccess.NONE:
        raise PermissionDenied
    if access is ResultsAccess.EARLY:
        context = {"study": study, "is_expert": votes_in(user, study)}
        return render(request, "results/gate.html", context)
    is_staff = role in STAFF
    if tab not in TABS:
        raise Http404
    if tab not in FOR_EXPERTS and not is_staff:
        raise PermissionDenied
    ratings = list(list_snapshots(study).defer("results")[:SHOWN])
    snapshot = _choose_snapshot(request, study, ratings)
    context = {
        "study": study,
        "imported": is_imported(study),
        "snapshot": snapshot,
        "ratings": ratings,
        "under_way": [rating for rating in ratings if rating.state != Snapshot.State.READY],
        "tab": tab,
        "tab_template": f"results/{tab}.html",
        "more": [name for name in (TABS if is_staff else FOR_EXPERTS) if name not in MAIN],
        "is_staff": is_staff,
        "has_evidence": is_staff and not is_imported(study),
        "query": f"?rating={snapshot.code}" if snapshot and request.GET.get("rating") else "",
    }
    if is_staff:
        context["form"] = RatingForm(snapshot=snapshot, study=study)
        # Votes from a file have no page of a study, where the files are otherwise.
        export = context["export"] = export_place(study, user) if is_imported(study) else None
        context |= wait_for_workers(waits=export is not None and export["is_waiting"])
    if is_staff and (link := getattr(snapshot, "shared", None)):
        address = reverse("shared-results", args=[link.token])
        context["shared_address"] = request.build_absolute_uri(address)
    if snapshot is not None:
        description = describe(snapshot, is_staff=is_staff)
        context |= description | TABS[tab](snapshot, description["table"])
    return render(request, "results/page.html", context)


@act_for(*STAFF, back="results")
def rate_study(request: HttpRequest, code: uuid.UUID) -> None:
    """Freeze a new rating of the votes as they are now; a big one is left to a worker."""
    study = get_readable_study(request, code)
    form = RatingForm(request.POST)
    if not form.is_valid():
        tell_errors(request, form)
        return
    choices = read_request(RatingRequest, form.cleaned_data).choices()
    choices |= {"early": study.state == Study.State.OPEN, "actor": get_user(request)}
    rate_or_send(request, study, **choices)


@act_for(*STAFF, back="results")
def compute_again(request: HttpRequest, code: uuid.UUID, rating: uuid.UUID) -> None:
    """Send a rating that waits or failed to the workers once more; twice does no harm."""
    study = get_readable_study(request, code)
    snapshot = get_object_or_404(Snapshot, study=study, code=rating)
    snapshot.wait_again(progress=0)
    sending.send_snapshot(snapshot.pk)


@act_for(*STAFF, back="results")
def share(request: HttpRequest, code: uuid.UUID, rating: uuid.UUID) -> HttpResponse:
    """Make the link by which anybody reads the table of this rating."""
    return _change_link(request, code, rating, share_rating)


@act_for(*STAFF, back="results")
def unshare(request: HttpRequest, code: uuid.UUID, rating: uuid.UUID) -> HttpResponse:
    """Take it back."""
    return _change_link(request, code, rating, stop_sharing)


@act_for(*STAFF, back="results")
def open_results_early(request: HttpRequest, code: uuid.UUID) -> None:
    """The explicit, logged act; who votes in the study votes no longer."""
    study = get_object_or_404(Study, code=code)
    open_early(study=study, actor=get_user(request))


@page_for(ADMIN, RESEARCHER, EXPERT)
@charts_for_pages
def rating_file(request: HttpRequest, code: uuid.UUID, name: str, form: str) -> HttpResponse:
    """A file of the rating that the address names, else of the newest.

    Experts who may read the results get its charts, which are pictures of their page; of a
    cancelled study, which has no rating, staff get the votes.
    """
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    is_staff = top_role(request.user) in STAFF
    if form not in CHART_FORMATS and not is_staff:
        raise PermissionDenied
    if study.state == Study.State.CANCELLED and name == "votes":
        stem = f"{slugify(study.name) or 'study'}-votes"
        return download(VOTE_FORMATS, form, stem, list_unrated(study))
    snapshot = get_snapshot(request, get_readable_study(request, code))
    with refusals_told(request):
        return download_rating(snapshot, name, form)
    return redirect("results", code=code)


# --- What other pages of a rating share --------------------------------------------------------


def get_readable_study(request: HttpRequest, code: uuid.UUID) -> Study:
    """The study if whoever asks may read its results.

    Raises:
        PermissionDenied: They may not, or not without opening them early first.
    """
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    if results_access(user=get_user(request), study=study) is not ResultsAccess.FULL:
        raise PermissionDenied
    return study


def get_snapshot(request: HttpRequest, study: Study) -> Snapshot:
    """The rating that the address names, else the first of `ready_snapshots`.

    Raises:
        Http404: There is none.
    """
    try:
        return snapshot_to_export(study, _rating_code(request))
    except NoSnapshot as error:
        raise Http404 from error


def _change_link(
    request: HttpRequest, code: uuid.UUID, rating: uuid.UUID, change: Callable[..., object]
) -> HttpResponse:
    study = get_readable_study(request, code)
    change(snapshot_to_export(study, rating), actor=get_user(request))
    return redirect(f"{reverse('results', args=[code])}?rating={rating}")


def _rating_code(request: HttpRequest) -> uuid.UUID | None:
    wanted = request.GET.get("rating")
    try:
        return uuid.UUID(wanted) if wanted else None
    except ValueError:
        raise Http404 from None


def _choose_snapshot(
    request: HttpRequest, study: Study, ratings: list[Snapshot]
) -> Snapshot | None:
    """The rating that the address names, else the first of `ready_snapshots`; with its results."""
    ready = [rating for rating in ratings if rating.state == Snapshot.State.READY]
    ready.sort(key=lambda rating: rating.question != study.questions[0])
    code = _rating_code(request) or next((rating.code for rating in ready), None)
    if code is None:
        return None
    rows = Snapshot.objects.select_related("study__vote_file", "made_by__person", "shared")
    return get_object_or_404(rows, study=study, code=code, state=Snapshot.State.READY)
