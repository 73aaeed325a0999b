"""Opening, watching, closing and cancelling a study by its pages; votes that come as a file."""

import html
import re
import uuid
from dataclasses import replace
from typing import Any

import pytest
from django.contrib.auth.models import User
from django.core.files.uploadedfile import SimpleUploadedFile
from django.test import Client
from django.urls import reverse

from arena.errors import NoSnapshot, StudyNotOpen
from arena.models import ImportedVote, Study, Vote
from arena.results.queries.access import snapshot_to_export
from arena.results.services.ratings import rate_now as rate
from arena.studies.pages import setup
from arena.studies.queries import count_progress
from arena.studies.services.opening import cancel_study, close_study
from arena.studies.services.outlook import StudyEstimate, prospect
from arena.studies.services.plan import PRESETS
from arena.voting.queries.ballots import tallies, voting_progress
from arena.voting.queries.blinding import ResultsAccess, results_access
from augment import tasks
from augment.errors import Conflict
from augment.models import Augmentation, Event
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from tests import study_rows
from tests.scenes import vehicle
from tests.web.cast import people, signed_in, world

pytestmark = pytest.mark.django_db


def test_an_admin_opens_a_study_that_can_be_planned_and_its_experts_can_vote(
    admin: Client,
) -> None:
    cast = study_rows.cast_of()
    study_rows.contestant("new")
    sent = {"name": "Round 1", **cast, "votes_per_expert": 9, "seed": 4, "sure": "1"}
    answer = admin.post(reverse("study-new"), {**sent, "contestants": ["ann", "new"]})
    assert answer.status_code == 422
    assert "no picture yet of new" in answer.content.decode()
    assert 'value="Round 1"' in answer.content.decode()
    assert not Study.objects.exists()
    answer = admin.post(reverse("study-new"), sent)
    study = Study.objects.get()
    assert answer.headers["Location"] == reverse("study", args=[study.code])
    assert (study.state, study.matchups.count()) == ("open", 18)


def test_progress_is_shown_by_expert_and_says_nothing_of_who_leads() -> None:
    study = study_rows.a_study()
    for matchup in study_rows.matchups_of(study, "eva")[:4]:
        study_rows.vote(matchup)
    page = signed_in(people()["researcher"]).get(reverse("study", args=[study.code]))
    shown = page.content.decode()
    assert "4 of 9" in shown
    assert "4 of 18 votes" in shown
    assert "Elo" not in shown[shown.index("<main") :]
    assert "Close the study" not in shown
    assert "finn" not in shown, "researchers know experts by their pseudonyms"


def test_an_admin_hands_over_what_an_expert_has_not_judged(admin: Client) -> None:
    study = study_rows.a_study(experts=("eva", "finn", "gus"))
    url = reverse("study-hand-over", args=[study.code])
    given = {"giver": "eva", "takers": ["finn", "gus"], "sure": "1"}
    said = admin.post(url, given, follow=True)
    assert "Handed over: finn 5, gus 4." in said.content.decode() or (
        "Handed over: finn 4, gus 5." in said.content.decode()
    )
    assert not study.matchups.filter(expert__username="eva").exists()
    again = admin.post(url, {"giver": "eva", "takers": ["finn"], "sure": "1"}, follow=True)
    assert "eva has nothing left to hand over." in again.content.decode()
    nobody = admin.post(url, {"giver": "finn"}, follow=True)
    assert "Choose who takes over." in nobody.content.decode()
    assert signed_in(User.objects.get(username="the-researcher")).post(url).status_code == 403


def test_attention_checks_are_drawn_by_a_worker_with_one_click(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    place = study_rows.scenario("with-reference")
    place.reference = modification_to_document(Modification(added=(vehicle("Agent2", 20.0, 0.0),)))
    place.save()
    study_rows.scenario("without")
    sent: list[int] = []
    monkeypatch.setattr(setup, "send_checks", sent.append)
    admin = people()["admin"]
    entered = {"name": "Half filled in", "draw": "1"}
    shown = signed_in(admin).post(reverse("study-new"), entered).content.decode()
    assert 'value="Half filled in"' in shown
    tasks.draw_checks(*sent)
    tasks.draw_checks(*sent)
    drawn = Augmentation.objects.get(contestant__kind="check")
    assert (drawn.scenario.slug, sent) == ("with-reference", [admin.pk])


@pytest.fixture
def study() -> Study:
    """Open, with three votes and a skip of eva's."""
    study = study_rows.a_study()
    first, *rest = study_rows.matchups_of(study, "eva")
    study_rows.vote(first, "skip", reason="unclear")
    for matchup in rest[:3]:
        study_rows.vote(matchup)
    return study


def test_cancelling_needs_the_name_and_says_how_it_differs_from_closing(
    study: Study, admin: Client
) -> None:
    page = reverse("study-cancel", args=[study.code])
    assert page in admin.get(reverse("study", args=[study.code])).content.decode()
    asked = text_of(admin.get(page))
    for fact in ("“Round 1”?", "nobody ever sees results", "exported as votes: 3."):
        assert fact in asked
    for typed in ("", "Round", "round 12"):
        answer = admin.post(page, {"sure": "1", "typed": typed, "why": "Wrong pictures."})
        assert answer.status_code == 422, typed
        assert "That is another name; nothing was done." in text_of(answer)
        assert "Wrong pictures." in answer.content.decode(), "nothing is lost"
        assert Study.objects.get().state == "open"
    answer = admin.post(page, {"sure": "1", "typed": "round-1", "why": "Wrong pictures."})
    assert answer.headers["Location"] == reverse("study", args=[study.code])
    event = Event.objects.get(verb="cancel")
    assert event.after == {"state": "cancelled", "why": "Wrong pictures."}
    assert event.actor == User.objects.get(username="the-admin")
    assert admin.get(page).status_code == 302, "there is nothing more to ask"


def test_an_expert_reads_a_calm_sentence_and_can_vote_no_more(study: Study) -> None:
    eva = signed_in(User.objects.get(username="eva"))
    waiting = study_rows.matchups_of(study, "eva")[5]
    cancel_study(study=study)
    shown = text_of(eva.get(reverse("vote", args=[study.code])))
    assert "This study was cancelled" in shown
    assert "There is nothing left for you to do. Your 3 answers are saved, thank you." in shown
    assert "This study was cancelled" in text_of(eva.get("/"))
    with pytest.raises(StudyNotOpen):
        study_rows.vote(waiting)
    assert Vote.objects.count() == 4


def test_it_has_no_results_for_anybody_also_where_somebody_rated_early(
    study: Study, admin: Client
) -> None:
    early = rate(study=study, early=True, rounds=20)
    cancel_study(study=study)
    study.refresh_from_db()
    for user in User.objects.all():
        assert results_access(user=user, study=study) is ResultsAccess.NONE, user
    for name in ("results", "study-rate"):
        address = reverse(name, args=[study.code])
        answer = admin.post(address) if name == "study-rate" else admin.get(address)
        assert answer.status_code == 403, name
    with pytest.raises(NoSnapshot):
        snapshot_to_export(study, early.code)
    with pytest.raises(Conflict):
        rate(study=study, early=True, rounds=20)
    shown = admin.get(reverse("studies")).content.decode()
    assert "Cancelled" in shown
    assert reverse("results", args=[study.code]) not in shown


def test_closed_and_cancelled_exclude_each_other(study: Study) -> None:
    for _ in range(2):
        assert cancel_study(study=study).state == "cancelled"
    assert Event.objects.filter(verb="cancel").count() == 1
    with pytest.raises(StudyNotOpen, match="is cancelled already"):
        close_study(study=study)
    Study.objects.update(state="closed")
    with pytest.raises(StudyNotOpen, match="is closed"):
        cancel_study(study=study)


def test_the_form_says_what_its_votes_will_tell_and_a_preset_changes_them(admin: Client) -> None:
    cast = study_rows.cast_of()
    cast["scenarios"] = ["finished"]
    sent = {**cast, "votes_per_expert": "9", "repeats": "0", "checks": "0", "overlap": "0"}
    shown = text_of(admin.post(reverse("study-new"), {**sent, "estimate": "1"}))
    estimate = StudyEstimate(
        contestants=3, experts=2, scenarios=6, votes_per_expert=9, repeats=0, checks=0, overlap=0
    )
    assert "18 votes 9 from each of 2 experts, about 2 minutes each, on 6 scenarios." in shown
    assert f"±{prospect(estimate).half_width:.0f} Elo" in shown
    pressed = text_of(admin.post(reverse("study-new"), {**sent, "preset": "pilot"}))
    preset = PRESETS["pilot"].quantities
    votes = int(preset["votes_per_expert"])
    pilot = replace(estimate, votes_per_expert=votes, overlap=preset["overlap"])
    assert f"{2 * votes} votes {votes} from each of 2 experts" in pressed
    assert f"±{prospect(pilot).half_width:.0f} Elo" in pressed


def test_a_new_form_is_filled_in_with_what_is_finished() -> None:
    cast = study_rows.cast_of()
    study_rows.contestant("late")
    shown = text_of(signed_in(people()["admin"]).get(reverse("study-new")))
    assert len(cast["contestants"]) == 3
    assert "from each of 3 experts" in shown, "the account of the cast of pages is one, too"
    assert "on 6 scenarios" in shown


def text_of(answer: Any) -> str:
    plain = re.sub(r"<[^>]+>", " ", html.unescape(answer.content.decode()))
    return " ".join(plain.split())


def hidden_of(answer: Any) -> dict[str, list[str]]:
    """What the page sends along, as a browser would."""
    sent: dict[str, list[str]] = {}
    pattern = r'<input type="hidden" name="([^"]+)" value="([^"]*)">'
    for name, value in re.findall(pattern, answer.content.decode()):
        if name != "csrfmiddlewaretoken":
            sent.setdefault(name, []).append(html.unescape(value))
    return sent


def test_closing_asks_says_what_will_be_missing_and_rates_the_votes_once(admin: Client) -> None:
    study = study_rows.a_study()
    first, second, third, *_ = study_rows.matchups_of(study, "eva")
    study_rows.vote(first, "skip", reason="unclear")
    for matchup in (second, third):
        study_rows.vote(matchup)
    page = reverse("study-close", args=[study.code])
    assert page in admin.get(reverse("study", args=[study.code])).content.decode()
    for asked in (admin.get(page), admin.get(page, {"sure": "1"}), admin.post(page)):
        assert asked.status_code == 200
        shown = text_of(asked)
        assert "Close the study “Round 1”?" in shown
        assert "Votes given: 2. Pairs skipped: 1. Still planned: 15." in shown
        study.refresh_from_db()
        assert study.state == "open"
    for _ in range(2):
        answer = admin.post(page, {"sure": "1"}, follow=True)
        assert answer.redirect_chain[-1][0] == reverse("results", args=[study.code])
        assert "2 votes counted" in answer.content.decode()
        assert "Not enough votes to rank" in answer.content.decode()
    study.refresh_from_db()
    assert (study.state, study.snapshots.count()) == ("closed", 1)
    assert admin.get(page).status_code == 302, "a closed one asks nothing"


def test_a_skip_is_counted_apart_everywhere_and_a_vote_instead_of_it_counts() -> None:
    study = study_rows.a_study(votes_per_expert=3)
    first, second, third = study_rows.matchups_of(study, "eva")
    skipped = study_rows.vote(first, "skip", reason="unclear")
    study_rows.vote(second, "skip", reason="unclear")
    study_rows.vote(third)
    before = study_rows.vote(study_rows.matchups_of(study, "finn")[0])
    study_rows.vote(before.matchup, "skip", reason="other", supersedes=before.key)

    def counted() -> tuple[object, ...]:
        (line,), eva = count_progress([study]), tallies(study)[0]
        (own,) = count_progress([study], first.expert)
        return (
            (line.voted, line.skipped, line.left),
            (eva.voted, eva.skipped, eva.left),
            (own.voted, own.skipped, own.left),
        )

    assert counted() == ((1, 3, 2), (1, 2, 0), (1, 2, 0))
    state = voting_progress(study=study, expert=first.expert)
    assert (state.voted, state.skipped, state.left) == (1, 2, 0)
    shown = signed_in(people()["researcher"]).get(reverse("study", args=[study.code]))
    text = " ".join(re.sub(r"<[^>]+>", " ", shown.content.decode()).split())
    assert "1 of 6 votes, 1 of 2 experts done; 3 pairs skipped" in text
    study_rows.vote(first, "left", supersedes=skipped.key)
    assert counted() == ((2, 2, 2), (2, 1, 0), (2, 1, 0))


def test_a_skipped_pair_is_found_again_and_its_vote_stands_in_place_of_the_skip() -> None:
    here = world()
    eva, finn = signed_in(here.expert), signed_in(User.objects.get(username="finn"))
    mine = study_rows.matchups_of(here.study, "eva")
    skip = study_rows.vote(mine[0], "skip", reason="unclear", comment="Which lane?")
    for matchup in [*mine[1:], *(study_rows.shown_again(one) for one in mine[1:5])]:
        study_rows.vote(matchup)  # more than the page's last ten
    address = reverse("vote-skipped", args=[here.study.code])
    listed = eva.get(address).content.decode()
    assert "Pair 1" in listed
    assert "Instruction unclear" in listed
    assert "Which lane?" in listed
    assert f"?change={skip.key}" in listed
    assert str(skip.key) not in finn.get(address).content.decode()
    again = f"{reverse('vote', args=[here.study.code])}?change={skip.key}"
    assert f'"change": {{"key": "{skip.key}"' in eva.get(again).content.decode()
    # Voters choose the keys of their votes, also this one.
    study_rows.vote(study_rows.matchups_of(here.study, "finn")[0], key=uuid.UUID(int=0))
    empty = again.replace(str(skip.key), "")
    for address_of_no_vote in (again, again.replace(str(skip.key), "7"), empty):
        assert '"change": null' in finn.get(address_of_no_vote).content.decode()
    study_rows.vote(mine[0], "right", supersedes=skip.key)
    assert "You have skipped no pair" in eva.get(address).content.decode()


FINE = b"model_a,model_b,winner,judge,item\nann,bob,model_a,j1,i1\nbob,ann,tie,j2,i2\n"


def test_a_file_becomes_a_closed_study_of_whoever_sent_it(
    admin: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    def send() -> Any:
        file = SimpleUploadedFile("../../etc/passwd", FINE)
        return admin.post(reverse("import-votes"), {"name": "Elsewhere", "file": file})

    with monkeypatch.context() as small:
        small.setattr(setup, "MOST_MB", 0)
        refused = send()
    assert refused.status_code == 422
    assert "Send a smaller one" in refused.content.decode()
    assert not Study.objects.exists()
    answer = send()
    study = Study.objects.get()
    assert study.vote_file.name == "passwd", "it climbs out of no folder"
    assert answer.headers["Location"] == reverse("results", args=[study.code])
    assert (study.name, study.state, ImportedVote.objects.count()) == ("Elsewhere", "closed", 2)
    event = Event.objects.get(verb="import votes")
    assert event.actor is not None
    assert event.actor.username == "the-admin"
