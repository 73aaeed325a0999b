"""The voting page: one vote per decision, films, drives and practice; not who made what."""

import gzip
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from django.conf import settings
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from arena.models import Matchup, PracticePair, Study, Vote
from arena.people.links import accept, invite
from arena.studies.services.opening import close_study
from arena.voting.queries.ballots import voting_progress
from arena.voting.queries.showings import as_shown
from arena.voting.services.practice import is_due, practice_pairs
from augment.models import Augmentation, Scenario
from augment.render.bev import draw, draw_empty
from augment.render.camera import camera_for
from augment.render.film import make_film
from augment.scene.codec import modification_to_document
from augment.scene.entities import AgentType, Modification
from augment.scene.planned_motion import AtTime, PlannedMotion
from augment.services.scenarios.pictures import (
    draw_checks,
    draw_scenario,
    film_document,
    redraw,
    store,
)
from tests import study_rows
from tests.drives import drive_pictures
from tests.moving import a_moving_study, cutting_in
from tests.opening import open_study
from tests.recorded import recorded
from tests.scenes import vehicle
from tests.study_rows import (
    KINDS,
    Cast,
    a_study,
    cast_of,
    contestant,
    matchups_of,
    picture,
    scenario,
)
from tests.web.cast import World, look, people, png, signed_in, world

pytestmark = pytest.mark.django_db


def ballot(study: Study) -> str:
    return reverse("vote", args=[study.code])


def test_the_page_is_never_cached_and_offers_both_miss_where_the_study_asks_for_it() -> None:
    here = world()
    expert = signed_in(here.expert)
    assert 'value="both_miss"' not in expert.get(ballot(here.study)).content.decode()
    here.study.allow_both_miss = True
    here.study.save()
    answer = expert.get(ballot(here.study))
    assert 'value="both_miss"' in answer.content.decode()
    assert "no-store" in answer.headers["Cache-Control"]


def test_the_last_vote_leads_to_the_thanks_and_a_closed_study_is_said_kindly() -> None:
    here = world()
    for matchup in study_rows.matchups_of(here.study, "eva"):
        study_rows.vote(matchup)
    expert = signed_in(here.expert)
    shown = expert.get(ballot(here.study)).content.decode()
    assert "You are done." in shown
    assert "9 answers saved" in shown
    close_study(study=here.study)
    assert "This study is closed" in expert.get(ballot(here.study)).content.decode()


def test_a_picture_goes_out_bare_and_to_its_expert_alone() -> None:
    here = world()
    shown = here.study.matchups.filter(expert=here.expert, votes=None).earliest("position")
    url = reverse("matchup-image", args=[shown.left_token])
    answer = signed_in(here.expert).get(url)
    assert b"".join(answer).startswith(b"\x89PNG")
    assert answer.headers["Content-Type"] == "image/png"
    assert answer.headers["Cache-Control"] == "private, max-age=31536000, immutable"
    assert answer.headers["Content-Disposition"] == "inline"
    assert not {"ETag", "Last-Modified"} & set(answer.headers)
    other = study_rows.matchups_of(here.study, "finn")[0]
    theirs = reverse("matchup-image", args=[other.right_token])
    assert signed_in(here.expert).get(theirs).status_code == 404
    assert look(signed_in(people()["admin"]), theirs) == 200
    assert signed_in(here.expert).get(reverse("matchup-image", args=["x"])).status_code == 404


NUMBERS = ("one", "many")
STATIC = Path(settings.BASE_DIR) / "static"


def given_to_the_script(here: World) -> dict[str, Any]:
    shown = signed_in(here.expert).get(ballot(here.study)).content.decode()
    found = re.search(r'<script id="given" [^>]*>(.*?)</script>', shown)
    assert found is not None
    given: dict[str, Any] = json.loads(found.group(1))
    return given


def test_the_script_gets_five_pairs_an_outbox_of_its_own_and_the_last_ten_votes() -> None:
    here = world()
    given = given_to_the_script(here)
    mine = study_rows.matchups_of(here.study, "eva")[:5]
    assert [pair["matchup"] for pair in given["pairs"]] == [str(one.code) for one in mine]
    assert (given["saved"], given["total"], given["last"]) == (0, 9, [])
    for code in (here.study.code, here.expert.person.code):
        assert str(code) in given["outbox"], "of two people or studies it is never the same"
    for matchup in mine[:3]:
        study_rows.vote(matchup, "equal")
    given = given_to_the_script(here)
    assert [vote["position"] for vote in given["last"]] == [3, 2, 1]
    assert {vote["outcome"] for vote in given["last"]} == {"E"}
    assert given["last"][0]["shown"]["matchup"] == str(mine[2].code)


def test_the_page_has_every_text_and_module_of_its_script_and_loads_at_most_40_kb() -> None:
    here = world()
    shown = signed_in(here.expert).get(ballot(here.study)).content.decode()
    offered = set(re.findall(r'data-text="([\w-]+)"', shown))
    scripts = "".join(path.read_text() for path in (STATIC / "js").glob("vote*.js"))
    said = set(re.findall(r'(?<!\.)\b(?:text|note|say)\("([\w-]+)"', scripts))
    said |= {f"{name}-{n}" for name in re.findall(r'counted\("(\w+)"', scripts) for n in NUMBERS}
    said |= {f"{name}-{n}" for name in re.findall(r'data-kept="(\w+)"', shown) for n in NUMBERS}
    assert said <= offered
    loaded = set(re.findall(r'(?:src|href)="/static/([^"]+\.(?:js|css))"', shown))
    assert {"js/vote.js", "css/vote.css"} <= loaded
    sizes = {name: len(gzip.compress((STATIC / name).read_bytes())) for name in sorted(loaded)}
    assert sum(sizes.values()) <= 40 * 1024, sizes
    named = set(re.findall(r'modulepreload" href="/static/js/([\w-]+\.js)"', shown))
    imported: set[str] = set()
    for script in ("vote.js", *named):
        text = (STATIC / "js" / script).read_text()
        imported |= set(re.findall(r'from "\./([\w-]+\.js)"', text))
    assert named == imported


@pytest.fixture
def moving() -> Study:
    return a_moving_study(scenarios=2, votes=6)


@pytest.fixture
def filmed(moving: Study) -> Client:
    return signed_in(moving.experts.get())


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
    moving: Study, filmed: Client
) -> None:
    films: dict[str, list[dict[str, Any]]] = {"ann": [], "bob": [], "cid": []}
    for matchup in moving.matchups.all():
        for slug, address in sides(matchup).items():
            films[slug].append(read(filmed, address))
    # Also bob's, whose car stands beside those that move.
    for shown in films.values():
        assert len(shown) > 1
        assert all(one == shown[0] for one in shown)
        assert shown[0].keys() == films["ann"][0].keys()
    assert films["ann"][0] != films["cid"][0]
    said = json.dumps(films["ann"])
    assert not any(word in said for word in ("ann", "New1", "Agent", "place"))


def test_strangers_and_stills_have_no_film(moving: Study, researcher: Client) -> None:
    matchup = moving.matchups.all()[0]
    (address, *_) = sides(matchup).values()
    finn = signed_in(study_rows.expert("finn"))
    assert finn.get(address, {"film": ""}).status_code == 404
    still = study_rows.scenario("still")
    redraw(still)
    assert film_document(still.original_image) is None
    picture = reverse("picture", args=["original", still.code])
    assert researcher.get(picture, {"film": ""}).status_code == 404


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


def test_a_reference_that_moves_has_a_film_on_its_scenarios_page(
    moving: Study, researcher: Client
) -> None:
    cut_in = modification_to_document(Modification(added=(cutting_in(1.0),)))
    Scenario.objects.update(reference=cut_in)
    place = Scenario.objects.all()[0]
    draw_scenario(place.pk)
    page = researcher.get(reverse("scenario", args=[place.code])).content.decode()
    assert page.count("?film") == 2
    assert page.count("film-bar") == 1
    assert read(researcher, reverse("picture", args=["reference", place.code]))["steps"] == 61


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


def a_driven_cast(**cast: object) -> Cast:
    made = cast_of(**cast)  # type: ignore[arg-type]
    drive_pictures(Augmentation.objects.select_related("contestant", "scenario"))
    return made


def a_replayed_study(**cast: object) -> Study:
    made = a_driven_cast(**cast)
    return open_study(name="Round 1", votes_per_expert=9, seed=7, allow_replay=True, **made)


def loaded(shown: str) -> set[str]:
    return set(re.findall(r'(?:src|href)="/static/([^"]+\.(?:js|css))"', shown))


def test_a_study_without_them_has_no_trace_of_them() -> None:
    study = a_study()
    eva = signed_in(User.objects.get(username="eva"))
    for address in (ballot(study), f"{ballot(study)}help/"):
        shown = eva.get(address).content.decode()
        for trace in ("replay", "film.css", "Drives", "planner", "<kbd>D</kbd>"):
            assert trace not in shown, (address, trace)


def test_the_answer_says_nothing_of_where_it_comes_from() -> None:
    first = matchups_of(a_replayed_study(), "eva")[0]
    address = reverse("replay", args=[first.code])
    answer = signed_in(User.objects.get(username="eva")).get(address)
    assert set(answer.json()) == {"a", "b"}
    told = {"format", "version", "step_s", "steps", "ego", "road", "objects"}
    assert set(answer.json()["a"]) == told
    assert answer["Cache-Control"] == "private, no-store"
    assert not {"ETag", "Last-Modified", "Content-Disposition"} & set(answer.headers)
    assert signed_in(User.objects.get(username="finn")).get(address).status_code == 404


def opened(*, outside: int = 6) -> Study:
    """Six scenarios in the study and some outside of it, all with something to practise on."""
    cast = cast_of()
    for number in range(outside):
        scenario(f"elsewhere-{number}")
    right = modification_to_document(Modification(added=(vehicle("car", 12.0, 1.0),)))
    Scenario.objects.update(reference=right)
    reference = contestant("reference", KINDS.REFERENCE)
    for place in Scenario.objects.all():
        picture(place, reference)
    draw_checks(scenarios=list(Scenario.objects.values_list("slug", flat=True)))
    for number, row in enumerate(Augmentation.objects.all()):
        Augmentation.objects.filter(pk=row.pk).update(image=store(png(number)))
    study = open_study(name="Round 1", votes_per_expert=9, seed=7, **cast)
    accept(token=invite(study=study, expert=the_eva()).token)
    return study


def the_eva() -> User:
    return User.objects.get(username="eva")


def practice(study: Study) -> str:
    return reverse("vote-practice", args=[study.code])


def answer(client: Client, study: Study, pair: PracticePair, *, well: bool) -> str:
    """The page that follows."""
    outcome = "left" if pair.good_is_left == well else "right"
    sent = {"pair": pair.position, "outcome": outcome}
    return client.post(practice(study), sent, follow=True).content.decode()


def test_five_pairs_with_feedback_come_before_the_first_pair_and_none_is_a_vote() -> None:
    study = opened()
    assert study.practice
    client = signed_in(the_eva())
    assert client.get(ballot(study)).headers["Location"] == practice(study)
    pairs = practice_pairs(study, the_eva())
    assert len(pairs) == 5
    for number, pair in enumerate(pairs, start=1):
        shown = client.get(practice(study)).content.decode()
        assert f"Practice {number} of 5." in shown
        assert "carries out the instruction, " not in shown, "the answer comes afterwards"
        told = answer(client, study, pair, well=number != 2)
        assert ("Right." in told) == (number != 2)
        assert ("Not quite." in told) == (number == 2)
        good, broken = ("A", "B") if pair.good_is_left else ("B", "A")
        assert f"{good} carries out the instruction, {broken} does not." in told
    assert "Start voting" in told
    assert "Right." in answer(client, study, pairs[0], well=False), "the first answer stays"
    assert client.get(ballot(study)).status_code == 200
    assert not Vote.objects.exists()
    assert voting_progress(study=study, expert=the_eva()).voted == 0


def test_only_who_came_by_a_link_practises_where_the_rules_say_so() -> None:
    study, finn = opened(), User.objects.get(username="finn")
    invite(study=study, expert=finn)
    assert [is_due(study, one) for one in (the_eva(), finn)] == [True, False]
    del study.rules["practice_for"]  # as studies that were opened before
    assert is_due(study, finn)
    rules = {"name": "Round 2", "votes_per_expert": 9, "seed": 7, "experts": ["eva", "finn"]}
    shown = {"contestants": ["ann", "bob", "cid"], "scenarios": [f"place-{n}" for n in range(6)]}
    assert open_study(**rules, **shown).practice
    assert not open_study(**rules | {"name": "Round 3"}, **shown, practice=False).practice


def test_scenarios_outside_of_the_study_come_first_and_its_own_where_those_are_too_few() -> None:
    study = opened(outside=3)
    slugs = [pair.scenario.slug for pair in practice_pairs(study, the_eva())]
    assert [slug.startswith("elsewhere") for slug in slugs] == [True] * 3 + [False] * 2
    assert len(set(slugs)) == 5


def test_a_study_with_nothing_to_practise_on_has_no_practice() -> None:
    assert not open_study(name="Round 0", votes_per_expert=9, **cast_of()).practice
