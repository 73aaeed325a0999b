"""Rating a study from a page: at once, or by a worker where that takes longer."""

from __future__ import annotations

import uuid
from functools import partial
from typing import Any, Unpack, cast

from django import forms
from django.contrib import messages
from django.contrib.auth.models import User
from django.core.exceptions import PermissionDenied
from django.db import transaction
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.utils.text import slugify
from django.views.decorators.http import require_POST, require_safe

from arena import tasks
from arena.errors import ArenaError, NoSnapshot
from arena.exports.files import CONTENT_TYPE, ZIP
from arena.exports.formats import format_named
from arena.models import Snapshot, Study
from arena.pairing.order import MAIN, REPEAT
from arena.queries.people import role_of
from arena.rating.bootstrap import Unit
from arena.rating.leaderboard import Intervals, Method
from arena.results.exports.bundle import bundle
from arena.results.exports.charts import CONTENT_TYPES, chart_bytes
from arena.results.exports.tables import EARLY_LOOK, for_experts, leaderboard_table
from arena.results.exports.votes import VOTE_FORMATS, unrated_votes, vote_table
from arena.results.exports.writers import FORMATS
from arena.results.pages.tabs import TABS, Tab, both_versions, show_adjustment
from arena.results.queries.access import STAFF as STAFF_ROLES
from arena.results.queries.access import (
    ResultsAccess,
    results_access,
    snapshot_to_export,
    snapshots_of,
    votes_in,
)
from arena.results.queries.evidence import settled_counted
from arena.results.queries.votes import Filters, is_imported
from arena.results.services.ratings import (
    DEFAULT_ROUNDS,
    MOST_ROUNDS,
    Choices,
    is_big,
    open_early,
    plan_snapshot,
)
from arena.results.services.ratings import rate_now as rate
from arena.services.covariates import COVARIATES, WITHOUT_PICTURES
from arena.web.access import ADMIN, ANALYST, EXPERT, STAFF, allow_only
from arena.web.studies.files import export_place
from augment.errors import AugmentError, Conflict, UnknownName
from augment.services.scenarios.types import type_choices


def rate_or_send(request: HttpRequest, study: Study, **choices: Unpack[Choices]) -> None:
    """Rate a study's current votes; with many of them a worker does, and a message says so.

    Raises:
        ArenaError, AugmentError: Those of `plan_snapshot`; QueueFault where no worker is reached.
    """
    if not is_big(study):
        rate(study=study, **choices)
        return
    with transaction.atomic():
        planned = plan_snapshot(study=study, **choices)
        transaction.on_commit(partial(tasks.send_snapshot, planned.pk))
    messages.success(request, "The rating is being computed.")


METHOD_LABELS = {"bt": "Bradley-Terry", "davidson": "Davidson (ties)", "elo": "Online Elo"}
UNIT_LABELS = {
    "": "as the votes allow",
    "two-way": "experts and scenarios",
    "scenario": "scenarios",
    "expert": "experts",
    "vote": "votes, as in the paper",
}


INTERVAL_LABELS = {
    "": "right for the method",
    "closed": "in closed form",
    "resamples": "by resamples",
}


COVARIATE_LABELS = {
    "side": "being on the left",
    "objects": "the number of objects",
    "vehicles": "the number of vehicles",
}


class AnyOf(forms.MultipleChoiceField):
    """Codes of experts; rating itself refuses those that do not occur."""

    def valid_value(self, value: Any) -> bool:
        """Whatever was ticked."""
        return True


class RatingForm(forms.Form):
    """Method, resampling and which votes count; experts are offered as a rating names them."""

    method = forms.ChoiceField(
        choices=[(one.value, METHOD_LABELS[one.value]) for one in Method],
        initial=Method.BRADLEY_TERRY.value,
        required=False,
    )
    resample = forms.ChoiceField(
        choices=[("", UNIT_LABELS[""]), *((one.value, UNIT_LABELS[one.value]) for one in Unit)],
        required=False,
    )
    intervals = forms.ChoiceField(
        choices=[
            ("", INTERVAL_LABELS[""]),
            *((interval.value, INTERVAL_LABELS[interval.value]) for interval in Intervals),
        ],
        required=False,
    )
    rounds = forms.IntegerField(
        min_value=1, max_value=MOST_ROUNDS, initial=DEFAULT_ROUNDS, required=False
    )
    seed = forms.IntegerField(min_value=0, max_value=2**63 - 1, initial=0, required=False)
    types = forms.MultipleChoiceField(choices=type_choices, required=False)
    experts = AnyOf(required=False)
    adjust = forms.MultipleChoiceField(
        choices=[(name, COVARIATE_LABELS[name]) for name in COVARIATES], required=False
    )
    with_repeats = forms.BooleanField(required=False)
    leave_out_settled = forms.BooleanField(required=False)
    leave_out_own = forms.BooleanField(required=False)

    def __init__(
        self, data: dict[str, Any] | None = None, *, snapshot: Snapshot | None = None
    ) -> None:
        super().__init__(data)
        for name in ("method", "resample", "intervals", "rounds", "seed"):
            self.fields[name].widget.attrs["class"] = "input"
        named = snapshot.results.judges if snapshot is not None else {}
        imported = snapshot is not None and is_imported(snapshot.study)
        known = WITHOUT_PICTURES if imported else COVARIATES
        self.adjustable = [(name, COVARIATE_LABELS[name]) for name in known]
        self.judges = sorted(named.items(), key=lambda item: item[1])

    def wanted(self) -> dict[str, Any]:
        """As `rate` takes it; what was not filled in is the default."""
        asked = self.cleaned_data
        kinds = (MAIN, REPEAT) if asked["with_repeats"] else (MAIN,)
        return {
            "method": asked["method"] or Method.BRADLEY_TERRY.value,
            "unit": asked["resample"] or None,
            "intervals": asked["intervals"] or None,
            "covariates": asked["adjust"],
            "rounds": asked["rounds"] or DEFAULT_ROUNDS,
            "seed": asked["seed"] or 0,
            "filters": Filters(
                types=tuple(asked["types"]),
                experts=tuple(asked["experts"]),
                kinds=kinds,
                leave_out_settled=asked["leave_out_settled"],
                leave_out_own=asked["leave_out_own"],
            ),
        }


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


@allow_only(*STAFF)
@require_safe
def export(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """The rating that the address names, else the newest, as a file or as all of them in a zip."""
    study = get_readable_study(request, code)
    snapshot = _snapshot(request, study)
    if form == ZIP:
        try:
            content = bundle(snapshot)
        except Conflict as error:
            messages.error(request, str(error))
            return redirect("results", code=code)
        return _file(content, CONTENT_TYPE, f"{_slug(study)}-rating.zip")
    try:
        chosen = format_named(FORMATS, form)
    except UnknownName as error:
        raise Http404 from error
    content = chosen.write(leaderboard_table(snapshot))
    return _file(content, chosen.content_type, f"{_slug(study)}-leaderboard.{chosen.suffix}")


@allow_only(ADMIN, ANALYST, EXPERT)
@require_safe
def export_chart(request: HttpRequest, code: uuid.UUID, name: str, form: str) -> HttpResponse:
    """A chart of a rating for whoever may read it: a picture of its page, or a file."""
    study = get_readable_study(request, code)
    snapshot = _snapshot(request, study)
    try:
        content = chart_bytes(snapshot, name=name, file_format=form)
    except UnknownName as error:
        raise Http404 from error
    return _file(content, CONTENT_TYPES[form], f"{_slug(study)}-{name}.{form}")


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
        rows = unrated_votes(study) if is_cancelled else vote_table(_snapshot(request, study))
    except UnknownName as error:
        raise Http404 from error
    except Conflict as error:
        messages.error(request, str(error))
        return redirect("results", code=code)
    name = f"{_slug(study)}-votes.{chosen.suffix}"
    return _file(chosen.write(rows), chosen.content_type, name)


def _snapshot(request: HttpRequest, study: Study) -> Snapshot:
    try:
        return snapshot_to_export(study, asked_rating(request))
    except NoSnapshot as error:
        raise Http404 from error


def _slug(study: Study) -> str:
    return slugify(study.name) or "study"


def _file(content: bytes, content_type: str, name: str) -> HttpResponse:
    return HttpResponse(
        content,
        content_type=content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )
