"""Pictures of scenarios and augmentations, stored once under the hash of their bytes."""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from enum import StrEnum
from typing import Any

import numpy as np
from django.contrib.auth.models import User
from django.core.files.base import ContentFile
from django.core.files.storage import default_storage
from django.db import transaction
from django.utils import timezone

from augment.baselines.registry import break_reference
from augment.models import Augmentation, BaseScene, Contestant, GenerationJob, Scenario
from augment.render.bev import draw, draw_empty, draw_for_review
from augment.render.camera import AROUND_THE_EGO, LOOK, Camera, camera_for
from augment.render.film import make_film
from augment.render.legend import change_keys
from augment.scene import codec
from augment.scene.entities import Modification, without_traffic
from augment.services.events import log_change
from augment.services.scenarios.scenes import LoadedScenario, content_hash, scene_key
from augment.services.texts import is_stored_name

FOLDER = "bev"


def camera_key(name: str) -> str:
    """The key of the camera that a picture was drawn with, "" where its name has none.

    Pictures of one scenario stand side by side only where this is the same.
    """
    parts = name.split("/")
    return parts[1] if len(parts) == 3 and parts[0] == FOLDER else ""


def original_picture(scenario: Scenario, camera: Camera | None = None) -> str:
    """The name of the picture before any change; drawn where there is none in today's window.

    Call it from a worker, not in a request.

    Args:
        scenario: Whose picture.
        camera: Today's window, where that is known.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    stored, camera = scenario.original_image, camera or load_camera(scenario)
    if stored and camera_key(stored) == camera.key and default_storage.exists(stored):
        return stored
    scenario.original_image = name = draw_picture(LoadedScenario(scenario), Modification(), camera)
    scenario.save(update_fields=["original_image"])
    return name


def load_camera(scenario: Scenario, unsaved: Mapping[int, dict[str, Any]] | None = None) -> Camera:
    """Return the window that all pictures of a scenario show, as its contestants are today.

    Args:
        scenario: Whose pictures.
        unsaved: Modifications that are not stored yet, by the keys of their augmentations.

    Raises:
        InvalidDocument: The stored scene or a modification can't be read.
    """
    answered = scenario.augmentations.exclude(modification=None).order_by("pk")
    stored = dict(answered.values_list("pk", "modification")) | dict(unsaved or {})
    return _window_around(LoadedScenario(scenario), [stored[pk] for pk in sorted(stored)])


def _window_around(loaded: LoadedScenario, documents: Iterable[dict[str, Any] | None]) -> Camera:
    """Return the window around the reference and these modifications."""
    changes = tuple(
        codec.modification_from_document(document) for document in documents if document
    )
    return camera_for(loaded.scene, loaded.reference, changes, loaded.expect)


def picture_view(camera: Camera) -> dict[str, Any]:
    """Return where metres lie in a picture: px_per_m, ego_px [x, y], width, height (pixels)."""
    ego = camera.to_pixels(np.zeros((1, 2)))[0]
    return {
        "px_per_m": camera.px_per_m,
        "ego_px": [float(ego[0]), float(ego[1])],
        "width": camera.width_px,
        "height": camera.height_px,
    }


def list_marks(document: Any, view: Mapping[str, Any]) -> list[list[Any]]:
    """Return the changed objects inside a picture: id, x, y and radius in its pixels each.

    Args:
        document: A stored modification, None for no change.
        view: Of `picture_view`.
    """
    change = codec.modification_from_document(document) if document else Modification()
    scale, (ego_x, ego_y) = view["px_per_m"], view["ego_px"]
    marks = [
        [
            *(one.id, round(ego_x + scale * one.x_m, 1), round(ego_y - scale * one.y_m, 1)),
            round(scale * math.hypot(one.length_m, one.width_m) / 2.0, 1),
        ]
        for one in change.changed
    ]
    seen = [mark for mark in marks if 0 < mark[1] < view["width"] and 0 < mark[2] < view["height"]]
    return sorted(seen, key=lambda mark: mark[1:])


def draw_picture(loaded: LoadedScenario, modification: Modification, camera: Camera) -> str:
    """Draw a scenario's scene after a change, with its film, and return the picture's name.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    png, film = _draw(loaded, modification, camera)
    # Pictures that look the same may move differently.
    name = f"{FOLDER}/{camera.key}/{hashlib.sha256(png + film).hexdigest()}.png"
    _keep(name, png, film)
    return name


def film_name(picture: str) -> str:
    """The name of the film of a picture, "" of one that has none."""
    return f"{picture.removesuffix('.png')}.json" if "-film/" in picture else ""


def film_document(picture: str) -> dict[str, Any] | None:
    """The film of a picture, with the name of the picture that it plays over; None without one.

    A film of an imported folder that names no picture is none.
    """
    name = film_name(picture)
    if not name or not default_storage.exists(name):
        return None
    with default_storage.open(name) as file:
        document: dict[str, Any] = json.load(file)
    ground, window = document.get("ground"), document.get("window")
    is_film = isinstance(ground, str) and isinstance(window, str) and is_stored_name(ground)
    return document if is_film else None


def store(png: bytes, *, folder: str = FOLDER) -> str:
    """The name under which these bytes are kept, <folder>/<sha256>.png; written only if absent."""
    name = f"{folder}/{hashlib.sha256(png).hexdigest()}.png"
    store_as(name, png)
    return name


def store_as(name: str, png: bytes) -> None:
    """Keep these bytes under a name that belongs to them alone; written if absent or cut off.

    Several workers may do so at once: what is kept is whole at every moment, and always the same.
    """
    if default_storage.exists(name) and default_storage.size(name) == len(png):
        return
    default_storage.save(name, ContentFile(png))


def redraw(scenario: Scenario) -> int:
    """Draw what shows another window than today's, until nothing does.

    Old files stay where they are and rows keep their names, for the studies that show them.
    Call it from a worker or a command, not in a request.

    Returns:
        How many augmentations have a new picture.

    Raises:
        InvalidDocument: What is stored can't be read.
        InvalidModification: A modification does not fit the scene.
    """
    redrawn, loaded = 0, LoadedScenario(scenario)
    # Another worker may store a change that widens the window while this one draws.
    while True:
        rows = scenario.augmentations.order_by("pk").only(
            "scenario", "image", "earlier_images", "state", "modification"
        )
        camera = _window_around(loaded, [row.modification for row in rows])
        outdated = [row for row in rows if row.image and camera_key(row.image) != camera.key]
        if not outdated:
            original_picture(scenario, camera)
            return redrawn
        drawn = [(row, draw_picture(loaded, find_modification(row), camera)) for row in outdated]
        with transaction.atomic():
            Scenario.objects.select_for_update(no_key=True).get(pk=scenario.pk)
            original_picture(scenario, camera)
            redrawn += sum(
                Augmentation.objects.filter(pk=row.pk, image=row.image).update(
                    image=name, earlier_images=[*row.earlier_images, row.image]
                )
                for row, name in drawn
            )


def draw_with_ids(row: Augmentation) -> bytes:
    """Draw the picture of a row with everybody's id, for staff; it takes a tenth of a second.

    Raises:
        InvalidDocument: What is stored can't be read.
        InvalidModification: The modification does not fit the scene.
    """
    scene, camera = LoadedScenario(row.scenario).scene, load_camera(row.scenario)
    return draw_for_review(scene, find_modification(row), camera)[0]


# --- Private -----------------------------------------------------------------------------------


def _draw(
    loaded: LoadedScenario, modification: Modification, camera: Camera
) -> tuple[bytes, bytes]:
    """A picture and its film, which names the picture that it plays over; no bytes for none."""
    scene = loaded.scene
    if not camera.is_filmed:
        return draw(scene, modification, camera), b""
    recording = loaded.expect(scene, modification)
    film = make_film(scene, modification, camera, recording)
    ground = store(draw_empty(scene, camera), folder=f"{FOLDER}/{camera.key}")
    document = {"ground": ground} | json.loads(film)
    return draw(scene, modification, camera, recording), json.dumps(
        document, separators=(",", ":")
    ).encode()


def _keep(picture: str, png: bytes, film: bytes) -> None:
    if film:
        store_as(film_name(picture), film)
    store_as(picture, png)


def find_modification(row: Augmentation) -> Modification:
    """Return the shown modification: an unreadable answer changes nothing."""
    if not row.is_answer:
        return Modification()
    return codec.modification_from_document(row.modification)


SCENES = "scenes"


class SceneView(StrEnum):
    """Content of a scene's picture."""

    KEPT = "kept"  # with the recorded traffic
    BACKDROP = "backdrop"  # the ego alone, from far: others are placed on it


def scene_picture(row: BaseScene, view: SceneView) -> str:
    """The name of a scene's picture, whether it is drawn yet or not."""
    content = row.content_hash or content_hash(row.document)
    key = AROUND_THE_EGO.key if view is SceneView.BACKDROP else str(LOOK)
    return f"{SCENES}/{content}-{key}-{view.value}.png"


def reference_picture(scenario: Scenario) -> str:
    """The name of the picture of a scenario's reference; empty where it has none."""
    if scenario.reference is None:
        return ""
    shown = [LOOK, scene_key(scenario), scenario.reference]
    digest = hashlib.sha256(json.dumps(shown, sort_keys=True).encode()).hexdigest()
    moves = codec.modification_from_document(scenario.reference).has_motion
    folder = f"references/{LOOK}-film" if moves else "references"
    return f"{folder}/{digest}.png"


def is_drawn(name: str) -> bool:
    """Return whether a worker has drawn the picture of that name."""
    return bool(name) and default_storage.exists(name)


def draw_scene(scene_pk: int) -> None:
    """Draw every picture of a scene that is not drawn yet.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    row = BaseScene.objects.defer("recording").get(pk=scene_pk)
    missing = [view for view in SceneView if not is_drawn(scene_picture(row, view))]
    if not missing:
        return
    scene = codec.scene_from_document(row.document)
    for view in missing:
        is_kept = view is SceneView.KEPT
        shown = scene if is_kept else without_traffic(scene)
        camera = camera_for(scene, None) if is_kept else AROUND_THE_EGO
        store_as(scene_picture(row, view), draw(shown, Modification(), camera))


def draw_scenario(scenario_pk: int) -> None:
    """Draw a scenario before any change, and with its reference.

    Raises:
        InvalidDocument: The stored scene or reference can't be read.
        InvalidModification: They do not fit together.
    """
    row = Scenario.objects.select_related("base_scene").get(pk=scenario_pk)
    draw_scene(row.base_scene_id)
    redraw(row)
    loaded, name = LoadedScenario(row), reference_picture(row)
    if loaded.reference is None or is_drawn(name):
        return
    camera = camera_for(loaded.scene, loaded.reference, expect=loaded.expect)
    _keep(name, *_draw(loaded, loaded.reference, camera))


def legends_of_changes(views: Mapping[int, Mapping[str, Any]]) -> dict[int, set[str]]:
    """Return the entries for what each augmentation adds, by its key; one query.

    Args:
        views: By the keys of augmentations, where metres lie in their pictures.

    Raises:
        InvalidDocument: A stored modification can't be read.
    """
    rows = Augmentation.objects.filter(pk__in=views.keys()).order_by()
    return {
        key: set()
        if not document
        else change_keys(codec.modification_from_document(document), views[key])
        for key, document in rows.values_list("pk", "modification")
    }


ATTENTION_CHECK = "attention-check"
JOB = "Attention checks"

State = Augmentation.State


def draw_checks(*, scenarios: Sequence[str], actor: User | None = None) -> list[Augmentation]:
    """Draw the broken picture of every scenario that has none yet for its reference.

    They belong to a contestant of kind check, which no job runs and no study rates. Drawing takes
    a tenth of a second each: call it from a command or a worker, not in a request.

    Args:
        scenarios: Slugs; those without a reference, or whose reference only removes, have no
            check.
        actor: Who wants them.

    Returns:
        The new rows.

    Raises:
        InvalidDocument: A stored scene or reference can't be read.
    """
    drawn = []
    for row in Scenario.objects.filter(slug__in=scenarios).select_related("base_scene"):
        loaded = LoadedScenario(row)
        change = loaded.reference and break_reference(loaded.reference)
        if change is None:
            continue
        document = codec.modification_to_document(change)
        checks = row.augmentations.filter(contestant__kind=Contestant.Kind.CHECK, state=State.DONE)
        if not checks.filter(modification=document).exists():
            image = draw_picture(loaded, change, load_camera(row))
            drawn.append(Augmentation(scenario=row, modification=document, image=image))
    made_checks = _keep_checks(drawn, actor) if drawn else []
    for made in made_checks:
        redraw(made.scenario)
    return made_checks


@transaction.atomic
def _keep_checks(drawn: list[Augmentation], actor: User | None) -> list[Augmentation]:
    contestant, _ = Contestant.objects.get_or_create(
        slug=ATTENTION_CHECK, defaults={"name": "Attention check", "kind": Contestant.Kind.CHECK}
    )
    now, finished = timezone.now(), GenerationJob.State.FINISHED
    job = GenerationJob.objects.create(
        name=JOB, state=finished, launched_by=actor, finished_at=now
    )
    job.contestants.set([contestant])
    job.scenarios.set([row.scenario for row in drawn])
    for row in drawn:
        row.job, row.contestant, row.state, row.finished_at = job, contestant, State.DONE, now
    rows = Augmentation.objects.bulk_create(drawn)
    after = {"scenarios": [row.scenario.slug for row in drawn]}
    log_change(job, "draw checks", actor, after=after)
    return rows
