"""Scenes from recordings: a file is sent, a worker reads it, a person chooses the moment."""

from __future__ import annotations

import uuid
from typing import cast

from django.contrib import messages
from django.contrib.auth.models import User
from django.http import HttpRequest, HttpResponse
from django.shortcuts import get_object_or_404, redirect, render
from django.urls import reverse
from django.views.decorators.http import require_POST, require_safe

from arena.scenarios.queries import counts_of, place_of, scene_rows, track_maps, upload_rows
from arena.services.sent_files import was_too_large
from arena.site.access import STAFF, allow_only
from arena.site.acts import looks_again, send_later
from augment.errors import AugmentError
from augment.models import BaseScene, SceneUpload, UploadMoment
from augment.services.scenarios import uploads
from augment.services.scenarios import uploads as upload_moments
from augment.services.scenarios.pictures import SceneView, is_drawn, scene_picture
from augment.services.scenarios.scene_imports import notes_of
from augment.tasks import enqueue_moment, enqueue_scene, enqueue_upload


@allow_only(*STAFF)
@require_POST
def send_file(request: HttpRequest) -> HttpResponse:
    """Keep a recording and leave it to a worker."""
    file = request.FILES.get("file")
    if was_too_large(request.META):
        text = "The file is too large: at most %(most)s MB are taken. A zip may be smaller."
        messages.error(request, text % {"most": uploads.most_megabytes()})
        return redirect("scenes")
    if file is None:
        messages.error(request, "Choose a file.")
        return redirect("scenes")
    try:
        row = uploads.keep_upload(
            name=file.name or "",
            content=file,
            source=request.POST.get("format", ""),
            actor=cast(User, request.user),
        )
    except AugmentError as error:
        messages.error(request, str(error))
        return redirect("scenes")
    send_later(request, enqueue_upload, row.pk)
    return redirect("upload", code=row.code)


@allow_only(*STAFF)
@require_safe
def upload_page(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """What a file is, what it holds, and the moment that somebody looks at."""
    row = get_object_or_404(SceneUpload.objects.select_related("uploaded_by"), code=code)
    moment = _moment_asked(row, request.GET.get("moment", ""))
    waits = row.state in row.UNDER_WAY or (moment is not None and moment.state in moment.UNDER_WAY)
    maps = track_maps(row)
    context = {
        "upload": row,
        "maps": maps,
        "moment": moment,
        "chosen": None if moment is None else place_of(maps, item=moment.item, frame=moment.frame),
        "notes": [] if moment is None else upload_moments.sentences_of(moment),
        "kept": row.moments.filter(state=UploadMoment.State.KEPT).select_related("scene"),
        "look": looks_again(request, waits=waits),
    }
    return render(request, "scenes/upload.html", context)


@allow_only(*STAFF)
@require_POST
def show_moment(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Have one moment drawn by a worker."""
    row = get_object_or_404(SceneUpload, code=code)
    page = reverse("upload", args=[code])
    try:
        item, frame = _stop(row, request.POST.get("track", "0"), request.POST.get("stop", ""))
        moment, is_new = upload_moments.ask_for_moment(
            row, item=item, frame=frame, actor=cast(User, request.user)
        )
    except AugmentError as error:
        messages.error(request, str(error))
        return redirect(page)
    except (ValueError, LookupError):
        messages.error(request, "This recording has no such moment.")
        return redirect(page)
    if is_new:
        send_later(request, enqueue_moment, moment.pk)
    return redirect(f"{page}?moment={moment.code}#moment")


@allow_only(*STAFF)
@require_POST
def keep_moment(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Have a moment kept as a scene."""
    moment = get_object_or_404(UploadMoment.objects.select_related("upload"), code=code)
    try:
        upload_moments.ask_to_keep(
            moment, slug=request.POST.get("slug", "").strip(), actor=cast(User, request.user)
        )
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        send_later(request, enqueue_moment, moment.pk)
    page = reverse("upload", args=[moment.upload.code])
    return redirect(f"{page}?moment={moment.code}#moment")


@allow_only(*STAFF)
@require_POST
def read_again(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Have a file read once more that could not be read."""
    row = get_object_or_404(SceneUpload, code=code)
    try:
        uploads.read_again(row)
    except AugmentError as error:
        messages.error(request, str(error))
    else:
        send_later(request, enqueue_upload, row.pk)
    return redirect("upload", code=code)


@allow_only(*STAFF)
@require_POST
def remove(request: HttpRequest, code: uuid.UUID) -> HttpResponse:
    """Forget the file; the scenes that were kept stay."""
    row = get_object_or_404(SceneUpload, code=code)
    uploads.remove_upload(row, actor=cast(User, request.user))
    messages.success(request, f"“{row.name}” is removed.")
    return redirect("scenes")


# --- Private -----------------------------------------------------------------------------------


def _moment_asked(row: SceneUpload, given: str) -> UploadMoment | None:
    try:
        code = uuid.UUID(given)
    except ValueError:
        return None
    return row.moments.select_related("scene").filter(code=code).first()


def _stop(row: SceneUpload, track: str, stop: str) -> tuple[str, int]:
    """Item and frame of the moment with that number, from 0."""
    part, number = int(track), int(stop)
    if part < 0 or number < 0:
        raise LookupError
    found = row.tracks[part]["stops"][number]
    return found["item"], found["frame"]


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
