"""Scenarios by form: a new one beside its scene, many from a file, changes by hand; intents."""

import json
import uuid
from itertools import zip_longest
from typing import Any

from django import forms
from django.contrib import messages
from django.http import HttpRequest, HttpResponse, JsonResponse, QueryDict
from django.shortcuts import get_object_or_404, redirect, render

from arena.scenarios import services
from arena.scenarios.pages.uploads import look_at
from arena.site.access import STAFF, act_for, form_for, user_of
from arena.site.acts import refusals_in, refusals_told, send_later
from arena.site.forms import offer, read_json
from augment.errors import Conflict
from augment.models import Augmentation, BaseScene, Contestant, Scenario
from augment.models.scenes import DENSITIES, GOALS
from augment.services.judging.findings import check_edit
from augment.services.running import by_hand
from augment.services.scenarios import bulk, editing, scenes
from augment.services.scenarios.intent_fields import (
    CHOICES,
    FIELDS,
    NEW_ROW,
    REST,
    IntentFields,
    fields_of_intent,
    intent_of_fields,
)
from augment.services.scenarios.pictures import SceneView
from augment.tasks import enqueue_job, enqueue_scenario

FREE_ROWS = 3
"""Empty objects that the fields of an intent end with."""

LONGEST_CHANGE = 1_000_000
"""Bytes of a modification."""


class ScenarioForm(forms.Form):
    """An instruction for a scene and its circumstances."""

    slug = forms.CharField(required=False, max_length=scenes.SLUG_LENGTH)
    type = forms.ChoiceField(required=False)
    own_type = forms.CharField(required=False, max_length=scenes.LONGEST_TYPE)
    instruction = forms.CharField(max_length=scenes.INSTRUCTION_LENGTH, strip=True)
    keep_traffic = forms.BooleanField(required=False)
    density = forms.ChoiceField(
        required=False, choices=[(one.value, one.value) for one in DENSITIES]
    )
    goal = forms.ChoiceField(
        required=False,
        choices=[("", "as recorded, or straightest"), *((one.value, one.value) for one in GOALS)],
    )

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        offer(self, "type", [*scenes.type_choices(), ("", "A type of your own")])

    def wanted(self) -> dict[str, Any]:
        """Return what the valid form says of a scenario."""
        given = self.cleaned_data
        names = ("instruction", "keep_traffic", "density", "goal")
        return {name: given[name] for name in names} | {"type": given["type"] or given["own_type"]}


@form_for(*STAFF)
def new_scenario_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show the form beside the picture of the scene, and add the scenario."""
    scene = get_object_or_404(BaseScene.objects.defer("recording"), code=code)
    form = ScenarioForm(request.POST or None)
    if form.is_valid():
        with refusals_in(form):
            scenario = scenes.add_scenario(
                scene=scene.slug,
                **form.wanted(),
                slug=form.cleaned_data["slug"] or None,
                intent=intent_of_fields(_entered_fields(request.POST)),
                actor=user_of(request),
            )
            send_later(request, enqueue_scenario, scenario.pk)
            messages.success(request, f"“{scenario.slug}” is added.")
            return redirect("scenario", code=scenario.code)
    fields = _entered_fields(request.POST)
    context = {"scene": scene, "form": form, **look_at(request, scene, SceneView.KEPT)}
    return render(request, "scenarios/new.html", context | _intent_context(fields))


@form_for(*STAFF)
def edit_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Change instruction, type and circumstances of a scenario that nothing needs yet."""
    scenario = get_object_or_404(Scenario, code=code)
    stored = {name: getattr(scenario, name) for name in ("type", "instruction", "keep_traffic")}
    stored |= {"density": scenario.traffic_density, "goal": scenario.goal}
    form = ScenarioForm(request.POST or stored)
    if request.method == "POST" and form.is_valid():
        with refusals_in(form):
            services.change_scenario(scenario, **form.wanted(), actor=user_of(request))
            send_later(request, enqueue_scenario, scenario.pk)
            messages.success(request, f"“{scenario.slug}” is changed.")
            return redirect("scenario", code=code)
    return render(request, "scenarios/change.html", {"scenario": scenario, "form": form})


@form_for(*STAFF)
def bulk_page(request: HttpRequest) -> HttpResponse:
    """Add many scenarios from a CSV or YAML file, all or none."""
    report, most = None, bulk.MOST_ROWS_AT_ONCE
    if request.method == "POST":
        table = request.FILES.get("file")
        with refusals_told(request):
            if table is None or services.was_too_large(request.META):
                raise Conflict("Choose a CSV or YAML file; it may be too large.")
            name, actor = table.name or "", user_of(request)
            report = bulk.add_rows(name, table.read(), most=most, actor=actor)
    context = {"report": report, "most": most}
    return render(request, "scenarios/bulk.html", context)


# --- Intents by fields -------------------------------------------------------------------------


@form_for(*STAFF)
def intent_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Change what a scenario asks for."""
    scenario = get_object_or_404(Scenario, code=code)
    if request.method == "POST":
        fields = _entered_fields(request.POST)
        with refusals_told(request):
            document = intent_of_fields(fields)
            editing.enter_intent(scenario=scenario.slug, document=document, actor=user_of(request))
            messages.success(request, "The intent is set. It counts from now on.")
            return redirect("scenario", code=code)
    else:
        reading = editing.waiting_reading(scenario) if "reading" in request.GET else None
        document = reading.document if reading else scenario.intent
        fields = fields_of_intent(document) if document else IntentFields(rows=())
    context = {"scenario": scenario, **_intent_context(fields)}
    return render(request, "scenarios/intent.html", context, status=_status(request))


def _status(request: HttpRequest) -> int:
    """Return the status of a page that shows its form: what was sent has been refused."""
    return 422 if request.method == "POST" else 200


def _entered_fields(posted: QueryDict) -> IntentFields:
    """Return the fields of the intent: the same name again for every further object."""
    columns = [posted.getlist(f"i_{name}") for name in FIELDS]
    rows = [dict(zip(FIELDS, row, strict=True)) for row in zip_longest(*columns, fillvalue="")]
    given = tuple(row for row in rows if row["kind"] or row[REST])
    return IntentFields(rows=given, rest=posted.get("i_whole", ""))


def _intent_context(fields: IntentFields) -> dict[str, Any]:
    rows = [*fields.rows, *[NEW_ROW] * FREE_ROWS]
    return {
        "rows": [
            {
                "fields": [(name, CHOICES[name], row[name]) for name in CHOICES],
                "rest": row[REST],
                "is_further": number > max(len(fields.rows), 1),
            }
            for number, row in enumerate(rows, start=1)
        ],
        "whole_rest": fields.rest,
    }


# --- References and corrections ----------------------------------------------------------------


@form_for(*STAFF)
def reference_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Draw or type the reference of a scenario; a refused one stays on the page."""
    scenario = _scenario(code)
    given: object = scenario.reference
    if request.method == "POST":
        with refusals_told(request):
            given = _document(request.POST.get("modification", ""))
            services.set_reference(scenario, given, actor=user_of(request))
            send_later(request, enqueue_scenario, scenario.pk)
            messages.success(request, "The reference is kept; a worker draws it.")
            return redirect("scenario", code=code)
    refusal = {"refusal": services.why_not_editable(scenario)}
    return _editor(request, scenario, given, refusal)


@form_for(*STAFF)
def correct_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Correct an augmentation; the result is an augmentation of its own."""
    rows = Augmentation.objects.select_related("contestant", "job", "scenario__base_scene")
    original = get_object_or_404(rows.defer("scenario__base_scene__recording"), code=code)
    slug = request.POST.get("contestant", "").strip() or by_hand.BY_HAND
    notes = request.POST.get("notes", "")
    given: object = by_hand.starting_document(original)
    if request.method == "POST":
        with refusals_told(request):
            given = _document(request.POST.get("modification", ""))
            made = by_hand.keep_correction(
                original, given, slug=slug, notes=notes, actor=user_of(request)
            )
            send_later(request, enqueue_job, made.job_id)
            messages.success(request, "The correction is kept; a worker draws it.")
            return redirect("augmentation", code=made.code)
    people = Contestant.objects.filter(kind=Contestant.Kind.HUMAN, retired_at=None)
    correction = {"original": original, "people": people, "slug": slug, "notes": notes}
    return _editor(request, original.scenario, given, correction)


@act_for(*STAFF, back="reference-edit")
def check_change(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Answer with what the checks find in a change that is being made; nothing is kept."""
    scenario = _scenario(code)
    try:
        sent = _document(request.body)
        if not isinstance(sent, dict):
            raise Conflict("A JSON object is needed.")
    except Conflict as error:
        return JsonResponse({"problem": str(error)}, status=422)
    checked = check_edit(scenario, sent.get("modification"), snapped=str(sent.get("snap") or ""))
    lines = [
        {
            "severity": line.severity,
            "label": "measured" if line.severity == "fact" else line.severity,
            "sentence": line.sentence(),
        }
        for line in checked.findings
    ]
    parts = ("modification", "problem", "is_against_intent")
    return JsonResponse({"lines": lines} | {name: getattr(checked, name) for name in parts})


def _scenario(code: uuid.UUID) -> Scenario:
    rows = Scenario.objects.select_related("base_scene").defer("base_scene__recording")
    return get_object_or_404(rows, code=code)


def _editor(
    request: HttpRequest, scenario: Scenario, given: object, more: dict[str, Any]
) -> HttpResponse:
    stored = "" if given is None else json.dumps(given, indent=2)
    context = {
        "scenario": scenario,
        "editor": editing.editor_document(scenario),
        "given": given,
        "text": request.POST.get("modification", stored),
        "types": [(one.value, one.value.replace("_", " ").lower()) for one in editing.PLACED],
        **look_at(request, scenario.base_scene, SceneView.BACKDROP),
        **more,
    }
    return render(request, "scenarios/edit.html", context, status=_status(request))


def _document(text: str | bytes) -> object:
    """Return what was sent; Conflict where it is too long, or no JSON."""
    if len(text) > LONGEST_CHANGE:
        raise Conflict("The change is too long.")
    return read_json(text, otherwise="The change is no JSON.")
