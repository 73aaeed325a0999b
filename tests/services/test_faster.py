"""Two who do the same at once."""

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from django.contrib.auth.models import User
from django.db import connection

from arena.errors import NothingToPlan
from arena.jobs.services import open_labelling
from arena.models import Invitation, LabellingRound
from arena.people.links import FreshLink, invite
from tests.exports.test_displacement import a_job
from tests.study_rows import a_study, expert

THREADS = 4


@pytest.mark.django_db(transaction=True)
def test_of_links_that_are_made_at_once_each_replaces_the_one_before() -> None:
    study = a_study()
    eva = User.objects.get(username="eva")
    together = threading.Barrier(THREADS)

    def make(_: int) -> FreshLink:
        together.wait()
        try:
            return invite(study=study, expert=eva)
        finally:
            connection.close()

    with ThreadPoolExecutor(THREADS) as pool:
        made = [link.invitation.pk for link in pool.map(make, range(THREADS))]
    alive = Invitation.objects.get(revoked_at=None)
    assert len(made) == Invitation.objects.count() == THREADS
    assert alive.pk == max(made)


@pytest.mark.django_db(transaction=True)
def test_of_labellings_that_are_opened_at_once_none_plans_what_another_has() -> None:
    job = a_job()
    expert("eva")
    together = threading.Barrier(THREADS)

    def opened(number: int) -> bool:
        together.wait()
        try:
            open_labelling(name=f"Faults {number}", job=job, experts=["eva"], seed=number)
        except NothingToPlan:
            return False
        finally:
            connection.close()
        return True

    with ThreadPoolExecutor(THREADS) as pool:
        assert sorted(pool.map(opened, range(THREADS))) == [False] * (THREADS - 1) + [True]
    assert LabellingRound.objects.count() == 1
