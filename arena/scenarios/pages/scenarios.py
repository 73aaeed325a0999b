"""Pages of the catalogue and of single augmentations, and the pictures on them."""

from __future__ import annotations

import re
import uuid
from functools import partial
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.db import transaction
from django.http import Http404, HttpRequest, HttpResponse, HttpResponseBase, JsonResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.views.decorators.http import require_http_methods, require_POST, require_safe

from arena.contestants.queries import asking_of
from arena.scenarios import queries
from arena.scenarios.queries import modification_lines
from arena.scenarios.services import delete_scenario, delete_scene, rename_scene, why_not_editable
from arena.site.access import ADMIN, STAFF, allow_only
from arena.site.acts import Confirmation, ask, is_sure, looks_again, send_later
from arena.site.forms import read_json
from arena.site.listing import read_listing, read_page, said_choices
from arena.site.queries import Narrowing, find_scenarios, group_by_type
from arena.web.pictures import picture_response, sized_picture_response
from augment.errors import AugmentError, Conflict, QueueFault
from augment.models import (
    Augmentation,
    BaseScene,
    EndpointModel,
    Scenario,
    Simulation,
    UploadMoment,
)
from augment.services.endpoints.contestants import ensure_builtin
from augment.services.events import retire, take_back
from augment.services.judging.displacement import of_augmentation
from augment.services.judging.findings import Checked, check_augmentation
from augment.services.running.calls import IMAGES
from augment.services.running.intent_readings import plan_reading
from augment.services.running.transcript_records import totals_of, transcript_of, tries_of
from augment.services.scenarios.catalogue import Step, load_catalogue
from augment.services.scenarios.editing import (
    accept_reading,
    enter_intent,
    last_reading,
    statements_of,
    waiting_reading,
)
from augment.services.scenarios.pictures import (
    SceneView,
    is_drawn,
    reference_picture,
    scene_picture,
)
from augment.services.scenarios.scene_imports import notes_of
from augment.services.scenarios.scenes import type_choices
from augment.tasks import enqueue_marks, enqueue_reading, enqueue_scenario

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


LONGEST_FILE = 200_000


@allow_only(*STAFF)
@require_safe
def intent_file(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The intent as its JSON document, to be mended and given back."""
    scenario = get_object_or_404(Scenario, code=code)
    if scenario.intent is None:
        raise Http404
    answer = JsonResponse(scenario.intent, json_dumps_params={"indent": 2, "ensure_ascii": False})
    answer["Content-Disposition"] = f'attachment; filename="intent-{scenario.slug}.json"'
    return answer


@allow_only(*STAFF)
@require_POST
def set_intent(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Accept the last reading, or take the intent of the file that came along."""
    scenario = get_object_or_404(Scenario, code=code)
    actor = request.user if request.user.is_authenticated else None
    try:
        if "accept" in request.POST:
            accept_reading(scenario=scenario.slug, actor=actor)
        else:
            enter_intent(scenario=scenario.slug, document=_document(request), actor=actor)
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        messages.success(request, "The intent is set. It counts from now on.")
    return redirect("scenario", code=code)


@allow_only(ADMIN)
@require_POST
def read_instruction(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Have a model read the instruction; a worker asks it, and what it read waits on this page."""
    scenario = get_object_or_404(Scenario, code=code)
    chosen = _reader(request)
    known = EndpointModel.objects.select_related("endpoint")
    reader = None if chosen is None else known.filter(code=chosen).first()
    if reader is None:
        messages.error(request, "Choose a model.")
        return redirect("scenario", code=code)
    try:
        with transaction.atomic():
            reading = plan_reading(
                scenario=scenario.slug,
                endpoint=reader.endpoint.label,
                model=reader.model,
                actor=cast(User, request.user),
            )
        enqueue_reading(reading.pk)
    except (AugmentError, QueueFault) as error:
        messages.error(request, str(error))
    else:
        messages.success(request, f"{reader.model} reads it now.")
    return redirect("scenario", code=code)


def _reader(request: HttpRequest) -> uuid.UUID | None:
    try:
        return uuid.UUID(request.POST.get("reader", ""))
    except ValueError:
        return None


def _document(request: HttpRequest) -> object:
    """What the file holds.

    Raises:
        Conflict: There is none, it is too long, or it is no JSON.
    """
    file = request.FILES.get("file")
    if file is None:
        raise Conflict("Choose a JSON file.")
    if file.size is None or file.size > LONGEST_FILE:
        raise Conflict("The file is too long for an intent.")
    return read_json(file.read(), otherwise="The file is no JSON.")


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def delete_scenario_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Delete a scenario that nothing depends on."""
    scenario = get_object_or_404(Scenario, code=code)
    if not is_sure(request):
        return ask(request, _question(scenario.slug, reverse("scenario", args=[code])))
    try:
        delete_scenario(scenario, actor=cast(User, request.user))
    except AugmentError as error:
        messages.error(request, str(error))
        return redirect("scenario", code=code)
    messages.success(request, f"“{scenario.slug}” is deleted.")
    return redirect("scenarios")


@allow_only(ADMIN)
@require_http_methods(["GET", "HEAD", "POST"])
def delete_scene_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Delete a scene that no scenario stands on."""
    scene = get_object_or_404(BaseScene.objects.defer("recording", "document"), code=code)
    if not is_sure(request):
        return ask(request, _question(scene.slug, reverse("scene", args=[code])))
    try:
        delete_scene(scene, actor=cast(User, request.user))
    except AugmentError as error:
        messages.error(request, str(error))
        return redirect("scene", code=code)
    messages.success(request, f"“{scene.slug}” is deleted.")
    return redirect("scenes")


@allow_only(ADMIN)
@require_POST
def set_scenario_retired(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Retire a scenario, or take that back."""
    row = get_object_or_404(Scenario, code=code)
    change = take_back if request.POST.get("retired") == "no" else retire
    change(row, actor=cast(User, request.user))
    return redirect("scenario", code=code)


@allow_only(ADMIN)
@require_POST
def set_scene_retired(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Retire a scene, or take that back."""
    row = get_object_or_404(BaseScene.objects.defer("recording", "document"), code=code)
    change = take_back if request.POST.get("retired") == "no" else retire
    change(row, actor=cast(User, request.user))
    return redirect("scene", code=code)


@allow_only(*STAFF)
@require_POST
def rename_scene_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Give a scene without scenarios another slug."""
    row = get_object_or_404(BaseScene.objects.only("code", "slug"), code=code)
    try:
        rename_scene(row, request.POST.get("slug", "").strip(), actor=cast(User, request.user))
    except AugmentError as error:
        messages.error(request, str(error))
    return redirect("scene", code=code)


def _question(slug: str, back: str) -> Confirmation:
    return Confirmation(
        title=f"Delete “{slug}”?",
        facts=("Only what no job, study or scenario needs is deleted. There is no way back.",),
        button="Delete",
        back=back,
    )


@allow_only(ADMIN)
@require_POST
def load_scenarios(request: HttpRequest) -> HttpResponse:
    """Load one set of the catalogue, all of it or nothing, and those who ask nobody."""
    actor = cast(User, request.user)
    try:
        report = load_catalogue(
            sets=[request.POST.get("set", "")],
            with_paraphrases="wordings" in request.POST,
            actor=actor,
        )
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        ensure_builtin()
        done = "Scenarios: %(added)s added, %(changed)s changed, %(unchanged)s as they were."
        numbers = {
            name: report.scenarios[Step(name)] for name in ("added", "changed", "unchanged")
        }
        messages.success(request, done % numbers)
        if report.kept:
            names = ", ".join(report.kept)
            messages.warning(request, f"Kept as stored, because augmentations use them: {names}.")
    return redirect("scenarios")
