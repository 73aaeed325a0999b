"""Pages of studies for admins and researchers: progress, reports and files, never who leads."""

import math
import uuid
from typing import Any

from django.contrib import messages
from django.contrib.auth.models import User
from django.core.exceptions import PermissionDenied
from django.db import transaction
from django.http import FileResponse, Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.text import slugify
from django.views.decorators.http import require_POST

from arena.exports.formats import attach
from arena.models import Study, StudyFile
from arena.people.queries import by_pseudonym, experts
from arena.shell import acts, pictures, sending
from arena.shell.access import ADMIN, STAFF, act_for, allow_only, form_for, get_user, page_for
from arena.shell.listing import read_listing, read_page
from arena.studies import queries
from arena.studies.forms import AuthorForm, HandOverForm
from arena.studies.services import files
from arena.studies.services.opening import cancel_study, preregistration_sha256
from arena.studies.services.plan import PLAN_INPUTS, read_opened_plan
from arena.studies.services.taking_part import hand_over
from arena.voting.queries.ballots import find_undrawn, is_being_drawn
from arena.voting.queries.blinding import ResultsAccess, is_imported, results_access
from arena.voting.services.drawing import MB_PER_PAIR
from augment.services import InputKind

STUDIES_AT_ONCE = 25

DRAFT = "draft"
"""What the list calls the state of a study that is still set up."""


@page_for(*STAFF)
def studies_page(request: HttpRequest) -> HttpResponse:
    """Studies with their bars, page by page; before the first ones the drafts."""
    states = [(DRAFT, "Draft"), *Study.State.choices]
    listing = read_listing(request, {"state": ("State", states)})
    rows = listing.narrow(queries.list_studies(), "name", by=["state"])
    page = read_page(request, rows, size=STUDIES_AT_ONCE)
    shows_drafts = page.number == 1 and listing.find_choice("state") in ("", DRAFT)
    context = {
        "studies": queries.count_progress(page.object_list),
        "drafts": list(queries.find_drafts(listing.search)) if shows_drafts else [],
        "page": page,
        "listing": listing,
    }
    return render(request, "studies/list.html", context)


@page_for(*STAFF)
def study_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show each expert's progress and link, and the rules."""
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    if is_imported(study):
        return redirect("results", code=code)
    study_plan, (line,) = read_opened_plan(study), queries.count_progress([study])
    lines, export = queries.expert_lines(study), export_place(study, get_user(request))
    undrawn_pairs = find_undrawn(study).count()
    if undrawn_pairs and not is_being_drawn(study):
        sending.send_pictures(study.pk)
    long = (InputKind.TEXT, InputKind.NAMES, InputKind.LINES)
    context = {
        "line": line,
        "export": export,
        **acts.wait_for_workers(waits=export["is_waiting"] or bool(undrawn_pairs)),
        "undrawn": undrawn_pairs,
        "undrawn_mb": math.ceil(undrawn_pairs * MB_PER_PAIR),
        "lines": lines,
        "done": sum(not line.tally.left for line in lines),
        "without_link": sum(line.waits_for_link for line in lines),
        "shows_links": any(line.may_be_invited or line.invitation for line in lines),
        "contestants": study.contestants.all(),
        "rules": [
            (field.label, field.show(getattr(study_plan, field.name)))
            for field in PLAN_INPUTS
            if field.kind not in long
        ],
        "plan": study_plan,
        "reports": queries.list_reports(study),
        "accounts": by_pseudonym(experts()),
        "frozen": preregistration_sha256(study),
        "authorships": queries.list_authorships(study),
        "author_form": AuthorForm(study=study),
    }
    return render(request, "studies/study.html", context)


@page_for(*STAFF)
def preregistration_file(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Return the preregistration, byte for byte as frozen at the opening."""
    study = get_object_or_404(Study, code=code)
    if not study.preregistration:
        raise Http404
    name = f"{slugify(study.name) or 'study'}-preregistration.json"
    return attach(study.preregistration, "application/json", name)


# --- Acts --------------------------------------------------------------------------------------


@act_for(ADMIN, back="study")
def hand_over_pairs(request: HttpRequest, code: uuid.UUID) -> HttpResponse | None:
    """Let others judge what an expert has not judged; asks first."""
    study = get_object_or_404(Study, code=code)
    if acts.wants_to_change(request):
        return None
    form = HandOverForm(
        request.POST,
        givers=list(study.experts.values_list("username", flat=True)),
        takers=[user.username for user in experts()],
    )
    if not form.is_valid():
        acts.tell_errors(request, form)
        return None
    giver, takers = form.cleaned_data["giver"], form.cleaned_data["takers"]
    if not acts.is_sure(request):
        question = study_question(
            study,
            f"Hand over what {giver} has not judged?",
            f"It is shared out among: {', '.join(takers)}.",
            f"{giver} no longer sees it; votes that were given stay. This can’t be taken back.",
            button="Hand over",
        )
        return acts.ask(request, question)
    taken = hand_over(study=study, username=giver, to=takers, actor=get_user(request))
    shares = ", ".join(f"{name} {votes}" for name, votes in taken.items())
    messages.success(request, f"Handed over: {shares}.")
    return None


@form_for(ADMIN)
def cancel(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Give the study up, without results; its name has to be typed."""
    study = get_object_or_404(Study, code=code)
    if not acts.is_typed(request, study.name):
        if study.state != Study.State.OPEN:
            return redirect("study", code=code)
        (line,) = queries.count_progress([study])
        question = study_question(
            study,
            f"Cancel the study “{study.name}”?",
            "No more votes are taken, and nobody ever sees results. This can’t be taken back.",
            f"Votes that stay and can be exported as votes: {line.voted}.",
            "To end it with results, close it instead. Its settings can be used again for "
            "another.",
            button="Cancel the study",
            phrase=study.name,
            asks_why=True,
        )
        return acts.ask(request, question)
    with acts.refusals_told(request):
        cancel_study(study=study, why=request.POST.get(acts.WHY, ""), actor=get_user(request))
        messages.success(request, "Cancelled. Its votes stay.")
    return redirect("study", code=code)


def study_question(
    study: Study, title: str, *facts: str, button: str, **more: Any
) -> acts.Confirmation:
    """Return a question about an act on a study, to be asked before it is done."""
    back = reverse("study", args=[study.code])
    crumbs = (("Studies", reverse("studies")), (study.name, back))
    return acts.Confirmation(
        title=title, facts=facts, button=button, back=back, crumbs=crumbs, **more
    )


# --- Files -------------------------------------------------------------------------------------


def export_place(study: Study, user: User) -> dict[str, Any]:
    """Return the available exports: whether results may be read, and files with obstacles."""
    may_read = results_access(user=user, study=study) is ResultsAccess.FULL
    rows, offered = files.newest_study_files(study), []
    for kind in files.SHOWS_RESULTS if is_imported(study) else StudyFile.Kind:
        obstacle = files.why_not(study, kind)
        if kind in files.SHOWS_RESULTS and not may_read:
            obstacle = obstacle or "It shows results, which you have not opened."
        offered.append({"kind": kind, "row": rows.get(kind.value), "obstacle": obstacle})
    return {
        "may_read": may_read,
        "is_imported": is_imported(study),
        "files": offered,
        "is_waiting": any(row.is_waiting for row in rows.values()),
    }


@allow_only(*STAFF)
@require_POST
def ask_for_file(request: HttpRequest, code: uuid.UUID, kind: str) -> HttpResponse:
    """Leave a file to a worker; twice does no harm."""
    study = _study_for(request, code, kind)
    with acts.refusals_told(request), transaction.atomic():
        row = files.ask_for_study_file(study=study, kind=kind, actor=get_user(request))
        acts.send_later(request, row)
        messages.success(request, "A worker writes the file; it is offered here when ready.")
    if is_imported(study):
        return redirect("results", code=code)
    return redirect(reverse("study", args=[code]) + "#export")


@page_for(*STAFF)
def download(request: HttpRequest, code: uuid.UUID, kind: str) -> FileResponse:
    """The newest one, once it is ready."""
    row = files.newest_study_files(_study_for(request, code, kind)).get(kind)
    return pictures.file_response(row if row and row.state == StudyFile.State.READY else None)


def _study_for(request: HttpRequest, code: uuid.UUID, kind: str) -> Study:
    """Return the study, for whoever may have this file of it."""
    study = get_object_or_404(Study.objects.select_related("vote_file"), code=code)
    if kind not in StudyFile.Kind.values:
        raise Http404
    access = results_access(user=get_user(request), study=study)
    if kind in files.SHOWS_RESULTS and access is not ResultsAccess.FULL:
        raise PermissionDenied
    return study
