"""What services refuse is said in the language of the voter, and kept in English."""

import pytest
from django.utils.translation import override

from arena.api.access import make_api_token
from arena.models import Snapshot
from arena.people.links import invite
from arena.results.queries.votes import Filters
from arena.results.services.ratings import RATINGS, plan_snapshot
from arena.studies.services.taking_part import hand_over
from augment.errors import Conflict
from augment.models import Event
from augment.services.running import jobs
from augment.services.running.budget import Caps
from augment.services.running.jobs import JobRequest
from tests import study_rows
from tests.jobs import rows

pytestmark = pytest.mark.django_db


def test_a_voter_is_refused_in_the_language_of_the_request() -> None:
    expert = study_rows.expert("eva")
    with override("de"), pytest.raises(Conflict) as german:
        make_api_token(owner=expert, name="x", role="expert", days=2)
    with override("en"), pytest.raises(Conflict) as english:
        make_api_token(owner=expert, name="x", role="expert", days=2)
    assert str(german.value) != str(english.value)
    assert str(english.value) == "A token works for 1, 7, 30, 90, 365 days, not 2."


def test_nothing_that_is_stored_is_german() -> None:
    study = study_rows.a_study()
    job = rows.launch()
    with override("de"):
        capped = jobs.launch(
            JobRequest(
                name="Capped",
                contestants=["reference"],
                scenarios=["street-1"],
                cap_calls=5,
                cap_tokens=900,
            )
        )
        jobs.pause(capped)
        jobs.resume(capped, higher=Caps(cap_calls=50))
        rows.leased(rows.only_row(job)).settle(rows.failed(), now=rows.NOON)
        invite(study=study, expert=study.experts.get(username="eva"))
        hand_over(study=study, username="eva", to=["finn"])
        snapshot = plan_snapshot(study=study, early=True, filters=Filters(experts=("nobody",)))
        RATINGS.perform(snapshot.pk)
    snapshot.refresh_from_db()
    assert snapshot.state == Snapshot.State.FAILED
    assert snapshot.reason.startswith("Unknown expert 'nobody'. Known: ")
    raised = Event.objects.get(verb="resume")
    assert raised.before == {"state": "paused", "cap": "5 calls, 900 tokens"}
    assert raised.after is not None
    assert raised.after["cap"] == "50 calls, 900 tokens"
    kept = " ".join(str((line.before, line.after)) for line in Event.objects.all())
    assert not any(word in kept for word in ("Aufrufe", "Studie", "„", "unbekannt"))
