"""What a scenario's instruction asks for, on its page: accept what a model read, or replace it."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.db import transaction
from django.http import Http404, HttpRequest, HttpResponse, JsonResponse
from django.shortcuts import get_object_or_404, redirect
from django.views.decorators.http import require_POST, require_safe

from arena.site.access import ADMIN, STAFF, allow_only
from arena.site.forms import read_json
from augment.errors import AugmentError, Conflict, QueueFault
from augment.models import EndpointModel, Scenario
from augment.services.running.intent_readings import plan_reading
from augment.services.scenarios.editing import accept_reading, enter_intent
from augment.tasks import enqueue_reading

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
