"""Changing a scene by hand: a scenario's reference, or the correction of an augmentation."""

from __future__ import annotations

import json
import uuid
from typing import Any, cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse, JsonResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.views.decorators.http import require_http_methods, require_POST

from arena.scenarios.services import drop_reference, set_reference, why_not_editable
from arena.site.access import STAFF, allow_only
from arena.site.acts import looks_again, send_later
from arena.site.forms import read_json
from augment.errors import AugmentError, Conflict
from augment.models import Augmentation, Scenario
from augment.services.judging.findings import check_edit
from augment.services.running import by_hand
from augment.services.scenarios.editing import PLACED, editor_document
from augment.services.scenarios.pictures import SceneView, is_drawn, scene_picture
from augment.tasks import enqueue_job, enqueue_scenario, enqueue_scene

LONGEST = 1_000_000
"""Of a modification, in bytes."""

NO_JSON = "The change is no JSON."


@allow_only(*STAFF)
@require_http_methods(["GET", "HEAD", "POST"])
def reference_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Draw or type the reference of a scenario; a refused one stays on the page."""
    scenario = _scenario(code)
    problem, given = "", scenario.reference
    if request.method == "POST":
        try:
            given = _document(request.POST.get("modification", ""))
            set_reference(scenario, given, actor=cast(User, request.user))
        except AugmentError as error:
            problem = str(error)
        else:
            send_later(request, enqueue_scenario, scenario.pk)
            messages.success(request, "The reference is kept; a worker draws it.")
            return redirect("scenario", code=code)
    context = _context(request, scenario, given, problem)
    context["refusal"] = why_not_editable(scenario)
    return render(request, "scenarios/edit.html", context, status=422 if problem else 200)


@allow_only(*STAFF)
@require_POST
def drop(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Leave a scenario without a reference."""
    scenario = _scenario(code)
    try:
        drop_reference(scenario, actor=cast(User, request.user))
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        messages.success(request, f"“{scenario.slug}” has no reference now.")
    return redirect("scenario", code=code)


@allow_only(*STAFF)
@require_POST
def check(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """What the checks find in a change that is being made; nothing is kept."""
    scenario = _scenario(code)
    no_json = "This is no JSON of a change."
    try:
        asked = _document(request.body, otherwise=no_json)
        if not isinstance(asked, dict):
            raise Conflict(no_json)
    except Conflict as error:
        return JsonResponse({"problem": str(error)}, status=422)
    snapped = asked.get("snap")
    found = check_edit(
        scenario, asked.get("modification"), snapped=snapped if isinstance(snapped, str) else ""
    )
    lines = [
        {
            "severity": line.severity,
            "label": "measured" if line.severity == "fact" else line.severity,
            "sentence": line.finding.sentence(),
        }
        for line in found.lines
    ]
    answer = {
        "modification": found.modification,
        "problem": found.problem,
        "lines": lines,
        "is_against_intent": found.is_against_intent,
    }
    return JsonResponse(answer)


@allow_only(*STAFF)
@require_http_methods(["GET", "HEAD", "POST"])
def correct_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Correct an augmentation; what comes of it is an augmentation of its own."""
    rows = Augmentation.objects.select_related("contestant", "job", "scenario__base_scene")
    original = get_object_or_404(rows.defer("scenario__base_scene__recording"), code=code)
    problem, given = "", cast(object, by_hand.starting_document(original))
    if request.method == "POST":
        try:
            given = _document(request.POST.get("modification", ""))
            made = by_hand.keep_correction(
                original,
                given,
                slug=request.POST.get("contestant", "").strip() or by_hand.BY_HAND,
                notes=request.POST.get("notes", ""),
                actor=cast(User, request.user),
            )
        except AugmentError as error:
            problem = str(error)
        else:
            send_later(request, enqueue_job, made.job_id)
            messages.success(request, "The correction is kept; a worker draws it.")
            return redirect("augmentation", code=made.code)
    context = _context(request, original.scenario, given, problem) | {
        "original": original,
        "people": by_hand.human_contestants(),
        "slug": request.POST.get("contestant", by_hand.BY_HAND),
        "notes": request.POST.get("notes", ""),
    }
    return render(request, "scenarios/edit.html", context, status=422 if problem else 200)


# --- Private -----------------------------------------------------------------------------------


def _scenario(code: uuid.UUID) -> Scenario:
    rows = Scenario.objects.select_related("base_scene").defer("base_scene__recording")
    return get_object_or_404(rows, code=code)


def _context(
    request: HttpRequest, scenario: Scenario, given: object, problem: str
) -> dict[str, Any]:
    drawn = is_drawn(scene_picture(scenario.base_scene, SceneView.BACKDROP))
    look = looks_again(request, waits=not drawn)
    if look == 1:
        send_later(request, enqueue_scene, scenario.base_scene_id)
    return {
        "scenario": scenario,
        "editor": editor_document(scenario),
        "given": given,
        "text": request.POST.get("modification", _as_text(given)),
        "problem": problem,
        "types": [(one.value, one.value.replace("_", " ").lower()) for one in PLACED],
        "is_drawn": drawn,
        "look": look,
    }


def _as_text(document: object) -> str:
    return "" if document is None else json.dumps(document, indent=2)


def _document(text: str | bytes, *, otherwise: str = NO_JSON) -> object:
    """What was typed.

    Raises:
        Conflict: It is too long, or no JSON.
    """
    if len(text) > LONGEST:
        raise Conflict("The change is too long.")
    return read_json(text, otherwise=otherwise)
