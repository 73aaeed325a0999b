"""The results of a study: its tabs, its files, a new rating, opening them early, its end."""

import uuid
from functools import partial
from typing import Any, Unpack

from django import forms
from django.contrib import messages
from django.contrib.auth.decorators import login_not_required
from django.core.exceptions import PermissionDenied
from django.db import transaction
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.text import slugify
from django.views.decorators.http import require_safe

from arena.errors import NoSnapshot
from arena.exports.formats import download
from arena.models import Question, Snapshot, Study
from arena.rating.rules import METHOD_TEXTS
from arena.results.exports.tables import for_experts, leaderboard_table
from arena.results.exports.votes import VOTE_FORMATS, list_unrated
from arena.results.exports.writers import CHART_FORMATS, FORMATS, download_rating
from arena.results.pages.tabs import FOR_EXPERTS, MAIN, TABS, describe, fill_table
from arena.results.queries.access import list_snapshots, ready_snapshots, snapshot_to_export
from arena.results.services.rating_request import RatingRequest
from arena.results.services.ratings import (
    Choices,
    is_big,
    open_early,
    plan_snapshot,
    rate_now,
    share_rating,
)
from arena.shell import access, acts
from arena.shell.accounts import top_role
from arena.shell.forms import RequestForm, offer
from arena.shell.pictures import charts_for_pages
from arena.shell.sending import send_charts
from arena.studies.pages.studies import export_place, study_question
from arena.studies.queries import count_progress
from arena.studies.services.opening import close_study
from arena.voting.queries import blinding
from augment.services import read_code, read_request, to_inputs
from augment.services.scenarios import type_choices
from augment.tasks import enqueue_row

SHOWN = 12
"""So many ratings can be chosen on the page; the log lists all."""


class AnyOf(forms.MultipleChoiceField):
    """Codes of experts; rating itself refuses those that do not occur."""

    def valid_value(self, value: Any) -> bool:
        """Accept any ticked value."""
        return True


class RatingForm(RequestForm):
    """Method, resampling and which votes count; experts are offered as a rating names them."""

    inputs = to_inputs(RatingRequest)
    experts = AnyOf(required=False)

    def __init__(
        self,
        data: dict[str, Any] | None = None,
        *,
        snapshot: Snapshot | None = None,
        study: Study | None = None,
    ) -> None:
        super().__init__(data)
        if study is not None:
            offer(self, "question", ((key, Question(key).label) for key in study.questions))
        offer(self, "method", ((key, text) for key, text in METHOD_TEXTS.items() if key != "elo"))
        for name in ("method", "rounds", "seed"):
            self.fields[name].required = False
        offer(self, "types", type_choices())
        names = snapshot.results.judges if snapshot is not None else {}
        self.judges = sorted(names.items(), key=lambda item: item[1])


@access.page_for(access.ADMIN, access.RESEARCHER, access.EXPERT)
def results_page(request: HttpRequest, code: uuid.UUID, tab: str = "table") -> HttpResponse:
    """One tab of a rating; of an open study only for staff who opened its results."""
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    user = access.get_user(request)
    role = top_role(user)
    allowed = blinding.results_access(user=user, study=study, role=role)
    if allowed is blinding.ResultsAccess.NONE:
        raise PermissionDenied
    if allowed is blinding.ResultsAccess.EARLY:
        context = {"study": study, "is_expert": blinding.votes_in(user, study)}
        return render(request, "results/gate.html", context)
    is_staff = role in access.STAFF
    if tab not in TABS:
        raise Http404
    if tab not in FOR_EXPERTS and not is_staff:
        raise PermissionDenied
    ratings = list(list_snapshots(study).defer("results")[:SHOWN])
    snapshot = _choose_snapshot(request, study)
    context = {
        "study": study,
        "imported": blinding.is_imported(study),
        "snapshot": snapshot,
        "ratings": ratings,
        "under_way": [rating for rating in ratings if rating.state != Snapshot.State.READY],
        "tab": tab,
        "tab_template": f"results/{tab}.html",
        "more": [name for name in (TABS if is_staff else FOR_EXPERTS) if name not in MAIN],
        "is_staff": is_staff,
        "has_evidence": is_staff and not blinding.is_imported(study),
        "query": f"?rating={snapshot.code}" if snapshot and request.GET.get("rating") else "",
    }
    if is_staff:
        context["form"] = RatingForm(snapshot=snapshot, study=study)
        # Votes from a file have no page of a study, where the files are otherwise.
        export = context["export"] = (
            export_place(study, user) if blinding.is_imported(study) else None
        )
        context |= acts.wait_for_workers(waits=export is not None and export["is_waiting"])
    if is_staff and (link := getattr(snapshot, "shared", None)):
        address = reverse("shared-results", args=[link.token])
        context["shared_address"] = request.build_absolute_uri(address)
    if snapshot is not None:
        description = describe(snapshot, is_staff=is_staff)
        context |= description | TABS[tab](snapshot, description["table"])
    return render(request, "results/page.html", context)


@access.act_for(*access.STAFF, back="results")
def rate_study(request: HttpRequest, code: uuid.UUID) -> None:
    """Freeze a new rating of the votes as they are now; a big one is left to a worker."""
    study = get_readable_study(request, code)
    form = RatingForm(request.POST)
    if not form.is_valid():
        acts.tell_errors(request, form)
        return
    choices = read_request(RatingRequest, form.cleaned_data).choices()
    choices |= {"early": study.state == Study.State.OPEN, "actor": access.get_user(request)}
    rate_or_send(request, study, **choices)


@access.act_for(*access.STAFF, back="results")
def compute_again(request: HttpRequest, code: uuid.UUID, rating: uuid.UUID) -> None:
    """Send a rating that waits or failed to the workers once more; twice does no harm."""
    study = get_readable_study(request, code)
    snapshot = get_object_or_404(Snapshot, study=study, code=rating)
    snapshot.wait_again(progress=0)
    enqueue_row(snapshot)


@access.act_for(*access.STAFF, back="results")
def share(
    request: HttpRequest, code: uuid.UUID, rating: uuid.UUID, *, is_shared: bool
) -> HttpResponse:
    """Make the link by which anybody reads the table of this rating, or take it back."""
    snapshot = snapshot_to_export(get_readable_study(request, code), rating)
    share_rating(snapshot, is_shared=is_shared, actor=access.get_user(request))
    return redirect(f"{reverse('results', args=[code])}?rating={rating}")


@access.act_for(*access.STAFF, back="results")
def open_results_early(request: HttpRequest, code: uuid.UUID) -> None:
    """The explicit, logged act; who votes in the study votes no longer."""
    study = get_object_or_404(Study, code=code)
    open_early(study=study, actor=access.get_user(request))


@access.page_for(access.ADMIN, access.RESEARCHER, access.EXPERT)
@charts_for_pages
def rating_file(request: HttpRequest, code: uuid.UUID, name: str, form: str) -> HttpResponse:
    """A file of the rating that the address names, else of the newest.

    Experts who may read the results get its charts, which are pictures of their page; of a
    cancelled study, which has no rating, staff get the votes.
    """
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    is_staff = top_role(request.user) in access.STAFF
    if form not in CHART_FORMATS and not is_staff:
        raise PermissionDenied
    if study.state == Study.State.CANCELLED and name == "votes":
        stem = f"{slugify(study.name) or 'study'}-votes"
        return download(VOTE_FORMATS, form, stem, list_unrated(study))
    snapshot = get_snapshot(request, get_readable_study(request, code))
    with acts.refusals_told(request):
        return download_rating(snapshot, name, form)
    return redirect("results", code=code)


@access.form_for(access.ADMIN)
def close_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Take no more votes, rate them with the defaults and show the table; asks first."""
    study = get_object_or_404(Study, code=code)
    if not acts.is_sure(request):
        if study.state != Study.State.OPEN:
            return redirect("study", code=code)
        (line,) = count_progress([study])
        question = study_question(
            study,
            f"Close the study “{study.name}”?",
            f"Votes given: {line.voted}. Pairs skipped: {line.skipped}. "
            f"Still planned: {line.left}.",
            "No more votes are taken. This can’t be taken back.",
            "Its results can be read then, also by its experts. To end it without any, cancel it.",
            button="Close the study",
        )
        return acts.ask(request, question)
    actor = access.get_user(request)
    with acts.refusals_told(request):
        closed = close_study(study=study, actor=actor)
        if study.state == Study.State.OPEN:  # not pressed twice
            rate_or_send(request, closed, actor=actor)
        return redirect("results", code=code)
    return redirect("study", code=code)


# --- For whoever has the link ------------------------------------------------------------------

DATA = {form: FORMATS[form] for form in ("csv", "json")}


@login_not_required
@require_safe
def show_shared(request: HttpRequest, token: str) -> HttpResponse:
    """The sentence, the table, how it came about, and links to its data."""
    snapshot = _find_snapshot(request, token)
    description = describe(snapshot, is_staff=False)
    context = {"study": snapshot.study, "snapshot": snapshot, "token": token}
    context |= description | fill_table(snapshot, description["table"])
    return access.keep_secret(render(request, "results/shared.html", context))


@login_not_required
@require_safe
def send_shared(request: HttpRequest, token: str, form: str) -> HttpResponse:
    """The data of the page, as CSV or JSON."""
    snapshot = _find_snapshot(request, token)
    stem = f"{slugify(snapshot.study.name) or 'study'}-leaderboard"
    table = for_experts(leaderboard_table(snapshot))
    return access.keep_secret(download(DATA, form, stem, table))


# --- What other pages of a rating share --------------------------------------------------------


def get_readable_study(request: HttpRequest, code: uuid.UUID) -> Study:
    """The study if whoever asks may read its results.

    Raises:
        PermissionDenied: They may not, or not without opening them early first.
    """
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    if (
        blinding.results_access(user=access.get_user(request), study=study)
        is not blinding.ResultsAccess.FULL
    ):
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


def rate_or_send(request: HttpRequest, study: Study, **choices: Unpack[Choices]) -> None:
    """Rate a study's current votes; with many of them a worker does, and a message says so.

    Raises:
        AugmentError: Those of `plan_snapshot`; QueueFault where no worker is reached.
    """
    if not is_big(study):
        snapshot = rate_now(study=study, **choices)
        acts.send_later(request, snapshot, partial(send_charts, snapshot.pk))
        return
    with transaction.atomic():
        planned = plan_snapshot(study=study, **choices)
        transaction.on_commit(partial(enqueue_row, planned))
    messages.success(request, "The rating is being computed.")


def _rating_code(request: HttpRequest) -> uuid.UUID | None:
    wanted = request.GET.get("rating")
    return read_code(wanted) if wanted else None


def _choose_snapshot(request: HttpRequest, study: Study) -> Snapshot | None:
    """The rating that the address names, else the first of `ready_snapshots`; with its results."""
    rows = ready_snapshots(study).select_related("study__vote_file", "made_by__person", "shared")
    code = _rating_code(request)
    return rows.first() if code is None else get_object_or_404(rows, code=code)


def _find_snapshot(request: HttpRequest, token: str) -> Snapshot:
    """The rating of a link that holds; of a study that is closed, as it was when it was shared."""
    blinding.refuse_open_judge(request.user, Study.objects.filter(snapshots__shared__token=token))
    rows = Snapshot.objects.select_related("study__vote_file")
    closed = rows.filter(study__state=Study.State.CLOSED, state=Snapshot.State.READY)
    return get_object_or_404(closed, shared__token=token)
