"""What services refuse is said in the language of whoever reads, and kept in English."""

from __future__ import annotations

import html
from typing import Any

import pytest
from django.contrib.messages import get_messages
from django.test import Client
from django.urls import reverse
from django.utils.translation import override

from arena import tasks
from arena.errors import StudyStillOpen
from arena.models import Snapshot
from arena.queries.vote_sets import Filters
from arena.services.faults import open_labelling
from arena.services.handing_over import hand_over
from arena.services.invitations import invite
from arena.services.ratings import plan_snapshot
from arena.services.studies import close_study, open_study
from augment.errors import Conflict, InvalidDocument, KeyMissing, QueueUnreachable, UnknownName
from augment.models import Augmentation, Contestant, Event
from augment.sentences import sentence, sentence_of, word
from augment.services.running import caps, jobs, leases
from augment.services.running.caps import Caps
from augment.services.wording import translate
from tests import study_rows
from tests.jobs import rows
from tests.web.cast import people, signed_in

pytestmark = pytest.mark.django_db

GERMAN: Any = {"HTTP_ACCEPT_LANGUAGE": "de"}
ODD = "100 % of %(name)s"


def flashed(client: Client, address: str, sent: dict[str, Any] | None = None) -> str:
    """What the next page says on top."""
    answer = client.post(address, sent or {}, **GERMAN)
    return [str(one) for one in get_messages(answer.wsgi_request)][-1]


def shown(client: Client, address: str, sent: dict[str, Any]) -> str:
    """The page that refuses a form, its white space evened out."""
    answer = client.post(address, sent, **GERMAN)
    assert answer.status_code == 422
    return " ".join(html.unescape(answer.content.decode()).split())


def in_german(error: Exception) -> str:
    with override("de"):
        return translate(error)


def test_a_sentence_is_said_with_its_names_as_they_are() -> None:
    error = Conflict(sentence("There is a study named '%(name)s' already.", name=ODD))
    assert str(error) == f"There is a study named '{ODD}' already."
    assert in_german(error) == f"Eine Studie namens „{ODD}“ gibt es schon."
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


def test_errors_without_a_sentence_stay_as_they_are() -> None:
    plain = KeyMissing("KEY", "local")
    assert in_german(plain) == str(plain)
    assert (in_german(Conflict()), translate("")) == ("", "")
    assert type(sentence_of(Conflict(word("100 %")))) is not str
    assert in_german(Conflict(word("100 %"))) == "100 %"


@pytest.mark.parametrize(
    ("error", "german"),
    [
        (StudyStillOpen(ODD), f"Die Studie „{ODD}“ läuft noch."),
        (QueueUnreachable("redis://here/0"), "Kein Redis unter redis://here/0: Starten Sie"),
        (UnknownName("expert", "eva", []), "Fachperson „eva“ ist unbekannt. Bekannt ist noch"),
    ],
)
def test_errors_that_word_themselves_speak_german(error: Exception, german: str) -> None:
    assert in_german(error).startswith(german)


def test_the_form_of_a_study_refuses_in_german() -> None:
    cast = study_rows.cast_of()
    study_rows.contestant("new")
    admin, address = signed_in(people()["admin"]), reverse("study-new")
    sent = {"name": ODD, **cast, "votes_per_expert": 12, "seed": 4}
    for rules, german in (
        ({"targets": f"ann {ODD}"}, f"„ann {ODD}“ ist keine Zielzahl: Schreiben Sie TEILNEHMER"),
        ({"targets": "ann vs bob 1"}, "ergeben zusammen 1 Stimmen, für alle Fachleute zusammen"),
        ({"targets": "ann 20"}, "Jeder Teilnehmer der Studie braucht genau eine Zielzahl: bob,"),
        ({"votes_per_expert": 99}, "Verschiedene Paare zu zeigen: 18 (Szenarien: 6). Je Person"),
        ({"contestants": ["ann", "new"]}, "Noch fehlen Bilder: new zu place-0, new zu place-1"),
        ({"seed": -1}, "Ein Startwert liegt zwischen 0 und 2^63 - 1; -1 geht nicht."),
    ):
        assert german in shown(admin, address, {**sent, **rules})
    open_study(name=ODD, **cast, votes_per_expert=9, seed=4)
    assert f"Eine Studie namens „{ODD}“ gibt es schon." in shown(admin, address, sent)


def test_handing_over_and_labelling_refuse_in_german() -> None:
    study = study_rows.a_study()
    admin = signed_in(people()["admin"])
    address = reverse("study-hand-over", args=[study.code])
    sent = {"giver": "eva", "takers": ["eva"]}
    assert flashed(admin, address, sent) == "eva kann nicht die eigenen Paare übernehmen."
    close_study(study=study)
    told = flashed(admin, address, sent | {"takers": ["finn"]})
    assert told == "Die Studie „Round 1“ ist geschlossen: Es wird nichts übergeben."
    job = Augmentation.objects.all()[0].job
    open_labelling(name=ODD, job=job, experts=["eva"], seed=1)
    again = {"name": ODD, "experts": ["eva"], "seed": 1}
    page = shown(admin, reverse("faults", args=[job.code]), again)
    assert f"Eine Beurteilung namens „{ODD}“ gibt es schon" in page


def test_jobs_refuse_in_german() -> None:
    job = rows.launch(scenarios=2)
    admin = signed_in(people()["admin"])
    for name, german in (
        ("retry", "Im Job „Round 1“ ist nichts fehlgeschlagen; es gibt nichts zu wiederholen."),
        (
            "resume",
            "Der Job „Round 1“ ist am Laufen; fortsetzen lässt sich nur einer, der angehalten",
        ),
        ("cancel", "Abgebrochen. Was fertig ist, bleibt."),
        ("cancel", "Der Job „Round 1“ ist schon abgebrochen."),
    ):
        told = flashed(admin, reverse(f"job-{name}", args=[job.code]), {"sure": "1"})
        assert told.startswith(german)
    rows.add_scenario("bare", reference=None)
    sent = {"name": "Night", "contestants": ["reference"], "scenarios": ["bare"]}
    refused = shown(admin, reverse("job-new"), sent)
    assert "reference braucht Szenarien mit einer Referenzänderung; diese haben keine: bare." in (
        refused
    )


def test_why_a_contestant_cannot_be_chosen_is_said_in_german() -> None:
    rows.add_kind("somebody", Contestant.Kind.HUMAN)
    page = signed_in(people()["admin"]).get(reverse("job-new"), **GERMAN)
    assert "von Menschen oder einem fremden Programm gemacht" in page.content.decode()


def test_keys_of_ones_own_are_refused_in_german() -> None:
    client = signed_in(study_rows.expert("eva"))
    body = {"keys": {"a": "s"}}
    answer = client.post("/api/v1/preferences", body, content_type="application/json", **GERMAN)
    assert answer.json()["error"]["fields"] == {
        "keys": ["„s“ würde zweierlei tun: A ist besser, Überspringen."]
    }


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
        leases.settle(
            held=rows.leased(rows.only_row(job)), settlement=rows.failed(), now=rows.NOON
        )
        invite(study=study, expert=study.experts.get(username="eva"))
        hand_over(study=study, username="eva", to=["finn"])
        snapshot = plan_snapshot(study=study, early=True, filters=Filters(experts=("nobody",)))
        tasks.compute_snapshot(snapshot.pk)
    snapshot.refresh_from_db()
    assert snapshot.state == Snapshot.State.FAILED
    assert snapshot.status.startswith("Unknown expert 'nobody'. Known: ")
    raised = Event.objects.get(verb="raise cap")
    assert raised.before == {"cap": "5 calls, 900 tokens"}
    assert raised.after == {"cap": "50 calls, 900 tokens"}
    kept = " ".join(str((line.before, line.after)) for line in Event.objects.all())
    assert not any(word in kept for word in ("Aufrufe", "Studie", "„", "unbekannt"))
