"""Studies whose pictures move: cars that cut in, each contestant's at another moment."""

from dataclasses import replace

from arena.models import Study
from augment.models import Augmentation
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification, TrafficAgent
from augment.scene.planned_motion import AtTime, PlannedMotion, PointPath
from augment.services.scenarios.pictures import (
    draw_picture,
    load_camera,
    original_picture,
    picture_view,
)
from augment.services.scenarios.scenes import LoadedScenario
from tests import study_rows
from tests.scenes import vehicle

CUT_IN = PointPath(points_m=((30.0, 3.5), (42.0, 0.0), (80.0, 0.0)))


def cutting_in(after_s: float) -> TrafficAgent:
    """A car beside the ego that comes into its lane after so many seconds."""
    motion = PlannedMotion(path=CUT_IN, start=AtTime(after_s=after_s))
    return replace(vehicle("New1", 14.0, 3.5), speed_mps=6.0, motion=motion)


def a_moving_study(*, scenarios: int, votes: int) -> Study:
    """An open study with one expert, eva; `bob` puts a car there that stands."""
    study = study_rows.a_study(scenarios=scenarios, votes_per_expert=votes, experts=("eva",))
    cars = {"ann": cutting_in(0.5), "bob": vehicle("New1", 14.0, 3.5), "cid": cutting_in(2.0)}
    rows = list(Augmentation.objects.select_related("scenario__base_scene", "contestant"))
    for row in rows:
        row.modification = modification_to_document(
            Modification(added=(cars[row.contestant.slug],))
        )
        row.save()
    for row in rows:
        camera = load_camera(row.scenario)
        original_picture(row.scenario)
        change = Modification(added=(cars[row.contestant.slug],))
        study_rows.hang(row, draw_picture(LoadedScenario(row.scenario), change, camera))
        row.scenario.matchups.update(
            original_image=row.scenario.original_image, view=picture_view(camera)
        )
    # The page has a bar where a picture of the plan has a film.
    for entry in study.rules["entries"]:
        entry["picture"] = camera.key + "/x.png"
    study.save()
    return study
