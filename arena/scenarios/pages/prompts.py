"""What a variant would send for a scenario, on a page, before anything is sent."""

from __future__ import annotations

import json
import uuid
from typing import Any
from urllib.parse import urlencode

from django.http import Http404, HttpRequest, HttpResponse, HttpResponseBase
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.views.decorators.http import require_safe

from arena.contestants.queries import asking_of
from arena.site.access import STAFF, allow_only
from arena.site.acts import looks_again, send_later
from arena.web.pictures import picture_response
from augment.errors import AugmentError, UnknownName
from augment.models import Contestant, Scenario
from augment.services.endpoints.contestants import asking_contestants, preview_contestant
from augment.services.endpoints.treatments import respondents_of
from augment.services.scenarios.prompts import Preview, list_choices, preview_prompt
from augment.tasks import enqueue_prompts


@allow_only(*STAFF)
@require_safe
def prompts_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """The exact messages of a variant's role, with about how many tokens they are."""
    scenario = _scenario(code)
    problem, found = "", Preview(shown=None)
    try:
        found = _preview(request, scenario)
    except AugmentError as error:
        problem = str(error)
    look = looks_again(request, waits=found.shown is None and not problem)
    if look == 1:
        send_later(request, enqueue_prompts, scenario.pk)
    variant = request.GET.get("variant", "otm")
    choices = list_choices()
    contestant = _contestant(request)
    context = {
        "contestants": asking_contestants(),
        "contestant": contestant,
        **_how(contestant, request.GET.get("role", "modifier")),
        "scenario": scenario,
        "choices": choices,
        "chosen": next((one for one in choices if one.slug == variant), None),
        "role": request.GET.get("role", "modifier"),
        "is_native": "native" in request.GET,
        "preview": found,
        "size": len(_written(found).encode()),
        "problem": problem,
        "query": request.GET.urlencode(),
        "look": look,
    }
    return render(request, "scenarios/prompts.html", context)


@allow_only(*STAFF)
@require_safe
def contestant_prompts(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """To what a contestant would send for the scenario that was chosen, else the first one."""
    contestant = get_object_or_404(Contestant, code=code)
    rows = Scenario.objects.order_by("type", "slug")
    if slug := request.GET.get("scenario"):
        rows = rows.filter(slug=slug)
    scenario = rows.only("code").first()
    if scenario is None:
        raise Http404
    address = reverse("prompts", args=[scenario.code])
    return redirect(f"{address}?{urlencode({'contestant': contestant.slug})}")


@allow_only(*STAFF)
@require_safe
def prompt_file(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Messages and tools as they would be sent, as JSON."""
    scenario = _scenario(code)
    try:
        found = _preview(request, scenario)
    except UnknownName as error:
        raise Http404 from error
    except AugmentError as error:
        return HttpResponse(str(error), status=422, content_type="text/plain; charset=utf-8")
    if found.shown is None:
        raise Http404
    answer = HttpResponse(_written(found), content_type="application/json")
    answer["Content-Disposition"] = f'attachment; filename="prompt-{scenario.slug}.json"'
    return answer


@allow_only(*STAFF)
@require_safe
def prompt_image(request: HttpRequest, code: uuid.UUID, number: int) -> HttpResponseBase:
    """A picture that the viewer of a variant would be shown."""
    try:
        found = _preview(request, _scenario(code))
    except AugmentError as error:
        raise Http404 from error
    if number >= len(found.images):
        raise Http404
    return picture_response(found.images[number])


def _scenario(code: uuid.UUID) -> Scenario:
    rows = Scenario.objects.select_related("base_scene").defer("base_scene__recording")
    return get_object_or_404(rows, code=code)


def _contestant(request: HttpRequest) -> Contestant | None:
    """The one that the address names by its slug, None where it names none.

    Raises:
        Http404: There is none of that name.
    """
    slug = request.GET.get("contestant")
    if not slug:
        return None
    return get_object_or_404(Contestant.objects.select_related("endpoint"), slug=slug)


def _how(contestant: Contestant | None, role: str) -> dict[str, Any]:
    """What goes with the messages of a contestant: its options, and who is asked."""
    if contestant is None:
        return {}
    try:
        respondents = {one.value: who for one, who in respondents_of(contestant).items()}
        return {"asking": asking_of(contestant), "respondent": respondents.get(role)}
    except AugmentError:  # said above the messages, of which there are none
        return {}


def _preview(request: HttpRequest, scenario: Scenario) -> Preview:
    contestant = _contestant(request)
    if contestant is not None:
        role = request.GET.get("role", "modifier")
        return preview_contestant(scenario, contestant, role=role)
    return preview_prompt(
        scenario,
        variant=request.GET.get("variant", "otm"),
        role=request.GET.get("role", "modifier"),
        native_tools="native" in request.GET,
    )


def _written(found: Preview) -> str:
    return json.dumps(found.to_document(), ensure_ascii=False)
