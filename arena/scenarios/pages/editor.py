"""Drawing: a new scenario on its scene, a scenario that is changed, a correction by hand."""

import json
import uuid
from typing import Any

from django import forms
from django.contrib import messages
from django.http import HttpRequest, HttpResponse, JsonResponse
from django.shortcuts import get_object_or_404, redirect, render

from arena.scenarios import services
from arena.scenarios.pages.augmentations import find_scenario
from arena.shell.access import STAFF, act_for, form_for, get_user
from arena.shell.acts import looks_again, refusals_in, refusals_told, send_later, wait_for_workers
from arena.shell.forms import offer, read_json
from augment.errors import Conflict, InvalidDocument
from augment.models import Augmentation, BaseScene, Contestant, Scenario
from augment.models.scenes import DENSITIES, GOALS
from augment.services import SLUG_LENGTH, free_slug, make_slug, read_code, scenarios
from augment.services.judging import check_edit
from augment.services.running import follow_ups
from augment.services.scenarios import editing, scenes

LONGEST_CHANGE = 1_000_000
"""Bytes of a modification."""
NOTHING = "type a sentence, or draw the change"
PARTS = ("agents", "lanes", "connectors", "areas")


class ScenarioForm(forms.Form):
    """A sentence and a drawing for a scene, and their circumstances."""

    slug = forms.CharField(
        required=False,
        max_length=SLUG_LENGTH,
        label="Name",
        help_text="Empty: made of scene and type.",
    )
    type = forms.ChoiceField(required=False)
    own_type = forms.CharField(
        required=False,
        max_length=scenarios.LONGEST_TYPE,
        label="A type of your own",
        help_text="It counts where no other is chosen.",
    )
    instruction = forms.CharField(
        required=False,
        max_length=scenes.INSTRUCTION_LENGTH,
        strip=True,
        label="Sentence",
        widget=forms.Textarea({"rows": 4, "placeholder": "Made from the drawing."}),
    )
    modification = forms.CharField(required=False, max_length=LONGEST_CHANGE)
    derives = forms.BooleanField(required=False)
    keep_traffic = forms.BooleanField(required=False)
    density = forms.ChoiceField(
        label="Traffic spawned in place of the recorded one",
        required=False,
        choices=[(density.value, density.value) for density in DENSITIES],
    )
    goal = forms.ChoiceField(
        label="Goal of the ego",
        help_text="Where its way turns; drawn in the pictures, told in the prompts and driven.",
        required=False,
        choices=[
            ("", "as recorded, or straightest"),
            *((goal.value, goal.value) for goal in GOALS),
        ],
    )

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        offer(self, "type", [("", "As the drawing looks"), *scenarios.type_choices()])

    def to_values(self) -> dict[str, Any]:
        """Return the scenario's fields from a valid form.

        Raises:
            Conflict: Nothing is said, or the drawing is no JSON.
        """
        values = self.cleaned_data
        names, own = ("instruction", "derives", "keep_traffic", "density"), values["own_type"]
        document = _document(values["modification"]) if values["modification"] else None
        if document is None and not values["instruction"]:
            raise InvalidDocument("scenario", [("instruction", NOTHING)])
        return {name: values[name] for name in (*names, "goal")} | {
            "type": values["type"] or make_slug(own).replace("-", "_") or own,
            "reference": document,
        }


def _form_values(scenario: Scenario) -> dict[str, Any]:
    """Return a scenario as the form has it; a sentence of the drawing is made anew."""
    names = ("type", "keep_traffic", "goal")
    return {name: getattr(scenario, name) for name in names} | {
        "instruction": "" if scenario.instruction_is_generated else scenario.instruction,
        "density": scenario.traffic_density,
        "modification": _text(scenario.reference),
        "derives": scenario.intent is None or scenario.intent_origin == "derived",
    }


@form_for(*STAFF)
def scene_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show a scene with what is drawn on it, and add that as a scenario; or copy another."""
    scene = get_object_or_404(BaseScene, code=code)
    original, first = (
        _find_scenario(request, scene, "copy"),
        _find_scenario(request, scene, "follow"),
    )
    usual = {"keep_traffic": True, "derives": True} if original is None else _form_values(original)
    if first is not None:
        usual = _form_values(first) | {"instruction": "", "derives": True}
    form = ScenarioForm(request.POST or usual)
    if request.method == "POST" and form.is_valid():
        with refusals_in(form):
            wanted, name = form.to_values(), form.cleaned_data["slug"] or None
            if original is not None and not wanted["derives"]:
                wanted |= {"intent": original.intent, "intent_origin": original.intent_origin}
            reference = editing.reference_document(
                editing.make_draft(scene, None, keep_traffic=wanted["keep_traffic"]),
                wanted["reference"],
            )
            new = scenes.NewScenario(
                scene=scene.slug,
                **wanted | {"reference": reference},
                slug=name and free_slug(Scenario.objects, name, otherwise="scenario"),
                follows="" if first is None else first.slug,
                variant_of="" if original is None else original.slug,
            )
            made = scenes.add_scenario(new, actor=get_user(request))
            send_later(request, made)
            messages.success(request, f"“{made.slug}” is added.")
            return redirect("scenario", code=made.code)
    context = {
        "form": form,
        "first": first,
        "scenarios": scene.scenarios.only("base_scene", "code", "slug", "instruction"),
        "notes": scenarios.note_sentences(scene.notes),
        "facts": {name: len(scene.document.get(name, ())) for name in PARTS}
        | {
            "provenance": scene.provenance,
            "recorded_s": scene.recording["times_s"][-1] if scene.recording else 0.0,
        },
    }
    draft = editing.make_draft(scene, None, keep_traffic=True)
    return _editor(request, draft, form["modification"].value(), context)


def _find_scenario(request: HttpRequest, scene: BaseScene, name: str) -> Scenario | None:
    return scene.scenarios.filter(code=read_code(request.GET.get(name, ""))).first()


@form_for(*STAFF)
def edit_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Change the drawing and the sentence of a scenario, as far as nothing needs them yet."""
    scenario = find_scenario(code)
    form = ScenarioForm(request.POST or _form_values(scenario))
    if request.method == "POST" and form.is_valid():
        with refusals_in(form):
            content = scenes.ScenarioContent(**form.to_values())
            services.change_scenario(scenario, content, actor=get_user(request))
            send_later(request, scenario)
            messages.success(request, f"“{scenario.slug}” is changed.")
            return redirect("scenario", code=code)
    context = {"form": form, "refusal": services.why_not_editable(scenario)}
    return _editor(request, scenario, form["modification"].value(), context)


@form_for(*STAFF)
def correct_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Correct an augmentation; the result is an augmentation of its own."""
    rows = Augmentation.objects.select_related("contestant", "job", "scenario__base_scene")
    original = get_object_or_404(rows.defer("scenario__base_scene__recording"), code=code)
    slug = request.POST.get("contestant", "").strip() or follow_ups.BY_HAND
    notes = request.POST.get("notes", "")
    text = request.POST.get("modification", _text(follow_ups.starting_document(original)))
    if request.method == "POST":
        with refusals_told(request):
            made = follow_ups.keep_correction(
                original, _document(text), slug=slug, notes=notes, actor=get_user(request)
            )
            send_later(request, made)
            messages.success(request, "The correction is kept; a worker draws it.")
            return redirect("augmentation", code=made.code)
    people = Contestant.objects.filter(kind=Contestant.Kind.HUMAN, retired_at=None)
    correction = {"original": original, "people": people, "slug": slug, "notes": notes}
    return _editor(request, original.scenario, text, correction)


@act_for(*STAFF, back="scene")
def check_change(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Answer with what the checks find in a drawing, and what it asks for; nothing is kept."""
    scene = get_object_or_404(BaseScene.objects.defer("recording"), code=code)
    try:
        is_json = request.content_type == "application/json"  # a form is read already
        sent = _document(request.body) if is_json else None
        if not isinstance(sent, dict):
            raise Conflict("A JSON object is needed.")
    except Conflict as error:
        return JsonResponse({"problem": str(error)}, status=422)
    scenario = scene.scenarios.filter(code=read_code(str(sent.get("scenario") or ""))).first()
    draft = editing.make_draft(scene, scenario, keep_traffic=sent.get("keep_traffic") is True)
    if sent.get("derives") is True:
        draft.intent = None
    checked = check_edit(
        draft,
        sent.get("modification"),
        snapped=str(sent.get("snap") or ""),
        preset=sent.get("preset"),
    )
    lines = [
        {
            "severity": line.severity,
            "label": "measured" if line.severity == "fact" else line.severity,
            "sentence": line.sentence(),
        }
        for line in checked.findings
    ]
    draft.reference, sentence = checked.modification, ""
    if sent.get("derives") is True:
        _, sentence = scenes.derive_intent(draft, str(sent.get("type") or ""), "")
    reading = {"sentence": sentence, "statements": editing.intent_statements(draft.intent)}
    parts = ("modification", "problem", "is_against_intent", "presets", "ways")
    return JsonResponse(
        {"lines": lines} | reading | {name: getattr(checked, name) for name in parts}
    )


def _editor(
    request: HttpRequest, draft: Scenario, text: str | None, more: dict[str, Any]
) -> HttpResponse:
    drawn = scenarios.is_drawn(
        scenarios.scene_picture(draft.base_scene, scenarios.SceneView.BACKDROP)
    )
    waits = not drawn and request.method != "POST"
    if waits and not looks_again(request):
        send_later(request, draft.base_scene)
    context = {
        "scenario": draft,
        "scene": draft.base_scene,
        "editor": editing.editor_document(draft),
        "text": text or "",
        "types": [(kind.value, kind.value.replace("_", " ").lower()) for kind in editing.PLACED],
        "is_drawn": drawn,
        **wait_for_workers(waits=waits),
        **more,
    }
    # What was sent has been refused.
    status = 422 if request.method == "POST" else 200
    return render(request, "scenarios/edit.html", context, status=status)


def _text(document: object) -> str:
    return "" if document is None else json.dumps(document, indent=2)


def _document(text: str | bytes) -> object:
    """Return the posted document; raise Conflict if it is too long or no JSON."""
    if len(text) > LONGEST_CHANGE:
        raise Conflict("The change is too long.")
    return read_json(text, otherwise="The change is no JSON.")
