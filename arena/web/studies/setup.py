"""Setting a study up: by one form, over several sittings where somebody saves it as a draft."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.http import Http404, HttpRequest, HttpResponse, QueryDict
from django.shortcuts import get_object_or_404, redirect, render
from django.views.decorators.http import require_http_methods, require_POST

from arena import tasks
from arena.errors import ArenaError
from arena.models import Study, StudyDraft
from arena.queries.inventory import usual_checks
from arena.queries.people import by_pseudonym, experts
from arena.queries.studies.drafts import missing_of
from arena.scenarios import queries
from arena.services.practice import has_practice
from arena.services.studies import open_study
from arena.services.study_drafts import (
    NAMES,
    SWITCHES,
    TEXTS,
    change_draft,
    discard_draft,
    draft_like,
    entered_of,
    keep_draft,
    open_draft,
)
from arena.web.access import ADMIN, allow_only
from arena.web.questions import ask, is_sure, wants_to_change
from arena.web.studies.forms import StudyForm
from arena.web.studies.study_questions import discarding, opening
from augment.errors import AugmentError
from augment.models import Contestant, GenerationJob

KEEP = "keep"
"""What the button sends that saves a draft."""

SUGGESTED = {"votes_per_expert": 40, "overlap": 10}
"""What a new form holds beside the defaults of a plan."""

_PLANNED = ("votes_per_expert", "repeats", "checks", "overlap")
"""What the planning page hands on to a new study."""


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def new_study_page(request: HttpRequest) -> HttpResponse:
    """Who competes on what, and who judges; opening plans every matchup."""
    return _set_up(request, None)


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def draft_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The same form with what was saved, and what of it is gone meanwhile."""
    drafts = StudyDraft.objects.select_related("changed_by__person")
    return _set_up(request, get_object_or_404(drafts, code=code))


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def discard(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Remove a draft; asks first."""
    draft = get_object_or_404(StudyDraft, code=code)
    if not is_sure(request):
        return ask(request, discarding(draft))
    discard_draft(draft=draft, actor=cast(User, request.user))
    messages.success(request, "The draft is discarded.")
    return redirect("studies")


@allow_only(ADMIN)
@require_POST
def use_again(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """A new draft with the settings of a study."""
    study = get_object_or_404(Study, code=code)
    try:
        draft = draft_like(study=study, actor=cast(User, request.user))
    except AugmentError as error:
        messages.error(request, str(error))
        return redirect("study", code=code)
    messages.success(request, f"A draft with the settings of “{study.name}”.")
    return redirect("study-draft", code=draft.code)


@allow_only(ADMIN)
@require_POST
def draw_checks(request: HttpRequest) -> HttpResponse:
    """Have workers draw the attention checks that are missing; twice does no harm."""
    try:
        tasks.send_checks(cast(User, request.user).pk)
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        messages.success(
            request, "Attention checks are being drawn. Reload this page in a moment."
        )
    return redirect("study-new")


# --- Private -----------------------------------------------------------------------------------


def _set_up(request: HttpRequest, draft: StudyDraft | None) -> HttpResponse:
    if request.method == "POST" and KEEP in request.POST:
        return _keep(request, draft)
    form = _form(data=request.POST or None, initial=_initial(request, draft))
    if request.method == "POST" and form.is_valid() and not wants_to_change(request):
        try:
            if not is_sure(request):
                return ask(request, opening(form.study_plan(), draft))
            study = _open(request, draft, form)
        except (ArenaError, AugmentError) as error:
            form.add_error(None, str(error))
        else:
            messages.success(request, f"“{study.name}” is open; its experts can vote now.")
            return redirect("study", code=study.code)
    revision = request.POST.get("revision", "") or (draft.revision if draft else "")
    return _shown(request, draft, form, revision)


def _open(request: HttpRequest, draft: StudyDraft | None, form: StudyForm) -> Study:
    actor = cast(User, request.user)
    if draft is None:
        return open_study(form.study_plan(), actor=actor)
    return open_draft(form.study_plan(), draft=draft, revision=_revision(request), actor=actor)


def _keep(request: HttpRequest, draft: StudyDraft | None) -> HttpResponse:
    """Save what stands in the form, whether it makes a study or not."""
    actor, entered = cast(User, request.user), _entered(request.POST)
    try:
        if draft is None:
            kept = keep_draft(entered=entered, actor=actor)
        else:
            kept = change_draft(
                draft=draft, entered=entered, revision=_revision(request), actor=actor
            )
    except AugmentError as error:
        draft = draft and StudyDraft.objects.filter(pk=draft.pk).first()
        messages.error(request, str(error))
        if draft is not None:
            messages.info(
                request, "What you entered stands below; saving it again replaces theirs."
            )
        form = _form(initial=entered)
        return _shown(request, draft, form, draft.revision if draft else "", 409 if draft else 422)
    messages.success(request, "Saved as a draft: no expert sees it, and nothing is planned yet.")
    return redirect("study-draft", code=kept.code)


def _shown(
    request: HttpRequest,
    draft: StudyDraft | None,
    form: StudyForm,
    revision: object,
    status: int | None = None,
) -> HttpResponse:
    context = {
        "form": form,
        "draft": draft,
        "revision": revision,
        "missing": missing_of(draft) if draft else [],
    }
    return render(
        request, "studies/new.html", context, status=status or (422 if form.errors else 200)
    )


def _form(**given: Any) -> StudyForm:
    return StudyForm(
        contestants=list(
            Contestant.objects.exclude(kind=Contestant.Kind.CHECK)
            .filter(retired_at=None)
            .select_related("endpoint")
            .order_by("name")
        ),
        groups=queries.by_type(),
        experts=by_pseudonym(experts()),
        jobs=list(GenerationJob.objects.all()),
        **given,
    )


def _entered(posted: QueryDict) -> dict[str, object]:
    """The form as it came in; whole types are the scenarios that they have now."""
    found: dict[str, object] = {name: posted.get(name, "") for name in TEXTS}
    found |= {name: name in posted for name in SWITCHES}
    types = set(posted.getlist("types"))
    whole = [
        row.slug for group in queries.by_type() if group.type in types for row in group.scenarios
    ]
    found |= {name: posted.getlist(name) for name in NAMES}
    return found | {"scenarios": [*posted.getlist("scenarios"), *whole]}


def _revision(request: HttpRequest) -> int:
    given = request.POST.get("revision", "")
    return int(given) if given.isascii() and given.isdigit() and len(given) < 9 else 0


def _initial(request: HttpRequest, draft: StudyDraft | None) -> dict[str, Any]:
    """What the draft has; or what the address says of a study that somebody planned."""
    if draft is not None:
        return dict(entered_of(draft))
    initial: dict[str, Any] = SUGGESTED | {"checks": usual_checks(), "practice": has_practice()}
    initial |= {name: request.GET[name] for name in _PLANNED if request.GET.get(name)}
    code = request.GET.get("study")
    if not code:
        return initial
    try:
        study = get_object_or_404(Study, code=uuid.UUID(code))
    except ValueError:
        raise Http404 from None
    return initial | {
        "contestants": list(study.contestants.values_list("slug", flat=True)),
        "scenarios": list(study.scenarios.values_list("slug", flat=True)),
        "experts": list(study.experts.values_list("username", flat=True)),
    }
