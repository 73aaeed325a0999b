"""Films go out as pictures do: to those who may see the pair, and blind."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from django.test import Client
from django.urls import reverse

from arena.models import Matchup, Study
from arena.voting.queries.showings import as_shown
from augment.models import Augmentation, Scenario
from augment.render.bev import draw, draw_empty
from augment.render.camera import camera_for
from augment.render.film import make_film
from augment.scene.codec import modification_to_document
from augment.scene.entities import AgentType, Modification
from augment.scene.planned_motion import AtTime, PlannedMotion
from augment.services.scenarios.pictures import draw_scenario, film_document, redraw
from tests import study_rows
from tests.moving import a_moving_study, cutting_in
from tests.recorded import recorded
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db


@pytest.fixture
def study() -> Study:
    return a_moving_study(scenarios=2, votes=6)


@pytest.fixture
def eva(study: Study) -> Client:
    return signed_in(study.experts.get())


def sides(matchup: Matchup) -> dict[str, str]:
    """The addresses of both pictures, by who made them."""
    shown = as_shown(study_rows.matchups_of(matchup.study, "eva")[matchup.position - 1])
    assert shown["is_filmed"]
    return {matchup.left.contestant.slug: shown["a"], matchup.right.contestant.slug: shown["b"]}


def read(client: Client, address: str) -> dict[str, Any]:
    answer = client.get(address, {"film": ""})
    assert answer.headers["Cache-Control"] == "private, max-age=31536000, immutable"
    assert not {"ETag", "Last-Modified", "Content-Disposition"} & set(answer.headers)
    document: dict[str, Any] = json.loads(answer.content)
    # Where the picture beneath lies: at the same token.
    ground = document.pop("ground")
    assert ground.partition("?")[0] == address
    assert b"".join(client.get(ground)).startswith(b"\x89PNG")
    return document


def test_both_sides_have_films_of_one_form_and_who_does_the_same_has_the_same(
    study: Study, eva: Client
) -> None:
    films: dict[str, list[dict[str, Any]]] = {"ann": [], "bob": [], "cid": []}
    for matchup in study.matchups.all():
        for slug, address in sides(matchup).items():
            films[slug].append(read(eva, address))
    # Also bob's, whose car stands beside those that move.
    for shown in films.values():
        assert len(shown) > 1
        assert all(one == shown[0] for one in shown)
        assert shown[0].keys() == films["ann"][0].keys()
    assert films["ann"][0] != films["cid"][0]
    said = json.dumps(films["ann"])
    assert not any(word in said for word in ("ann", "New1", "Agent", "place"))


def test_strangers_and_stills_have_no_film(study: Study) -> None:
    matchup = study.matchups.all()[0]
    (address, *_) = sides(matchup).values()
    finn = signed_in(study_rows.expert("finn"))
    assert finn.get(address, {"film": ""}).status_code == 404
    still = study_rows.scenario("still")
    redraw(still)
    assert film_document(still.original_image) is None
    staff = signed_in(people()["researcher"])
    picture = reverse("picture", args=["original", still.code])
    assert staff.get(picture, {"film": ""}).status_code == 404


def test_where_one_begins_to_move_every_picture_is_drawn_anew_with_a_film() -> None:
    place = study_rows.scenario("place")
    rows = [study_rows.picture(place, study_rows.contestant(name)) for name in ("ann", "bob")]
    study_rows.write_changes()
    redraw(place)
    assert not any("film" in row.image for row in place.augmentations.all())
    moving = modification_to_document(Modification(added=(cutting_in(1.0),)))
    Augmentation.objects.filter(pk=rows[0].pk).update(modification=moving)
    redraw(place)
    films = [film_document(row.image) for row in place.augmentations.order_by("pk")]
    assert all(films)
    assert films[0] != films[1] == film_document(place.original_image)


def test_a_reference_that_moves_has_a_film_on_its_scenarios_page(study: Study) -> None:
    moving = modification_to_document(Modification(added=(cutting_in(1.0),)))
    Scenario.objects.update(reference=moving)
    place = Scenario.objects.all()[0]
    draw_scenario(place.pk)
    staff = signed_in(people()["researcher"])
    page = staff.get(reverse("scenario", args=[place.code])).content.decode()
    assert page.count("?film") == 2
    assert page.count("film-bar") == 1
    assert read(staff, reverse("picture", args=["reference", place.code]))["steps"] == 61


@pytest.mark.realdata
def test_a_moving_pair_of_a_busy_street_takes_less_than_300_kb(realdata: Path) -> None:
    scene, recording = recorded(realdata)
    cars = [one for one in scene.agents if one.type is AgentType.VEHICLE][:3]
    motion = PlannedMotion(speeds=((2.0, 5.0),), start=AtTime())
    change = Modification(moved=tuple(replace(car, motion=motion) for car in cars))
    camera = camera_for(scene, change, expect=lambda *_: recording)
    side = len(draw(scene, change, camera, recording))
    side += len(make_film(scene, change, camera, recording))
    before = len(draw(scene, Modification(), camera, recording))
    assert 2 * side + before + len(draw_empty(scene, camera)) < 300_000
