"""Pages of the catalogue and of single augmentations, and the pictures on them."""

from __future__ import annotations

import re
import uuid
from functools import partial

from django.contrib import messages
from django.db import transaction
from django.http import Http404, HttpRequest, HttpResponse, HttpResponseBase, JsonResponse
from django.shortcuts import get_object_or_404, render
from django.views.decorators.http import require_safe

from arena.contestants.queries import asking_of
from arena.scenarios import queries
from arena.scenarios.queries import modification_lines
from arena.scenarios.services import why_not_editable
from arena.site.access import STAFF, allow_only
from arena.site.acts import looks_again, send_later
from arena.site.listing import read_listing, read_page, said_choices
from arena.site.queries import Narrowing, find_scenarios, group_by_type
from arena.web.pictures import picture_response, sized_picture_response
from augment.errors import QueueFault
from augment.models import (
    Augmentation,
    BaseScene,
    EndpointModel,
    Scenario,
    Simulation,
    UploadMoment,
)
from augment.services.judging.displacement import of_augmentation
from augment.services.judging.findings import Checked, check_augmentation
from augment.services.running.calls import IMAGES
from augment.services.running.transcript_records import totals_of, transcript_of, tries_of
from augment.services.scenarios.editing import last_reading, statements_of, waiting_reading
from augment.services.scenarios.pictures import (
    SceneView,
    is_drawn,
    reference_picture,
    scene_picture,
)
from augment.services.scenarios.scene_imports import notes_of
from augment.services.scenarios.scenes import type_choices
from augment.tasks import enqueue_marks, enqueue_scenario

LOOKS = tuple(str(number) for number in range(6))
"""So often the page of an augmentation looks again for a picture that is being drawn."""


SCENARIOS_AT_ONCE = 60


@allow_only(*STAFF)
@require_safe
def scenarios_page(request: HttpRequest) -> HttpResponse:
    """The contact sheet: scenarios of a set by type, the reference where it was drawn."""
    chosen = queries.set_asked(request.GET.get("set"))
    choices = {
        "type": ("Type", said_choices(type_choices())),
        "offered": ("In forms", [("retired", "retired")]),
    }
    listing = read_listing(request, choices, keep=("set",))
    wanted = Narrowing(
        search=listing.search,
        kind=listing.chosen("type"),
        part=chosen,
        is_retired=listing.chosen("offered") == "retired",
    )
    page = read_page(request, find_scenarios(wanted), size=SCENARIOS_AT_ONCE)
    rows = list(page.object_list)
    context = {
        "groups": group_by_type(rows),
        "sets": queries.set_choices(chosen),
        "references": queries.reference_pictures(rows),
        "page": page,
        "listing": listing,
    }
    return render(request, "scenarios/list.html", context)


@allow_only(*STAFF)
@require_safe
def scenario_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """One scenario: before and after the reference, and every other result."""
    scenario = get_object_or_404(
        Scenario.objects.select_related("base_scene", "paraphrase_of"), code=code
    )
    reading = waiting_reading(scenario)
    is_waiting = not scenario.original_image or (
        scenario.reference is not None and not is_drawn(reference_picture(scenario))
    )
    look = looks_again(request, waits=is_waiting)
    if look == 1:
        send_later(request, enqueue_scenario, scenario.pk)
    context = {
        "scenario": scenario,
        "paraphrases": scenario.paraphrases.all(),
        "has_picture": is_drawn(reference_picture(scenario)),
        "reference_version": reference_picture(scenario)[-16:-4],
        "look": look,
        "why_not_editable": why_not_editable(scenario),
        "lines": modification_lines(scenario.reference),
        "statements": statements_of(scenario.intent),
        "reading": reading,
        "reading_statements": statements_of(None if reading is None else reading.document),
        "last_reading": last_reading(scenario),
        "readers": EndpointModel.objects.select_related("endpoint").order_by(
            "endpoint__label", "model"
        ),
        "notes": notes_of(scenario.base_scene),
        "augmentations": queries.augmentations_of(scenario),
    }
    return render(request, "scenarios/scenario.html", context)


@allow_only(*STAFF)
@require_safe
def augmentation_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """One augmentation with everything that led to it."""
    augmentation = _augmentation(code)
    tries = tries_of(augmentation)
    measured = check_augmentation(augmentation)
    context = {
        "augmentation": augmentation,
        "lines": modification_lines(augmentation.modification),
        "corrections": augmentation.corrections.select_related("contestant", "made_by"),
        "drive": augmentation.simulations.filter(state=Simulation.State.DONE).first(),
        "measured": of_augmentation(augmentation),
        "checked": measured,
        "drawing": _drawing(request, augmentation, measured),
        "tries": tries,
        "asking": asking_of(augmentation.contestant, augmentation.options),
        "totals": totals_of(tries),
    }
    return render(request, "jobs/augmentation.html", context)


@allow_only(*STAFF)
@require_safe
def transcript(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The whole record of an augmentation as one JSON file."""
    document = transcript_of(_augmentation(code))
    answer = JsonResponse(document, json_dumps_params={"indent": 2, "ensure_ascii": False})
    answer["Content-Disposition"] = f'attachment; filename="transcript-{code}.json"'
    answer["Cache-Control"] = "private, no-store"
    return answer


@allow_only(*STAFF)
@require_safe
def asked_image(request: HttpRequest, digest: str) -> HttpResponseBase:
    """An image that a language model was shown, by the hash that its request names."""
    if not re.fullmatch(r"[0-9a-f]{64}", digest):
        raise Http404
    return picture_response(f"{IMAGES}/{digest}.png")


@allow_only(*STAFF)
@require_safe
def picture(request: HttpRequest, kind: str, code: uuid.UUID) -> HttpResponseBase:
    """A picture by what it belongs to; the addresses of experts' pictures are others."""
    if kind == "original":
        name = get_object_or_404(Scenario.objects.only("original_image"), code=code).original_image
    elif kind == "augmentation":
        name = get_object_or_404(Augmentation.objects.only("image"), code=code).image
    elif kind == "marked":
        found = check_augmentation(_augmentation(code))
        name = "" if found is None else found.picture
    elif kind == "moment":
        name = get_object_or_404(UploadMoment.objects.only("picture"), code=code).picture
    elif kind == "reference":
        rows = Scenario.objects.select_related("base_scene")
        name = reference_picture(get_object_or_404(rows, code=code))
    elif kind in list(SceneView):
        rows_of_scenes = BaseScene.objects.defer("recording")
        name = scene_picture(get_object_or_404(rows_of_scenes, code=code), SceneView(kind))
    else:
        raise Http404
    return sized_picture_response(request, name)


def _drawing(request: HttpRequest, augmentation: Augmentation, found: Checked | None) -> int:
    """Have the marked picture drawn; how often the page has looked for it, 0 to look no more."""
    if found is None or not found.picture or found.is_drawn:
        return 0
    looked = request.GET.get("drawing", "0")
    number = int(looked) if looked in LOOKS else 0
    if number == 0:
        transaction.on_commit(partial(_send_marks, request, augmentation.pk))
    return (number + 1) % len(LOOKS)


def _send_marks(request: HttpRequest, augmentation_pk: int) -> None:
    try:
        enqueue_marks(augmentation_pk)
    except QueueFault as error:
        messages.warning(request, str(error))


def _augmentation(code: uuid.UUID) -> Augmentation:
    rows = Augmentation.objects.select_related(
        *("job", "scenario__base_scene", "contestant__endpoint", "made_by"), "corrects__contestant"
    ).defer("scenario__base_scene__recording")
    return get_object_or_404(rows, code=code)
