"""Each pair has a window of its own, drawn after the opening; what is shown stays as it is."""

import json

import pytest
from django.urls import reverse

from arena.models import Study
from arena.studies.services.opening import open_study
from arena.studies.services.plan import StudyPlan
from arena.studies.services.taking_part import hand_over
from arena.voting.queries.ballots import find_undrawn, upcoming
from arena.voting.queries.showings import view_shown
from arena.voting.services.drawing import draw_pictures
from augment.models import Augmentation
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.scenarios import camera_key
from tests import opening
from tests.api.asking import error_of
from tests.scenes import vehicle
from tests.study_rows import cast_of, expert
from tests.web.cast import signed_in

pytestmark = pytest.mark.django_db
AHEAD_M = {"ann": 20.0, "bob": 20.3, "cid": 45.0}
COLUMNS = ("left_image", "right_image", "original_image", "view")


@pytest.fixture
def study() -> Study:
    cast = cast_of(contestants=tuple(AHEAD_M), scenarios=1, experts=("eva",))
    for name, ahead_m in AHEAD_M.items():
        change = Modification(added=(vehicle("New1", ahead_m, 0.0),))
        row = Augmentation.objects.filter(contestant__slug=name)
        row.update(modification=modification_to_document(change))
    return open_study(StudyPlan.read({**cast, "name": "s", "votes_per_expert": 3, "seed": 7}))


def test_pairs_wait_until_they_are_drawn_each_in_its_own_window(study: Study) -> None:
    eva = study.experts.get()
    assert upcoming(study=study, expert=eva, n=5) == []
    page = reverse("vote", args=[study.code])
    client, pairs = signed_in(eva), f"/api/v1/matchups?study={study.code}"
    assert "being drawn" in client.get(page).content.decode()
    answer = client.get(pairs)
    error_of(answer, 409, "being_drawn")
    assert answer.headers["Retry-After"] == "2"
    assert draw_pictures(study, within_s=0.0)
    assert len(client.get(pairs).json()) == 1
    assert len(upcoming(study=study, expert=eva, n=5)) == 1
    assert not draw_pictures(study)
    rows = upcoming(study=study, expert=eva, n=5)
    assert len(rows) == 3
    assert not find_undrawn(study).exists()
    scales = {}
    for row in rows:
        names = row.left_image, row.right_image, row.original_image
        assert len({camera_key(name) for name in names}) == 1
        assert len(set(names)) == 3
        pair = {row.left.contestant.slug, row.right.contestant.slug}
        scales[frozenset(pair)] = view_shown(row)["px_per_m"]
    near = scales[frozenset({"ann", "bob"})]
    assert all(near > scale for pair, scale in scales.items() if "cid" in pair)
    # 0.3 m are few pixels: an inset lies over the ground, beside the scale.
    shown = {
        pair: len(view_shown(row)["covered_px"]) for pair, row in zip(scales, rows, strict=True)
    }
    assert shown[frozenset({"ann", "bob"})] == 2
    assert json.loads(study.preregistration)["rules"]["windows"] == "pair"


def test_a_repeat_and_a_pair_handed_over_show_what_was_drawn(study: Study) -> None:
    draw_pictures(study)
    before = {row.left_id + row.right_id: row for row in study.matchups.all()}
    finn = expert("finn")
    hand_over(study=study, username="eva", to=["finn"])
    assert not find_undrawn(study).exists()
    for row in study.matchups.filter(expert=finn):
        first = before[row.left_id + row.right_id]
        assert {row.left_image, row.right_image} == {first.left_image, first.right_image}
        assert (row.original_image, row.view) == (first.original_image, first.view)


def test_a_study_with_one_window_a_scenario_keeps_it() -> None:
    cast = cast_of(contestants=("ann", "bob"), scenarios=2, experts=("eva",))
    Augmentation.objects.update(modification=modification_to_document(Modification()))
    study = opening.open_study(**cast, name="old", votes_per_expert=2, seed=7)
    legend = {"scene": ["lane"], "pair": []}
    for row in study.matchups.all():
        row.view, row.original_image = {**(row.view or {}), "legend": legend}, "bev/original.png"
        row.save()
    study.rules.pop("windows")
    study.save()
    shown = {frozenset(row[:2]): row[2:] for row in study.matchups.values_list(*COLUMNS)}
    finn = expert("finn")
    hand_over(study=study, username="eva", to=["finn"])
    rows = study.matchups.filter(expert=finn).values_list(*COLUMNS)
    assert {frozenset(row[:2]): row[2:] for row in rows} == shown
