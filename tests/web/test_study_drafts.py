"""A study is set up over several sittings: saved as it stands, taken up, opened, discarded."""

import html
import re
from typing import Any

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse

from arena.models import Study, StudyDraft
from arena.pairing.plan import plan
from arena.studies.services.drafts import keep_draft
from arena.studies.services.planning import frozen_rules
from arena.studies.services.taking_part import forget_identity
from tests import study_rows
from tests.opening import open_study
from tests.web.cast import signed_in
from tests.web.test_studies import hidden_of, text_of

pytestmark = pytest.mark.django_db

NEW = "/studies/new/"


def page_of(draft: StudyDraft) -> str:
    return reverse("study-draft", args=[draft.code])


def ticked(answer: Any, name: str) -> list[str]:
    """What is ticked on a page, as a browser would send it."""
    boxes = re.findall(r'<input type="checkbox" name="([^"]+)"([^>]*)>', answer.content.decode())
    return [
        match[1]
        for field, rest in boxes
        if field == name and " checked" in rest and (match := re.search(r'value="([^"]*)"', rest))
    ]


def value(answer: Any, name: str) -> str:
    """What stands in a field of a page."""
    shown = answer.content.decode()
    found = re.search(rf'<input[^>]* name="{name}"(?:[^>]*? value="([^"]*)")?', shown)
    if found is None:
        found = re.search(rf'<textarea[^>]* name="{name}"[^>]*>\n?([^<]*)</textarea>', shown)
    assert found is not None, name
    return html.unescape(found[1] or "")


def test_a_draft_keeps_every_field_as_it_stands(admin: Client) -> None:
    study_rows.cast_of()
    sent = {
        "name": "Round 1", "contestants": ["bob"], "experts": ["finn"],
        "scenarios": ["place-0", "place-3"], "votes_per_expert": "", "seed": "77",
        "repeats": "12.5", "checks": "99", "hypotheses": "ann above", "allow_replay": "on",
        "samples": "all", "keep": "1",
    }  # fmt: skip
    answer = admin.post(NEW, sent)
    draft = StudyDraft.objects.get()
    assert answer.headers["Location"] == page_of(draft)
    shown = admin.get(page_of(draft))
    assert shown.status_code == 200, "what is not finished is no error yet"
    for name in ("name", "seed", "repeats", "checks", "hypotheses"):
        assert value(shown, name) == sent[name], name
    assert value(shown, "votes_per_expert") == "", "no number comes back that was deleted"
    for name in ("contestants", "experts", "scenarios"):
        assert ticked(shown, name) == sent[name], name
    page = shown.content.decode()
    assert '<option value="all" selected>' in page
    assert re.search('name="allow_replay"[^>]* checked', page)
    assert not re.search('name="practice"[^>]* checked', page), "a switch that was off stays off"
    assert not Study.objects.exists()


def test_a_draft_is_listed_and_no_expert_sees_it(admin: Client) -> None:
    cast = study_rows.cast_of()
    keep_draft(entered={"name": "Secret plan", **cast})
    shown = text_of(admin.get(reverse("studies")))
    assert "Secret plan" in shown
    assert "Draft" in shown
    listed = {
        (state, word): "Secret plan" in text_of(admin.get(f"/studies/?state={state}&q={word}"))
        for state in ("draft", "open")
        for word in ("secret", "other")
    }
    assert [pair for pair, is_there in listed.items() if is_there] == [("draft", "secret")]
    eva = signed_in(User.objects.get(username="eva"))
    assert "Secret plan" not in eva.get("/").content.decode()
    assert not Study.objects.exists(), "so nothing else can show it either"


def test_a_draft_is_previewed_and_opened_and_is_gone_then(admin: Client) -> None:
    sent = {"name": "Round 1", **study_rows.cast_of(), "votes_per_expert": "9", "seed": "4"}
    shown = admin.post(NEW, {**sent, "preview": "1"}, follow=True)
    assert "what you answer is not stored" in text_of(shown)
    assert shown.content.decode().count('src="/pictures/augmentation/') == 2
    assert admin.post(shown.request["PATH_INFO"], {"outcome": "A"}).json()["next"] == []
    assert not Study.objects.exists(), "a preview plans nothing"
    nameless = admin.post(NEW, {**sent, "name": "", "preview": "1"}, follow=True)
    assert "Name: This field is required." in text_of(nameless)
    StudyDraft.objects.latest("pk").delete()
    draft = StudyDraft.objects.get()
    refused = admin.post(page_of(draft), {**sent, "contestants": [], "sure": "1"})
    assert refused.status_code == 422
    answer = admin.post(page_of(draft), {**sent, "revision": "1", "sure": "1"})
    study = Study.objects.get()
    assert answer.headers["Location"] == reverse("study", args=[study.code])
    assert (study.state, study.matchups.count()) == ("open", 18)
    assert not StudyDraft.objects.exists()
    assert admin.get(page_of(draft)).status_code == 404


def test_two_admins_do_not_overwrite_each_other_unseen(admin: Client) -> None:
    cast = study_rows.cast_of()
    draft = keep_draft(entered={"name": "Round 1", **cast})
    admin.post(page_of(draft), {"name": "Mine", "revision": "1", "keep": "1"})
    late = admin.post(page_of(draft), {"name": "Theirs", "revision": "1", "keep": "1"})
    assert late.status_code == 409
    assert value(late, "name") == "Theirs", "what was entered is not lost"
    assert StudyDraft.objects.get().name == "Mine"
    sent = {"name": "Round 1", **cast, "votes_per_expert": "9", "seed": "4", "revision": "1"}
    opened = admin.post(page_of(draft), {**sent, "sure": "1"})
    assert (opened.status_code, Study.objects.count()) == (422, 0)
    admin.post(page_of(draft), {**hidden_of(late), "name": "Theirs", "keep": "1"})
    assert StudyDraft.objects.get().name == "Theirs", "the second time they mean it"


def test_who_is_forgotten_is_forgotten_in_drafts_too(admin: Client) -> None:
    draft = keep_draft(entered={"experts": study_rows.cast_of()["experts"]})
    eva = User.objects.get(username="eva")
    forget_identity(user=eva, actor=User.objects.get(username="the-admin"))
    draft.refresh_from_db()
    assert "eva" not in str(draft.entered)


def a_rich_study() -> Study:
    """One that departs from the defaults wherever it can."""
    given = {
        "repeats": 25,
        "overlap": 10,
        "allow_both_miss": True,
        "hypotheses": ["ann above bob", "It is so."],
    }
    cast = study_rows.cast_of()
    return open_study(name="Round 1", **cast, votes_per_expert=12, seed=4, **given)


def test_the_settings_of_a_study_open_another_that_is_planned_the_same(admin: Client) -> None:
    first = a_rich_study()
    answer = admin.post(reverse("study-again", args=[first.code]))
    draft = StudyDraft.objects.get()
    assert answer.headers["Location"] == page_of(draft)
    assert draft.name == "Round 1 (2)"
    sent: dict[str, Any] = {k: v for k, v in draft.entered.items() if v is not False}
    sent |= {k: "on" for k, v in draft.entered.items() if v is True}
    admin.post(page_of(draft), {**sent, "revision": "1", "sure": "1"})
    second = Study.objects.get(name="Round 1 (2)")
    first.refresh_from_db()
    apart = {"jobs", "replays"}
    kept = [{k: v for k, v in one.rules.items() if k not in apart} for one in (first, second)]
    assert kept[0] == kept[1]
    assert plan(frozen_rules(first)) == plan(frozen_rules(second))
    for name in ("allow_both_miss", "allow_replay", "practice", "allow_simulated"):
        assert getattr(first, name) == getattr(second, name), name
