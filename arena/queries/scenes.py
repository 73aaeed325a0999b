"""Scenes as pages list and show them."""

from __future__ import annotations

from dataclasses import dataclass

from django.db.models import Count, QuerySet

from augment.models import BaseScene, SceneUpload


def scene_rows() -> QuerySet[BaseScene]:
    """All scenes without what is heavy, with `number`, that of their scenarios."""
    rows = BaseScene.objects.defer("document", "recording", "notes")
    return rows.annotate(number=Count("scenarios")).order_by("-created_at", "slug")


def upload_rows(most: int = 20) -> list[SceneUpload]:
    """The uploads of late."""
    return list(SceneUpload.objects.defer("tracks").select_related("uploaded_by")[:most])


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneCounts:
    """What a scene holds."""

    agents: int
    lanes: int
    connectors: int
    areas: int
    recorded_s: float


def counts_of(scene: BaseScene) -> SceneCounts:
    """How much of everything is in a stored scene and its recording."""
    document, recording = scene.document, scene.recording
    return SceneCounts(
        agents=len(document.get("agents", ())),
        lanes=len(document.get("lanes", ())),
        connectors=len(document.get("connectors", ())),
        areas=len(document.get("areas", ())),
        recorded_s=recording["times_s"][-1] if recording else 0.0,
    )
