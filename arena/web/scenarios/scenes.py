"""Pages of scenes: which there are, and what one of them holds."""

from __future__ import annotations

import uuid

from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, render
from django.views.decorators.http import require_safe

from arena.scenarios.queries import counts_of, scene_rows, upload_rows
from arena.site.access import STAFF, allow_only
from arena.site.acts import looks_again, send_later
from augment.models import BaseScene
from augment.services.scenarios import uploads
from augment.services.scenarios.pictures import SceneView, is_drawn, scene_picture
from augment.services.scenarios.scene_imports import notes_of
from augment.tasks import enqueue_scene


@allow_only(*STAFF)
@require_safe
def scenes_page(request: HttpRequest) -> HttpResponse:
    """Every scene, the files that were sent, and the form to send another."""
    context = {
        "scenes": scene_rows(),
        "uploads": upload_rows(),
        "formats": uploads.FORMATS.items(),
        "most_megabytes": uploads.most_megabytes(),
    }
    return render(request, "scenes/list.html", context)


@allow_only(*STAFF)
@require_safe
def scene_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """One scene: drawn with and without its traffic, what is in it, its scenarios."""
    row = get_object_or_404(BaseScene, code=code)
    drawn = is_drawn(scene_picture(row, SceneView.KEPT))
    look = looks_again(request, waits=not drawn)
    if look == 1:
        send_later(request, enqueue_scene, row.pk)
    context = {
        "scene": row,
        "counts": counts_of(row),
        "notes": notes_of(row),
        "scenarios": row.scenarios.only("base_scene", "code", "slug", "instruction"),
        "is_drawn": drawn,
        "look": look,
    }
    return render(request, "scenes/scene.html", context)
