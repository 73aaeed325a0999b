"""Scenes, and how they come from recordings: a worker reads a file, a person chooses a moment."""

import uuid
from typing import Any

from django.contrib import messages
from django.db.models import Count
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse

from arena.scenarios.services import was_too_large
from arena.shell import acts, listing
from arena.shell.access import STAFF, act_for, get_user, page_for
from augment.errors import Conflict
from augment.models import BaseScene, SceneUpload, UploadMoment
from augment.services import read_code
from augment.services.scenarios import SceneView, is_drawn, note_sentences, scene_picture, uploads
from augment.services.scenarios.scene_imports import free_scene_slug

UPLOADS_SHOWN = 10
SCENES_AT_ONCE = 24


@page_for(*STAFF)
def scenes_page(request: HttpRequest) -> HttpResponse:
    """Show every scene, the files that were sent, and the form to send others."""
    scenes = BaseScene.objects.defer("document", "recording", "notes")
    rows = scenes.annotate(number=Count("scenarios")).order_by("-created_at", "slug")
    page = listing.read_page(request, rows, size=SCENES_AT_ONCE)
    shown = [(row, is_drawn(scene_picture(row, SceneView.KEPT))) for row in page.object_list]
    sent = SceneUpload.objects.defer("tracks").select_related("uploaded_by")[:UPLOADS_SHOWN]
    waits = any(row.state in row.UNDER_WAY for row in sent) or not all(has for _, has in shown)
    for row, has_picture in shown:
        if not has_picture and not acts.looks_again(request):
            acts.send_later(request, row)
    context = {
        "page": page,
        "scenes": shown,
        "uploads": sent,
        **acts.wait_for_workers(waits=waits),
        "formats": uploads.FORMATS.items(),
        "most_megabytes": uploads.most_megabytes(),
    }
    return render(request, "scenes/list.html", context)


@act_for(*STAFF, back="scenes")
def send_file(request: HttpRequest) -> HttpResponse | None:
    """Keep each file as an upload of its own, and leave them to workers."""
    rows = []
    for file in request.FILES.getlist("file"):
        with acts.refusals_told(request):
            row = uploads.keep_upload(
                name=file.name or "",
                content=file,
                source=request.POST.get("format", ""),
                actor=get_user(request),
            )
            acts.send_later(request, row)
            rows.append(row)
    if was_too_large(request.META) or not request.FILES:
        most = uploads.most_megabytes()
        raise Conflict(f"Choose files of at most {most} MB together; a zip may be smaller.")
    return redirect("upload", code=rows[0].code) if len(rows) == 1 else None


@page_for(*STAFF)
def upload_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Show what a file holds and one moment of it; a moment that is kept leads to its scene."""
    row = get_object_or_404(SceneUpload.objects.select_related("uploaded_by__person"), code=code)
    wanted = read_code(request.GET.get("moment", ""))
    moments = row.moments.select_related("scene")
    moment = moments.filter(code=wanted).first() or moments.first()
    if moment is not None and moment.scene is not None and "keep" in request.GET:
        return redirect("scene", code=moment.scene.code)
    waits = row.state in row.UNDER_WAY or any(one.state in one.UNDER_WAY for one in moments)
    context = {
        "upload": row,
        "format": uploads.FORMATS.get(row.format, row.format),
        "what": "place" if row.format == uploads.MAP_FORMAT else "moment",
        "stops": list(enumerate(_stops(row))),
        "moment": moment,
        "notes": note_sentences(((moment and moment.report) or {}).get("notes", ())),
        "slug": free_scene_slug(row.name),
        "strip": _list_strip(row, list(moments)),
        "kept": moments.filter(state=UploadMoment.State.KEPT),
        **acts.wait_for_workers(waits=waits),
    }
    return render(request, "scenes/upload.html", context)


@act_for(*STAFF, back="upload")
def show_moment(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Have a moment, or a place of a map, drawn by a worker, or kept, which leads to its scene."""
    row = get_object_or_404(SceneUpload, code=code)
    if "put" in request.POST:
        place = request.POST.get("place", "")
        return _send_moment(request, uploads.ask_for_place(row, place, actor=get_user(request)))
    is_kept = "keep" in request.POST
    try:
        chosen = _stops(row)[int(request.POST.get("stop", ""))]
    except (ValueError, IndexError):
        raise Conflict("This recording has no such moment.") from None
    moment = uploads.ask_for_moment(
        *(row, chosen["item"], chosen["frame"]),
        slug=free_scene_slug(request.POST.get("name", "") or row.name) if is_kept else "",
        actor=get_user(request),
    )
    return _send_moment(request, moment, "&keep=1" * is_kept)


def _send_moment(request: HttpRequest, moment: UploadMoment, goes_on: str = "") -> HttpResponse:
    acts.send_later(request, moment)
    page = reverse("upload", args=[moment.upload.code])
    return redirect(f"{page}?moment={moment.code}{goes_on}")


def _list_strip(
    row: SceneUpload, moments: list[UploadMoment]
) -> list[tuple[int, dict[str, Any], UploadMoment]]:
    """Return the moments that are drawn or will be, in their order, with the numbers of stops."""
    by_stop = {(moment.item, moment.frame): moment for moment in moments}
    return [
        (number, stop, by_stop[place])
        for number, stop in enumerate(_stops(row))
        if (place := (stop["item"], stop["frame"])) in by_stop
    ]


def _stops(row: SceneUpload) -> list[dict[str, Any]]:
    return [stop for track in row.tracks for stop in track["stops"]]


@act_for(*STAFF, back="scenes")
def remove(request: HttpRequest, code: uuid.UUID) -> None:
    """Remove the file; the scenes that were kept stay."""
    row = get_object_or_404(SceneUpload, code=code)
    uploads.remove_upload(row, actor=get_user(request))
    messages.success(request, f"“{row.name}” is removed.")
