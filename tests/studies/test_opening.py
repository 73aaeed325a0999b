from collections import Counter

import pytest
from django.contrib.auth.models import Group, User
from django.utils import timezone

from arena.errors import NothingToPlan
from arena.models import Study
from arena.pairing.plan import plan
from arena.studies.services.planning import frozen_rules
from augment.errors import Conflict, UnknownName
from augment.models import Augmentation, Contestant, Event, Scenario
from tests.opening import open_study
from tests.study_rows import KINDS, a_study, cast_of, picture

pytestmark = pytest.mark.django_db


def test_an_open_study_has_every_experts_matchups_and_a_line_in_the_log() -> None:
    study = a_study(votes_per_expert=9)
    assert study.state == Study.State.OPEN
    assert study.opened_at is not None
    per_expert = Counter(study.matchups.values_list("expert__username", flat=True))
    assert per_expert == {"eva": 9, "finn": 9}
    event = Event.objects.get(verb="open")
    assert event.object_code == str(study.code)
    assert event.after == {"name": "Round 1", "matchups": 18, "seed": 7}


def test_the_stored_rules_give_the_stored_plan_again() -> None:
    study = Study.objects.get(pk=a_study().pk)
    planned = plan(frozen_rules(study))
    stored = study.matchups.order_by("expert__username", "position").values_list(
        "expert__username",
        "position",
        "scenario__slug",
        "left__contestant__slug",
        "right__contestant__slug",
    )
    assert list(stored) == [
        (m.expert, m.position, m.scenario, m.left, m.right) for m in planned.matchups
    ]
    assert study.rules["scenario_gap_kept"] == 5


@pytest.mark.parametrize("state", [Augmentation.State.DONE, Augmentation.State.UNREADABLE])
def test_the_latest_picture_takes_part_also_of_an_unreadable_answer(state: str) -> None:
    cast = cast_of(contestants=("ann", "bob"), scenarios=1)
    place, ann = Scenario.objects.get(), Contestant.objects.get(slug="ann")
    latest = picture(place, ann, state=state)
    picture(place, ann, state=Augmentation.State.FAILED, image="")
    study = open_study(name="Round 1", votes_per_expert=1, seed=1, **cast)
    shown = {pk for pair in study.matchups.values_list("left", "right") for pk in pair}
    assert latest.pk in shown


def test_identical_pictures_are_never_shown() -> None:
    cast = cast_of(contestants=("ann", "bob"), scenarios=3)
    for slug in cast["contestants"]:
        place = Scenario.objects.get(slug="place-1")
        picture(place, Contestant.objects.get(slug=slug), image="bev/empty.png")
    study = open_study(name="Round 1", votes_per_expert=2, seed=1, **cast)
    shown = set(study.matchups.values_list("scenario__slug", flat=True))
    assert shown == {"place-0", "place-2"}
    assert study.rules["identical"] == [["place-1", "ann", "bob"]]


def test_missing_pictures_are_named_and_nothing_is_stored() -> None:
    cast = cast_of()
    Augmentation.objects.filter(contestant__slug="cid", scenario__slug="place-3").delete()
    Augmentation.objects.filter(contestant__slug="bob", scenario__slug="place-0").update(
        state="failed", finished_at=timezone.now()
    )
    with pytest.raises(NothingToPlan, match=r"of bob on place-0, cid on place-3\. Generate"):
        open_study(name="Round 1", votes_per_expert=4, seed=1, **cast)
    assert not Study.objects.exists()


def test_simulated_contestants_take_part_only_when_allowed() -> None:
    cast = cast_of(kind=KINDS.SIMULATED)
    with pytest.raises(Conflict, match="contestant ann, contestant bob"):
        open_study(name="Round 1", votes_per_expert=2, seed=1, **cast)
    allowed = open_study(name="Round 1", votes_per_expert=2, seed=1, allow_simulated=True, **cast)
    assert allowed.allow_simulated


def test_who_may_know_the_contestants_is_not_asked_to_vote() -> None:
    cast = cast_of()
    finn = User.objects.get(username="finn")
    finn.groups.add(Group.objects.get_or_create(name="researcher")[0])
    with pytest.raises(UnknownName, match=r"Unknown expert 'finn'. Known: eva"):
        open_study(name="Round 1", votes_per_expert=3, seed=7, **cast)
