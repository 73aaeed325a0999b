"""Submissions: sent by entrants, read by workers, accepted or declined by admins."""

import uuid

from django import forms
from django.contrib import messages
from django.core.paginator import Paginator
from django.db import transaction
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render

from arena.scenarios.queries import is_waiting, submissions_for
from arena.scenarios.services import was_too_large
from arena.shell import accounts, acts, listing
from arena.shell.access import ADMIN, ENTRANT, STAFF, act_for, form_for, get_user, page_for
from arena.shell.forms import RequestForm, offer
from augment.models import Benchmark, Submission
from augment.services import read_request, running, scenarios, to_inputs
from augment.services.benchmarks import submissions

AT_ONCE = 50


class SubmissionForm(forms.Form):
    """A file, and which benchmark it answers."""

    benchmark = forms.ChoiceField(label="Benchmark")
    file = forms.FileField(label="Drop the zip here, or choose it")

    def __init__(self, *args: object, **kwargs: object) -> None:
        super().__init__(*args, **kwargs)  # type: ignore[arg-type]
        rows = Benchmark.objects.filter(retired_at=None)
        offer(
            self,
            "benchmark",
            [(str(row.code), f"{row.title}, version {row.version}") for row in rows],
        )


class AcceptForm(RequestForm):
    """Name of an accepted submission, and whether it runs at once."""

    inputs = tuple(field for field in to_inputs(running.AcceptRequest) if field.name != "slug")


@page_for(*STAFF, ENTRANT)
def submissions_page(request: HttpRequest) -> HttpResponse:
    """Show staff all submissions, those that wait for them first, and entrants their own."""
    page = listing.read_page(request, submissions_for(get_user(request)), size=AT_ONCE)
    waits = any(row.state in row.UNDER_WAY for row in page.object_list)
    context = {"page": page, **acts.wait_for_workers(waits=waits)}
    return render(request, "submissions/list.html", context)


@form_for(*STAFF, ENTRANT)
def new_submission_page(request: HttpRequest) -> HttpResponse:
    """Send a submission, which a worker reads."""
    initial = {"benchmark": request.GET.get("benchmark", "")}
    form = SubmissionForm(request.POST or None, request.FILES or None, initial=initial)
    if was_too_large(request.META):
        form.add_error("file", f"At most {scenarios.most_megabytes()} MB are taken.")
    elif form.is_valid():
        with acts.refusals_in(form, "file"):
            file = form.cleaned_data["file"]
            row = submissions.keep_submission(
                Benchmark.objects.get(code=form.cleaned_data["benchmark"]),
                name=file.name,
                content=file,
                actor=get_user(request),
            )
            acts.send_later(request, row)
            return redirect("submission", code=row.code)
    context = {"form": form, "most_megabytes": scenarios.most_megabytes()}
    return render(request, "submissions/new.html", context, status=422 if form.errors else 200)


@form_for(*STAFF, ENTRANT)
def submission_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show a report, rejections first; an admin accepts here."""
    row = _find(request, code)
    is_admin = accounts.top_role(request.user) == ADMIN
    form = AcceptForm(request.POST if is_admin and request.method == "POST" else None)
    if form.is_valid():
        with acts.refusals_in(form), transaction.atomic():
            acceptance = read_request(running.AcceptRequest, form.cleaned_data)
            contestant, job = running.accept_submission(row, acceptance, actor=get_user(request))
            messages.success(request, f"“{contestant.name}” is accepted.")
            if job is None:
                return redirect("contestant", code=contestant.code)
            acts.send_later(request, job)
            return redirect("job", code=job.code)
    elif not form.is_bound:
        form.initial = {"name": row.title, "runs": True}
    page = Paginator(submissions.get_entries(row), AT_ONCE).get_page(listing.page_asked(request))
    context = {
        "submission": row,
        "form": form if is_admin and is_waiting(row) else None,
        "is_own": row.uploaded_by == request.user,
        "page": page,
        "remarks": (row.report or {}).get("remarks", ()),
        **acts.wait_for_workers(waits=row.state in row.UNDER_WAY),
    }
    status = 422 if form.errors else 200
    return render(request, "submissions/submission.html", context, status=status)


@act_for(ADMIN, back="submission")
def decline(request: HttpRequest, code: uuid.UUID) -> None:
    """Decline a submission, with the reason that its sender reads."""
    reason = request.POST.get("reason", "")
    submissions.decline_submission(_find(request, code), reason=reason, actor=get_user(request))


@act_for(*STAFF, ENTRANT, back="submission")
def withdraw(request: HttpRequest, code: uuid.UUID) -> None:
    """Take one's own submission back before it is decided."""
    own = submissions_for(get_user(request)).filter(uploaded_by=get_user(request))
    submissions.withdraw_submission(get_object_or_404(own, code=code), actor=get_user(request))
    messages.success(request, "It is withdrawn, and its file removed.")


def _find(request: HttpRequest, code: uuid.UUID) -> Submission:
    """Return a submission that this account may see, or answer 404."""
    return get_object_or_404(submissions_for(get_user(request), with_report=True), code=code)
