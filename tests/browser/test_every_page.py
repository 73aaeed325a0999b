"""Every page of the site, once each in one browser: axe, and a phone's width."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest
from django.contrib.auth.models import User
from django.urls import reverse
from playwright.sync_api import BrowserContext, ConsoleMessage, Page, Route

from arena.results.exports.board_files import write_table
from arena.results.pages.tabs import TABS
from arena.results.queries.votes import Filters
from arena.results.services.boards import make_board, publish_table
from arena.results.services.ratings import rate_now as rate
from augment.models import GenerationJob, Submission
from tests.browser.booth import PHONE, TOO_WIDE, Booth, ready
from tests.browser.test_voting_page import faults
from tests.drives import driven
from tests.mixed_study import mixed_study
from tests.web.addresses import address
from tests.web.cast import people, signed_in, world
from tests.web.test_access import PAGES

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True), pytest.mark.slow]
OPENED = """() => {
  for (const one of document.querySelectorAll("details")) one.open = true;
  for (const one of document.querySelectorAll("[data-findings]"))
    one.innerHTML = "<li>A finding</li>".repeat(99);
}"""
SCROLLED = {"runOnly": {"type": "rule", "values": ["scrollable-region-focusable"]}}


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownPage:
    """A page as somebody is shown it."""

    name: str
    url: str
    user: User


def pages_of_an_open_study() -> list[ShownPage]:
    """The pages that an admin can open, one of the questions, those of an expert who votes."""
    here, admin = world(), people()["admin"]
    named = {name: address(name, here) for name in (*PAGES, "study-close")}
    staff = _shown(admin, named)
    own = {name: url for name, url in named.items() if name.startswith(("home", "vote"))}
    sender = Submission.objects.get().uploaded_by
    assert sender is not None
    entered = [name for name in named if name.startswith(("home", "submission", "benchmark"))]
    theirs = _shown(sender, {name: named[name] for name in entered})
    return staff + _shown(here.expert, own) + theirs


def pages_of_a_rated_study() -> list[ShownPage]:
    """The results of a study with everything that a vote can be, closed and rated."""
    study = mixed_study()
    study.allow_simulated = True
    study.save()
    rate(study=study, rounds=100, filters=Filters())
    code, job = [study.code], GenerationJob.objects.earliest("pk")
    driven(job)
    named = {f"tab {tab}": reverse("results-tab", args=[*code, tab]) for tab in TABS}
    named |= {
        name: reverse(name, args=code)
        for name in ("study", "preregistration", "results-votes", "results-judges")
    }
    named["job driving"] = reverse("job-tab", args=[job.code, "driving"])
    board = make_board(name="City", study=study)
    publish_table(board, write=write_table)
    named["board"] = reverse("board", args=[board.code])
    return _shown(people()["admin"], named)


def _shown(user: User, named: dict[str, str]) -> list[ShownPage]:
    client, found = signed_in(user), []
    for name, url in named.items():
        answer = client.get(url)
        is_page = "html" in answer.headers.get("Content-Type", "")
        if answer.streaming:
            b"".join(answer)
        elif answer.status_code == 200 and is_page:
            found.append(ShownPage(name=name, url=url, user=user))
    return found


@pytest.mark.parametrize("pages", [pages_of_an_open_study, pages_of_a_rated_study])
def test_axe_finds_nothing_and_nothing_is_wider_than_a_phone(
    bare_booth: Booth, pages: Callable[[], list[ShownPage]]
) -> None:
    shown = pages()
    wrong: dict[str, list[str]] = {}
    by_user: dict[str, BrowserContext] = {}
    for one in shown:
        told: list[ConsoleMessage] = []
        page = _tab(bare_booth, by_user, one, told)
        found = faults(page) + [line.text for line in told if "Permissions-Policy" in line.text]
        page.set_viewport_size(PHONE)
        if beyond := page.evaluate(TOO_WIDE):
            found.append(f"{beyond} px wider than a phone")
        page.evaluate(OPENED)
        found += faults(page, SCROLLED)
        if found:
            wrong[f"{one.name} for {one.user.username}"] = found
        page.close()
    assert not wrong, "\n".join(f"{name}: {found}" for name, found in wrong.items())


def _tab(
    booth: Booth, by_user: dict[str, BrowserContext], one: ShownPage, told: list[ConsoleMessage]
) -> Page:
    """A tab of its own, that stays where it is even if it would look again by itself."""
    who = one.user.username
    if who not in by_user:
        how = {"bypass_csp": True, "reduced_motion": "reduce"}
        by_user[who] = booth.visit(who, reverse("healthz"), how).context
    page = by_user[who].new_page()
    page.on("console", lambda line: told.append(line))
    page.goto(one.url)
    if page.locator("#answers").count():
        # The pair fades until it takes an answer.
        ready(page)
    page.route("**/*", _stay)
    return page


def _stay(route: Route) -> None:
    if route.request.is_navigation_request():
        route.abort()
    else:
        route.continue_()
