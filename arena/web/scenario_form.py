"""New scenarios: one on a scene that is looked at, or many from a file."""

from __future__ import annotations

import uuid
from typing import Any, cast

from django import forms
from django.contrib import messages
from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.utils.translation import gettext as _
from django.utils.translation import gettext_lazy
from django.views.decorators.http import require_http_methods

from arena.services.sent_files import was_too_large
from arena.web.access import STAFF, allow_only
from arena.web.json_text import read_json
from arena.web.sending import looks_again, send_later
from augment.errors import AugmentError, Conflict
from augment.models import BaseScene
from augment.scene_tasks import enqueue_scenario, enqueue_scene
from augment.sentences import sentence
from augment.services.scenarios.bulk import MOST_ROWS_AT_ONCE, BulkReport
from augment.services.scenarios.bulk_files import MOST_FILES, add_from_files
from augment.services.scenarios.scene_pictures import SceneView, is_drawn, scene_picture
from augment.services.scenarios.scenes import INSTRUCTION_LENGTH, SLUG_LENGTH, add_scenario
from augment.services.scenarios.simple_intent import CHOICES, simple_intent
from augment.services.scenarios.types import LONGEST_LABEL, LONGEST_TYPE, type_choices
from augment.services.wording import translate

OWN = ""
LONGEST_INTENT = 200_000


class ScenarioForm(forms.Form):
    """An instruction for a scene; what it asks for as JSON, or by fields for one kind."""

    slug = forms.CharField(required=False, max_length=SLUG_LENGTH)
    type = forms.ChoiceField(required=False)
    own_type = forms.CharField(required=False, max_length=LONGEST_TYPE)
    own_label = forms.CharField(required=False, max_length=LONGEST_LABEL)
    instruction = forms.CharField(max_length=INSTRUCTION_LENGTH, strip=True)
    keep_traffic = forms.BooleanField(required=False)
    intent = forms.CharField(required=False, max_length=LONGEST_INTENT)

    def __init__(self, data: Any = None) -> None:
        super().__init__(data)
        field = cast(forms.ChoiceField, self.fields["type"])
        field.choices = [*type_choices(), (OWN, gettext_lazy("A type of your own"))]

    def intent_document(self) -> dict[str, Any] | None:
        """What was entered, None where nothing was.

        Raises:
            Conflict: The text is no JSON object.
            InvalidDocument: The fields do not make an intent.
        """
        text = self.cleaned_data["intent"].strip()
        if not text:
            return simple_intent({name: self.data.get(f"i_{name}", "") for name in CHOICES})
        no_json = sentence("The intent is no JSON.")
        found = read_json(text, otherwise=no_json)
        if not isinstance(found, dict):
            raise Conflict(no_json)
        return found


@allow_only(*STAFF)
@require_http_methods(["GET", "HEAD", "POST"])
def new_scenario_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The form beside the picture of the scene; filled in as it was where something is wrong."""
    scene = get_object_or_404(BaseScene.objects.defer("recording"), code=code)
    form = ScenarioForm(request.POST if request.method == "POST" else None)
    if request.method == "POST" and form.is_valid():
        given = form.cleaned_data
        try:
            made = add_scenario(
                scene=scene.slug,
                type=given["type"] or given["own_type"],
                type_label=None if given["type"] else given["own_label"] or None,
                instruction=given["instruction"],
                slug=given["slug"] or None,
                intent=form.intent_document(),
                keep_traffic=given["keep_traffic"],
                actor=cast(User, request.user),
            )
        except AugmentError as error:
            form.add_error(None, translate(error))
        else:
            send_later(request, enqueue_scenario, made.pk)
            messages.success(request, _("“%(name)s” is added.") % {"name": made.slug})
            return redirect("scenario", code=made.code)
    drawn = is_drawn(scene_picture(scene, SceneView.KEPT))
    look = looks_again(request, waits=not drawn and request.method != "POST")
    if look == 1:
        send_later(request, enqueue_scene, scene.pk)
    entered = {name: form.data.get(f"i_{name}", "") for name in CHOICES}
    context = {
        "scene": scene,
        "form": form,
        "is_drawn": drawn,
        "look": look,
        "asks": [(name, CHOICES[name], entered[name]) for name in CHOICES],
    }
    return render(request, "scenarios/new.html", context)


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
            problem = translate(error)
        if report is not None and report.is_kept:
            text = _("%(number)s scenarios are added.") % {"number": len(report.rows)}
            messages.success(request, text)
    context = {"report": report, "problem": problem, "most": MOST_ROWS_AT_ONCE}
    return render(request, "scenarios/bulk.html", context)


# --- Private -----------------------------------------------------------------------------------


def _bulk(request: HttpRequest) -> BulkReport:
    """What becomes of the file that came along.

    Raises:
        Conflict: There is none, or too much of it.
        InvalidDocument: It can't be read.
    """
    table, others = request.FILES.get("file"), request.FILES.getlist("documents")
    if was_too_large(request.META) or len(others) > MOST_FILES:
        raise Conflict(sentence("The files are too large, or too many."))
    if table is None:
        raise Conflict(sentence("Choose a CSV or YAML file."))
    return add_from_files(
        table, others, keeps="try" not in request.POST, actor=cast(User, request.user)
    )
