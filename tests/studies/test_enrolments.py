"""A link for everybody: places, consent, quotas, drop-outs, and who may know who somebody is."""

from datetime import timedelta

import pytest
from django.utils import timezone

from arena.errors import EnrolmentOver
from arena.models import EnrolledVoter, Enrolment, Study
from arena.people.services import create_person
from arena.studies.queries import state_of
from arena.studies.services.opening import close_study
from arena.studies.services.taking_part import drop_silent, enrol, forget_identity, set_enrolment
from arena.voting.queries.ballots import list_voters
from augment.errors import Conflict
from augment.models import Event
from tests.study_rows import a_study, matchups_of, vote

pytestmark = pytest.mark.django_db


def link(study: Study, **changes: object) -> Enrolment:
    given: dict[str, object] = {
        "consent": "I agree.",
        "asks_for": "Your ID",
        "places": 2,
        "votes_each": 6,
        "drop_out_after_h": 24,
    }
    return set_enrolment(study=study, rules={**given, **changes})


def join(enrolment: Enrolment, name: str) -> EnrolledVoter:
    return enrol(token=enrolment.token, external_id=name, agreed_sha256=enrolment.consent_sha256)


def answer(study: Study, voter: EnrolledVoter, pairs: int) -> None:
    for matchup in matchups_of(study, voter.expert.username)[:pairs]:
        vote(matchup)


def age(voter: EnrolledVoter, *, hours: float) -> None:
    """As if they had come so long ago."""
    came = timezone.now() - timedelta(hours=hours)
    EnrolledVoter.objects.filter(pk=voter.pk).update(enrolled_at=came)


@pytest.fixture
def study() -> Study:
    return a_study(votes_per_expert=3)


def test_a_newcomer_gets_an_account_and_the_quota_and_is_done_with_it(study: Study) -> None:
    voter = join(link(study), "w-1")
    mine = study.matchups.filter(expert=voter.expert)
    assert mine.count() == 6
    assert list(mine.order_by("position").values_list("position", flat=True)) == [1, 2, 3, 4, 5, 6]
    assert voter.expert in study.experts.all()
    assert not voter.expert.has_usable_password()
    assert not list_voters(study).get().is_done
    answer(study, voter, 6)
    assert list_voters(study).get().is_done, "every pair has an answer: the code is told"
    assert state_of(voter.enrolment)["done"] == 1


def test_one_id_has_one_place_and_with_every_place_taken_nobody_is_taken_on(study: Study) -> None:
    enrolment = link(study)
    join(enrolment, " w-1 ")
    with pytest.raises(Conflict, match="takes part already"):
        join(enrolment, "W-1")
    join(enrolment, "w-2")
    before = study.matchups.count()
    with pytest.raises(EnrolmentOver, match="Every place"):
        join(enrolment, "w-3")
    assert study.matchups.count() == before
    assert state_of(enrolment)["free"] == 0


def test_what_is_closed_takes_nobody_on(study: Study) -> None:
    with pytest.raises(EnrolmentOver):
        join(link(study, is_open=False), "w-1")
    enrolment = link(study)
    close_study(study=study)
    with pytest.raises(EnrolmentOver):
        join(enrolment, "w-1")


def test_who_read_an_older_text_reads_the_new_one_first(study: Study) -> None:
    read = link(study).consent_sha256
    enrolment = link(study, consent="I agree to more.")
    with pytest.raises(Conflict, match="changed meanwhile"):
        enrol(token=enrolment.token, external_id="w-1", agreed_sha256=read)
    assert join(enrolment, "w-1").consent_sha256 == enrolment.consent_sha256


def test_who_is_silent_for_too_long_makes_room(study: Study) -> None:
    enrolment = link(study, places=1)
    voter = join(enrolment, "w-1")
    for hours, places, pairs in ((23.9, 0, 6), (24.1, 1, 0)):
        age(voter, hours=hours)
        assert drop_silent(enrolment=enrolment) == places
        assert state_of(enrolment)["free"] == places
        assert study.matchups.filter(expert=voter.expert).count() == pairs


def test_a_drop_out_is_replaced_when_somebody_comes_and_keeps_the_votes(study: Study) -> None:
    enrolment = link(study, places=1)
    first = join(enrolment, "w-1")
    answer(study, first, 2)
    age(first, hours=30)
    with pytest.raises(EnrolmentOver):
        join(enrolment, "w-2")  # the last vote was just now
    later = timezone.now() + timedelta(hours=25)
    drop_silent(enrolment=enrolment, now=later)
    second = join(enrolment, "w-2")
    assert study.matchups.filter(expert=first.expert).count() == 2
    assert study.matchups.filter(expert=second.expert).count() == 6
    told = list_voters(study).get(expert=first.expert)
    assert (told.dropped_at, told.is_done) == (later, False)


def test_the_id_stands_in_no_log_and_goes_when_the_person_is_forgotten(study: Study) -> None:
    admin = create_person(username="root", password=None, role="admin")
    enrolment = link(study)
    voter = enrol(
        token=enrolment.token,
        external_id="w-secret",
        agreed_sha256=enrolment.consent_sha256,
        platform_study="s-secret",
        platform_session="t-secret",
    )
    assert not [
        event.pk for event in Event.objects.all() if "-secret" in f"{event.before} {event.after}"
    ]
    forget_identity(user=voter.expert, actor=admin)
    voter.refresh_from_db()
    assert [voter.external_id, voter.platform_study, voter.platform_session] == ["", "", ""]


@pytest.mark.parametrize(("answered", "free"), [(0, 1), (2, 1), (6, 0)])
def test_who_is_forgotten_before_the_end_makes_room_at_once(
    study: Study, answered: int, free: int
) -> None:
    admin = create_person(username="root", password=None, role="admin")
    enrolment = link(study, places=1, drop_out_after_h=None)
    voter = join(enrolment, "w-1")
    answer(study, voter, answered)
    forget_identity(user=voter.expert, actor=admin)
    assert state_of(enrolment)["free"] == free
    assert study.matchups.filter(expert=voter.expert).count() == answered
    assert Event.objects.filter(verb="drop out", actor=admin).count() == free
    if free:
        newcomer = join(enrolment, "w-2")
        assert study.matchups.filter(expert=newcomer.expert).count() == 6
