"""What services refuse is said in the language of the voter, and kept in English."""

from __future__ import annotations

import pytest
from django.utils.translation import override

from arena.errors import StudyStillOpen
from arena.models import Snapshot
from arena.queries.vote_sets import Filters
from arena.services.handing_over import hand_over
from arena.services.invitations import invite
from arena.services.ratings import RATINGS, plan_snapshot
from augment.errors import Conflict, InvalidDocument, UnknownName
from augment.models import Event
from augment.sentences import sentence
from augment.services.running import caps, jobs
from augment.services.running.caps import Caps
from augment.services.wording import translate
from tests import study_rows
from tests.jobs import rows

pytestmark = pytest.mark.django_db

ODD = "100 % of %(name)s"


def in_german(error: Exception) -> str:
    with override("de"):
        return translate(error)


def test_a_sentence_is_said_with_its_names_as_they_are() -> None:
    error = Conflict(sentence("The study '%(name)s' is not open: nobody can enrol.", name=ODD))
    assert str(error) == f"The study '{ODD}' is not open: nobody can enrol."
    assert in_german(error).startswith(f"Die Studie „{ODD}“ ")
    with override("en"):
        assert translate(error) == str(error)


def test_words_and_sentences_within_a_sentence_are_said_and_names_are_not() -> None:
    error = UnknownName("scenario", "Scenario", ["draft", "open"])
    assert str(error) == "Unknown scenario 'Scenario'. Known: draft, open."
    assert in_german(error) == "Szenario „Scenario“ ist unbekannt. Bekannt: draft, open."
    rule = sentence("1 to %(most)s printable characters are needed", most=120)
    wrong = InvalidDocument("study", [("name", rule), ("speed_%", "is no number")])
    assert str(wrong) == (
        "This study can't be read: name: 1 to 120 printable characters are needed; "
        "speed_%: is no number"
    )
    assert in_german(wrong) == (
        "Studie nicht lesbar: Name: 1 bis 120 druckbare Zeichen sind nötig; speed_%: is no number"
    )
    many = InvalidDocument("scene", [(f"lanes.{n}", "is empty") for n in range(10)])
    assert str(many).endswith("lanes.7: is empty (and 2 more)")
    assert in_german(many).endswith("lanes.7: is empty (und 2 weitere)")


@pytest.mark.parametrize(
    ("error", "german"),
    [
        (StudyStillOpen(ODD), f"Die Studie „{ODD}“ läuft noch."),
        (UnknownName("expert", "eva", []), "Fachperson „eva“ ist unbekannt. Bekannt ist noch"),
    ],
)
def test_errors_that_word_themselves_speak_german(error: Exception, german: str) -> None:
    assert in_german(error).startswith(german)


def test_nothing_that_is_stored_is_german() -> None:
    study = study_rows.a_study()
    job = rows.launch()
    with override("de"):
        capped = jobs.launch(
            name="Capped",
            contestants=["reference"],
            scenarios=["street-1"],
            caps=Caps(calls=5, tokens=900),
        )
        caps.raise_cap(capped, caps=Caps(calls=50))
        rows.leased(rows.only_row(job)).settle(rows.failed(), now=rows.NOON)
        invite(study=study, expert=study.experts.get(username="eva"))
        hand_over(study=study, username="eva", to=["finn"])
        snapshot = plan_snapshot(study=study, early=True, filters=Filters(experts=("nobody",)))
        RATINGS.perform(snapshot.pk)
    snapshot.refresh_from_db()
    assert snapshot.state == Snapshot.State.FAILED
    assert snapshot.reason.startswith("Unknown expert 'nobody'. Known: ")
    raised = Event.objects.get(verb="raise cap")
    assert raised.before == {"cap": "5 calls, 900 tokens"}
    assert raised.after == {"cap": "50 calls, 900 tokens"}
    kept = " ".join(str((line.before, line.after)) for line in Event.objects.all())
    assert not any(word in kept for word in ("Aufrufe", "Studie", "„", "unbekannt"))
