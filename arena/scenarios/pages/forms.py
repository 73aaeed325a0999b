"""Scenarios by form: a new one beside its scene, many from a file, or one to be changed."""

from __future__ import annotations

import json
import uuid
from dataclasses import replace
from typing import Any, cast

from django import forms
from django.contrib import messages
from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse, QueryDict
from django.shortcuts import get_object_or_404, redirect, render
from django.views.decorators.http import require_http_methods

from arena.scenarios.services import change_scenario
from arena.services.sent_files import was_too_large
from arena.site.access import STAFF, allow_only
from arena.site.acts import looks_again, send_later
from arena.site.forms import read_json
from augment.errors import AugmentError, Conflict
from augment.models import BaseScene, Scenario
from augment.models.scenes import DENSITIES, GOALS
from augment.services.scenarios.bulk import (
    MOST_FILES,
    MOST_ROWS_AT_ONCE,
    BulkReport,
    add_from_files,
)
from augment.services.scenarios.editing import enter_intent, waiting_reading
from augment.services.scenarios.intent_fields import (
    CHOICES,
    FIELDS,
    NEW_ROW,
    REST,
    IntentFields,
    fields_of_intent,
    intent_of_fields,
)
from augment.services.scenarios.pictures import SceneView, is_drawn, scene_picture
from augment.services.scenarios.scenes import (
    INSTRUCTION_LENGTH,
    LONGEST_LABEL,
    LONGEST_TYPE,
    SLUG_LENGTH,
    add_scenario,
    read_circumstances,
    type_choices,
)
from augment.tasks import enqueue_scenario, enqueue_scene

OWN = ""
LONGEST_INTENT = 200_000
DENSITY_CHOICES = [(one.value, one.value) for one in DENSITIES]
GOAL_CHOICES = [("", "as recorded, or straightest"), *((one.value, one.value) for one in GOALS)]

REARRANGE = "fields"
"""What the buttons send that add and remove objects, and turn fields into JSON and back."""


class IntentForm(forms.Form):
    """What a scenario asks for as JSON, or object by object by fields."""

    intent = forms.CharField(required=False, max_length=LONGEST_INTENT)

    def intent_document(self) -> dict[str, Any] | None:
        """What was entered, None where nothing was.

        Raises:
            Conflict: The text is no JSON object.
            InvalidDocument: The fields do not make an intent.
        """
        text = self.cleaned_data["intent"].strip()
        if not text:
            return intent_of_fields(entered_fields(cast(QueryDict, self.data)))
        return _read_json(text)


class ScenarioForm(IntentForm):
    """An instruction for a scene, and what it asks for."""

    slug = forms.CharField(required=False, max_length=SLUG_LENGTH)
    type = forms.ChoiceField(required=False)
    own_type = forms.CharField(required=False, max_length=LONGEST_TYPE)
    own_label = forms.CharField(required=False, max_length=LONGEST_LABEL)
    instruction = forms.CharField(max_length=INSTRUCTION_LENGTH, strip=True)
    keep_traffic = forms.BooleanField(required=False)
    density = forms.ChoiceField(required=False, choices=DENSITY_CHOICES)
    goal = forms.ChoiceField(required=False, choices=GOAL_CHOICES)

    def __init__(self, data: Any = None, *, initial: dict[str, Any] | None = None) -> None:
        super().__init__(data, initial=initial)
        field = cast(forms.ChoiceField, self.fields["type"])
        field.choices = [*type_choices(), (OWN, "A type of your own")]


@allow_only(*STAFF)
@require_http_methods(["GET", "HEAD", "POST"])
def new_scenario_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The form beside the picture of the scene; filled in as it was where something is wrong."""
    scene = get_object_or_404(BaseScene.objects.defer("recording"), code=code)
    if request.method == "POST" and REARRANGE in request.POST:
        return _rearranged(request, scene)
    form = ScenarioForm(request.POST if request.method == "POST" else None)
    if request.method == "POST" and form.is_valid():
        given = form.cleaned_data
        try:
            made = add_scenario(
                scene=scene.slug,
                **_wanted(given),
                slug=given["slug"] or None,
                intent=form.intent_document(),
                actor=cast(User, request.user),
            )
        except AugmentError as error:
            form.add_error(None, str(error))
        else:
            send_later(request, enqueue_scenario, made.pk)
            messages.success(request, f"“{made.slug}” is added.")
            return redirect("scenario", code=made.code)
    fields = entered_fields(request.POST) if request.method == "POST" else IntentFields()
    return _shown(request, scene, form, fields)


@allow_only(*STAFF)
@require_http_methods(["GET", "HEAD", "POST"])
def edit_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Instruction, type and circumstances of a scenario that nothing needs yet."""
    scenario = get_object_or_404(Scenario, code=code)
    if scenario.in_catalogue:
        messages.error(
            request, f"“{scenario.slug}” is the catalogue’s own; change it in its file."
        )
        return redirect("scenario", code=code)
    form = ScenarioForm(request.POST if request.method == "POST" else _entered(scenario))
    if request.method == "POST" and form.is_valid():
        try:
            change_scenario(scenario, **_wanted(form.cleaned_data), actor=cast(User, request.user))
        except AugmentError as error:
            form.add_error(None, str(error))
        else:
            send_later(request, enqueue_scenario, scenario.pk)
            messages.success(request, f"“{scenario.slug}” is changed.")
            return redirect("scenario", code=code)
    return render(request, "scenarios/change.html", {"scenario": scenario, "form": form})


@allow_only(*STAFF)
@require_http_methods(["GET", "HEAD", "POST"])
def intent_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """What a scenario asks for, in the fields, to be changed."""
    scenario = get_object_or_404(Scenario, code=code)
    problem = ""
    initial: dict[str, Any] = {}
    form = IntentForm(request.POST if request.method == "POST" else None)
    if request.method == "POST" and REARRANGE in request.POST:
        fields, initial, problem = _rearrange(request)
        form = IntentForm(initial=initial)
    elif request.method == "POST":
        fields = entered_fields(request.POST)
        try:
            if form.is_valid():
                enter_intent(
                    scenario=scenario.slug,
                    document=form.intent_document(),
                    actor=cast(User, request.user),
                )
                messages.success(request, "The intent is set. It counts from now on.")
                return redirect("scenario", code=code)
        except AugmentError as error:
            form.add_error(None, str(error))
    else:
        reading = waiting_reading(scenario) if "reading" in request.GET else None
        document = scenario.intent if reading is None else reading.document
        fields = fields_of_intent(document) if document else IntentFields()
    context = {"scenario": scenario, "form": form} | _intent_context(fields, problem)
    return render(request, "scenarios/intent.html", context, status=422 if problem else 200)


@allow_only(*STAFF)
@require_http_methods(["GET", "HEAD", "POST"])
def bulk_page(request: HttpRequest) -> HttpResponse:
    """Many scenarios from a CSV or YAML file and the JSON files that it names, all or none."""
    report: BulkReport | None = None
    problem = ""
    if request.method == "POST":
        try:
            report = _bulk(request)
        except AugmentError as error:
            problem = str(error)
        if report is not None and report.is_kept:
            text = f"{len(report.rows)} scenarios are added."
            messages.success(request, text)
    context = {"report": report, "problem": problem, "most": MOST_ROWS_AT_ONCE}
    return render(request, "scenarios/bulk.html", context)


def entered_fields(posted: QueryDict) -> IntentFields:
    """The fields of the intent as they came in: the same name again for every further object."""
    columns = {name: posted.getlist(f"i_{name}") for name in FIELDS}
    number = max(map(len, columns.values()))
    rows = tuple(
        {name: values[n] if n < len(values) else "" for name, values in columns.items()}
        for n in range(number)
    )
    return IntentFields(rows=rows or (NEW_ROW,), rest=posted.get("i_whole", ""))


# --- Private -----------------------------------------------------------------------------------


def _wanted(given: dict[str, Any]) -> dict[str, Any]:
    """What the form says of a scenario that is new or is changed."""
    return {
        "type": given["type"] or given["own_type"],
        "type_label": None if given["type"] else given["own_label"] or None,
        "instruction": given["instruction"],
        "keep_traffic": given["keep_traffic"],
        "circumstances": read_circumstances(given["density"], given["goal"]),
    }


def _entered(scenario: Scenario) -> dict[str, Any]:
    """A scenario as the form would send it."""
    return {
        "type": scenario.type,
        "instruction": scenario.instruction,
        "keep_traffic": scenario.keep_traffic,
        "density": scenario.traffic_density,
        "goal": scenario.goal,
    }


def _rearranged(request: HttpRequest, scene: BaseScene) -> HttpResponse:
    """The form as it was filled in; nothing is added yet, so nothing is asked of the rest."""
    fields, initial, problem = _rearrange(request)
    return _shown(request, scene, ScenarioForm(initial=initial), fields, problem)


def _rearrange(request: HttpRequest) -> tuple[IntentFields, dict[str, Any], str]:
    """The fields with an object more or less, or as JSON and back; all else; what is wrong."""
    fields, act = entered_fields(request.POST), request.POST[REARRANGE]
    initial, problem = request.POST.dict(), ""
    try:
        if act == "add":
            fields = replace(fields, rows=(*fields.rows, NEW_ROW))
        elif act == "write":
            document = intent_of_fields(fields)
            initial["intent"] = "" if document is None else _written(document)
            fields = IntentFields()
        elif act == "read":
            fields = fields_of_intent(_read_json(initial.get("intent", "")))
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


def _shown(
    request: HttpRequest,
    scene: BaseScene,
    form: ScenarioForm,
    fields: IntentFields,
    problem: str = "",
) -> HttpResponse:
    drawn = is_drawn(scene_picture(scene, SceneView.KEPT))
    look = looks_again(request, waits=not drawn and request.method != "POST")
    if look == 1:
        send_later(request, enqueue_scene, scene.pk)
    context = {"scene": scene, "form": form, "is_drawn": drawn, "look": look} | _intent_context(
        fields, problem
    )
    return render(request, "scenarios/new.html", context, status=422 if problem else 200)


def _read_json(text: str) -> dict[str, Any]:
    """An intent as somebody wrote it.

    Raises:
        Conflict: The text is no JSON object.
    """
    no_json = "The intent is no JSON."
    found = read_json(text, otherwise=no_json)
    if not isinstance(found, dict):
        raise Conflict(no_json)
    return found


def _written(document: dict[str, Any]) -> str:
    return json.dumps(document, indent=2, ensure_ascii=False)


def _bulk(request: HttpRequest) -> BulkReport:
    """What becomes of the file that came along.

    Raises:
        Conflict: There is none, or too much of it.
        InvalidDocument: It can't be read.
    """
    table, others = request.FILES.get("file"), request.FILES.getlist("documents")
    if was_too_large(request.META) or len(others) > MOST_FILES:
        raise Conflict("The files are too large, or too many.")
    if table is None:
        raise Conflict("Choose a CSV or YAML file.")
    return add_from_files(
        table, others, keeps="try" not in request.POST, actor=cast(User, request.user)
    )
