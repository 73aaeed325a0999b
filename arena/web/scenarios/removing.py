"""Retiring scenarios and scenes, renaming and deleting them; says what needs them."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect
from django.urls import reverse
from django.views.decorators.http import require_http_methods, require_POST

from arena.scenarios.services import delete_scenario, delete_scene, rename_scene
from arena.site.access import ADMIN, STAFF, allow_only
from arena.site.acts import Confirmation, ask, is_sure
from augment.errors import AugmentError
from augment.models import BaseScene, Scenario
from augment.services.events import retire, take_back


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
