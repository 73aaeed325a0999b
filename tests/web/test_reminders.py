"""Experts who have not begun or fell behind: who they are, and the texts that remind them."""

from __future__ import annotations

import html
import re
from datetime import UTC, datetime, timedelta

import pytest
from django.contrib.auth.models import User
from django.test import Client
from django.urls import reverse
from django.utils import timezone

from arena.models import Invitation, Study, Vote
from arena.queries.profiles import Language
from arena.queries.reminders import ExpertPace, Lag, lag_of, pairs_due
from arena.services.preferences import choose_language
from arena.services.prospects import GUESSES
from augment.models import Event
from tests import study_rows
from tests.append_only import rewriting
from tests.web.cast import people, signed_in
from tests.web.test_questions import text_of

NOW = datetime(2026, 11, 22, 12, tzinfo=UTC)
DAY, WEEK = timedelta(hours=24), timedelta(days=7)
A_MOMENT = timedelta(seconds=1)


def pace(decided: int, *, due: int = 100, quiet: timedelta = DAY) -> ExpertPace:
    return ExpertPace(decided=decided, due=due, quiet_since=NOW - quiet)


@pytest.mark.parametrize(
    ("own", "others", "lag"),
    [
        # Not begun: after a day of silence, whatever the others do.
        (pace(0, quiet=DAY), [], Lag.NOT_BEGUN),
        (pace(0, quiet=DAY - A_MOMENT), [], None),
        (pace(0, quiet=DAY), [pace(0)], Lag.NOT_BEGUN),
        (pace(0, due=0), [pace(50)], None),
        # Behind: less than half of the median share of the others, and silent for a day.
        (pace(24), [pace(50)], Lag.BEHIND),
        (pace(25), [pace(50)], None),
        (pace(24, quiet=DAY - A_MOMENT), [pace(50)], None),
        (pace(24), [pace(10), pace(50), pace(90)], Lag.BEHIND),
        (pace(24), [pace(10), pace(40), pace(90)], None),
        (pace(12, due=50), [pace(50)], Lag.BEHIND),
        (pace(13, due=50), [pace(50)], None),
        # Others who gave more than is due are done, not further.
        (pace(50), [pace(300)], None),
        (pace(49), [pace(300)], Lag.BEHIND),
        # Silent for a week: behind, also alone.
        (pace(90, quiet=WEEK), [pace(10)], Lag.BEHIND),
        (pace(90, quiet=WEEK - A_MOMENT), [pace(10)], None),
        (pace(90, quiet=WEEK), [], Lag.BEHIND),
        # Done is done.
        (pace(100, quiet=4 * WEEK), [pace(100)], None),
        (pace(99, quiet=4 * WEEK), [pace(100)], Lag.BEHIND),
    ],
)
def test_who_is_slow(own: ExpertPace, others: list[ExpertPace], lag: Lag | None) -> None:
    assert lag_of(own, others, now=NOW) == lag


@pytest.mark.parametrize(
    ("stop_votes", "due"), [(None, 40), (80, 40), (79, 40), (78, 39), (2, 1), (1, 1), (400, 40)]
)
def test_a_stopping_rule_asks_less_of_each(stop_votes: int | None, due: int) -> None:
    assert pairs_due(40, experts=2, stop_votes=stop_votes) == due


pytestmark = pytest.mark.django_db


@pytest.fixture
def study() -> Study:
    """Opened two days ago; eva judged six of nine pairs then, finn none."""
    study = study_rows.a_study()
    for matchup in study_rows.matchups_of(study, "eva")[:6]:
        study_rows.vote(matchup, ms_visible=20_000)
    Study.objects.update(opened_at=study.opened_at and study.opened_at - 2 * DAY)
    User.objects.filter(username="finn").update(email="finn@example.org")
    return study


@pytest.fixture
def admin() -> Client:
    return signed_in(people()["admin"])


def text_in(page: str) -> str:
    found = re.search(r"<textarea[^>]*data-reminder>(.*?)</textarea>", page, re.S)
    assert found is not None
    return html.unescape(found[1])


def test_a_slow_expert_gets_a_text_with_what_is_left_and_a_link(
    study: Study, admin: Client
) -> None:
    shown = text_of(admin.get(reverse("experts", args=[study.code])))
    assert "Write 1 reminder" in shown
    assert "has not begun" in shown
    page = admin.post(reverse("remind", args=[study.code])).content.decode()
    text = text_in(page)
    assert "you have not begun yet with “Round 1”. 9 pairs wait for you, about 2 minutes." in text
    assert GUESSES["seconds"] * 9 / 60 < 2, "too few votes came to say more than the guess"
    assert "example.org" in page
    assert 'href="mailto:finn%40example.org?subject=' in page
    link = re.search(r"http://testserver(/invitation/[^\s]+)", text)
    assert link is not None
    fresh = Client()
    assert "Round 1" in fresh.get(link[1]).content.decode()
    fresh.post(link[1])
    assert fresh.get(reverse("vote", args=[study.code])).status_code == 200
    for word in ("ann", "bob", "cid", "Elo"):
        assert not re.search(rf"\b{word}\b", text, re.I), word
    event = Event.objects.get(verb="remind")
    assert event.after == {"experts": [str(User.objects.get(username="finn").person.code)]}
    assert "Nobody has to be reminded" in text_of(
        admin.post(reverse("remind", args=[study.code]), follow=True)
    ), "who was asked a moment ago is left alone"


def test_the_text_is_in_the_language_that_the_expert_chose(study: Study, admin: Client) -> None:
    choose_language(user=User.objects.get(username="finn"), language=Language.DE)
    page = admin.post(reverse("remind", args=[study.code])).content.decode()
    assert text_in(page).startswith("Hallo ")
    assert "9 Paare warten" in text_in(page)
    assert "Reminders" in page, "the page stays in the language of who reads it"


def test_who_voted_a_moment_ago_is_not_behind(study: Study, admin: Client) -> None:
    study_rows.vote(study_rows.matchups_of(study, "finn")[0])
    assert not admin.get(reverse("experts", args=[study.code])).context["slow"]


def test_who_is_behind_is_told_how_far_they_are(study: Study, admin: Client) -> None:
    study_rows.vote(study_rows.matchups_of(study, "finn")[0], ms_visible=30_000)
    page = reverse("experts", args=[study.code])
    with rewriting(Vote):
        Vote.objects.update(at=timezone.now() - 2 * DAY)
    assert "has 8 of 9 pairs left" in text_of(admin.get(page))
    text = text_in(admin.post(reverse("remind", args=[study.code])).content.decode())
    assert "you have judged 1 of 9 pairs of “Round 1”" in text
    assert "8 pairs wait for you, about 4 minutes." in text, "at their own pace of 30 s"


def test_nobody_is_reminded_of_a_study_that_is_over(study: Study, admin: Client) -> None:
    Study.objects.update(state=Study.State.CANCELLED)
    assert "Slow experts" not in text_of(admin.get(reverse("experts", args=[study.code])))
    admin.post(reverse("remind", args=[study.code]))
    assert not Invitation.objects.exists()
