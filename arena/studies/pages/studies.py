"""Pages of studies for admins and analysts: progress, reports and files, never who leads."""

import uuid
from typing import Any

from django.contrib import messages
from django.contrib.auth.models import User
from django.core.exceptions import PermissionDenied
from django.core.files.storage import default_storage
from django.db import transaction
from django.http import FileResponse, Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.text import slugify
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena import tasks
from arena.models import Report, Study, StudyFile
from arena.people.queries import by_pseudonym, experts
from arena.results.pages.rating_form import rate_or_send
from arena.results.queries.access import ResultsAccess, latest_snapshot, results_access
from arena.results.queries.votes import is_imported
from arena.results.services.written_files import (
    SHOWS_RESULTS,
    ask_for_study_file,
    study_files_of,
    why_not,
)
from arena.site.access import ADMIN, STAFF, allow_only, user_of
from arena.site.acts import (
    WHY,
    Confirmation,
    ask,
    is_sure,
    is_typed,
    refusals_told,
    send_later,
    tell_errors,
    wants_to_change,
)
from arena.site.listing import read_listing, read_page
from arena.studies import queries
from arena.studies.forms import HandOverForm
from arena.studies.services.opening import (
    cancel_study,
    close_study,
    preregistration_bytes,
    preregistration_sha256,
)
from arena.studies.services.plan import PLAN_INPUTS, hypotheses_of, plan_of
from arena.studies.services.taking_part import hand_over
from arena.voting.queries.ballots import tallies
from arena.voting.queries.showings import view_shown
from augment.services.inputs import InputKind

STUDIES_AT_ONCE = 25

DRAFT = "draft"
"""What the list calls the state of a study that is still set up."""


@allow_only(*STAFF)
@require_safe
def studies_page(request: HttpRequest) -> HttpResponse:
    """Studies with their bars, page by page; before the first ones the drafts."""
    states = [(DRAFT, "Draft"), *Study.State.choices]
    listing = read_listing(request, {"state": ("State", states)})
    rows = listing.narrow(Study.objects.all(), "name", by=["state"])
    page = read_page(request, rows, size=STUDIES_AT_ONCE)
    shows_drafts = page.number == 1 and listing.chosen("state") in ("", DRAFT)
    context = {
        "studies": queries.of_studies(list(page.object_list)),
        "drafts": list(queries.find_drafts(listing.search)) if shows_drafts else [],
        "page": page,
        "listing": listing,
    }
    return render(request, "studies/list.html", context)


@allow_only(*STAFF)
@require_safe
def study_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The rules, and how far each expert is."""
    study = _find_study(code)
    if is_imported(study):
        return redirect("results", code=code)
    study_plan = plan_of(study)
    context = {
        "line": queries.of_study(study),
        "export": export_place(study, user_of(request)),
        "tallies": tallies(study),
        "contestants": list(study.contestants.all()),
        "scenario_count": study.scenarios.count(),
        "rules": [
            (one.label, one.shown(getattr(study_plan, one.name)))
            for one in PLAN_INPUTS
            if one.kind not in (InputKind.TEXT, InputKind.NAMES, InputKind.LINES)
        ],
        "targets": study_plan.targets,
        "coverage": queries.coverage(study),
        "reports": list(queries.reports_of(study)),
        "accounts": by_pseudonym(experts()),
        "hypotheses": hypotheses_of(study),
        "frozen": preregistration_sha256(study),
    }
    return render(request, "studies/study.html", context)


def _find_study(code: uuid.UUID) -> Study:
    return get_object_or_404(Study.objects.select_related("vote_file"), code=code)


@allow_only(*STAFF)
@require_safe
def preregistration_file(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """What was frozen at the opening, byte for byte."""
    study = get_object_or_404(Study, code=code)
    content = preregistration_bytes(study)
    if not content:
        raise Http404
    name = f"{slugify(study.name) or 'study'}-preregistration.json"
    return HttpResponse(
        content,
        content_type="application/json",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


# --- Acts --------------------------------------------------------------------------------------


@allow_only(ADMIN)
@require_POST
def hand_over_pairs(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Let others judge what an expert has not judged; asks first."""
    study = get_object_or_404(Study, code=code)
    if wants_to_change(request):
        return redirect("study", code=code)
    form = HandOverForm(
        request.POST,
        givers=list(study.experts.values_list("username", flat=True)),
        takers=[user.username for user in experts()],
    )
    if not form.is_valid():
        tell_errors(request, form)
        return redirect("study", code=code)
    giver, takers = form.cleaned_data["giver"], form.cleaned_data["takers"]
    with refusals_told(request), transaction.atomic():
        taken = hand_over(study=study, username=giver, to=takers, actor=user_of(request))
        if not is_sure(request):  # it was only tried
            transaction.set_rollback(True)
            return ask(request, _handing_over(study, giver, taken))
        shares = ", ".join(f"{name} {votes}" for name, votes in taken.items())
        messages.success(request, f"Handed over: {shares}.")
    return redirect("study", code=code)


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def close(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Take no more votes, rate them with the defaults and show the table; asks first."""
    study = get_object_or_404(Study, code=code)
    if not is_sure(request):
        if study.state != Study.State.OPEN:
            return redirect("study", code=code)
        return ask(request, _closing(study))
    actor = user_of(request)
    with refusals_told(request):
        closed = close_study(study=study, actor=actor)
        if study.state == Study.State.OPEN:  # not pressed twice
            rate_or_send(request, closed, actor=actor)
        return redirect("results", code=code)
    return redirect("study", code=code)


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def cancel(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Give the study up, without results; its name has to be typed."""
    study = get_object_or_404(Study, code=code)
    if not is_typed(request, study.name):
        if study.state != Study.State.OPEN:
            return redirect("study", code=code)
        return ask(request, _cancelling(study))
    with refusals_told(request):
        cancel_study(study=study, why=request.POST.get(WHY, ""), actor=user_of(request))
        messages.success(request, "Cancelled. Its votes stay.")
    return redirect("study", code=code)


def _handing_over(study: Study, giver: str, taken: dict[str, int]) -> Confirmation:
    return _question(
        study,
        f"Hand over what {giver} has not judged?",
        *(f"Pairs that {name} takes: {number}." for name, number in taken.items()),
        f"{giver} no longer sees them; votes that were given stay.",
        "The pairs are planned anew for who takes them. This can’t be taken back.",
        button="Hand over",
    )


def _closing(study: Study) -> Confirmation:
    lines = tallies(study)
    return _question(
        study,
        f"Close the study “{study.name}”?",
        f"Votes given: {sum(line.voted for line in lines)}. "
        f"Pairs skipped: {sum(line.skips for line in lines)}.",
        f"Planned votes that will be missing: {sum(line.left for line in lines)}. "
        f"Experts who are not done: {sum(line.left > 0 for line in lines)}.",
        "No more votes are taken. This can’t be taken back.",
        "Its results can be read then, also by its experts. To end it without any, cancel it.",
        button="Close the study",
    )


def _cancelling(study: Study) -> Confirmation:
    early = "Ratings that were made early are shown to nobody any more."
    return _question(
        study,
        f"Cancel the study “{study.name}”?",
        "No more votes are taken, and the study is never rated: it has no results. "
        "This can’t be taken back.",
        *([early] if study.snapshots.exists() else []),
        "Votes that stay and can be exported as votes: "
        f"{sum(line.voted for line in tallies(study))}.",
        "Experts read that it was cancelled and that nothing is left to do.",
        "To end it with results, close it instead. Its settings can be used again for another.",
        button="Cancel the study",
        phrase=study.name,
        asks_why=True,
    )


def _question(study: Study, title: str, *facts: str, button: str, **more: Any) -> Confirmation:
    back = reverse("study", args=[study.code])
    return Confirmation(
        title=title,
        facts=facts,
        button=button,
        back=back,
        crumbs=(("Studies", reverse("studies")), (study.name, back)),
        **more,
    )


# --- Files -------------------------------------------------------------------------------------


def export_place(study: Study, user: User) -> dict[str, Any]:
    """Return what there is to take away: whether results may be read, and files with obstacles."""
    access = results_access(user=user, study=study)
    rows = study_files_of(study)
    kinds = [StudyFile.Kind.STUDY] if is_imported(study) else list(StudyFile.Kind)
    files = [
        {
            "kind": kind.value,
            "label": str(kind.label),
            "row": rows.get(kind.value),
            "obstacle": _obstacle(study, kind, access),
        }
        for kind in kinds
    ]
    return {
        "may_read": access is ResultsAccess.FULL,
        "is_early": access is ResultsAccess.EARLY,
        "is_rated": latest_snapshot(study) is not None,
        "is_imported": is_imported(study),
        "files": files,
        "is_waiting": any(row.is_waiting for row in rows.values()),
    }


def _obstacle(study: Study, kind: StudyFile.Kind, access: ResultsAccess) -> str:
    if kind in SHOWS_RESULTS and access is not ResultsAccess.FULL:
        return why_not(study, kind) or "It shows results, which you have not opened."
    return why_not(study, kind)


@allow_only(*STAFF)
@require_POST
def ask_for_file(request: HttpRequest, code: uuid.UUID, kind: str) -> HttpResponse:
    """Leave a file to a worker; twice does no harm."""
    study = _study_for(request, code, kind)
    with refusals_told(request), transaction.atomic():
        row = ask_for_study_file(study=study, kind=kind, actor=user_of(request))
        send_later(request, tasks.send_study_file, row.pk)
        messages.success(request, "A worker writes the file; it is offered here when ready.")
    if is_imported(study):
        return redirect("results", code=code)
    return redirect(reverse("study", args=[code]) + "#export")


@allow_only(*STAFF)
@require_safe
def download(request: HttpRequest, code: uuid.UUID, kind: str) -> FileResponse:
    """The newest one, once it is ready."""
    row = study_files_of(_study_for(request, code, kind)).get(kind)
    if row is None or row.state != StudyFile.State.READY:
        raise Http404
    try:
        content = default_storage.open(row.stored)
    except FileNotFoundError:
        raise Http404 from None
    return FileResponse(content, as_attachment=True, filename=row.name)


def _study_for(request: HttpRequest, code: uuid.UUID, kind: str) -> Study:
    """Return the study, for whoever may have this file of it."""
    study = _find_study(code)
    if kind not in StudyFile.Kind.values:
        raise Http404
    access = results_access(user=user_of(request), study=study)
    if kind in SHOWS_RESULTS and access is not ResultsAccess.FULL:
        raise PermissionDenied
    return study


# --- Reports -----------------------------------------------------------------------------------


@allow_only(ADMIN)
@require_safe
def report_page(request: HttpRequest, code: uuid.UUID, key: uuid.UUID) -> HttpResponse:
    """One report, with both pictures as the expert saw them and the mark in them."""
    study = get_object_or_404(Study, code=code)
    report = get_object_or_404(queries.reports_of(study), key=key)
    matchup, view = report.matchup, view_shown(report.matchup)
    votes_here = study.experts.filter(pk=user_of(request).pk).exists()
    is_blind = study.state == Study.State.OPEN and votes_here
    mark = None
    if report.mark_x is not None and report.mark_y is not None:
        mark = (report.mark_x * view["width"], report.mark_y * view["height"])
    sides = (
        (Report.Side.LEFT, "A", matchup.left_token, matchup.left),
        (Report.Side.RIGHT, "B", matchup.right_token, matchup.right),
    )
    pictures = [
        {
            "letter": letter,
            "token": token,
            "made": None if is_blind else made,
            "is_named": report.side in (side, Report.Side.BOTH),
            "mark": mark if report.side in (side, Report.Side.BOTH) else None,
        }
        for side, letter, token, made in sides
    ]
    context = {
        "study": study,
        "report": report,
        "view": view,
        "radius": view["width"] / 40,
        "pictures": pictures,
        "before": matchup.original_token if matchup.original_image else "",
    }
    return render(request, "studies/report.html", context)
