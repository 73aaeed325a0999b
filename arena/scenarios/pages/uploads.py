"""Scenes, and how they come from recordings: a worker reads a file, a person chooses a moment."""

import uuid

from django.contrib import messages
from django.db.models import Count
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse

from arena.scenarios import queries
from arena.scenarios.services import was_too_large
from arena.site.access import STAFF, act_for, page_for, user_of
from arena.site.acts import looks_again, refusals_told, send_later
from arena.site.forms import read_code
from augment.errors import Conflict
from augment.models import BaseScene, SceneUpload, UploadMoment
from augment.services.scenarios import uploads
from augment.services.scenarios.pictures import SceneView, is_drawn, scene_picture
from augment.services.scenarios.scene_imports import notes_of
from augment.tasks import enqueue_moment, enqueue_scene, enqueue_upload

UPLOADS_SHOWN = 20
PARTS = ("agents", "lanes", "connectors", "areas")


@page_for(*STAFF)
def scenes_page(request: HttpRequest) -> HttpResponse:
    """List every scene, the files that were sent, and the form to send another."""
    scenes = BaseScene.objects.defer("document", "recording", "notes")
    sent = SceneUpload.objects.defer("tracks").select_related("uploaded_by")
    context = {
        "scenes": scenes.annotate(number=Count("scenarios")).order_by("-created_at", "slug"),
        "uploads": sent[:UPLOADS_SHOWN],
        "formats": uploads.FORMATS.items(),
        "most_megabytes": uploads.most_megabytes(),
    }
    return render(request, "scenes/list.html", context)


@page_for(*STAFF)
def scene_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show one scene: drawn with and without its traffic, what is in it, its scenarios."""
    row = get_object_or_404(BaseScene, code=code)
    context = {
        "scene": row,
        "counts": {name: len(row.document.get(name, ())) for name in PARTS},
        "recorded_s": row.recording["times_s"][-1] if row.recording else 0.0,
        "notes": notes_of(row),
        "scenarios": row.scenarios.only("base_scene", "code", "slug", "instruction"),
        **look_at(request, row, SceneView.KEPT),
    }
    return render(request, "scenes/scene.html", context)


def look_at(request: HttpRequest, scene: BaseScene, view: SceneView) -> dict[str, object]:
    """Return whether a scene's picture is drawn; where it isn't, a worker is asked to."""
    drawn = is_drawn(scene_picture(scene, view))
    look = looks_again(request, waits=not drawn and request.method != "POST")
    if look == 1:
        send_later(request, enqueue_scene, scene.pk)
    return {"is_drawn": drawn, "look": look}


@act_for(*STAFF, back="scenes")
def send_file(request: HttpRequest) -> HttpResponse:
    """Keep a recording and leave it to a worker."""
    file = request.FILES.get("file")
    if file is None or was_too_large(request.META):
        raise Conflict(
            f"Choose a file of at most {uploads.most_megabytes()} MB; a zip may be smaller."
        )
    row = uploads.keep_upload(
        name=file.name or "",
        content=file,
        source=request.POST.get("format", ""),
        actor=user_of(request),
    )
    send_later(request, enqueue_upload, row.pk)
    return redirect("upload", code=row.code)


@page_for(*STAFF)
def upload_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show what a file is, what it holds, and the moment that somebody looks at."""
    row = get_object_or_404(SceneUpload.objects.select_related("uploaded_by"), code=code)
    asked = read_code(request.GET.get("moment", ""))
    moment = row.moments.select_related("scene").filter(code=asked).first()
    waits = row.state in row.UNDER_WAY or (moment is not None and moment.state in moment.UNDER_WAY)
    maps = [queries.track_map(number, track) for number, track in enumerate(row.tracks)]
    context = {
        "upload": row,
        "maps": maps,
        "moment": moment,
        "chosen": moment and queries.place_of(maps, moment),
        "notes": [] if moment is None else uploads.sentences_of(moment),
        "kept": row.moments.filter(state=UploadMoment.State.KEPT).select_related("scene"),
        "look": looks_again(request, waits=waits),
    }
    return render(request, "scenes/upload.html", context)


@act_for(*STAFF, back="upload")
def show_moment(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Have one moment drawn by a worker."""
    row = get_object_or_404(SceneUpload, code=code)
    try:
        track, stop = (int(request.POST.get(name, "")) for name in ("track", "stop"))
        chosen = row.tracks[track]["stops"][stop]
    except (ValueError, LookupError):
        raise Conflict("This recording has no such moment.") from None
    moment = uploads.ask_for_moment(
        row, item=chosen["item"], frame=chosen["frame"], actor=user_of(request)
    )
    send_later(request, enqueue_moment, moment.pk)
    return _moment_page(moment)


@act_for(*STAFF, back="scenes")
def keep_moment(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Have a moment kept as a scene."""
    moment = get_object_or_404(UploadMoment.objects.select_related("upload"), code=code)
    with refusals_told(request):
        slug = request.POST.get("slug", "").strip()
        uploads.ask_to_keep(moment, slug=slug, actor=user_of(request))
        send_later(request, enqueue_moment, moment.pk)
    return _moment_page(moment)


def _moment_page(moment: UploadMoment) -> HttpResponse:
    page = reverse("upload", args=[moment.upload.code])
    return redirect(f"{page}?moment={moment.code}#moment")


@act_for(*STAFF, back="scenes")
def remove(request: HttpRequest, code: uuid.UUID) -> None:
    """Remove the file; the scenes that were kept stay."""
    row = get_object_or_404(SceneUpload, code=code)
    uploads.remove_upload(row, actor=user_of(request))
    messages.success(request, f"“{row.name}” is removed.")
