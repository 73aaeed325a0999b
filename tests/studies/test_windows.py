"""Both pictures of a pair show one window, whatever was drawn when."""

import pytest

from arena.errors import NothingToPlan
from arena.models import Matchup, Study
from arena.scenarios.services import redraw_pictures
from arena.studies.services.planning import frozen_pictures, list_planned
from arena.voting.queries.showings import VIEW_OF_OLD, view_shown
from arena.voting.services.shown_pictures import find_frames
from augment.models import Augmentation, Scenario
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.running import runner
from augment.services.running.by_hand import keep_correction
from augment.services.scenarios.pictures import (
    camera_key,
    load_camera,
    original_picture,
    picture_view,
)
from tests.opening import open_study
from tests.scenes import cone, pedestrian
from tests.study_rows import cast_of

pytestmark = pytest.mark.django_db
CONE_AHEAD = Modification(added=(cone("New1", 15.0, 0.0),))


def drawn_before(folder: str = "bev") -> None:
    """All pictures as if an earlier version had drawn them; names once said no window."""
    for row in Augmentation.objects.all():
        Augmentation.objects.filter(pk=row.pk).update(
            image=f"{folder}/{row.pk}.png", modification=modification_to_document(Modification())
        )
    Scenario.objects.update(original_image=f"{folder}/original.png")


def look_otherwise(contestant: str) -> None:
    """Its pictures as if they showed something else, in the same window."""
    for row in Augmentation.objects.filter(contestant__slug=contestant):
        Augmentation.objects.filter(pk=row.pk).update(image=row.image.replace(".png", "x.png"))


def opened(name: str, **cast: object) -> Study:
    return open_study(**({"votes_per_expert": 2, "seed": 7} | cast), name=name)


def test_pictures_of_two_windows_are_never_paired() -> None:
    cast = cast_of(contestants=("ann", "bob"), scenarios=2, experts=("eva",))
    drawn_before()
    one = Augmentation.objects.filter(contestant__slug="ann")[:1].get()
    Augmentation.objects.filter(pk=one.pk).update(image=original_picture(one.scenario))
    with pytest.raises(NothingToPlan, match="different windows"):
        opened("mixed", **cast)
    assert list(redraw_pictures())
    look_otherwise("bob")
    for matchup in opened("redrawn", **cast).matchups.all():
        windows = {
            camera_key(name)
            for name in (matchup.left_image, matchup.right_image, matchup.original_image)
        }
        assert windows == {load_camera(matchup.scenario).key}
        assert view_shown(matchup) == picture_view(load_camera(matchup.scenario))
    assert not list(redraw_pictures())


def test_a_study_keeps_the_pictures_that_were_shown() -> None:
    cast = cast_of(contestants=("ann", "bob"), scenarios=2, experts=("eva",))
    drawn_before()
    study = opened("before", **cast)
    assert {row.original_image for row in study.matchups.all()} == {"bev/original.png"}
    assert [view_shown(row) for row in study.matchups.all()] == [VIEW_OF_OLD] * 2
    shown = set(study.matchups.values_list("left_image", "right_image", "original_image"))
    assert [number for _, number in redraw_pictures()] == [2, 2]
    assert not Augmentation.objects.filter(image__regex=r"^bev/[^/]+$").exists()
    assert set(study.matchups.values_list("left_image", "right_image", "original_image")) == shown
    assert {row.image for row in frozen_pictures(study).values()} == {
        name for pair in shown for name in pair[:2]
    }


def test_pictures_of_a_former_window_keep_the_view_that_they_were_shown_with() -> None:
    cast = cast_of(contestants=("ann", "bob"), scenarios=2, experts=("eva",))
    drawn_before("bev/1-0ld")
    with pytest.raises(NothingToPlan, match="different windows"):
        opened("unknown", **cast)
    drawn_before()
    opened("first", **cast)
    then = VIEW_OF_OLD | {"px_per_m": 12.5}
    drawn_before("bev/1-0ld")
    Matchup.objects.update(view=then, original_image="shown.png")
    ann, bob = "bev/1-0ld/a.png", "bev/1-0ld/b.png"
    Augmentation.objects.filter(contestant__slug="ann").update(image=ann)
    Augmentation.objects.filter(contestant__slug="bob").update(image=bob)
    Matchup.objects.update(left_image=ann, right_image=bob)
    for number, sides in enumerate(((ann, bob), (bob, ann))):
        Matchup.objects.filter(study__name="first").update(
            left_image=sides[0], right_image=sides[1]
        )
        again = opened(f"again {number}", **cast)
        found = [(view_shown(row), row.original_image) for row in again.matchups.all()]
        assert found == [(then, "shown.png")] * 2
        again.matchups.all().delete()


def test_a_change_outside_widens_the_window_of_all_and_an_open_study_keeps_its_own() -> None:
    cast = cast_of(contestants=("reference", "ann"), scenarios=1, experts=("eva",))
    place = Scenario.objects.get()
    Scenario.objects.update(reference=modification_to_document(CONE_AHEAD))
    Augmentation.objects.update(modification=modification_to_document(CONE_AHEAD))
    assert list(redraw_pictures())
    look_otherwise("ann")
    study = opened("before", **cast, votes_per_expert=1)
    shown = study.matchups.values_list("left_image", "right_image", "original_image").get()

    far = Augmentation.objects.get(contestant__slug="ann")
    person = Modification(added=(pedestrian("New1", 12.0, -40.0),))
    row = keep_correction(far, modification_to_document(person))
    runner.AUGMENTATIONS.perform(row.pk)

    place.refresh_from_db()
    assert load_camera(place).y_min_m <= -45.0
    names = [place.original_image, *Augmentation.objects.values_list("image", flat=True)]
    assert {camera_key(name) for name in names} == {load_camera(place).key}
    assert {picture.image for picture in frozen_pictures(study).values()} == set(shown[:2])
    enlarged = study.matchups.get()
    frame = find_frames(
        list_planned(study)["eva"], frozen_pictures(study), {place.slug: place}, {}
    )
    assert frame[place.slug].view == view_shown(enlarged)
    assert frame[place.slug].original_image == enlarged.original_image
    cast["contestants"] = ["reference", "by-hand"]
    opened("after", **cast, votes_per_expert=1)
