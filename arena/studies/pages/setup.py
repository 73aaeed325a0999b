"""Setting a study up by one form, over several sittings as a draft; or by a file of votes."""

import re
import uuid
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from django import forms
from django.contrib import messages
from django.contrib.auth.models import User
from django.core.files.uploadedfile import UploadedFile
from django.db import transaction
from django.http import HttpRequest, HttpResponse, JsonResponse, QueryDict
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse

from arena.errors import NothingToPlan
from arena.models import Study, StudyDraft
from arena.people.queries import by_pseudonym, experts
from arena.scenarios import queries
from arena.scenarios.services import was_too_large
from arena.shell.access import ADMIN, act_for, form_for, get_user
from arena.shell.acts import is_sure, refusals_in, refusals_told, tell_errors
from arena.studies.forms import StudyForm
from arena.studies.queries import (
    FINISHED,
    find_missing,
    latest_contestants,
    list_offered,
    usual_checks,
)
from arena.studies.services import drafts, importing, opening, outlook, plan
from arena.voting.screen import AHEAD, vote_context
from arena.voting.services.drawing import show_own_pictures
from arena.voting.services.practice import has_practice
from augment.models import GenerationJob
from augment.services import read_code
from augment.tasks import send_checks

USUAL = "paper"
"""The preset of a new form."""

KEEP, PREVIEW = "keep", "preview"
"""What the buttons send that save a draft; the second one then shows its first pairs."""

MOST_MB = 20
"""Some 200,000 votes, read while the page waits; more goes by `manage.py import_votes`."""

TOO_LARGE = (
    f"The file has more than {MOST_MB} MB. Send a smaller one, or use “manage.py import_votes”."
)
_ODD = re.compile(r"[^A-Za-z0-9._ -]+")


@act_for(ADMIN, back="studies")
def discard(request: HttpRequest, code: uuid.UUID) -> None:
    """Remove a draft."""
    draft = get_object_or_404(StudyDraft, code=code)
    drafts.discard_draft(draft=draft, actor=get_user(request))
    messages.success(request, "The draft is discarded.")


@act_for(ADMIN, back="study")
def use_again(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """A new draft with the settings of a study."""
    study = get_object_or_404(Study, code=code)
    draft = drafts.draft_like(study=study, actor=get_user(request))
    messages.success(request, f"A draft with the settings of “{study.name}”.")
    return redirect("study-draft", code=draft.code)


# --- The form ----------------------------------------------------------------------------------


@form_for(ADMIN)
def set_up_page(request: HttpRequest, code: uuid.UUID | None = None) -> HttpResponse:
    """Choose contestants, scenarios and experts; see the outlook; opening plans every pair.

    Of a draft, with what was saved, and what of it is gone meanwhile.
    """
    rows = StudyDraft.objects.select_related("changed_by__person")
    draft, posted = get_object_or_404(rows, code=code) if code else None, request.POST
    entered = _read_form(posted) if posted else _initial(draft, request.GET.get("job", ""))
    if (preset := posted.get("preset")) in plan.PRESETS:
        entered |= _quantities(preset)
    form = _form(entered)
    if KEEP in posted or PREVIEW in posted:
        return _keep(request, draft, form)
    if "draw" in posted:  # twice does no harm
        with refusals_told(request):
            send_checks(get_user(request).pk)
            messages.success(request, "Workers draw the missing attention checks.")
    if is_sure(request) and form.is_valid():
        with refusals_in(form):
            study = drafts.open_draft(
                form.study_plan(),
                draft=draft,
                revision=_revision(request),
                actor=get_user(request),
            )
            messages.success(request, f"“{study.name}” is open; its experts can vote now.")
            return redirect("study", code=study.code)
    revision = posted.get("revision", "") or (draft.revision if draft else "")
    return _show(request, draft, form, revision, 422 if is_sure(request) else 200)


def _keep(request: HttpRequest, draft: StudyDraft | None, form: StudyForm) -> HttpResponse:
    """Save what stands in the form, whether it makes a study or not."""
    with refusals_told(request):
        draft_row = drafts.keep_draft(
            entered=form.data, draft=draft, revision=_revision(request), actor=get_user(request)
        )
        if PREVIEW in request.POST:
            return redirect("study-draft-preview", code=draft_row.code)
        messages.success(request, "Saved as a draft: no expert sees it, nothing is planned yet.")
        return redirect("study-draft", code=draft_row.code)
    # Shown with the revision of whoever was faster, so that saving again replaces theirs.
    draft = draft and StudyDraft.objects.filter(pk=draft.pk).first()
    return _show(request, draft, form, draft.revision if draft else "", 409)


def _show(
    request: HttpRequest, draft: StudyDraft | None, form: StudyForm, revision: object, status: int
) -> HttpResponse:
    estimate = form.estimate()
    context = {
        "form": form if is_sure(request) else form.as_entered(),
        "draft": draft,
        "revision": revision,
        "missing": find_missing(draft) if draft else [],
        "presets": plan.PRESETS,
        "chosen": request.POST.get("preset", "" if request.POST or draft else USUAL),
        "estimate": estimate,
        "compared": outlook.compare_votes(estimate) if estimate else [],
    }
    return render(request, "studies/new.html", context, status=status)


def _form(data: dict[str, Any]) -> StudyForm:
    return StudyForm(
        data,
        contestants=list(list_offered().select_related("endpoint").order_by("name")),
        groups=queries.by_type(),
        experts=by_pseudonym(experts()),
        jobs=list(GenerationJob.objects.all()),
    )


def _read_form(posted: QueryDict) -> dict[str, Any]:
    """Return the form as it came in; whole types are the scenarios that they have now."""
    entered = posted.dict() | {name: posted.getlist(name) for name in drafts.NAMES}
    groups = [group for group in queries.by_type() if group.type in posted.getlist("types")]
    whole = [row.slug for group in groups for row in group.scenarios]
    return entered | {"scenarios": [*posted.getlist("scenarios"), *whole], "types": []}


def _revision(request: HttpRequest) -> int:
    text = request.POST.get("revision", "")
    return int(text) if text.isascii() and text.isdigit() and len(text) < 9 else 0


def _initial(draft: StudyDraft | None, job_code: str) -> dict[str, Any]:
    """Return the draft's values, or a common default, of one job where that is given."""
    if draft is not None:
        return dict(draft.entered)
    job = GenerationJob.objects.filter(code=read_code(job_code)).first()
    people = experts().filter(person__is_simulated=False)
    return _quantities(USUAL) | {
        "practice": has_practice(),
        "contestants": latest_contestants(job),
        "scenarios": [FINISHED if job is None else f"job:{job.code}"],
        "experts": [user.username for user in people],
    }


def _quantities(preset: str) -> dict[str, Any]:
    """Return a preset's quantities; no checks where none were drawn."""
    return plan.PRESETS[preset].quantities | ({} if usual_checks() else {"checks": 0.0})


@form_for(ADMIN)
def preview_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The first pairs as experts would see them; what the script sends is taken and forgotten."""
    draft = get_object_or_404(StudyDraft, code=code)
    if request.method == "POST":
        return JsonResponse({"saved": 0, "total": 0, "skipped": 0, "next": []})
    if "study" in request.GET:  # the script asks for more pairs
        return JsonResponse([], safe=False)
    form = _form(draft.entered)
    if form.is_valid():
        with refusals_in(form), transaction.atomic():
            study = opening.open_study(form.study_plan(), actor=get_user(request))
            show_own_pictures(study, pairs=AHEAD)
            context = _first_pairs(study, draft) | {"draft": draft}
            shown = render(request, "studies/preview.html", context)
            transaction.set_rollback(True)
            return shown
    tell_errors(request, form)
    return redirect("study-draft", code=code)


def _first_pairs(study: Study, draft: StudyDraft) -> dict[str, Any]:
    """Return the pairs that one of the experts sees first, with addresses that stay."""
    here = reverse("study-draft-preview", args=[draft.code])
    expert = study.experts.order_by("username")[0]
    context = vote_context(study, expert, change="")
    if context is None:
        raise NothingToPlan("No pair is shown to anybody: nobody can tell these pictures apart.")
    for shown in context["given"]["pairs"]:
        rows = study.matchups.select_related("left", "right", "scenario")
        matchup = rows.get(code=shown["matchup"])
        shown["a"] = reverse("picture", args=["augmentation", matchup.left.code])
        shown["b"] = reverse("picture", args=["augmentation", matchup.right.code])
        shown["original"] = reverse("picture", args=["original", matchup.scenario.code])
    urls = dict.fromkeys(context["given"]["urls"], here)
    urls |= {"matchups": f"{here}?study", "page": reverse("study-draft", args=[draft.code])}
    context["given"] |= {"outbox": "arena preview", "urls": urls}
    return context


# --- Votes from a file -------------------------------------------------------------------------


class VoteFileForm(forms.Form):
    """A file and what its study is called."""

    name = forms.CharField(max_length=120, strip=True, label="Name of the study")
    file = forms.FileField(
        label="File", allow_empty_file=True, error_messages={"required": "Choose a file."}
    )
    is_simulated = forms.BooleanField(required=False)

    def clean_file(self) -> "UploadedFile[bytes]":
        """Refuse a file that is too large for a page to wait for."""
        file: UploadedFile[bytes] = self.cleaned_data["file"]
        if (file.size or 0) > MOST_MB * 1_000_000:
            raise forms.ValidationError(TOO_LARGE)
        return file


@form_for(ADMIN)
def upload_votes_page(request: HttpRequest) -> HttpResponse:
    """The form; what can't be read is said with its line, and nothing is kept."""
    form = VoteFileForm(request.POST or None, request.FILES or None)
    if was_too_large(request.META):
        form.is_valid()
        form.errors.pop("file", None)
        form.add_error("file", TOO_LARGE)
    elif form.is_valid():
        with refusals_in(form):
            imported = _import(form, get_user(request))
            text = f"Imported: votes {imported.votes}, contestants {imported.contestants}."
            messages.success(request, f"{text} {imported.note}".rstrip())
            return redirect("results", code=imported.study.code)
    context = {"form": form, "most_mb": MOST_MB}
    return render(request, "studies/votes.html", context, status=422 if form.errors else 200)


def _import(form: VoteFileForm, actor: User) -> importing.ImportedVotes:
    file: UploadedFile[bytes] = form.cleaned_data["file"]
    with TemporaryDirectory(prefix="arena-votes-") as folder:
        # The reader's errors name the file: as its sender called it, in plain letters.
        path = Path(folder) / (_ODD.sub("_", file.name or "")[-100:].lstrip(".") or "votes")
        path.write_bytes(file.read())
        return importing.import_votes(
            path=path,
            name=form.cleaned_data["name"],
            is_simulated=form.cleaned_data["is_simulated"],
            actor=actor,
        )
