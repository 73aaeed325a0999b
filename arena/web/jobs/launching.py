"""The page of a new job: choose, see what it would use, try one scenario first, launch."""

from __future__ import annotations

import uuid
from decimal import Decimal
from functools import partial
from typing import Any, cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.db import transaction
from django.http import HttpRequest, HttpResponse
from django.shortcuts import redirect, render
from django.views.decorators.http import require_http_methods

from arena.jobs.pages.jobs import send_rows
from arena.jobs.pages.launching import LaunchForm
from arena.scenarios import queries
from arena.site.access import ADMIN, allow_only
from augment.errors import AugmentError
from augment.models import Contestant, EndpointModel, GenerationJob
from augment.services.running import jobs as service
from augment.services.running.matrix import add_cells, matrix_text, read_matrix

LONGEST_FILE = 1_000_000
LONGEST_NAME = 120


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def new_job_page(request: HttpRequest) -> HttpResponse:
    """Choose contestants and scenarios, then launch."""
    if "read" in request.POST:
        return _read(request)
    form = _form(request, request.POST or None, initial=_like(request))
    if "matrix" in request.POST:
        return _matrix(request, form)
    if "estimate" in request.POST:
        return _estimated(request, form)
    if request.method == "POST" and form.is_valid():
        try:
            job = _launch(request, form)
        except AugmentError as error:
            form.add_error(None, str(error))
        else:
            messages.success(request, f"“{job.name}” is launched.")
            return redirect("job", code=job.code)
    return _page(request, form, status=422 if form.errors else 200)


# --- Private -----------------------------------------------------------------------------------


def _form(request: HttpRequest, data: Any, *, initial: dict[str, Any] | None = None) -> LaunchForm:
    return LaunchForm(
        data,
        initial=initial,
        contestants=list(
            Contestant.objects.filter(retired_at=None).select_related("endpoint").order_by("name")
        ),
        groups=queries.by_type(queries.set_asked(request.GET.get("set"))),
        models=list(
            EndpointModel.objects.select_related("endpoint").order_by("endpoint__label", "model")
        ),
    )


def _page(
    request: HttpRequest, form: LaunchForm, *, status: int = 200, **more: object
) -> HttpResponse:
    chosen_set = queries.set_asked(request.GET.get("set"))
    context = {"form": form, "sets": queries.set_choices(chosen_set), **more}
    return render(request, "jobs/new.html", context, status=status)


def _like(request: HttpRequest) -> dict[str, Any]:
    """What the form is filled with: another job where the address names one, else nothing."""
    try:
        code = uuid.UUID(request.GET.get("like", ""))
    except ValueError:
        return {}
    job = GenerationJob.objects.filter(code=code).first()
    if job is None:
        return {}
    caps = {"cap_usd": job.cap_usd, "cap_calls": job.cap_calls, "cap_tokens": job.cap_tokens}
    found: dict[str, Any] = {
        "name": f"{job.name} (2)"[:LONGEST_NAME],
        "contestants": list(job.contestants.values_list("slug", flat=True)),
        "scenarios": list(job.scenarios.values_list("slug", flat=True)),
        "samples": job.samples,
        "is_fresh": job.is_fresh,
        **{name: value for name, value in caps.items() if value is not None},
    }
    if found.get("cap_usd") is not None:
        found["cap_usd"] = f"{found['cap_usd'].normalize():f}"
    plan = job.full_plan
    return found | plan if plan is not None and request.GET.get("all") == "1" else found


def _estimated(request: HttpRequest, form: LaunchForm) -> HttpResponse:
    """The page as it came in, with what the job would use; nothing is launched."""
    more: dict[str, Any] = {}
    try:
        found = form.estimated()
    except AugmentError as error:
        form.add_error(None, str(error))
    else:
        cap = form.cleaned_data.get("cap_usd")
        more |= {"estimate": found, "cap_usd": cap}
        if found is not None and cap is not None:
            more["rows_within"] = found.rows_within(cap)
    return _page(request, form, **more)


def _matrix(request: HttpRequest, form: LaunchForm) -> HttpResponse:
    """What is chosen as a file for `generate --matrix`; a name is not needed for it."""
    form.is_valid()
    form.errors.pop("name", None)
    if form.errors:
        return _page(request, form, status=422)
    text = matrix_text(
        form.chosen_rows(),
        form.cleaned_data["scenarios"],
        samples=form.cleaned_data["samples"],
        name=form.cleaned_data.get("name", ""),
    )
    return HttpResponse(
        text,
        content_type="application/yaml; charset=utf-8",
        headers={"Content-Disposition": 'attachment; filename="matrix.yaml"'},
    )


def _read(request: HttpRequest) -> HttpResponse:
    """The form filled in from a matrix file; contestants that it has in full are made."""
    file = request.FILES.get("file")
    problem = ""
    if file is None:
        problem = "Choose a matrix file."
    elif file.size is None or file.size > LONGEST_FILE:
        problem = "The file is too long for a matrix: at most 1 MB."
    else:
        try:
            found = read_matrix(file.read().decode(), actor=cast(User, request.user))
        except UnicodeDecodeError:
            problem = "The file is not UTF-8."
        except AugmentError as error:
            problem = str(error)
    if problem:
        return _page(request, _form(request, None), status=422, file_problem=problem)
    for slug in found.made:
        messages.success(request, f"“{slug}” is added.")
    initial = {
        "name": found.name or "",
        "contestants": list(found.contestants),
        "scenarios": list(found.scenarios),
        "samples": found.samples,
    }
    return _page(request, _form(request, None, initial=initial))


def _launch(request: HttpRequest, form: LaunchForm) -> GenerationJob:
    """The job; of one that tries first, one scenario with a memory of the rest."""
    actor, chosen = cast(User, request.user), form.cleaned_data
    where, samples, name, plan = chosen["scenarios"], chosen["samples"], chosen["name"], None
    if "try" in request.POST:
        plan = _plan(form)
        where, samples = where[:1], 1
        name = f"{name}, first try"
    with transaction.atomic():
        made = add_cells(form.chosen_cells_value(), actor=actor)
        job = service.launch(
            name=name[:LONGEST_NAME],
            contestants=list(dict.fromkeys([*chosen["contestants"], *made])),
            scenarios=where,
            caps=form.caps(),
            samples=samples,
            is_fresh=chosen["is_fresh"],
            full_plan=plan,
            actor=actor,
        )
        transaction.on_commit(partial(send_rows, request, job.pk))
    return job


def _plan(form: LaunchForm) -> dict[str, Any]:
    """What was chosen for the whole job, as the form's fields have it."""
    names = ("name", "scenarios", "samples", "is_fresh", "cap_usd", "cap_calls", "cap_tokens")
    chosen = {name: form.cleaned_data.get(name) for name in names}
    return {
        name: str(value) if isinstance(value, Decimal) else value
        for name, value in chosen.items()
        if value is not None
    }
