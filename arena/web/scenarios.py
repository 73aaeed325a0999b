"""Pages of the catalogue and of single augmentations, and the pictures on them."""

from __future__ import annotations

import uuid

from django.http import Http404, HttpRequest, HttpResponse, HttpResponseBase
from django.shortcuts import get_object_or_404, render
from django.views.decorators.http import require_safe

from arena.queries import scenarios
from arena.queries.modifications import modification_lines
from arena.web.access import STAFF, only
from arena.web.pictures import picture_response
from augment.models import Augmentation, Scenario


@only(*STAFF)
@require_safe
def scenarios_page(request: HttpRequest) -> HttpResponse:
    """The contact sheet: every scenario by type, its reference where it was drawn."""
    context = {"groups": scenarios.by_type(), "references": scenarios.reference_pictures()}
    return render(request, "scenarios/list.html", context)


@only(*STAFF)
@require_safe
def scenario_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """One scenario: before and after the reference, and every other result."""
    scenario = get_object_or_404(Scenario.objects.select_related("base_scene"), code=code)
    context = {
        "scenario": scenario,
        "reference_code": scenarios.reference_pictures().get(scenario.pk),
        "lines": modification_lines(scenario.reference),
        "augmentations": scenarios.augmentations_of(scenario),
    }
    return render(request, "scenarios/scenario.html", context)


@only(*STAFF)
@require_safe
def augmentation_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """One augmentation with everything that led to it."""
    rows = Augmentation.objects.select_related("job", "scenario", "contestant")
    augmentation = get_object_or_404(rows, code=code)
    context = {
        "augmentation": augmentation,
        "lines": modification_lines(augmentation.modification),
        "attempts": list(augmentation.attempts.prefetch_related("calls")),
    }
    return render(request, "jobs/augmentation.html", context)


@only(*STAFF)
@require_safe
def picture(request: HttpRequest, kind: str, code: uuid.UUID) -> HttpResponseBase:
    """A picture by what it belongs to; the addresses of experts' pictures are others."""
    if kind == "original":
        name = get_object_or_404(Scenario.objects.only("original_image"), code=code).original_image
    elif kind == "augmentation":
        name = get_object_or_404(Augmentation.objects.only("image"), code=code).image
    else:
        raise Http404
    return picture_response(name)
