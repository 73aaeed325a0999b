"""Fault labels: the page of an expert, which tells nothing of who made what, and that of a job."""

import uuid
from typing import Any

from django import forms
from django.contrib import messages
from django.contrib.auth.models import User
from django.core.exceptions import PermissionDenied
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.views.decorators.cache import never_cache

from arena.errors import AlreadyLabelled, LabellingClosed
from arena.jobs import queries
from arena.jobs.exports.faults import fault_table
from arena.jobs.pages.jobs import job_crumbs
from arena.jobs.services import close_labelling, open_labelling, save_label
from arena.models import FaultLabel, LabellingRound
from arena.people.queries import by_pseudonym, experts
from arena.shell.access import ADMIN, EXPERT, STAFF, form_for, get_user
from arena.shell.accounts import top_role
from arena.shell.acts import Confirmation, ask, is_sure, refusals_in, refusals_told
from arena.shell.forms import offer
from arena.voting.queries.showings import original_beside
from augment.models import GenerationJob
from augment.services.judging import FaultClass


class LabelForm(forms.Form):
    """The faults that an expert sees in one picture: any of three, or none."""

    task = forms.UUIDField()
    position = forms.BooleanField(required=False)
    heading = forms.BooleanField(required=False)
    logic = forms.BooleanField(required=False)
    note = forms.CharField(required=False, max_length=2000)

    def faults(self) -> frozenset[FaultClass]:
        """Return the ticked classes of a valid form."""
        return frozenset(fault for fault in FaultClass if self.cleaned_data[fault.value])


class LabellingForm(forms.Form):
    """A new labelling of a job."""

    name = forms.CharField(
        max_length=120, strip=True, help_text="Experts see it: it should name no contestant."
    )
    experts = forms.MultipleChoiceField(error_messages={"required": "Choose at least one expert."})
    seed = forms.IntegerField(
        label="Seed of the order", initial=1, min_value=0, max_value=2**63 - 1
    )

    def __init__(self, *args: Any, experts: list[User], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.accounts = [user for user in experts if not user.person.is_simulated]
        offer(self, "experts", [(user.username, user.username) for user in self.accounts])


@form_for(EXPERT)
@never_cache
def label_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show the next picture; a label is saved and followed by a redirect."""
    expert = get_user(request)
    labelling = queries.labelling_progress(expert=expert, code=code)
    if request.method == "POST":
        _save(request, expert)
        return redirect("label", code=code)
    task = queries.next_task(labelling=labelling, expert=expert)
    context = {
        **{"labelling": labelling, "task": task, "faults": list(FaultClass)},
        "has_original": task is not None and bool(original_beside(task.augmentation)),
    }
    return render(request, "label/label.html" if task else "label/done.html", context)


def _save(request: HttpRequest, expert: User) -> None:
    form = LabelForm(request.POST)
    if not form.is_valid():
        messages.error(request, "That could not be read; nothing was saved.")
        return
    task, note = form.cleaned_data["task"], form.cleaned_data["note"]
    try:
        label = save_label(expert=expert, task_code=task, faults=form.faults(), note=note)
    except AlreadyLabelled as error:
        messages.info(request, str(error))
    except LabellingClosed as error:
        messages.error(request, str(error))
    else:
        messages.success(request, f"Saved. {_guess(label)}")


def _guess(label: FaultLabel) -> str:
    """Return the first guess of the checks, revealed only after the label."""
    if label.guessed_position is None:
        return "The automatic checks could not look at that picture."
    guessed = [fault.value for fault in FaultClass if getattr(label, f"guessed_{fault.value}")]
    return f"The automatic checks had guessed: {', '.join(guessed) or 'no fault'}."


@form_for(*STAFF)
def faults_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show what was labelled in a job, and the form that opens a labelling."""
    job = get_object_or_404(GenerationJob, code=code)
    form = LabellingForm(request.POST or None, experts=by_pseudonym(experts()))
    if request.method == "POST" and top_role(request.user) != ADMIN:
        raise PermissionDenied
    if form.is_bound and form.is_valid():
        with refusals_in(form):
            labelling = open_labelling(job=job, **form.cleaned_data, actor=get_user(request))
            messages.success(request, f"“{labelling.name}” is open; its experts can label now.")
            return redirect("faults", code=job.code)
    context = {
        "job": job,
        "form": form,
        "table": fault_table(job),
        "labellings": queries.find_labellings(job=job),
    }
    return render(request, "label/job.html", context, status=422 if form.errors else 200)


@form_for(ADMIN)
def close(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Take no more labels; there is no way back, so ask first."""
    labelling = get_object_or_404(LabellingRound.objects.select_related("job"), code=code)
    if is_sure(request):
        with refusals_told(request):
            close_labelling(labelling=labelling, actor=get_user(request))
            messages.success(request, f"“{labelling.name}” is closed; its labels stay.")
    elif labelling.closed_at is None:
        labels = FaultLabel.objects.filter(task__labelling=labelling).count()
        missing = labelling.tasks.count() - labels
        back = reverse("faults", args=[labelling.job.code])
        question = Confirmation(
            title=f"Close the labelling “{labelling.name}”?",
            facts=(
                f"Labels saved, which stay: {labels}.",
                f"Planned labels that will be missing: {missing}.",
                "It takes no more labels. This can’t be taken back.",
            ),
            button="Close the labelling",
            back=back,
            crumbs=(*job_crumbs(labelling.job), ("Fault labels", back)),
        )
        return ask(request, question)
    return redirect("faults", code=labelling.job.code)
