"""What an admin is asked before a labelling opens or closes."""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.db import transaction
from django.http import Http404, HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.utils.text import slugify
from django.views.decorators.cache import never_cache
from django.views.decorators.http import require_http_methods, require_safe

from arena.errors import AlreadyLabelled, ArenaError, LabellingClosed, NotYours
from arena.exports.formats import format_named
from arena.jobs import queries
from arena.jobs.exports.faults import FORMATS, fault_table
from arena.jobs.queries import of_job
from arena.jobs.services import close_labelling, open_labelling, save_label
from arena.models import FaultLabel, LabellingRound
from arena.queries.people import by_pseudonym, experts, role_of
from arena.queries.voting.showings import original_beside
from arena.web.access import ADMIN, EXPERT, STAFF, allow_only
from arena.web.forms import LabelForm, LabellingForm
from arena.web.questions import Confirmation, ask, is_sure, wants_to_change
from augment.errors import AugmentError, UnknownName
from augment.models import GenerationJob
from augment.services.judging.findings import FaultClass


def opening(job: GenerationJob, *, name: str, experts: Sequence[str], seed: int) -> Confirmation:
    """Counted by opening it and taking that back at once.

    Raises:
        ArenaError, AugmentError: It can't be opened.
    """
    with transaction.atomic():
        labelling = open_labelling(job=job, name=name, experts=experts, seed=seed)
        tasks = labelling.tasks.count()
        pictures = labelling.tasks.values("augmentation").distinct().count()
        transaction.set_rollback(True)
    facts = (
        f"Pictures: {pictures}. Experts: {len(experts)}. Labels planned: {tasks}.",
        "Experts see it at once; who labels, and in which order, can’t be changed afterwards.",
    )
    return Confirmation(
        title=f"Open the labelling “{name}”?",
        facts=facts,
        button="Open the labelling",
        back=reverse("faults", args=[job.code]),
        is_final=False,
        crumbs=_crumbs(job),
    )


def closing(labelling: LabellingRound) -> Confirmation:
    """What is there, and what will never come."""
    line = next(one for one in of_job(labelling.job) if one.labelling.pk == labelling.pk)
    facts = (
        f"Labels saved, which stay: {line.labelled}.",
        f"Planned labels that will be missing: {line.left}.",
        "It takes no more labels. This can’t be taken back.",
    )
    return Confirmation(
        title=f"Close the labelling “{labelling.name}”?",
        facts=facts,
        button="Close the labelling",
        back=reverse("faults", args=[labelling.job.code]),
        crumbs=_crumbs(labelling.job),
    )


def _crumbs(job: GenerationJob) -> tuple[tuple[str, str], ...]:
    return (
        ("Jobs", reverse("jobs")),
        (job.name, reverse("job", args=[job.code])),
        ("Fault labels", reverse("faults", args=[job.code])),
    )


@allow_only(EXPERT)
@never_cache
@require_http_methods(["GET", "HEAD", "POST"])
def label_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The next picture; a label is saved and followed by a redirect."""
    expert = cast(User, request.user)
    try:
        progress = queries.labelling_of(expert=expert, code=code)
        if request.method == "POST":
            return _save(request, expert, code)
    except NotYours as error:
        raise Http404 from error
    task = queries.next_task(labelling=progress.labelling, expert=expert)
    context = {
        **{"progress": progress, "task": task, "faults": list(FaultClass)},
        "has_original": task is not None and bool(original_beside(task.augmentation)),
    }
    return render(request, "label/label.html" if task else "label/done.html", context)


@allow_only(*STAFF)
@require_http_methods(["GET", "HEAD", "POST"])
def faults_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """What was labelled in a job, and the form that opens a labelling."""
    job = get_object_or_404(GenerationJob, code=code)
    form = LabellingForm(request.POST or None, experts=by_pseudonym(experts()))
    if request.method == "POST":
        if role_of(request.user) != ADMIN:
            return HttpResponse(status=403)
        if form.is_valid() and not wants_to_change(request):
            answer = _open(request, job, form)
            if answer is not None:
                return answer
    context = {
        "job": job,
        "form": form,
        "table": fault_table(job),
        "labellings": queries.of_job(job),
    }
    return render(request, "label/job.html", context, status=422 if form.errors else 200)


@allow_only(*STAFF)
@require_safe
def export(request: HttpRequest, code: uuid.UUID, form: str) -> HttpResponse:
    """The faults of a job as a file."""
    job = get_object_or_404(GenerationJob, code=code)
    try:
        chosen = format_named(FORMATS, form)
    except UnknownName as error:
        raise Http404 from error
    name = f"{slugify(job.name) or 'job'}-faults.{chosen.suffix}"
    return HttpResponse(
        chosen.write(fault_table(job)),
        content_type=chosen.content_type,
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def close(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Take no more labels; there is no way back, so it asks first."""
    labelling = get_object_or_404(LabellingRound.objects.select_related("job"), code=code)
    if not is_sure(request):
        if labelling.closed_at is not None:
            return redirect("faults", code=labelling.job.code)
        return ask(request, closing(labelling))
    try:
        close_labelling(labelling=labelling, actor=cast(User, request.user))
    except ArenaError as error:
        messages.error(request, str(error))
    else:
        messages.success(request, f"“{labelling.name}” is closed; its labels stay.")
    return redirect("faults", code=labelling.job.code)


# Private


def _save(request: HttpRequest, expert: User, code: uuid.UUID) -> HttpResponse:
    form = LabelForm(request.POST)
    if not form.is_valid():
        messages.error(request, "That could not be read; nothing was saved.")
        return redirect("label", code=code)
    try:
        label = save_label(
            expert=expert,
            task_code=form.cleaned_data["task"],
            faults=form.faults(),
            note=form.cleaned_data["note"],
        )
    except AlreadyLabelled as error:
        messages.info(request, str(error))
    except LabellingClosed as error:
        messages.error(request, str(error))
    else:
        messages.success(request, " ".join(("Saved.", _guess(label))))
    return redirect("label", code=code)


def _guess(label: FaultLabel) -> str:
    """What the checks had guessed, told only now."""
    if label.guessed_position is None:
        return "The automatic checks could not look at that picture."
    names = {
        FaultClass.POSITION: "position",
        FaultClass.HEADING: "heading",
        FaultClass.LOGIC: "logic",
    }
    seen = [name for fault, name in names.items() if getattr(label, f"guessed_{fault.value}")]
    queries = ", ".join(seen) or "no fault"
    return f"The automatic checks had guessed: {queries}."


def _open(request: HttpRequest, job: GenerationJob, form: LabellingForm) -> HttpResponse | None:
    """The page that asks first, or where to go once it is open; None where it is refused."""
    given = {name: form.cleaned_data[name] for name in ("name", "experts", "seed")}
    try:
        if not is_sure(request):
            return ask(request, opening(job, **given))
        labelling = open_labelling(job=job, **given, actor=cast(User, request.user))
    except (ArenaError, AugmentError) as error:
        form.add_error(None, str(error))
        return None
    messages.success(request, f"“{labelling.name}” is open; its experts can label now.")
    return redirect("faults", code=job.code)
