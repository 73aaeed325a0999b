"""The results of a study: its tabs, its files, a new rating, and opening them early."""

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
from arena.people.queries import role_of
from arena.rating.leaderboard import Intervals, Method
from arena.rating.rules import Unit
from arena.results.exports.charts import CONTENT_TYPES, chart_bytes
from arena.results.exports.tables import EARLY_LOOK, for_experts, leaderboard_table
from arena.results.exports.votes import VOTE_FORMATS, unrated_votes, vote_table
from arena.results.exports.writers import FORMATS, bundle
from arena.results.pages.tabs import COVARIATE_LABELS, TABS, both_versions, show_adjustment
from arena.results.queries.access import STAFF as STAFF_ROLES
from arena.results.queries.access import (
    ResultsAccess,
    results_access,
    snapshot_to_export,
    snapshots_of,
    votes_in,
)
from arena.results.queries.evidence import count_settled
from arena.results.queries.votes import Filters, is_imported
from arena.results.services.ratings import (
    DEFAULT_ROUNDS,
    MOST_ROUNDS,
    Choices,
    is_big,
    open_early,
    plan_snapshot,
    rate_now,
)
from arena.services.covariates import COVARIATES, WITHOUT_PICTURES
from arena.site.access import ADMIN, ANALYST, EXPERT, STAFF, allow_only
from arena.studies.pages.studies import export_place
from augment.errors import AugmentError, Conflict, UnknownName
from augment.services.scenarios.scenes import type_choices

METHODS = {
    Method.BRADLEY_TERRY: "Bradley-Terry",
    Method.DAVIDSON: "Davidson (ties)",
    Method.ELO: "Online Elo",
}
UNITS = {
    "": "as the votes allow",
    Unit.TWO_WAY: "experts and scenarios",
    Unit.SCENARIO: "scenarios",
    Unit.EXPERT: "experts",
    Unit.VOTE: "votes, as in the paper",
}
INTERVALS = {
    "": "right for the method",
    Intervals.CLOSED_FORM: "in closed form",
    Intervals.RESAMPLES: "by resamples",
}

SHOWN = 12
"""So many ratings can be chosen on the page; the log lists all."""


class AnyOf(forms.MultipleChoiceField):
    """Codes of experts; rating itself refuses those that do not occur."""

    def valid_value(self, value: Any) -> bool:
        """Whatever was ticked."""
        return True


class RatingForm(forms.Form):
    """Method, resampling and which votes count; experts are offered as a rating names them."""

    method = forms.ChoiceField(choices=[*METHODS.items()], required=False)
    resample = forms.ChoiceField(choices=[*UNITS.items()], required=False)
    intervals = forms.ChoiceField(choices=[*INTERVALS.items()], required=False)
    rounds = forms.IntegerField(
        min_value=1, max_value=MOST_ROUNDS, initial=DEFAULT_ROUNDS, required=False
    )
    seed = forms.IntegerField(min_value=0, max_value=2**63 - 1, initial=0, required=False)
    types = forms.MultipleChoiceField(choices=type_choices, required=False)
    experts = AnyOf(required=False)
    adjust = forms.MultipleChoiceField(choices=[*COVARIATE_LABELS.items()], required=False)
    with_repeats = forms.BooleanField(required=False)
    leave_out_settled = forms.BooleanField(required=False)
    leave_out_own = forms.BooleanField(required=False)

    def __init__(
        self, data: dict[str, Any] | None = None, *, snapshot: Snapshot | None = None
    ) -> None:
        super().__init__(data)
        for name in ("method", "resample", "intervals", "rounds", "seed"):
            self.fields[name].widget.attrs["class"] = "input"
        names = snapshot.results.judges if snapshot is not None else {}
        imported = snapshot is not None and is_imported(snapshot.study)
        known = WITHOUT_PICTURES if imported else COVARIATES
        self.adjustable = [(name, COVARIATE_LABELS[name]) for name in known]
        self.judges = sorted(names.items(), key=lambda item: item[1])

    def choices(self) -> Choices:
        """As `rate_now` takes it; what was not filled in is the default."""
        asked = self.cleaned_data
        return Choices(
            method=asked["method"] or Method.BRADLEY_TERRY.value,
            unit=asked["resample"] or None,
            intervals=asked["intervals"] or None,
            covariates=asked["adjust"],
            rounds=asked["rounds"] or DEFAULT_ROUNDS,
            seed=asked["seed"] or 0,
            filters=Filters(
                types=tuple(asked["types"]),
                experts=tuple(asked["experts"]),
                kinds=(MAIN, REPEAT) if asked["with_repeats"] else (MAIN,),
                leave_out_settled=asked["leave_out_settled"],
                leave_out_own=asked["leave_out_own"],
            ),
        )


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
        if is_staff:
            context["own_votes"] = both_versions(snapshot.results.own_votes, table)
        else:
            table = for_experts(table)
        settled = count_settled(snapshot)
        context |= {
            "table": table,
            "early_look": EARLY_LOOK,
            "settled": settled,
            "cast": snapshot.votes_counted - settled,
            "adjusted": show_adjustment(snapshot, table),
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


def rate_or_send(request: HttpRequest, study: Study, **choices: Unpack[Choices]) -> None:
    """Rate a study's current votes; with many of them a worker does, and a message says so.

    Raises:
        ArenaError, AugmentError: Those of `plan_snapshot`; QueueFault where no worker is reached.
    """
    if not is_big(study):
        rate_now(study=study, **choices)
        return
    with transaction.atomic():
        planned = plan_snapshot(study=study, **choices)
        transaction.on_commit(partial(tasks.send_snapshot, planned.pk))
    messages.success(request, "The rating is being computed.")


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
