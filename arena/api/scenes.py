"""Scenes: what scenarios are made of, with what their sources left open."""

from __future__ import annotations

import uuid
from typing import Any

from django.http.response import HttpResponseBase
from django.shortcuts import get_object_or_404
from rest_framework import serializers
from rest_framework.request import Request
from rest_framework.response import Response

from arena.api.access import StaffOnly
from arena.api.errors import ApiView
from arena.api.files import PNG, FileView, describe_file
from arena.api.paging import PageQuery, answer_page, page_of, read_query
from arena.api.pictures import picture_named
from arena.api.schema import describe
from arena.queries.scenes import counts_of, scene_rows
from augment.models import BaseScene
from augment.services.scenarios.scene_notes import notes_of
from augment.services.scenarios.scene_pictures import SceneView, scene_picture
from augment.services.wording import translate


class SceneQuery(PageQuery):
    """Which scenes."""

    slug = serializers.CharField(max_length=80, required=False)


class SceneLineDocument(serializers.Serializer[Any]):
    """One scene of a list."""

    code = serializers.UUIDField()
    slug = serializers.CharField()
    source = serializers.CharField()  # type: ignore[assignment]
    provenance = serializers.CharField()
    scenarios = serializers.IntegerField(source="number")
    created_at = serializers.DateTimeField()


class WholeSceneDocument(SceneLineDocument):
    """One scene with what is in it."""

    agents = serializers.IntegerField()
    lanes = serializers.IntegerField()
    connectors = serializers.IntegerField()
    areas = serializers.IntegerField()
    recorded_s = serializers.FloatField(help_text="How long its recording goes on.")
    notes = serializers.ListField(
        child=serializers.CharField(), help_text="What the source left open."
    )


class ScenesView(ApiView):
    """The scenes."""

    permission_classes = (StaffOnly,)

    @describe(
        "Scenes by slug", answers=page_of(SceneLineDocument), query=SceneQuery, name="listScenes"
    )
    def get(self, request: Request) -> Response:
        """Those that came with the project, and those that were kept of uploads."""
        query = read_query(request, SceneQuery)
        rows = scene_rows()
        if "slug" in query:
            rows = rows.filter(slug=query["slug"])
        return answer_page(request, rows, query, SceneLineDocument, order="slug")


class OneSceneView(ApiView):
    """One scene."""

    permission_classes = (StaffOnly,)

    @describe("A scene", answers=WholeSceneDocument, name="getScene")
    def get(self, request: Request, code: uuid.UUID) -> Response:
        """How much of everything is in it, and what its source left open."""
        row = get_object_or_404(BaseScene, code=code)
        counts = counts_of(row)
        found = {name: getattr(row, name) for name in ("code", "slug", "source", "provenance")}
        found |= {name: getattr(counts, name) for name in counts.__dataclass_fields__}
        return Response(
            WholeSceneDocument(
                found
                | {
                    "number": row.scenarios.count(),
                    "created_at": row.created_at,
                    "notes": [translate(note) for note in notes_of(row)],
                }
            ).data
        )


class ScenePictureView(FileView):
    """A scene as it was recorded."""

    permission_classes = (StaffOnly,)
    is_never_cached = True

    @describe_file("A scene with its recorded traffic", types=[PNG], name="getScenePicture")
    def get(self, request: Request, code: uuid.UUID) -> HttpResponseBase:
        """Nothing before it was drawn."""
        row = get_object_or_404(BaseScene.objects.defer("recording"), code=code)
        return picture_named(scene_picture(row, SceneView.KEPT))
