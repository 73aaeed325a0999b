"""The button that loads what comes with the project."""

from __future__ import annotations

from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse
from django.shortcuts import redirect
from django.views.decorators.http import require_POST

from arena.site.access import ADMIN, allow_only
from augment.errors import AugmentError
from augment.services.endpoints.contestants import ensure_builtin
from augment.services.scenarios.catalogue import load_own_catalogue


@allow_only(ADMIN)
@require_POST
def load_scenarios(request: HttpRequest) -> HttpResponse:
    """Load one set of the catalogue, all of it or nothing, and those who ask nobody."""
    actor = cast(User, request.user)
    try:
        report = load_own_catalogue(
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
            "added": report.scenarios_added,
            "changed": report.scenarios_changed,
            "unchanged": report.scenarios_unchanged,
        }
        messages.success(request, done % numbers)
        if report.kept:
            names = ", ".join(report.kept)
            messages.warning(request, f"Kept as stored, because augmentations use them: {names}.")
    return redirect("scenarios")
