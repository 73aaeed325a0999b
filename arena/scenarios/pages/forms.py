"""Scenarios by form: a new one beside its scene, many from a file, one to be changed; intents."""

import json
import uuid
from dataclasses import replace
from itertools import zip_longest
from typing import Any, cast

from django import forms
from django.contrib import messages
from django.http import HttpRequest, HttpResponse, JsonResponse, QueryDict
from django.shortcuts import get_object_or_404, redirect, render
from django.views.decorators.http import require_http_methods, require_POST

from arena.scenarios.pages.uploads import look_at
from arena.scenarios.services import (
    change_scenario,
    drop_reference,
    set_reference,
    was_too_large,
    why_not_editable,
)
from arena.site.access import STAFF, allow_only, user_of
from arena.site.acts import refusals_in, refusals_told, send_later
from arena.site.forms import read_json
from augment.errors import AugmentError, Conflict
from augment.models import Augmentation, BaseScene, Scenario
from augment.models.scenes import DENSITIES, GOALS
from augment.services.judging.findings import check_edit
from augment.services.running import by_hand
from augment.services.scenarios.bulk import (
    MOST_FILES,
    MOST_ROWS_AT_ONCE,
    BulkReport,
    add_from_files,
)
from augment.services.scenarios.editing import (
    PLACED,
    editor_document,
    enter_intent,
    waiting_reading,
)
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
from augment.services.scenarios.scenes import (
    INSTRUCTION_LENGTH,
    LONGEST_TYPE,
    SLUG_LENGTH,
    add_scenario,
    type_choices,
)
from augment.tasks import enqueue_job, enqueue_scenario

PAGE = ["GET", "HEAD", "POST"]
OWN = ""
LONGEST_INTENT = 200_000
NO_JSON = "The intent is no JSON."

REARRANGE = "fields"
"""What the buttons send that add and remove objects, and turn fields into JSON and back."""


class IntentForm(forms.Form):
    """What a scenario asks for as JSON, or object by object by fields."""

    intent = forms.CharField(required=False, max_length=LONGEST_INTENT)

    def intent_document(self) -> dict[str, Any] | None:
        """Return what was entered, None where nothing was.

        Raises:
            Conflict: The text is no JSON object.
            InvalidDocument: The fields do not make an intent.
        """
        text = self.cleaned_data["intent"].strip()
        if not text:
            return intent_of_fields(entered_fields(cast(QueryDict, self.data)))
        return _read_object(text)


class ScenarioForm(IntentForm):
    """An instruction for a scene, and what it asks for."""

    slug = forms.CharField(required=False, max_length=SLUG_LENGTH)
    type = forms.ChoiceField(required=False)
    own_type = forms.CharField(required=False, max_length=LONGEST_TYPE)
    instruction = forms.CharField(max_length=INSTRUCTION_LENGTH, strip=True)
    keep_traffic = forms.BooleanField(required=False)
    density = forms.ChoiceField(
        required=False, choices=[(one.value, one.value) for one in DENSITIES]
    )
    goal = forms.ChoiceField(
        required=False,
        choices=[("", "as recorded, or straightest"), *((one.value, one.value) for one in GOALS)],
    )

    def __init__(self, data: Any = None, *, initial: dict[str, Any] | None = None) -> None:
        super().__init__(data, initial=initial)
        field = cast(forms.ChoiceField, self.fields["type"])
        field.choices = [*type_choices(), (OWN, "A type of your own")]

    def wanted(self) -> dict[str, Any]:
        """Return what the form says of a scenario, once it is valid."""
        given = self.cleaned_data
        names = ("instruction", "keep_traffic", "density", "goal")
        return {name: given[name] for name in names} | {"type": given["type"] or given["own_type"]}


@allow_only(*STAFF)
@require_http_methods(PAGE)
def new_scenario_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show the form beside the picture of the scene, filled in as it was where it is refused."""
    scene = get_object_or_404(BaseScene.objects.defer("recording"), code=code)
    problem, fields = "", IntentFields()
    form = ScenarioForm(request.POST if request.method == "POST" else None)
    if REARRANGE in request.POST:  # nothing is added yet, so nothing is asked of the rest
        fields, initial, problem = _rearrange(request)
        form = ScenarioForm(initial=initial)
    elif form.is_bound:
        fields = entered_fields(request.POST)
        if form.is_valid():
            with refusals_in(form):
                scenario = add_scenario(
                    scene=scene.slug,
                    **form.wanted(),
                    slug=form.cleaned_data["slug"] or None,
                    intent=form.intent_document(),
                    actor=user_of(request),
                )
                send_later(request, enqueue_scenario, scenario.pk)
                messages.success(request, f"“{scenario.slug}” is added.")
                return redirect("scenario", code=scenario.code)
    context = {"scene": scene, "form": form, **look_at(request, scene, SceneView.KEPT)}
    context |= _intent_context(fields, problem)
    return render(request, "scenarios/new.html", context, status=422 if problem else 200)


@allow_only(*STAFF)
@require_http_methods(PAGE)
def edit_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Change instruction, type and circumstances of a scenario that nothing needs yet."""
    scenario = get_object_or_404(Scenario, code=code)
    if scenario.in_catalogue:
        messages.error(
            request, f"“{scenario.slug}” is the catalogue’s own; change it in its file."
        )
        return redirect("scenario", code=code)
    stored = {
        "type": scenario.type,
        "instruction": scenario.instruction,
        "keep_traffic": scenario.keep_traffic,
        "density": scenario.traffic_density,
        "goal": scenario.goal,
    }
    form = ScenarioForm(request.POST if request.method == "POST" else stored)
    if request.method == "POST" and form.is_valid():
        with refusals_in(form):
            change_scenario(scenario, **form.wanted(), actor=user_of(request))
            send_later(request, enqueue_scenario, scenario.pk)
            messages.success(request, f"“{scenario.slug}” is changed.")
            return redirect("scenario", code=code)
    return render(request, "scenarios/change.html", {"scenario": scenario, "form": form})


@allow_only(*STAFF)
@require_http_methods(PAGE)
def intent_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Change what a scenario asks for, by fields."""
    scenario = get_object_or_404(Scenario, code=code)
    problem = ""
    form = IntentForm(request.POST if request.method == "POST" else None)
    if REARRANGE in request.POST:
        fields, initial, problem = _rearrange(request)
        form = IntentForm(initial=initial)
    elif form.is_bound:
        fields = entered_fields(request.POST)
        if form.is_valid():
            with refusals_in(form):
                enter_intent(
                    scenario=scenario.slug, document=form.intent_document(), actor=user_of(request)
                )
                messages.success(request, "The intent is set. It counts from now on.")
                return redirect("scenario", code=code)
    else:
        reading = waiting_reading(scenario) if "reading" in request.GET else None
        document = scenario.intent if reading is None else reading.document
        fields = fields_of_intent(document) if document else IntentFields()
    context = {"scenario": scenario, "form": form, **_intent_context(fields, problem)}
    return render(request, "scenarios/intent.html", context, status=422 if problem else 200)


@allow_only(*STAFF)
@require_http_methods(PAGE)
def bulk_page(request: HttpRequest) -> HttpResponse:
    """Add many scenarios from a CSV or YAML file and the JSON files that it names, all or none."""
    report: BulkReport | None = None
    problem = ""
    if request.method == "POST":
        table, others = request.FILES.get("file"), request.FILES.getlist("documents")
        keeps = "try" not in request.POST
        try:
            if was_too_large(request.META) or len(others) > MOST_FILES:
                raise Conflict("The files are too large, or too many.")
            if table is None:
                raise Conflict("Choose a CSV or YAML file.")
            report = add_from_files(table, others, keeps=keeps, actor=user_of(request))
        except AugmentError as error:
            problem = str(error)
        if report is not None and report.is_kept:
            messages.success(request, f"{len(report.rows)} scenarios are added.")
    context = {"report": report, "problem": problem, "most": MOST_ROWS_AT_ONCE}
    return render(request, "scenarios/bulk.html", context)


def entered_fields(posted: QueryDict) -> IntentFields:
    """Return the fields of the intent: the same name again for every further object."""
    columns = {name: posted.getlist(f"i_{name}") for name in FIELDS}
    rows = tuple(
        dict(zip(columns, values, strict=True))
        for values in zip_longest(*columns.values(), fillvalue="")
    )
    return IntentFields(rows=rows or (NEW_ROW,), rest=posted.get("i_whole", ""))


def _rearrange(request: HttpRequest) -> tuple[IntentFields, dict[str, Any], str]:
    """Return the fields with an object more or less, or as JSON and back; all else; a problem."""
    fields, act = entered_fields(request.POST), request.POST[REARRANGE]
    initial, problem = request.POST.dict(), ""
    try:
        if act == "add":
            fields = replace(fields, rows=(*fields.rows, NEW_ROW))
        elif act == "write":
            document = intent_of_fields(fields)
            text = json.dumps(document, indent=2, ensure_ascii=False)
            initial["intent"] = "" if document is None else text
            fields = IntentFields()
        elif act == "read":
            fields = fields_of_intent(_read_object(initial.get("intent", "")))
            initial["intent"] = ""
        else:
            kept = [row for n, row in enumerate(fields.rows) if act != f"drop-{n}"]
            fields = replace(fields, rows=tuple(kept) or (NEW_ROW,))
    except AugmentError as error:
        problem = str(error)
    return fields, initial, problem


def _intent_context(fields: IntentFields, problem: str) -> dict[str, Any]:
    return {
        "rows": [
            {"fields": [(name, CHOICES[name], row[name]) for name in CHOICES], "rest": row[REST]}
            for row in fields.rows
        ],
        "whole_rest": fields.rest,
        "intent_problem": problem,
    }


def _read_object(text: str) -> dict[str, Any]:
    """Return a JSON object; Conflict for anything else."""
    document = read_json(text, otherwise=NO_JSON)
    if not isinstance(document, dict):
        raise Conflict(NO_JSON)
    return document


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
def drop_reference_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Leave a scenario without a reference."""
    scenario = _scenario(code)
    with refusals_told(request):
        drop_reference(scenario, actor=user_of(request))
        messages.success(request, f"“{scenario.slug}” has no reference now.")
    return redirect("scenario", code=code)


@allow_only(*STAFF)
@require_POST
def check_change(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
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
