"""A practice round: five pairs with what was right and why, once, and nothing of it a vote."""

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from arena.models import PracticePair, Study, Vote
from arena.people.links import accept, invite
from arena.voting.queries.ballots import voting_progress
from arena.voting.services.practice import is_due, practice_pairs
from augment.models import Augmentation, Scenario
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.scenarios.pictures import draw_checks, store
from tests.opening import open_study
from tests.scenes import vehicle
from tests.study_rows import KINDS, cast_of, contestant, picture, scenario
from tests.web.cast import png, signed_in

pytestmark = pytest.mark.django_db


def opened(*, outside: int = 6, **options: object) -> Study:
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
    study = open_study(**{"name": "Round 1", "votes_per_expert": 9, "seed": 7, **cast, **options})
    accept(token=invite(study=study, expert=eva()).token)
    return study


def eva() -> User:
    return User.objects.get(username="eva")


def practice(study: Study) -> str:
    return reverse("vote-practice", args=[study.code])


def page(study: Study) -> str:
    return reverse("vote", args=[study.code])


def answer(client: Client, study: Study, pair: PracticePair, *, well: bool) -> str:
    """The page that follows."""
    outcome = "left" if pair.good_is_left == well else "right"
    sent = {"pair": pair.position, "outcome": outcome}
    return client.post(practice(study), sent, follow=True).content.decode()


def test_five_pairs_with_feedback_come_before_the_first_pair_and_none_is_a_vote() -> None:
    study = opened()
    client = signed_in(eva())
    assert client.get(page(study)).headers["Location"] == practice(study)
    pairs = practice_pairs(study, eva())
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
    assert client.get(page(study)).status_code == 200
    assert not Vote.objects.exists()
    assert voting_progress(study=study, expert=eva()).voted == 0


def test_only_who_came_by_a_link_practises_where_the_rules_say_so() -> None:
    study, finn = opened(), User.objects.get(username="finn")
    invite(study=study, expert=finn)
    assert [is_due(study, one) for one in (eva(), finn)] == [True, False]
    del study.rules["practice_for"]  # as studies that were opened before
    assert is_due(study, finn)


def test_scenarios_outside_of_the_study_come_first_and_its_own_where_those_are_too_few() -> None:
    study = opened(outside=3)
    slugs = [pair.scenario.slug for pair in practice_pairs(study, eva())]
    assert [slug.startswith("elsewhere") for slug in slugs] == [True] * 3 + [False] * 2
    assert len(set(slugs)) == 5


def test_a_second_answer_to_a_pair_changes_nothing() -> None:
    study = opened()
    client = signed_in(eva())
    first = practice_pairs(study, eva())[0]
    answer(client, study, first, well=True)
    assert "Right." in answer(client, study, first, well=False)
    first.refresh_from_db()
    assert first.is_right


def test_a_study_with_nothing_to_practise_on_has_no_practice() -> None:
    assert not open_study(name="Round 0", votes_per_expert=9, **cast_of()).practice


@pytest.mark.parametrize(("said", "practises"), [({}, True), ({"practice": False}, False)])
def test_a_study_has_practice_unless_it_is_said(said: dict[str, bool], practises: bool) -> None:
    assert opened(**said).practice == practises
