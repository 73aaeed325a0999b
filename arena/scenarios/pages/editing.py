"""Changing a scene by hand: a scenario's reference, or the correction of an augmentation."""

from __future__ import annotations

import json
import uuid
from typing import Any

from django.contrib import messages
from django.http import HttpRequest, HttpResponse, JsonResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.views.decorators.http import require_http_methods, require_POST

from arena.scenarios.pages.uploads import look_at
from arena.scenarios.services import drop_reference, set_reference, why_not_editable
from arena.site.access import STAFF, allow_only, user_of
from arena.site.acts import refusals_told, send_later
from arena.site.forms import read_json
from augment.errors import AugmentError, Conflict
from augment.models import Augmentation, Scenario
from augment.services.judging.findings import check_edit
from augment.services.running import by_hand
from augment.services.scenarios.editing import PLACED, editor_document
from augment.services.scenarios.pictures import SceneView
from augment.tasks import enqueue_job, enqueue_scenario

PAGE = ["GET", "HEAD", "POST"]
LONGEST = 1_000_000
"""Of a modification, in bytes."""


@allow_only(*STAFF)
@require_http_methods(PAGE)
def reference_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Draw or type the reference of a scenario; a refused one stays on the page."""
    scenario = _scenario(code)
    given: object = scenario.reference
    problem = ""
    if request.method == "POST":
        try:
            given = _document(request.POST.get("modification", ""))
            set_reference(scenario, given, actor=user_of(request))
        except AugmentError as error:
            problem = str(error)
        else:
            send_later(request, enqueue_scenario, scenario.pk)
            messages.success(request, "The reference is kept; a worker draws it.")
            return redirect("scenario", code=code)
    refusal = {"refusal": why_not_editable(scenario)}
    return _editor(request, scenario, given, problem, refusal)


@allow_only(*STAFF)
@require_POST
def drop(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Leave a scenario without a reference."""
    scenario = _scenario(code)
    with refusals_told(request):
        drop_reference(scenario, actor=user_of(request))
        messages.success(request, f"“{scenario.slug}” has no reference now.")
    return redirect("scenario", code=code)


@allow_only(*STAFF)
@require_POST
def check(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Answer with what the checks find in a change that is being made; nothing is kept."""
    scenario = _scenario(code)
    no_json = "This is no JSON of a change."
    try:
        asked = _document(request.body, otherwise=no_json)
        if not isinstance(asked, dict):
            raise Conflict(no_json)
    except Conflict as error:
        return JsonResponse({"problem": str(error)}, status=422)
    snapped = asked.get("snap")
    checked = check_edit(
        scenario, asked.get("modification"), snapped=snapped if isinstance(snapped, str) else ""
    )
    lines = [
        {
            "severity": line.severity,
            "label": "measured" if line.severity == "fact" else line.severity,
            "sentence": line.finding.sentence(),
        }
        for line in checked.lines
    ]
    return JsonResponse(
        {
            "modification": checked.modification,
            "problem": checked.problem,
            "lines": lines,
            "is_against_intent": checked.is_against_intent,
        }
    )


@allow_only(*STAFF)
@require_http_methods(PAGE)
def correct_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Correct an augmentation; the result is an augmentation of its own."""
    rows = Augmentation.objects.select_related("contestant", "job", "scenario__base_scene")
    original = get_object_or_404(rows.defer("scenario__base_scene__recording"), code=code)
    slug, notes = request.POST.get("contestant", by_hand.BY_HAND), request.POST.get("notes", "")
    given: object = by_hand.starting_document(original)
    problem = ""
    if request.method == "POST":
        try:
            given = _document(request.POST.get("modification", ""))
            made = by_hand.keep_correction(
                original,
                given,
                slug=slug.strip() or by_hand.BY_HAND,
                notes=notes,
                actor=user_of(request),
            )
        except AugmentError as error:
            problem = str(error)
        else:
            send_later(request, enqueue_job, made.job_id)
            messages.success(request, "The correction is kept; a worker draws it.")
            return redirect("augmentation", code=made.code)
    correction = {
        "original": original,
        "people": by_hand.human_contestants(),
        "slug": slug,
        "notes": notes,
    }
    return _editor(request, original.scenario, given, problem, correction)


def _scenario(code: uuid.UUID) -> Scenario:
    rows = Scenario.objects.select_related("base_scene").defer("base_scene__recording")
    return get_object_or_404(rows, code=code)


def _editor(
    request: HttpRequest, scenario: Scenario, given: object, problem: str, more: dict[str, Any]
) -> HttpResponse:
    stored = "" if given is None else json.dumps(given, indent=2)
    context = {
        "scenario": scenario,
        "editor": editor_document(scenario),
        "given": given,
        "text": request.POST.get("modification", stored),
        "problem": problem,
        "types": [(one.value, one.value.replace("_", " ").lower()) for one in PLACED],
        **look_at(request, scenario.base_scene, SceneView.BACKDROP),
        **more,
    }
    return render(request, "scenarios/edit.html", context, status=422 if problem else 200)


def _document(text: str | bytes, *, otherwise: str = "The change is no JSON.") -> object:
    """Return what was typed; Conflict where it is too long, or no JSON."""
    if len(text) > LONGEST:
        raise Conflict("The change is too long.")
    return read_json(text, otherwise=otherwise)
