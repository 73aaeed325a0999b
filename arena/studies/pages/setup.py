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
from django.http import HttpRequest, HttpResponse, QueryDict
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.views.decorators.http import require_POST

from arena import tasks
from arena.models import Study, StudyDraft
from arena.people.queries import by_pseudonym, experts
from arena.results.services.vote_files import ImportedVotes, import_votes
from arena.scenarios import queries
from arena.scenarios.services import was_too_large
from arena.site.access import ADMIN, act_for, allow_only, form_for, user_of
from arena.site.acts import Confirmation, ask, is_sure, refusals_in, refusals_told, wants_to_change
from arena.site.queries import usual_checks
from arena.studies.forms import StudyForm
from arena.studies.queries import missing_of
from arena.studies.services import drafts
from arena.studies.services.experts import has_practice
from arena.studies.services.outlook import StudyEstimate
from arena.studies.services.plan import StudyPlan
from augment.models import Contestant, GenerationJob

KEEP = "keep"
"""What the button sends that saves a draft."""

SUGGESTED = {"votes_per_expert": 40, "overlap": 10}
"""What a new form holds beside the defaults of a plan."""

MOST_MB = 20
"""Some 200,000 votes, read while the page waits; more goes by `manage.py import_votes`."""

TOO_LARGE = (
    f"The file has more than {MOST_MB} MB. Send a smaller one, or use “manage.py import_votes”."
)
_ODD = re.compile(r"[^A-Za-z0-9._ -]+")


@form_for(ADMIN)
def new_study_page(request: HttpRequest) -> HttpResponse:
    """Who competes on what, and who judges; opening plans every matchup."""
    return _set_up(request, None)


@form_for(ADMIN)
def draft_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The same form with what was saved, and what of it is gone meanwhile."""
    rows = StudyDraft.objects.select_related("changed_by__person")
    return _set_up(request, get_object_or_404(rows, code=code))


@allow_only(ADMIN)
@require_POST
def discard(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Remove a draft."""
    draft = get_object_or_404(StudyDraft, code=code)
    drafts.discard_draft(draft=draft, actor=user_of(request))
    messages.success(request, "The draft is discarded.")
    return redirect("studies")


@act_for(ADMIN, back="study")
def use_again(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """A new draft with the settings of a study."""
    study = get_object_or_404(Study, code=code)
    draft = drafts.draft_like(study=study, actor=user_of(request))
    messages.success(request, f"A draft with the settings of “{study.name}”.")
    return redirect("study-draft", code=draft.code)


@act_for(ADMIN, back="study-new")
def draw_checks(request: HttpRequest) -> None:
    """Have workers draw the attention checks that are missing; twice does no harm."""
    tasks.send_checks(user_of(request).pk)
    text = "Attention checks are being drawn. Reload this page in a moment."
    messages.success(request, text)


# --- The form ----------------------------------------------------------------------------------


def _set_up(request: HttpRequest, draft: StudyDraft | None) -> HttpResponse:
    if KEEP in request.POST:
        return _keep(request, draft)
    form = _form(data=request.POST or None, initial=_initial(draft))
    if form.is_valid() and not wants_to_change(request):
        with refusals_in(form):
            study_plan = form.study_plan()
            if not is_sure(request):
                return ask(request, _opening(study_plan, draft))
            study = drafts.open_draft(
                study_plan, draft=draft, revision=_revision(request), actor=user_of(request)
            )
            messages.success(request, f"“{study.name}” is open; its experts can vote now.")
            return redirect("study", code=study.code)
    revision = request.POST.get("revision", "") or (draft.revision if draft else "")
    return _show(request, draft, form, revision, 422 if form.errors else 200)


def _keep(request: HttpRequest, draft: StudyDraft | None) -> HttpResponse:
    """Save what stands in the form, whether it makes a study or not."""
    entered = _entered(request.POST)
    with refusals_told(request):
        kept = drafts.keep_draft(
            entered=entered, draft=draft, revision=_revision(request), actor=user_of(request)
        )
        messages.success(request, "Saved as a draft: no expert sees it, nothing is planned yet.")
        return redirect("study-draft", code=kept.code)
    # Shown with the revision of whoever was faster, so that saving again replaces theirs.
    draft = draft and StudyDraft.objects.filter(pk=draft.pk).first()
    return _show(request, draft, _form(initial=entered), draft.revision if draft else "", 409)


def _show(
    request: HttpRequest, draft: StudyDraft | None, form: StudyForm, revision: object, status: int
) -> HttpResponse:
    missing = missing_of(draft) if draft else []
    context = {"form": form, "draft": draft, "revision": revision, "missing": missing}
    return render(request, "studies/new.html", context, status=status)


def _form(**given: Any) -> StudyForm:
    offered = Contestant.objects.exclude(kind=Contestant.Kind.CHECK).filter(retired_at=None)
    return StudyForm(
        contestants=list(offered.select_related("endpoint").order_by("name")),
        groups=queries.by_type(),
        experts=by_pseudonym(experts()),
        jobs=list(GenerationJob.objects.all()),
        **given,
    )


def _entered(posted: QueryDict) -> dict[str, object]:
    """Return the form as it came in; whole types are the scenarios that they have now."""
    entered: dict[str, object] = posted.dict() | {
        name: posted.getlist(name) for name in drafts.NAMES
    }
    groups = [group for group in queries.by_type() if group.type in posted.getlist("types")]
    whole = [row.slug for group in groups for row in group.scenarios]
    return entered | {"scenarios": [*posted.getlist("scenarios"), *whole]}


def _revision(request: HttpRequest) -> int:
    given = request.POST.get("revision", "")
    return int(given) if given.isascii() and given.isdigit() and len(given) < 9 else 0


def _initial(draft: StudyDraft | None) -> dict[str, Any]:
    """Return what the draft has, or what suits most studies."""
    if draft is not None:
        return dict(draft.entered)
    return SUGGESTED | {"checks": usual_checks(), "practice": has_practice()}


def _opening(plan: StudyPlan, draft: StudyDraft | None) -> Confirmation:
    pairs = plan.votes_per_expert * (1 + (plan.repeats + plan.checks) / 100)
    seconds = StudyEstimate().seconds
    page = ("New study", reverse("study-new"))
    if draft is not None:
        page = ("Draft", reverse("study-draft", args=[draft.code]))
    return Confirmation(
        title=f"Open the study “{plan.name}”?",
        facts=(
            f"Experts: {len(plan.experts)}. Votes: {len(plan.experts) * plan.votes_per_expert}. "
            f"Contestants: {len(plan.contestants)}. Scenarios: {len(plan.scenarios)}.",
            f"For each expert about {pairs:.0f} pairs, repeats and checks among them, which take "
            f"{pairs * seconds / 60:.0f} minutes at {seconds:g} s a pair.",
            "Experts can vote at once. The rules can’t be changed afterwards.",
        ),
        button="Open the study",
        back=page[1],
        is_final=False,
        crumbs=(("Studies", reverse("studies")), page),
    )


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
            imported = _import(form, user_of(request))
            text = f"Imported: votes {imported.votes}, contestants {imported.contestants}."
            messages.success(request, text)
            return redirect("results", code=imported.study.code)
    context = {"form": form, "most_mb": MOST_MB}
    return render(request, "studies/votes.html", context, status=422 if form.errors else 200)


def _import(form: VoteFileForm, actor: User) -> ImportedVotes:
    file: UploadedFile[bytes] = form.cleaned_data["file"]
    with TemporaryDirectory(prefix="arena-votes-") as folder:
        # The reader's errors name the file: as its sender called it, in plain letters.
        path = Path(folder) / (_ODD.sub("_", file.name or "")[-100:].lstrip(".") or "votes")
        path.write_bytes(file.read())
        return import_votes(
            path=path,
            name=form.cleaned_data["name"],
            is_simulated=form.cleaned_data["is_simulated"],
            actor=actor,
        )
