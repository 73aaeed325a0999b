"""Pages of the catalogue: scenarios with their intents; retiring, renaming and deleting."""

import uuid
from typing import Any

from django.contrib import messages
from django.db import transaction
from django.http import Http404, HttpRequest, HttpResponse, JsonResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.scenarios import queries, services
from arena.site.access import ADMIN, STAFF, allow_only, user_of
from arena.site.acts import Confirmation, ask, is_sure, looks_again, refusals_told, send_later
from arena.site.forms import read_json
from arena.site.listing import read_listing, read_page
from augment.errors import Conflict
from augment.models import BaseScene, EndpointModel, Scenario
from augment.services.endpoints.contestants import ensure_builtin
from augment.services.events import retire, take_back
from augment.services.running.intent_readings import plan_reading
from augment.services.scenarios.catalogue import CatalogueStep, load_catalogue
from augment.services.scenarios.editing import (
    accept_reading,
    enter_intent,
    last_reading,
    statements_of,
    waiting_reading,
)
from augment.services.scenarios.pictures import is_drawn, reference_picture
from augment.services.scenarios.scene_imports import notes_of
from augment.services.scenarios.scenes import type_choices
from augment.tasks import enqueue_reading, enqueue_scenario

SCENARIOS_AT_ONCE = 60
LONGEST_FILE = 200_000
JSON_STYLE = {"indent": 2, "ensure_ascii": False}


@allow_only(*STAFF)
@require_safe
def scenarios_page(request: HttpRequest) -> HttpResponse:
    """List scenarios of a set by type, with the reference where it was drawn."""
    chosen = queries.set_asked(request.GET.get("set"))
    choices = {"type": ("Type", type_choices()), "offered": ("In forms", [("retired", "retired")])}
    listing = read_listing(request, choices, keep=("set",))
    found = queries.listed_scenarios(chosen, is_retired=bool(listing.chosen("offered")))
    found = listing.narrow(found, "slug", "instruction", "base_scene__slug", by=["type"])
    page = read_page(request, found, size=SCENARIOS_AT_ONCE)
    rows = list(page.object_list)
    context = {
        "groups": queries.group_by_type(rows),
        "sets": queries.set_choices(chosen),
        "references": queries.reference_pictures(rows),
        "page": page,
        "listing": listing,
    }
    return render(request, "scenarios/list.html", context)


@allow_only(ADMIN)
@require_POST
def load_scenarios(request: HttpRequest) -> HttpResponse:
    """Load one set of the catalogue, all of it or nothing, and the built-in contestants."""
    with refusals_told(request):
        report = load_catalogue(
            sets=[request.POST.get("set", "")],
            with_paraphrases="wordings" in request.POST,
            actor=user_of(request),
        )
        ensure_builtin()
        messages.success(
            request,
            "Scenarios: {added} added, {changed} changed, {unchanged} as they were.".format(
                **{step.value: report.scenarios[step] for step in CatalogueStep}
            ),
        )
        if report.kept:
            names = ", ".join(report.kept)
            messages.warning(request, f"Kept as stored, because augmentations use them: {names}.")
    return redirect("scenarios")


@allow_only(*STAFF)
@require_safe
def scenario_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show one scenario: before and after the reference, and every other result."""
    rows = Scenario.objects.select_related("base_scene", "paraphrase_of")
    scenario = get_object_or_404(rows, code=code)
    reading, reference = waiting_reading(scenario), reference_picture(scenario)
    has_picture = is_drawn(reference)
    is_waiting = not scenario.original_image or (
        scenario.reference is not None and not has_picture
    )
    look = looks_again(request, waits=is_waiting)
    if look == 1:
        send_later(request, enqueue_scenario, scenario.pk)
    readers = EndpointModel.objects.select_related("endpoint")
    context = {
        "scenario": scenario,
        "paraphrases": scenario.paraphrases.all(),
        "has_picture": has_picture,
        "reference_version": reference[-16:-4],
        "look": look,
        "why_not_editable": services.why_not_editable(scenario),
        "lines": queries.modification_lines(scenario.reference),
        "statements": statements_of(scenario.intent),
        "reading": reading,
        "reading_statements": statements_of(None if reading is None else reading.document),
        "last_reading": last_reading(scenario),
        "readers": readers.order_by("endpoint__label", "model"),
        "notes": notes_of(scenario.base_scene),
        "augmentations": queries.augmentations_of(scenario),
    }
    return render(request, "scenarios/scenario.html", context)


# --- Intents -----------------------------------------------------------------------------------


@allow_only(*STAFF)
@require_safe
def intent_file(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Answer with the intent as its JSON document, to be edited and sent back."""
    scenario = get_object_or_404(Scenario, code=code)
    if scenario.intent is None:
        raise Http404
    answer = JsonResponse(scenario.intent, json_dumps_params=JSON_STYLE)
    answer["Content-Disposition"] = f'attachment; filename="intent-{scenario.slug}.json"'
    return answer


@allow_only(*STAFF)
@require_POST
def set_intent(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Accept the last reading, or take the intent of the file that came along."""
    scenario = get_object_or_404(Scenario, code=code)
    with refusals_told(request):
        if "accept" in request.POST:
            accept_reading(scenario=scenario.slug, actor=user_of(request))
        else:
            file = request.FILES.get("file")
            if file is None:
                raise Conflict("Choose a JSON file.")
            if file.size is None or file.size > LONGEST_FILE:
                raise Conflict("The file is too long for an intent.")
            document = read_json(file.read(), otherwise="The file is no JSON.")
            enter_intent(scenario=scenario.slug, document=document, actor=user_of(request))
        messages.success(request, "The intent is set. It counts from now on.")
    return redirect("scenario", code=code)


@allow_only(ADMIN)
@require_POST
def read_instruction(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Have a worker ask a model to read the instruction; what it read waits on the page."""
    scenario = get_object_or_404(Scenario, code=code)
    known = EndpointModel.objects.select_related("endpoint")
    try:
        reader = known.filter(code=uuid.UUID(request.POST.get("reader", ""))).first()
    except ValueError:
        reader = None
    if reader is None:
        messages.error(request, "Choose a model.")
        return redirect("scenario", code=code)
    with refusals_told(request), transaction.atomic():
        reading = plan_reading(
            scenario=scenario, endpoint=reader.endpoint, model=reader.model, actor=user_of(request)
        )
        send_later(request, enqueue_reading, reading.pk)
        messages.success(request, f"{reader.model} reads it now.")
    return redirect("scenario", code=code)


# --- Retiring, renaming, deleting --------------------------------------------------------------


def _find(kind: str, code: uuid.UUID) -> Scenario | BaseScene:
    if kind == "scenario":
        return get_object_or_404(Scenario, code=code)
    return get_object_or_404(BaseScene.objects.defer("recording", "document"), code=code)


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def delete(request: HttpRequest, code: uuid.UUID, kind: str) -> HttpResponse:
    """Delete a scenario or scene that nothing depends on, once that is confirmed."""
    row = _find(kind, code)
    if not is_sure(request):
        facts = ("Only what no job, study or scenario needs is deleted. There is no way back.",)
        back = reverse(kind, args=[code])
        question = Confirmation(
            title=f"Delete “{row.slug}”?", facts=facts, button="Delete", back=back
        )
        return ask(request, question)
    with refusals_told(request):
        services.delete(row, actor=user_of(request))
        messages.success(request, f"“{row.slug}” is deleted.")
        return redirect(f"{kind}s")
    return redirect(kind, code=code)


@allow_only(ADMIN)
@require_POST
def set_retired(request: HttpRequest, code: uuid.UUID, kind: str) -> HttpResponse:
    """Retire a scenario or scene, or take that back."""
    row: Any = _find(kind, code)
    change = take_back if request.POST.get("retired") == "no" else retire
    change(row, actor=user_of(request))
    return redirect(kind, code=code)


@allow_only(*STAFF)
@require_POST
def rename_scene(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Give a scene without scenarios another slug."""
    row = get_object_or_404(BaseScene.objects.only("code", "slug"), code=code)
    with refusals_told(request):
        services.rename_scene(row, request.POST.get("slug", "").strip(), actor=user_of(request))
    return redirect("scene", code=code)
